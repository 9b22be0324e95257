"""Selection: which of the functions of a scene a library has. Fewer of them compile faster."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

from eomgen.base.data import dataclass
from eomgen.system.terms import PURPOSES, TERMS


@dataclass(frozen=True)
class Selection:
    """Which functions a library has.

    Attributes
    ----------
    terms : wanted by name; None: the scene's list, or all functions that the scene can use
    start : ``initial`` or ``equilibrium``: only functions called by runs with this start; empty: all functions
    """

    terms: tuple[str, ...] | None = None
    start: str = ""

    @classmethod
    def from_data(cls, data: Mapping[str, Any]) -> Selection:
        """Return the selection that a library's layout or a checkpoint holds as JSON."""
        return cls(None if data["terms"] is None else tuple(data["terms"]), data["start"])

    def functions(self, derived: Sequence[str], called: Collection[str], *, implicit: bool) -> list[str]:
        """Return the selected functions of a derived System, in order.

        Parameters
        ----------
        called : by the steps of the method
        implicit : whether these steps are implicit: unresolved motions are then found by partials of the residual, of
            which steps have nonzeros or the whole; else states that decay too fast, by partials of the internal states
        """
        if not self.start:
            return list(derived)
        accelerations = "forward_dynamics" if "forward_dynamics" in derived else "residual"
        of_residual = "iteration" if "iteration" in derived and "iteration" in called else "partials"
        needed = {*called, *PURPOSES["run"], accelerations, of_residual if implicit else "internal_partials"}
        if self.start == "equilibrium":
            needed |= {*PURPOSES["equilibrium"], *(() if "partials" in derived else ("iteration",))}
        return [name for name in derived if name in needed or name not in TERMS or TERMS[name].of_events]
