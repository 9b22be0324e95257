"""Values of a prescribed motion and of its rate, by the complex step."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from eomgen.base.arrays import Array
from eomgen.formula.nodes import Formula, Symbol
from eomgen.formula.recording import record
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.scalar import Algebra, Scalar
from eomgen.symbolic.tape import Tape

_STEP = 1e-30  # of the complex step


def law_and_rate(formula: Formula, known: Mapping[str, float]) -> Callable[[Array], tuple[Array, Array]]:
    """Return a function that gives a law and its rate at times."""
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
