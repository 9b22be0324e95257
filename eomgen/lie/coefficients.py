"""Coefficient functions of y = |theta|^2 in exp, T and T^-1, accurate to round-off and free of branches on values,
from exact series.

Each is smooth in y, so both sides of a selection are finite, also for a derivative taken through it: the side that is
not selected works on a harmless argument.

Taylor series of f2 = (cos x - 1)/x^2 and f3 = (x - sin x)/x^3 in y = x^2, their derivatives f4 = 2 df2/dy and f5 = -2
df3/dy; f6 = (1 - (x/2) cot(x/2))/x^2 by its partial fractions 2 sum_n 1/((2 pi n)^2 - y) (Euler), the first two poles
treated separately.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from eomgen.lie.algebra import Algebra, Value

Coefficients = tuple[float, ...]

#: Up to y = pi^2 the terms dropped are below a quarter of the round-off of every function.
TAYLOR_TERMS = 15
#: With the poles at 2 pi and 4 pi treated separately the rest converges like (x / 6 pi)^2: 1/9 at x = 2 pi.
POLE_TERMS = 18
TAYLOR_LIMIT = math.pi**2
POLES = (4.0 * math.pi**2, 16.0 * math.pi**2)


#: Numerator and denominator: Python rounds the quotient of two integers once, and ``fractions`` takes time to import.
Ratio = tuple[int, int]


def _derivative(coefficients: Sequence[Ratio]) -> list[Ratio]:
    return [(power * above, below) for power, (above, below) in enumerate(coefficients)][1:]


def _floats(coefficients: Sequence[Ratio], factor: int = 1) -> Coefficients:
    return tuple(factor * above / below for above, below in coefficients)


def _alternating(offset: int, terms: int) -> list[Ratio]:
    """Return (-1)^k / (2 k + offset)! for k = 0, 1, ..."""
    return [((-1) ** k, math.factorial(2 * k + offset)) for k in range(terms)]


def _tail(exponent: int) -> float:
    """Return the sum of n^-exponent over n >= 3 (Euler-Maclaurin from n = 40)."""
    start = 40.0
    direct = math.fsum(float(n) ** -exponent for n in range(3, int(start)))
    rest: float = start ** (1.0 - exponent) / (exponent - 1.0) + 0.5 * start**-exponent
    rest += exponent * start ** (-exponent - 1.0) / 12.0
    rest -= exponent * (exponent + 1.0) * (exponent + 2.0) * start ** (-exponent - 3.0) / 720.0
    rest += math.prod(exponent + i for i in range(5)) * start ** (-exponent - 5.0) / 30240.0
    return direct + rest


_F2 = [(-above, below) for above, below in _alternating(2, TAYLOR_TERMS + 1)]
_F3 = _alternating(3, TAYLOR_TERMS + 1)

#: Few terms suffice for these two: they are used for y <= 1/4 only (`half_angle`); sin and cos are accurate elsewhere.
SINC = _floats(_alternating(1, 8))
COS = _floats(_alternating(0, 8))
F3 = _floats(_F3[:TAYLOR_TERMS])
F4 = _floats(_derivative(_F2), 2)
F5 = _floats(_derivative(_F3), -2)

_TAILS = [_tail(2 * k) for k in range(1, POLE_TERMS + 1)]
#: f6 without its first two poles, in powers of y / (4 pi^2); the constant factor is included.
F6_REMAINDER: Coefficients = tuple(2.0 / POLES[0] * tail for tail in _TAILS)
#: f8 = 2 df6/dy without its first two poles, likewise.
F8_REMAINDER: Coefficients = tuple(4.0 / POLES[0] ** 2 * (k + 1) * tail for k, tail in enumerate(_TAILS[1:]))

#: 2 atan(r)/r in powers of r^2, for r^2 <= 0.01.
ARCTANGENT: Coefficients = tuple(2.0 * (-1) ** k / (2 * k + 1) for k in range(9))


def polynomial(coefficients: Sequence[float], y: Value) -> Value:
    """Return sum_k coefficients[k] y^k by Horner's rule."""
    total: Value = coefficients[-1]
    for coefficient in reversed(coefficients[:-1]):
        total = y * total + coefficient
    return total


def half_angle(algebra: Algebra, y: Value) -> tuple[Value, Value]:
    """Return sin(x/2)/(x/2) and cos(x/2) for y = x^2."""
    quarter = y * 0.25
    small = algebra.less(quarter, 0.25)
    half = algebra.sqrt(algebra.select(small, 1.0, quarter))
    sinc = algebra.select(small, polynomial(SINC, quarter), algebra.sin(half) / half)
    cosine = algebra.select(small, polynomial(COS, quarter), algebra.cos(half))
    return sinc, cosine


def f1_f2(algebra: Algebra, y: Value) -> tuple[Value, Value]:
    """Return f1 = sin x/x and f2 = (cos x - 1)/x^2, from half angles, without cancellation."""
    sinc, cosine = half_angle(algebra, y)
    return sinc * cosine, sinc * sinc * (-0.5)


def f2_to_f5(algebra: Algebra, y: Value, up_to: int = 5) -> tuple[Value, ...]:
    """Return f2 = (cos x - 1)/x^2 and f3 = (x - sin x)/x^3 for y = x^2; with ``up_to`` 5 also f4 = 2 df2/dy, f5 = -2
    df3/dy."""
    f1, f2 = f1_f2(algebra, y)
    small = algebra.less(y, TAYLOR_LIMIT)
    large = algebra.select(small, 1.0, y)
    f3 = algebra.select(small, polynomial(F3, y), (f1 * (-1.0) + 1.0) / large)
    if up_to == 3:
        return f2, f3
    f4 = algebra.select(small, polynomial(F4, y), (f2 * (-2.0) - f1) / large)
    f5 = algebra.select(small, polynomial(F5, y), (f3 * 3.0 + f2) / large)
    return f2, f3, f4, f5


def f6_f8(y: Value, up_to: int = 8) -> tuple[Value, ...]:
    """Return f6 = (1 - (x/2) cot(x/2))/x^2 for y = x^2, as a tuple; with ``up_to`` 8 also f8 = 2 df6/dy. Accurate for
    |x| < 2 pi, infinite at 2 pi."""
    first, second = (((y * (-1.0)) + pole) for pole in POLES)
    scaled = y * (1.0 / POLES[0])
    by_first, by_second = _inverse(first), _inverse(second)
    f6 = (by_first + by_second) * 2.0 + polynomial(F6_REMAINDER, scaled)
    if up_to == 6:
        return (f6,)
    f8 = (by_first * by_first + by_second * by_second) * 4.0 + polynomial(F8_REMAINDER, scaled)
    return f6, f8


def angle_factor(algebra: Algebra, scalar_part: Value, vector_square: Value) -> Value:
    """Return the factor from the vector part of a unit quaternion to the logarithm theta of the rotation, |theta| <=
    pi. ``scalar_part`` is w, ``vector_square`` the squared length of the vector part. The factor is negative for w < 0,
    which picks the shorter of the two rotations."""
    negative = algebra.less(scalar_part, 0.0)
    cosine = algebra.select(negative, scalar_part * (-1.0), scalar_part)
    small = algebra.less(vector_square, cosine * cosine * 0.01)
    safe_cosine = algebra.select(small, cosine, 1.0)
    ratio = algebra.select(small, vector_square, 0.0) / (safe_cosine * safe_cosine)
    sine = algebra.sqrt(algebra.select(small, 1.0, vector_square))
    factor = algebra.select(
        small, polynomial(ARCTANGENT, ratio) / safe_cosine, algebra.atan2(sine, cosine) * 2.0 / sine
    )
    return algebra.select(negative, factor * (-1.0), factor)


def _inverse(x: Value) -> Value:
    """Return 1/x by a division of two values, since a plain number cannot be divided by a scalar of a tape."""
    return (x * 0.0 + 1.0) / x
