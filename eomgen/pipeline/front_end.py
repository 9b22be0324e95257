"""Front ends: interface to what derives a System and a Description from documents of one class.

Nothing behind a front end knows its documents. Mechanics is one, for Scenes; other distributions name theirs as entry
points of the group ``eomgen.front_ends``. A document may also say itself who derives its equations: its attribute
``front_end`` is a ``FrontEnd`` then, and nothing has to be installed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, cast

if TYPE_CHECKING:
    from eomgen.compiled.model import Gains, Start
    from eomgen.model import Model
    from eomgen.solvers.constraint_rows import EveryRow
    from eomgen.system.description import Description
    from eomgen.system.system import System

#: Builds the model of a document with some terms, the same bits everywhere.
Build = Callable[[Any, Sequence[str]], "Model"]


class Document(Protocol):
    """What a front end derives equations of: a Scene, or what another front end takes instead."""

    @property
    def content(self) -> bytes:
        """All that determines the equations, for the key of the cache; empty if nothing is known of it."""
        ...


@dataclass(frozen=True)
class FrontEnd:
    """What makes equations of documents of one class.

    Attributes
    ----------
    name : of the front end, part of the key of the cache
    document : class of its documents, each a ``Document``
    describe : what a document is about; asked for at every build, also of a cached model, so it should import nothing
        slow
    derive : the System with the terms wanted, all that a run may need where that is None; those that it cannot give are
        left out
    prepared : the document with what has to be found with a compiled model of it, before it is derived
    start : what gives q and v of the initial state at other values of tunable parameters, where they depend on them
    gains : what finds parameters that ``prepared`` fills at other values of the others, if there are any
    every_row : what evaluates the constraints with the rows that were left out as redundant, if there are any
    content : all that determines the equations of a document; its ``content`` if nothing else is said
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
