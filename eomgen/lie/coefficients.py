"""Coefficient functions of y = |theta|^2 in exp, T and T^-1, accurate to round-off and free of branches on values.

Each is smooth in y, so both sides of a selection are finite, also for a derivative taken through it: the side that is
not selected works on a harmless argument.
"""

from __future__ import annotations

from collections.abc import Sequence

from eomgen.lie import series
from eomgen.lie.algebra import Algebra, Value


def polynomial(coefficients: Sequence[float], y: Value) -> Value:
    """Return sum_k coefficients[k] y^k by Horner's rule."""
    total: Value = coefficients[-1]
    for coefficient in reversed(coefficients[:-1]):
        total = y * total + coefficient
    return total


def half_angle(algebra: Algebra, y: Value) -> tuple[Value, Value]:
    """Return sin(x/2)/(x/2) and cos(x/2) for y = x^2."""
    quarter = y * 0.25
    small = algebra.less(quarter, series.SMALL_LIMIT)
    half = algebra.sqrt(algebra.select(small, 1.0, quarter))
    sinc = algebra.select(small, polynomial(series.SINC, quarter), algebra.sin(half) / half)
    cosine = algebra.select(small, polynomial(series.COS, quarter), algebra.cos(half))
    return sinc, cosine


def f1_f2(algebra: Algebra, y: Value) -> tuple[Value, Value]:
    """Return f1 = sin x/x and f2 = (cos x - 1)/x^2, from half angles, without cancellation."""
    sinc, cosine = half_angle(algebra, y)
    return sinc * cosine, sinc * sinc * (-0.5)


def f2_to_f5(algebra: Algebra, y: Value, up_to: int = 5) -> tuple[Value, ...]:
    """Return f2, f3 = (x - sin x)/x^3 and, with ``up_to = 5``, f4 = 2 df2/dy and f5 = -2 df3/dy."""
    f1, f2 = f1_f2(algebra, y)
    small = algebra.less(y, series.TAYLOR_LIMIT)
    large = algebra.select(small, 1.0, y)
    f3 = algebra.select(small, polynomial(series.F3, y), (f1 * (-1.0) + 1.0) / large)
    if up_to == 3:
        return f2, f3
    f4 = algebra.select(small, polynomial(series.F4, y), (f2 * (-2.0) - f1) / large)
    f5 = algebra.select(small, polynomial(series.F5, y), (f3 * 3.0 + f2) / large)
    return f2, f3, f4, f5


def f6_f8(y: Value, up_to: int = 8) -> tuple[Value, ...]:
    """Return f6 = (1 - (x/2) cot(x/2))/x^2 and, with ``up_to = 8``, f8 = 2 df6/dy; good for |x| < 2 pi, infinite
    there."""
    first, second = (((y * (-1.0)) + pole) for pole in series.POLES)
    scaled = y * (1.0 / series.POLES[0])
    by_first, by_second = _inverse(first), _inverse(second)
    f6 = (by_first + by_second) * 2.0 + polynomial(series.F6_REMAINDER, scaled)
    if up_to == 6:
        return (f6,)
    f8 = (by_first * by_first + by_second * by_second) * 4.0 + polynomial(series.F8_REMAINDER, scaled)
    return f6, f8


def angle_factor(algebra: Algebra, scalar_part: Value, vector_square: Value) -> Value:
    """Return |theta|/|quaternion's vector part| for the shorter of the two rotations, with the sign that picks it.

    theta = factor * vector part, with |theta| <= pi, is the logarithm of the rotation.
    """
    negative = algebra.less(scalar_part, 0.0)
    cosine = algebra.select(negative, scalar_part * (-1.0), scalar_part)
    small = algebra.less(vector_square, cosine * cosine * series.ARCTANGENT_LIMIT)
    safe_cosine = algebra.select(small, cosine, 1.0)
    ratio = algebra.select(small, vector_square, 0.0) / (safe_cosine * safe_cosine)
    sine = algebra.sqrt(algebra.select(small, 1.0, vector_square))
    factor = algebra.select(
        small, polynomial(series.ARCTANGENT, ratio) / safe_cosine, algebra.atan2(sine, cosine) * 2.0 / sine
    )
    return algebra.select(negative, factor * (-1.0), factor)


def _inverse(x: Value) -> Value:
    """Return 1/x; written so because a tape's scalar divides, but a number is not divided by it."""
    return (x * 0.0 + 1.0) / x
