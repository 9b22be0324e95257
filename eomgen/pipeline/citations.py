"""Papers of methods and of the methods of scenes, for ``eomgen cite``."""

from __future__ import annotations

from collections.abc import Sequence

from eomgen.integrators.families.literature import papers_of
from eomgen.integrators.families.register import AUTO, STANDARD, method_compiled, method_names
from eomgen.pipeline.documents import load
from eomgen.scene.sources.register import own_endings


def papers_of_methods(names: Sequence[str]) -> list[str]:
    """Return the papers of methods as BibTeX, each once, in the order of the names.

    Parameters
    ----------
    names : of methods, or paths of scene files, whose methods are meant

    Raises
    ------
    UsageError, DescriptionError, FileError
        There is no such method, or no such scene.
    """
    papers = (paper for name in names for paper in papers_of(method_compiled(_method(name)).source))
    return list(dict.fromkeys(papers))


def names_of_methods(start: str) -> list[str]:
    """Return the names of eomgen's own methods that begin with letters."""
    return [name for name in method_names() if name.startswith(start)]


def _method(name: str) -> str:
    """Return a name, or the method of a scene file."""
    if not name.endswith(own_endings()):
        return name
    method = load(name).simulation.method
    return STANDARD if method == AUTO else method
