"""Prescribed motions as formulas of time: their values and rates, and which of them must not jump."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.formula.evaluate import symbols
from eomgen.formula.nodes import Application, Formula, Number, Operation, Quantity, Symbol
from eomgen.formula.recording import record
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.operations import ELEMENTARY, NAMES
from eomgen.symbolic.scalar import Algebra, Scalar
from eomgen.symbolic.tape import Tape

_STEP = 1e-30  # of the complex step


def law_and_rate(formula: Formula, known: Mapping[str, float]) -> Callable[[Array], tuple[Array, Array]]:
    """Return a function that gives a law and the rate of the law at times."""
    tape = Tape()
    algebra = Algebra(tape)
    time = Scalar(tape, tape.input("t", 0))

    def resolved(symbol: Symbol) -> Scalar:
        return time if symbol.kind == "time" else algebra.scalar(known[symbol.name])

    law = record(algebra, formula, resolved)

    def values(t: Array) -> tuple[Array, Array]:
        with np.errstate(all="ignore"):
            result = evaluate(tape, [law.ref], {"t": t[:, np.newaxis] + 1j * _STEP})[:, 0]
        return result.real, result.imag / _STEP

    return values


#: Operations that are as smooth as their operands.
_SMOOTH = frozenset({"add", "sub", "mul", "neg"} | {NAMES[op] for op, row in ELEMENTARY.items() if row.smooth})


@dataclass(frozen=True)
class Law:
    """A formula of time that a coordinate or a body must follow, with location and description for messages, and the
    unit of the formula."""

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
    """Return whether neither a formula of time nor the rate of the formula can jump, by operations and curves alone."""
    if constant(formula) or not isinstance(formula, Operation | Application):
        return True
    if isinstance(formula, Application):  # a spline's third derivative jumps at its ends
        kinks = [order for _, order in formula.curve.kinks()]
        return formula.derivative <= 1 and min(kinks, default=3) - formula.derivative >= 2 and smooth(formula.argument)
    if isinstance(formula, Quantity):
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
