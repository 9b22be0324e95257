"""Series coefficients of exp and its tangent, exact if they are rational.

Taylor series of f2 = (cos x - 1)/x^2 and f3 = (x - sin x)/x^3 in y = x^2, their derivatives f4 = 2 df2/dy and f5 = -2
df3/dy; f6 = (1 - (x/2) cot(x/2))/x^2 by its partial fractions 2 sum_n 1/((2 pi n)^2 - y) (Euler), the first two poles
kept apart.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction

Coefficients = tuple[float, ...]

#: Up to y = pi^2 the terms dropped are below a quarter of the round-off of every function.
TAYLOR_TERMS = 15
#: With the poles at 2 pi and 4 pi kept apart the rest converges like (x / 6 pi)^2: 1/9 at x = 2 pi.
POLE_TERMS = 18
TAYLOR_LIMIT = math.pi**2
POLES = (4.0 * math.pi**2, 16.0 * math.pi**2)


def _derivative(coefficients: Sequence[Fraction]) -> list[Fraction]:
    return [power * value for power, value in enumerate(coefficients)][1:]


def _floats(coefficients: Sequence[Fraction]) -> Coefficients:
    return tuple(float(value) for value in coefficients)


def _alternating(offset: int, terms: int) -> list[Fraction]:
    """Return (-1)^k / (2 k + offset)! for k = 0, 1, ..."""
    return [Fraction((-1) ** k, math.factorial(2 * k + offset)) for k in range(terms)]


def _tail(exponent: int) -> float:
    """Return the sum of n^-exponent over n >= 3 (Euler-Maclaurin from n = 40)."""
    start = 40.0
    direct = math.fsum(float(n) ** -exponent for n in range(3, int(start)))
    rest: float = start ** (1.0 - exponent) / (exponent - 1.0) + 0.5 * start**-exponent
    rest += exponent * start ** (-exponent - 1.0) / 12.0
    rest -= exponent * (exponent + 1.0) * (exponent + 2.0) * start ** (-exponent - 3.0) / 720.0
    rest += math.prod(exponent + i for i in range(5)) * start ** (-exponent - 5.0) / 30240.0
    return direct + rest


_F2 = [-value for value in _alternating(2, TAYLOR_TERMS + 1)]
_F3 = _alternating(3, TAYLOR_TERMS + 1)

#: Few terms suffice for these two: they are used for y <= 1/4 only; sin and cos are accurate elsewhere.
SINC = _floats(_alternating(1, 8))
COS = _floats(_alternating(0, 8))
SMALL_LIMIT = 0.25
F3 = _floats(_F3[:TAYLOR_TERMS])
F4 = _floats([2 * value for value in _derivative(_F2)])
F5 = _floats([-2 * value for value in _derivative(_F3)])

_TAILS = [_tail(2 * k) for k in range(1, POLE_TERMS + 1)]
#: f6 without its first two poles, in powers of y / (4 pi^2); the constant factor is included.
F6_REMAINDER: Coefficients = tuple(2.0 / POLES[0] * tail for tail in _TAILS)
#: f8 = 2 df6/dy without its first two poles, likewise.
F8_REMAINDER: Coefficients = tuple(4.0 / POLES[0] ** 2 * (k + 1) * tail for k, tail in enumerate(_TAILS[1:]))

#: 2 atan(r)/r in powers of r^2, for r^2 <= 0.01.
ARCTANGENT: Coefficients = tuple(2.0 * (-1) ** k / (2 * k + 1) for k in range(9))
ARCTANGENT_LIMIT = 0.01
