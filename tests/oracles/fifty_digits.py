"""Evaluation of a tape over mpmath numbers."""

from __future__ import annotations

import bisect
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import mpmath
import numpy as np

from eomgen.symbolic.evaluate import ARITHMETIC, Arithmetic, check_component, run
from eomgen.symbolic.operations import NAMES, CurveLike, InputSymbol, Op
from eomgen.symbolic.tape import Ref, Tape


def evaluate_mpmath(
    tape: Tape, refs: Sequence[Ref], inputs: Mapping[str, Sequence[Any]], digits: int = 50
) -> list[Any]:
    """Evaluate references over mpmath numbers of ``digits`` decimal digits, or more if mpmath's context says so.

    Inputs map block names to sequences of numbers; a bare number stands for a block of size 1. Doubles, those of the
    tape included, enter exactly. Raises ValueError when a block is missing or too short.
    """
    with mpmath.workdps(max(digits, mpmath.mp.dps)):
        blocks = {
            name: [
                mpmath.mpmathify(entry) for entry in (given if isinstance(given, Sequence | np.ndarray) else [given])
            ]
            for name, given in inputs.items()
        }

        def leaf(symbol: InputSymbol) -> Any:
            check_component(symbol, len(blocks.get(symbol.block, ())))
            return blocks[symbol.block][symbol.index]

        return run(tape, refs, leaf, Arithmetic(_mpmath_rules(), mpmath.mpf))


def _mpmath_rules() -> dict[Op, Callable[..., Any]]:
    one, zero, nan, re = mpmath.mpf(1), mpmath.mpf(0), mpmath.mpf("nan"), mpmath.re

    def truth(holds: bool, x: Any, y: Any) -> Any:
        return nan if mpmath.isnan(x) or mpmath.isnan(y) else one if holds else zero

    def atan2(y: Any, x: Any) -> Any:
        angle = mpmath.atan2(re(y), re(x))
        if not (mpmath.im(x) or mpmath.im(y)):
            return angle
        cosine, sine = mpmath.cos(angle), mpmath.sin(angle)
        # turned to where arctan is analytic
        return angle + mpmath.atan((cosine * y - sine * x) / (cosine * x + sine * y))

    def polynomial(x: Any, curve: CurveLike, derivative: int) -> Any:
        """Return a curve between its first and last break, without what its doubles round."""
        piece = min(max(bisect.bisect_right(curve.breaks, float(re(x))) - 1, 0), len(curve.breaks) - 2)
        local, coefficients = x - mpmath.mpf(curve.breaks[piece]), list(map(mpmath.mpf, curve.coefficients[piece]))
        for _ in range(derivative):
            coefficients = [power * value for power, value in enumerate(coefficients)][1:]
        return mpmath.polyval(coefficients[::-1], local) if coefficients else zero

    return {
        **ARITHMETIC,
        **{op: getattr(mpmath, name) for op, name in NAMES.items()},
        Op.POW: mpmath.power,
        Op.ATAN2: atan2,
        Op.ABS: lambda x: mpmath.sign(re(x)) * x,
        Op.SIGN: lambda x: mpmath.sign(re(x)),
        Op.MIN: lambda x, y: x if re(x) <= re(y) or mpmath.isnan(x) else y,
        Op.MAX: lambda x, y: x if re(y) <= re(x) or mpmath.isnan(x) else y,
        Op.LT: lambda x, y: truth(re(x) < re(y), x, y),
        Op.LE: lambda x, y: truth(re(x) <= re(y), x, y),
        Op.SELECT: lambda condition, x, y: nan if mpmath.isnan(condition) else x if re(condition) != 0 else y,
        Op.CURVE: polynomial,
    }
