"""Front ends: interface to the derivation of a System and a Description from documents of one class.

Only a front end knows its documents. Mechanics is one, for Scenes; other distributions name theirs as entry
points of the group ``eomgen.front_ends``. A document may also say itself who derives its equations: its attribute
``front_end`` is a ``FrontEnd`` then, and no installation is needed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, cast

if TYPE_CHECKING:
    from eomgen.compiled.model import Gains, Start
    from eomgen.pipeline.model import Model
    from eomgen.solvers.constraint_rows import EveryRow
    from eomgen.system.description import Description
    from eomgen.system.system import System

#: Builds the model of a document with some terms, the same bits everywhere.
Build = Callable[[Any, Sequence[str]], "Model"]


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
    document : class of its documents, each a ``Document``
    describe : description of a document; called at every build, also of a cached model, so it should import no
        slow modules
    derive : the System with the wanted terms, all that a run may need if that is None; terms that it cannot derive are
        left out
    prepared : the document with values found by a compiled model of it, before it is derived
    start : returns q and v of the initial state at other values of tunable parameters, if they depend on them
    gains : finds parameters that ``prepared`` fills at other values of the others, if there are any
    every_row : evaluates the constraints with the rows that were left out as redundant, if there are any
    content : all data that determine the equations of a document; by default its ``content``
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
