"""Shape functions of uniform beams, bars and shafts: their modes, and polynomials orthogonal in their mass.

Polynomials have exact rational coefficients: f_k = w(s) P_k(s), w with the geometric conditions at the ends, P_k Jacobi
polynomials on 0 .. 1, orthogonal with the weight w^2 (Abramowitz and Stegun, chapter 22). So a dozen of them still make
a well conditioned mass matrix.

Modes are functions of s = 0 .. 1. Bending (R. D. Blevins, Formulas for Natural Frequency and Mode Shape, 1979, table
8-1): f = cosh x -+ cos x - sigma (sinh x -+ sin x) with x = lambda s. Growing and decaying part are brought together by
A = (1 - sigma) e^lambda, found with as many digits as that takes, so that large numbers are never subtracted from one
another and any mode is as exact as the first.
"""

from __future__ import annotations

import functools
from fractions import Fraction
from math import comb
from typing import Any, NamedTuple

import mpmath
import numpy as np

from eomgen.mechanics.shape_functions.families import ShapeFunctions, Values
from eomgen.mechanics.shape_functions.fixed_point import WORKING, Fixed, from_fixed, polynomial, to_fixed
from eomgen.scene.bodies.model import DeformationKind, Ends

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


def family(kind: DeformationKind, ends: Ends, size: int) -> ShapeFunctions:
    """Return ``size`` polynomials of a kind of deformation, orthogonal over s with constant weight, for conditions at
    the ends; f = 1 at a free second end."""
    at_first, at_second, lowest = (_BENDING if kind.startswith("bending") else _OTHERS)[ends]
    weight = product(_power((Fraction(0), Fraction(1)), at_first), _power((Fraction(1), Fraction(-1)), at_second))
    numbers = range(lowest, lowest + size)
    polynomials = [product(weight, _jacobi(number, 2 * at_second, 2 * at_first)) for number in numbers]

    def values(s: Fixed) -> Values:
        f, slope, curvature = (
            np.array([polynomial(differentiate(entry, times), s) for entry in polynomials]) for times in range(3)
        )
        return f, slope, curvature

    return ShapeFunctions(size, (len(polynomials[-1]) - 1) / 4.0, values)


def _jacobi(degree: int, alpha: int, beta: int) -> Coefficients:
    """Return the coefficients, constant first, of the Jacobi polynomial P_n^(alpha, beta)(2 s - 1). Orthogonal on 0 ..
    1 with the weight (1 - s)^alpha s^beta; the value at s = 1 is C(n + alpha, n)."""
    result: list[Fraction] = [Fraction(0)] * (degree + 1)
    for number in range(degree + 1):
        # about s = 1: sum of C(n, j) C(n + alpha + beta + j, ...) (s - 1)^j, expanded
        factor = Fraction(comb(degree + alpha + beta + number, number) * comb(degree + alpha, degree - number))
        for power, entry in enumerate(_power((Fraction(-1), Fraction(1)), number)):
            result[power] += factor * entry
    return tuple(result)


def product(first: Coefficients, second: Coefficients) -> Coefficients:
    """Return the coefficients, constant first, of the product of two polynomials."""
    return tuple(np.convolve(np.array(first, object), np.array(second, object)))


def differentiate(entry: Coefficients, times: int = 1) -> Coefficients:
    """Return the coefficients, constant first, of a derivative of a polynomial, of the order ``times``."""
    for _ in range(times):
        entry = tuple(power * factor for power, factor in enumerate(entry))[1:] or (Fraction(0),)
    return entry


def on_piece(entry: Coefficients, piece: int, count: int) -> Coefficients:
    """Return the coefficients in r of a polynomial of s on one of ``count`` equal pieces, s = (piece + r) / count."""
    result: Coefficients = ()
    for factor in reversed(entry):
        longer = product(result or (Fraction(0),), (Fraction(piece, count), Fraction(1, count)))
        result = (longer[0] + factor, *longer[1:])
    return result[: len(entry)]


def integrate(entry: Coefficients) -> Coefficients:
    """Return the antiderivative that vanishes at 0."""
    return (Fraction(0), *(factor / (power + 1) for power, factor in enumerate(entry)))


def _power(base: Coefficients, exponent: int) -> Coefficients:
    return functools.reduce(product, [base] * exponent, (Fraction(1),))


class Root(NamedTuple):
    """One mode: wave number lambda, sigma, A = (1 - sigma) e^lambda, and e^-lambda, in mpmath numbers."""

    wave_number: Any
    sigma: Any
    growing: Any
    decay: Any


@functools.cache
def root(sign: int, number: int) -> Root:
    """Return the mode ``number`` = 1, 2, ... of cos x cosh x = -sign: 1 for clamped-free, -1 for free-free bending."""
    with mpmath.workprec(WORKING + 10 * number):  # cosh(lambda) grows by 4.5 bits a mode, and is squared on the way
        guess = (number - sign * mpmath.mpf(1) / 2) * mpmath.pi
        wave = mpmath.findroot(lambda x: mpmath.cos(x) + sign * mpmath.sech(x), guess)
        sigma = (mpmath.cosh(wave) + sign * mpmath.cos(wave)) / (mpmath.sinh(wave) + sign * mpmath.sin(wave))
        return Root(wave, sigma, (1 - sigma) * mpmath.exp(wave), mpmath.exp(-wave))


def _bending(sign: int, mode: Root, s: Any) -> tuple[Any, Any, Any]:
    """Return value, first and second derivative by s of one mode at one position (mpmath). ``sign`` is 1 for a
    clamped-free, -1 for a free-free beam."""
    wave, sigma, growing, decay = mode
    x = wave * s
    cos, sin = mpmath.cos_sin(x)
    grown = mpmath.exp(x - wave)
    rising, falling = growing * grown / 2, (1 + sigma) * decay / (2 * grown)
    even = sign * (cos - sigma * sin)
    odd = sign * (sin + sigma * cos)
    return rising + falling - even, wave * (rising - falling + odd), wave * wave * (rising + falling + even)


def _harmonic(ends: Ends, turns: Any, s: Any) -> tuple[Any, Any, Any]:
    """Return value, first and second derivative by s of one function, with ``turns`` half waves, at one position
    (mpmath)."""
    wave = turns * mpmath.pi
    cos, sin = mpmath.cospi(turns * s), mpmath.sinpi(turns * s)
    if ends == "free_free":
        return cos, -wave * sin, -wave * wave * cos
    return sin, wave * cos, -wave * wave * sin


def _table(modes: list[Any], function: Any, s: Fixed) -> Values:
    """Return values, first and second derivatives of modes at fixed-point positions ``s``, (n, m) each, fixed-point.
    ``function(mode, position)`` returns the three in mpmath numbers."""
    result = np.zeros((3, len(modes), len(s)), dtype=object)
    with mpmath.workprec(WORKING):
        positions = [from_fixed(position) for position in s]
        for row, mode in enumerate(modes):
            for column, position in enumerate(positions):
                result[:, row, column] = [to_fixed(part) for part in function(mode, position)]
    f, slope, curvature = result
    return f, slope, curvature


def modes(bends: bool, ends: Ends, size: int) -> ShapeFunctions:
    """Return the lowest ``size`` modes of a uniform beam in bending (``bends``), or in stretch or torsion, by
    conditions at the ends, without rigid motions.

    Bending modes of clamped-free and free-free beams have int f^2 = 1, and f = 2 (-1)^(k+1), or 2, at a free end. The
    others have the greatest value 1: sin((k - 1/2) pi s) of ``clamped_free``, cos(k pi s) of ``free_free``, sin(k pi s)
    of ``pinned_pinned``.
    """
    numbers = range(1, size + 1)
    if bends and ends != "pinned_pinned":
        sign = 1 if ends == "clamped_free" else -1
        roots = [root(sign, number) for number in numbers]
        bending = functools.partial(_bending, sign)
        return ShapeFunctions(size, float(roots[-1].wave_number), functools.partial(_table, roots, bending))
    half = mpmath.mpf(1) / 2 if ends == "clamped_free" else 0
    harmonic = functools.partial(_harmonic, ends)
    return ShapeFunctions(size, np.pi * size, functools.partial(_table, [k - half for k in numbers], harmonic))
