"""Polynomial shape functions with exact rational coefficients, orthogonal in the mass of a uniform beam.

f_k = w(s) P_k(s), w with the geometric conditions at the ends, P_k Jacobi polynomials on 0 .. 1,
orthogonal with the weight w^2 (Abramowitz and Stegun, chapter 22). So a dozen of them still make a well conditioned
mass matrix.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from math import comb

import numpy as np

from eomgen.mechanics.shape_functions.fixed_point import Fixed, polynomial
from eomgen.scene.bodies.beam import DeformationKind, Ends

#: Coefficients, constant first.
Coefficients = tuple[Fraction, ...]

#: For bending and for the rest: powers of s and of 1 - s in w, and the degree of the first polynomial, rigid motions
#: left out.
_BENDING: dict[Ends, tuple[int, int, int]] = {
    "clamped_free": (2, 0, 0),
    "free_free": (0, 0, 2),
    "pinned_pinned": (1, 1, 0),
}
_OTHERS: dict[Ends, tuple[int, int, int]] = {
    "clamped_free": (1, 0, 0),
    "free_free": (0, 0, 1),
    "pinned_pinned": (1, 1, 0),
}


@dataclass(frozen=True)
class Polynomials:
    """Polynomials of s; f = 1 at a free second end.

    Attributes
    ----------
    coefficients : of each function, constant first
    """

    coefficients: tuple[Coefficients, ...]
    breaks: tuple[Fraction, ...] = ()

    @property
    def size(self) -> int:
        """Number of functions."""
        return len(self.coefficients)

    @property
    def wave_number(self) -> float:
        """A quarter of the highest degree."""
        return max(len(entry) - 1 for entry in self.coefficients) / 4.0

    def values(self, s: Fixed) -> tuple[Fixed, Fixed, Fixed]:
        """Return (n, m) values, first and second derivatives by s."""
        f, slope, curvature = (
            np.array([polynomial(differentiated(entry, times), s) for entry in self.coefficients]) for times in range(3)
        )
        return f, slope, curvature


def family(kind: DeformationKind, ends: Ends, size: int) -> Polynomials:
    """Return the polynomials of a kind of deformation."""
    at_first, at_second, lowest = (_BENDING if kind.startswith("bending") else _OTHERS)[ends]
    weight = product(_power((Fraction(0), Fraction(1)), at_first), _power((Fraction(1), Fraction(-1)), at_second))
    numbers = range(lowest, lowest + size)
    return Polynomials(tuple(product(weight, _jacobi(number, 2 * at_second, 2 * at_first)) for number in numbers))


def _jacobi(degree: int, alpha: int, beta: int) -> Coefficients:
    """Return P_n^(alpha, beta)(2 s - 1), orthogonal on 0 .. 1 with the weight (1 - s)^alpha s^beta; C(n + alpha, n) at
    s = 1."""
    result: list[Fraction] = [Fraction(0)] * (degree + 1)
    for number in range(degree + 1):
        # about s = 1: sum of C(n, j) C(n + alpha + beta + j, ...) (s - 1)^j, expanded
        factor = Fraction(comb(degree + alpha + beta + number, number) * comb(degree + alpha, degree - number))
        for power, entry in enumerate(_power((Fraction(-1), Fraction(1)), number)):
            result[power] += factor * entry
    return tuple(result)


def product(first: Coefficients, second: Coefficients) -> Coefficients:
    """Return the product of two polynomials."""
    result = [Fraction(0)] * (len(first) + len(second) - 1)
    for power, factor in enumerate(first):
        for other_power, entry in enumerate(second):
            result[power + other_power] += factor * entry
    return tuple(result)


def differentiated(entry: Coefficients, times: int = 1) -> Coefficients:
    """Return a derivative."""
    for _ in range(times):
        entry = tuple(power * factor for power, factor in enumerate(entry))[1:] or (Fraction(0),)
    return entry


def shifted(entry: Coefficients, piece: int, count: int) -> Coefficients:
    """Return a polynomial of s as one of r, s = (piece + r) / count."""
    result: Coefficients = ()
    for factor in reversed(entry):
        longer = product(result or (Fraction(0),), (Fraction(piece, count), Fraction(1, count)))
        result = (longer[0] + factor, *longer[1:])
    return result[: len(entry)]


def integrated(entry: Coefficients) -> Coefficients:
    """Return the antiderivative that vanishes at 0."""
    return (Fraction(0), *(factor / (power + 1) for power, factor in enumerate(entry)))


def _power(base: Coefficients, exponent: int) -> Coefficients:
    result: Coefficients = (Fraction(1),)
    for _ in range(exponent):
        result = product(result, base)
    return result
