"""Prescribed motions as formulas of time, and which of them must not jump."""

from __future__ import annotations

from functools import cached_property

from eomgen.base.data import dataclass
from eomgen.formula.evaluate import symbols
from eomgen.formula.nodes import Application, EntryQuantity, Formula, Number, Operation
from eomgen.symbolic.operations import ELEMENTARY, NAMES

#: Operations that are as smooth as their operands.
_SMOOTH = frozenset({"add", "sub", "mul", "neg"} | {NAMES[op] for op, row in ELEMENTARY.items() if row.smooth})


@dataclass(frozen=True)
class PrescribedLaw:
    """A formula of time that a coordinate or a body must follow, with file, line and key, the noun of the quantity and
    the unit, for messages."""

    where: str
    quantity: str
    unit: str
    formula: Formula

    @cached_property
    def constant(self) -> bool:
        """Whether the motion is at rest."""
        return constant(self.formula)

    @cached_property
    def smooth(self) -> bool:
        """Whether neither the law nor the rate of the law can jump."""
        return smooth(self.formula)


def smooth(formula: Formula) -> bool:
    """Return whether neither a formula of time nor its rate can jump, judged by operations and curves alone; False is
    inconclusive."""
    if constant(formula) or not isinstance(formula, Operation | Application):
        return True
    if isinstance(formula, Application):  # a spline's third derivative jumps at its ends
        kinks = [order for _, order in formula.curve.kinks()]
        return formula.derivative <= 1 and min(kinks, default=3) - formula.derivative >= 2 and smooth(formula.argument)
    if isinstance(formula, EntryQuantity):
        return formula.word.smooth and all(smooth(item) for item in formula.arguments)
    first, second = formula.arguments[0], formula.arguments[-1]
    if formula.name == "div":
        return smooth(first) and constant(second)
    if formula.name == "pow":
        return smooth(first) and isinstance(second, Number) and second.value >= 0.0 and second.value.is_integer()
    return formula.name in _SMOOTH and all(smooth(item) for item in formula.arguments)


def constant(formula: Formula) -> bool:
    """Return whether a formula of time is one of parameters only."""
    return all(symbol.kind != "time" for symbol in symbols(formula))
