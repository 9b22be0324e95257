"""Events of a Scene: formulas and the targets of their actions."""

from __future__ import annotations

from eomgen.base.data import dataclass
from eomgen.formula.nodes import Formula, Symbol
from eomgen.system.events import Action, Direction


@dataclass(frozen=True)
class Event:
    """An event at the roots of the formula ``when``, passed in ``direction``, with an action.

    Attributes
    ----------
    resets : pairs of a coordinate, a velocity or an internal state, and the new value; of ``reset``
    restitution : of ``impact``
    mode, to : of ``switch``
    least_interval : s; 0 by default
    place : file, line and key of ``when``, for messages
    """

    name: str
    when: Formula
    direction: Direction
    action: Action
    resets: tuple[tuple[Symbol, Formula], ...] = ()
    restitution: Formula | None = None
    mode: str = ""
    to: Formula | None = None
    least_interval: float = 0.0
    description: str = ""
    place: str = ""

    def actions(self) -> list[Formula]:
        """Return the formulas of the action: new values, a restitution, a new mode."""
        formulas = [self.restitution, self.to]
        return [*(formula for _, formula in self.resets), *(formula for formula in formulas if formula is not None)]
