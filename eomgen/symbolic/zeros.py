"""Values that vanish for all inputs, as (J_y - J_z) omega_x does with equal moments of inertia.

Values are taken modulo a prime at random inputs, without rounding (Schwartz 1980). Roots, sines, cases, curves and
external functions have random values too, equal ones at equal arguments: a rational function of all of these that is 0
at random values is 0 everywhere, but for a chance of its degree in 10^9 per sample. Values that are 0 by other
properties of these functions are kept.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

import numpy as np

from eomgen.symbolic.evaluate import Arithmetic, run, side_by_side
from eomgen.symbolic.operations import ELEMENTARY, InputSymbol, Op
from eomgen.symbolic.tape import Ref, Tape

#: Modulus, and shape of the random samples.
_PRIME, _SAMPLES = 2**31 - 1, (3,)


def vanishing(tape: Tape, refs: Iterable[Ref]) -> set[Ref]:
    """Return the references whose values are 0 for all inputs, whichever cases of conditions hold. By evaluation at
    three random samples modulo a prime."""
    distinct = sorted(set(refs))
    residues = _Residues()
    values = run(tape, distinct, residues.leaf, residues.arithmetic)
    return {ref for ref, value in zip(distinct, values, strict=True) if not np.any(value % _PRIME)}


class _Residues:
    """Arithmetic modulo the prime for the evaluation of a tape, with several random samples side by side."""

    def __init__(self) -> None:
        """Define all operations modulo a prime, with random residues for unknown values."""
        self._random = np.random.default_rng(0)
        self._known: dict[Any, Any] = {}
        rules: dict[Op, Callable[..., Any]] = {
            op: lambda *operands, op=op: self._unknown(op, *operands)
            for op in (*ELEMENTARY, Op.POW, Op.ATAN2, Op.SIGN, Op.LT, Op.LE)
        }
        rules |= {
            Op.ADD: lambda x, y: (x + y) % _PRIME,
            Op.SUB: lambda x, y: (x - y) % _PRIME,
            Op.MUL: _product,
            Op.DIV: lambda x, y: _product(x, self._inverse(y)),
            Op.SIN: lambda x: self._sine_and_cosine(x)[0],
            Op.COS: lambda x: self._sine_and_cosine(x)[1],
            Op.ABS: lambda x: _product(self._unknown(Op.SIGN, x), x),
            Op.SELECT: lambda condition, x, y: self._mix(self._unknown(Op.SELECT, condition), x, y),
            Op.CURVE: lambda x, curve, derivative: self._unknown((id(curve), derivative), x),
        }
        rules |= {op: lambda x, y, op=op: self._mix(self._unknown(op, x, y), x, y) for op in (Op.MIN, Op.MAX)}
        self.arithmetic = Arithmetic(
            rules,
            self._constant,
            partial(side_by_side, _SAMPLES, np.int64),
            lambda call, _: [self._numbers(()) for _ in range(call.size)],
        )

    def leaf(self, symbol: InputSymbol) -> Any:
        return self._numbers(())

    def _numbers(self, shape: tuple[int, ...]) -> Any:
        return self._random.integers(1, _PRIME, np.broadcast_shapes(shape, _SAMPLES))

    def _unknown(self, function: Any, *operands: Any) -> Any:
        """Return random residues for values of a function, the same at equal arguments; arrays broadcast."""
        arguments = [np.asarray(x) % _PRIME for x in operands]
        key = (function, *((x.shape, x.tobytes()) for x in arguments))
        if key not in self._known:
            self._known[key] = self._numbers(np.broadcast_shapes(*(x.shape for x in arguments)))
        return self._known[key]

    def _mix(self, share: Any, x: Any, y: Any) -> Any:
        return (y + _product(share, x - y)) % _PRIME

    def _sine_and_cosine(self, x: Any) -> tuple[Any, Any]:
        """Return sine and cosine by a random tangent of the half angle."""
        tangent = self._unknown("half angle", x)
        square = _product(tangent, tangent)
        divisor = self._inverse(1 + square)
        return _product(2 * tangent, divisor), _product(1 - square, divisor)

    def _inverse(self, x: Any) -> Any:
        """Return 1/x modulo the prime, elementwise; for 0 a random number."""
        x = np.asarray(x) % _PRIME
        power, result, exponent = x, np.ones_like(x), _PRIME - 2
        while exponent:  # Fermat's theorem
            result = result * power % _PRIME if exponent & 1 else result
            power, exponent = power * power % _PRIME, exponent >> 1
        return np.where(x == 0, self._unknown("inverse", x), result)

    def _constant(self, number: float) -> Any:
        if not np.isfinite(number):
            return self._unknown("constant", np.array(number).view(np.int64))
        above, below = number.as_integer_ratio()
        return np.int64(above * pow(below, -1, _PRIME) % _PRIME)


def _product(x: Any, y: Any) -> Any:
    return (x % _PRIME) * (y % _PRIME) % _PRIME
