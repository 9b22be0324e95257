"""Nodes and matrices of time-discontinuous Galerkin steps, in exact arithmetic with rounded roots.

On a step of length 1 a motion is a polynomial of degree p through the p + 1 nodes of Radau's quadrature on the right;
``integration`` is the parent's operator, Radau IIA's. In Laguerre's polynomials L_j(s/gamma) the operator

    P = gamma (1 - N),   N e_j = e_{j+1},   N e_p = 0,

integrates polynomials of degree below p exactly and has one eigenvalue, gamma. It differs from the parent's in its
action on L_p alone: Burrage, BIT 18 (1978) 22; Butcher, J. ACM 26 (1979) 731.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import cache
from itertools import pairwise

from eomgen.base.data import dataclass

Matrix = list[list[Fraction]]


@dataclass(frozen=True)
class Operators:
    """Nodes and matrices; a matrix acts on values at the nodes, ``modes`` transforms values into coefficients of
    L_j(s/gamma).

    Attributes
    ----------
    nodes : the last one is 1
    integration : A, of Radau IIA
    first : V P V^-1, of the first pass
    values, modes : V_ij = L_j(c_i/gamma), and V^-1
    derivative : A^-1, of polynomials of degree p + 1 that vanish at 0
    """

    nodes: Sequence[Fraction]
    integration: Matrix
    first: Matrix
    values: Matrix
    modes: Matrix
    derivative: Matrix


def operators(degree: int, gamma: Fraction) -> Operators:
    """Return nodes and matrices of time-discontinuous Galerkin steps for polynomials of a degree >= 1. `gamma` is the
    eigenvalue of the operator of the first pass, in shares of a step."""
    nodes = right_radau_nodes(degree + 1)
    size = len(nodes)
    powers = [[node**k for k in range(size)] for node in nodes]
    integrals = [[node ** (k + 1) / (k + 1) for k in range(size)] for node in nodes]
    integration = product(integrals, inverse(powers))
    values = [laguerre(degree, node / gamma) for node in nodes]
    modes = inverse(values)
    shifted = [[gamma * (row[j] - (row[j + 1] if j < degree else 0)) for j in range(size)] for row in values]
    return Operators(nodes, integration, product(shifted, modes), values, modes, inverse(integration))


@cache
def right_radau_nodes(size: int) -> tuple[Fraction, ...]:
    """Return the `size` nodes of Radau's quadrature on (0, 1], increasing; the last one is 1. These are the zeros of
    P_s - P_{s-1}, Legendre's polynomials shifted to (0, 1]."""

    def difference(x: Fraction) -> Fraction:
        before, now = Fraction(1), 2 * x - 1
        for k in range(1, size):
            before, now = now, ((2 * k + 1) * (2 * x - 1) * now - k * before) / (k + 1)
        return now - before

    places = [(x, difference(x)) for x in (Fraction(k, 64 * size * size) for k in range(64 * size * size))]
    result = [root(difference, low, high) for (low, below), (high, above) in pairwise(places) if below * above < 0]
    return (*result, Fraction(1))


def laguerre(degree: int, x: Fraction) -> list[Fraction]:
    """Return L_0(x) to L_degree(x)."""
    result = [Fraction(1), 1 - x]
    for k in range(1, degree):
        result.append(((2 * k + 1 - x) * result[k] - k * result[k - 1]) / (k + 1))
    return result[: degree + 1]


def root(function: Callable[[Fraction], Fraction], low: Fraction, high: Fraction) -> Fraction:
    """Return a zero of a function between two places at which its signs differ, rounded down to 256 binary places."""
    rising, parts = function(high) > 0, 2**256
    below, above = math.floor(low * parts), math.ceil(high * parts)
    while above - below > 1:
        middle = (below + above) // 2
        if (function(Fraction(middle, parts)) > 0) is rising:
            above = middle
        else:
            below = middle
    return Fraction(below, parts)


def product(left: Sequence[Sequence[Fraction]], right: Sequence[Sequence[Fraction]]) -> Matrix:
    """Return the product of two matrices."""
    columns = list(zip(*right, strict=True))
    return [[sum((x * y for x, y in zip(row, column, strict=True)), Fraction(0)) for column in columns] for row in left]


def inverse(matrix: Sequence[Sequence[Fraction]]) -> Matrix:
    """Return the inverse of a regular square matrix, by elimination with exact fractions."""
    size = len(matrix)
    rows = [[*row, *(Fraction(int(i == j)) for j in range(size))] for i, row in enumerate(matrix)]
    for k in range(size):
        pivot = next(i for i in range(k, size) if rows[i][k])
        rows[k], rows[pivot] = rows[pivot], rows[k]
        rows[k] = [x / rows[k][k] for x in rows[k]]
        for i in range(size):
            if i != k and rows[i][k]:
                rows[i] = [x - rows[i][k] * y for x, y in zip(rows[i], rows[k], strict=True)]
    return [row[size:] for row in rows]
