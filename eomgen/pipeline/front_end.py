"""Front ends, which derive a System and a Description from documents of one class, and the register of kinds of files
other than mechanical scenes, each with its own reader, models and answers on the command line.

Only a front end knows its documents. Mechanics is one, for Scenes; other distributions name theirs as entry
points of the group ``eomgen.front_ends``. A document may also name the front end: with a ``FrontEnd`` as attribute
``front_end`` no installation is needed.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, cast

from eomgen.base.data import dataclass, field
from eomgen.base.products import rows_of
from eomgen.scene.sources.source import KINDS, OtherFileKind

if TYPE_CHECKING:
    from eomgen.codegen.program import Program
    from eomgen.compiled.model import Gains, Start
    from eomgen.pipeline.model import Model
    from eomgen.scene.scene import Scene
    from eomgen.solvers.constraint_rows import EveryRow
    from eomgen.system.description import Description
    from eomgen.system.system import Sample, System


#: The group of registers of products in which each row is a ``Preparation``.
PREPARATIONS = "eomgen.preparations"
#: Builds the model of a document with some terms, the same bits everywhere.
Build = Callable[[Any, Sequence[str]], "Model"]
#: Function that derives a document for a longer one: the Program, and the reason for a missing stepper.
Programs = Callable[[Any, "Sample"], tuple["Program", str]]


class Document(Protocol):
    """Source of equations: a Scene, or the document of another front end."""

    @property
    def content(self) -> bytes:
        """All data that determine the equations, for the key of the cache; empty if unknown."""
        ...


@dataclass(frozen=True)
class FrontEnd:
    """Derivation of equations from documents of one class.

    Attributes
    ----------
    name : of the front end, part of the key of the cache
    document : class of the documents, each a ``Document``
    describe : description of a document; called at every build, also of a cached model, so the function should import
        no slow modules
    derive : the System with the wanted terms, None: all terms that a run may need; terms that cannot be derived are
        left out
    prepared : the document with values from a compiled model of the document, before the derivation
    start : returns q and v of the initial state at other values of tunable parameters, if the state depends on
        parameters
    gains : finds parameters filled by ``prepared`` at other values of the remaining parameters; None without such
        parameters
    every_row : evaluates the constraints with the rows that were left out as redundant, if there are any
    content : all data that determine the equations of a document; by default ``content`` of the document
    program : the Program of a document with many equal parts, and the reason for a missing stepper, by a function that
        derives documents with few such parts for longer ones; None for other documents
    """

    name: str
    document: type
    describe: Callable[[Any], Description]
    derive: Callable[[Any, Sequence[str] | None], System]
    prepared: Callable[[Any, Build], Any] = lambda document, _: document
    start: Callable[[Any], Start | None] = lambda _: None
    gains: Callable[[Any, Build], Gains | None] = lambda _, __: None
    every_row: Callable[[Any], EveryRow] | None = None
    content: Callable[[Any], bytes] = lambda document: cast("bytes", document.content)
    program: Callable[[Any, Programs], tuple[Program, str] | None] = lambda _, __: None


@dataclass(frozen=True)
class Preparation:
    """A product that finds parameters of scenes from compiled models of the scenes, before the equations are derived.

    Attributes
    ----------
    name : of the key of scenes that asks for it
    prepared : the scene with values found by a function that builds models
    values : these values at other values of the remaining parameters, with notes
    """

    name: str
    prepared: Callable[[Scene, Build], Scene]
    values: Callable[[Scene, Mapping[str, float], Build], tuple[dict[str, float], list[str]]]


@dataclass(frozen=True)
class FileKind(OtherFileKind):
    """A kind of file with the functions of the kind's documents.

    Attributes
    ----------
    front_end : of the documents of such files
    read : returns the document of a path or of nested data, or a given document unchanged; None for any other argument.
        Raises DescriptionError, and UsageError for options of mechanical scenes
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
    return rows_of(KINDS, FileKind)


def is_scene(described: object) -> bool:
    """Return whether a description is a Scene."""
    if isinstance(described, str | os.PathLike | Mapping):
        return False
    from eomgen.scene.scene import Scene  # noqa: PLC0415  # a stored scene needs no classes of scenes

    return isinstance(described, Scene)


def other_document(described: object, options: Mapping[str, Any] | None = None) -> tuple[FileKind, Any] | None:
    """Return kind and document of a description that is not a mechanical scene; None for mechanical scenes.

    ``options`` are the caller's for mechanical scenes.

    Raises
    ------
    DescriptionError
        With all faults of the content.
    UsageError
        An option of mechanical scenes.
    """
    if is_scene(described):
        return None
    if isinstance(described, str | os.PathLike) and not str(described).lower().endswith(".toml"):
        return None  # files in TOML say their kind
    for kind in file_kinds():
        document = kind.read(described, options)
        if document is not None:
            return kind, document
    return None


def given_options(options: Mapping[str, Any]) -> list[str]:
    """Return the options that are neither empty nor the defaults of a source of scenes."""
    from eomgen.scene.sources.register import all_options  # noqa: PLC0415  # for options of mechanical scenes alone

    defaults = {name: option.default for name, (_, option) in all_options().items()}
    return sorted(name for name, value in options.items() if value and value != defaults.get(name))
