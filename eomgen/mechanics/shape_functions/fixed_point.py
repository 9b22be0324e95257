"""Fixed-point numbers: integers in units of 2^-BITS, in NumPy arrays of objects; products, polynomials, rounding to
doubles.

Shape integrals become constants of the C. Sums of doubles would differ in the last digit between processors, and so
would the C; sums of whole numbers do not, and are right to some forty digits, so each constant is rounded once.
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray

BITS = 128
#: Binary digits of results of mpmath: some more, for digits lost on the way.
WORKING = BITS + 32
ONE = 1 << BITS
#: Whole numbers of any size.
Fixed = NDArray[np.object_]


def to_fixed(number: Any) -> int:
    """Return a number of mpmath, a fraction or a double in units of 2^-BITS."""
    if isinstance(number, mpmath.mpf):
        return int(mpmath.floor(mpmath.ldexp(number, BITS)))
    fraction = Fraction(number)
    return (fraction.numerator << BITS) // fraction.denominator


def array(numbers: Iterable[Any]) -> Fixed:
    """Return an array of numbers in units of 2^-BITS."""
    return np.array([to_fixed(number) for number in numbers], dtype=object)


def from_fixed(number: int) -> Any:
    """Return a number of mpmath."""
    return mpmath.ldexp(mpmath.mpf(number), -BITS)


def times(*factors: Any) -> Fixed:
    """Return the product of arrays, or numbers, in units of 2^-BITS."""
    product = factors[0]
    for factor in factors[1:]:
        product = (product * factor) >> BITS
    return np.asarray(product, dtype=object)


def polynomial(coefficients: Iterable[Any], s: Fixed) -> Fixed:
    """Return the values of a polynomial at fixed-point positions ``s``; plain coefficients, constant first."""
    result = np.zeros(s.shape, dtype=object)
    for entry in reversed(list(coefficients)):
        result = times(result, s) + to_fixed(entry)
    return result


def round_to_doubles(values: Fixed, scale: Fraction = Fraction(1)) -> NDArray[np.float64]:
    """Return the nearest doubles of values times a scale."""
    flat = [float(Fraction(int(value)) * scale / ONE) for value in np.ravel(values)]
    return np.array(flat, dtype=float).reshape(np.shape(values))
