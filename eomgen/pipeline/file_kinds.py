"""Register of kinds of files beside mechanical scenes, each with its own reader, models and answers on the command
line: rows of products of the group ``eomgen.file_kinds``."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from eomgen.base.products import rows_of
from eomgen.pipeline.front_end import FrontEnd
from eomgen.scene.sources.other_kinds import GROUP, OtherKind
from eomgen.scene.sources.register import all_options


@dataclass(frozen=True)
class FileKind(OtherKind):
    """A kind of file with the functions of its documents.

    Attributes
    ----------
    front_end : of the documents of such files
    read : returns the document of a path, of nested data or of itself; None for anything else. Raises
        DescriptionError, and UsageError for options of mechanical scenes
    build : returns the compiled model of a document, for a method and a profile
    generate : writes a document with a method as a folder of C, and returns the paths
    show : prints the answer of ``info`` to a path, for a method, options and whether as JSON; False for other files
    simulate : runs the document of a path into a folder and returns the exit code, for options, whether with plots,
        and whether as JSON; None for other files
    schemas : help text and JSON Schema by the word of ``eomgen schema --kind``
    """

    front_end: FrontEnd
    read: Callable[[object, Mapping[str, Any] | None], Any]
    build: Callable[[Any, str | None, str], Any]
    generate: Callable[[Any, str | Path, str | None], list[Path]]
    show: Callable[[str, str | None, Mapping[str, Any], bool], bool]
    simulate: Callable[[str, str, Mapping[str, Any], bool, bool], int | None]
    schemas: Mapping[str, tuple[str, Callable[[], str]]] = field(default_factory=dict)


def file_kinds() -> tuple[FileKind, ...]:
    """Return the kinds of files of all products."""
    return rows_of(GROUP, FileKind)


def other_document(described: object, options: Mapping[str, Any] | None = None) -> tuple[FileKind, Any] | None:
    """Return kind and document of a description that is no mechanical scene; None for others.

    Raises
    ------
    DescriptionError
        With all faults of its content.
    UsageError
        An option of mechanical scenes.
    """
    for kind in file_kinds():
        document = kind.read(described, options)
        if document is not None:
            return kind, document
    return None


def given_options(options: Mapping[str, Any]) -> list[str]:
    """Return the options that are neither empty nor the defaults of a source of scenes."""
    defaults = {name: option.default for name, (_, option) in all_options().items()}
    return sorted(name for name, value in options.items() if value and value != defaults.get(name))
