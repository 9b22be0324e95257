"""Polynomial shape functions with exact rational coefficients, orthogonal in the mass of a uniform beam.

f_k = w(s) P_k(s), where w holds the geometric conditions at the ends and P_k are Jacobi polynomials on 0 .. 1, orthogonal with
the weight w^2 (Abramowitz and Stegun, chapter 22). So a dozen of them still make a well conditioned mass matrix.
"""

from __future__ import annotations

from fractions import Fraction
from math import comb

import numpy as np

from eomgen.mechanics.beams.families import Array
from eomgen.scene.beam import DeformationKind, Ends

#: Coefficients, constant first.
Coefficients = tuple[Fraction, ...]

#: For bending and for the rest: powers of s and of 1 - s in w, and the degree of the first polynomial, rigid motions left out.
_BENDING: dict[Ends, tuple[int, int, int]] = {"clamped_free": (2, 0, 0), "free_free": (0, 0, 2), "pinned_pinned": (1, 1, 0)}
_OTHERS: dict[Ends, tuple[int, int, int]] = {"clamped_free": (1, 0, 0), "free_free": (0, 0, 1), "pinned_pinned": (1, 1, 0)}


class Polynomials:
    """Polynomials of s; f = 1 at a free second end, f' = -4^n there where both ends are held.

    Parameters
    ----------
    coefficients : sequence
        Of each function, constant first, all of the same length.
    """

    breaks: tuple[float, ...] = ()

    def __init__(self, coefficients: tuple[Coefficients, ...]) -> None:
        self.coefficients = coefficients

    @property
    def size(self) -> int:
        """Number of functions."""
        return len(self.coefficients)

    @property
    def wave_number(self) -> float:
        """The degree."""
        return float(len(self.coefficients[0]) - 1)

    def values(self, s: Array, derivative: int = 0) -> Array:
        """Return (n, m) values of a derivative by s."""
        return np.array([evaluated(differentiated(entry, derivative), s) for entry in self.coefficients])


def family(kind: DeformationKind, ends: Ends, size: int) -> Polynomials:
    """Return the polynomials of a kind of deformation."""
    at_first, at_second, lowest = (_BENDING if kind.startswith("bending") else _OTHERS)[ends]
    weight = product(_power((Fraction(0), Fraction(1)), at_first), _power((Fraction(1), Fraction(-1)), at_second))
    degree = lowest + size - 1 + at_first + at_second
    found = []
    for number in range(lowest, lowest + size):
        entry = product(weight, _jacobi(number, 2 * at_second, 2 * at_first))
        found.append(entry + (Fraction(0),) * (degree + 1 - len(entry)))
    return Polynomials(tuple(found))


def _jacobi(degree: int, alpha: int, beta: int) -> Coefficients:
    """Return P_n^(alpha, beta)(2 s - 1), orthogonal on 0 .. 1 with the weight (1 - s)^alpha s^beta; C(n + alpha, n) at s = 1."""
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
    for place, factor in enumerate(first):
        for other, entry in enumerate(second):
            result[place + other] += factor * entry
    return tuple(result)


def differentiated(polynomial: Coefficients, times: int = 1) -> Coefficients:
    """Return a derivative."""
    for _ in range(times):
        polynomial = tuple(place * entry for place, entry in enumerate(polynomial))[1:] or (Fraction(0),)
    return polynomial


def integrated(polynomial: Coefficients, origin: Fraction = Fraction(0)) -> Coefficients:
    """Return the antiderivative that vanishes at a place."""
    result = (Fraction(0), *(entry / (place + 1) for place, entry in enumerate(polynomial)))
    return (-at(result, origin), *result[1:])


def at(polynomial: Coefficients, place: Fraction) -> Fraction:
    """Return the exact value at a place."""
    value = Fraction(0)
    for entry in reversed(polynomial):
        value = value * place + entry
    return value


def evaluated(polynomial: Coefficients, s: Array) -> Array:
    """Return values in double precision, each correctly rounded: high powers cancel, so they are taken exactly."""
    return np.array([float(at(polynomial, Fraction(float(place)))) for place in s])


def _power(base: Coefficients, exponent: int) -> Coefficients:
    result: Coefficients = (Fraction(1),)
    for _ in range(exponent):
        result = product(result, base)
    return result
