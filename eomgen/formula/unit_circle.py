"""Cosines and sines of constants to the last bit: they go into C, whose bytes are to be the same on every machine.

Sines and cosines of the C library differ in the last digit between its versions and between processors.
"""

from __future__ import annotations

from fractions import Fraction

#: Binary digits behind the point.
_DIGITS = 192
#: pi / 4 = 4 arctan(1/5) - arctan(1/239) (Machin 1706).
_MACHIN = ((16, 5), (-4, 239))


def unit_circle(angle: float, quarter_turns: int = 0) -> tuple[float, float]:
    """Return cosine and sine of an angle in rad plus quarter turns, rounded once."""
    pi = sum(factor * _inverse_tangent(number) for factor, number in _MACHIN)
    exact = Fraction(angle)
    x = (exact.numerator << _DIGITS) // exact.denominator
    quarters = (2 * x + pi // 2) // pi
    x -= quarters * pi // 2
    cosine = sine = 0
    power, order = 1 << _DIGITS, 0
    while power:
        sign = -1 if order & 2 else 1
        if order & 1:
            sine += sign * power
        else:
            cosine += sign * power
        order += 1
        power = (power * x >> _DIGITS) // order
    for _ in range((quarters + quarter_turns) % 4):
        cosine, sine = -sine, cosine
    return _rounded(cosine), _rounded(sine)


def _inverse_tangent(number: int) -> int:
    """Return the inverse tangent of 1/number, in units of the last digit."""
    total, power, order = 0, (1 << _DIGITS) // number, 1
    while power:
        total += -(power // order) if order & 2 else power // order
        power //= number * number
        order += 2
    return total


def _rounded(value: int) -> float:
    return float(Fraction(value, 1 << _DIGITS))
