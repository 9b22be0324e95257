"""Families of shape functions, and Gauss quadrature along a beam, in fixed-point numbers."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
from numpy.polynomial.legendre import legvander

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, replace
from eomgen.mechanics.shape_functions.fixed_point import WORKING, Fixed, array, round_to_doubles, times, to_fixed

#: Values, first and second derivatives by s of n functions at m positions, (n, m) each, fixed-point.
Values = tuple[Fixed, Fixed, Fixed]


@dataclass(frozen=True)
class ShapeFunctions:
    """Shape functions f_0 .. f_(n-1) of s.

    Attributes
    ----------
    size : n
    wave_number : largest wave number of the functions between breaks, rad; of polynomials, a quarter of the degree
    values : the function that returns Values at m positions
    breaks : places at which functions or derivatives are not smooth, within 0 < s < 1, in order
    """

    size: int
    wave_number: float
    values: Callable[[Fixed], Values]
    breaks: tuple[Fraction, ...] = ()

    def scale(self, factors: Fixed) -> ShapeFunctions:
        """Return the functions multiplied by factors (n,)."""

        def values(s: Fixed) -> Values:
            f, slope, curvature = (times(factors[:, None], part) for part in self.values(s))
            return f, slope, curvature

        return replace(self, values=values)


_NODES = 24


@functools.cache
def _rule() -> tuple[Fixed, Fixed, Fixed]:
    """Return nodes and weights of Gauss's rule on [0, 1], and the integrals of its Lagrange polynomials from 0 to each
    node. All are fixed-point; the integrals are (n, n), a row for each node."""
    with mpmath.workprec(WORKING):
        nodes = [_root(number) for number in range(_NODES)][::-1]
        weights = [2 / ((1 - x * x) * _legendre(x)[1][-1] ** 2) for x in nodes]
        running = np.zeros((_NODES, _NODES), dtype=object)
        values = [_legendre(x)[0] for x in nodes]
        for row, x in enumerate(nodes):
            # int_(-1)^x P_j = (P_(j+1) - P_(j-1)) / (2 j + 1), and x + 1 for j = 0
            rises = [x + 1, *((values[row][j + 1] - values[row][j - 1]) / (2 * j + 1) for j in range(1, _NODES))]
            for column, weight in enumerate(weights):
                terms = (rise * values[column][j] * (2 * j + 1) for j, rise in enumerate(rises))
                running[row, column] = to_fixed(sum(terms) * weight / 4)
        return array((x + 1) / 2 for x in nodes), array(weight / 2 for weight in weights), running


def _legendre(x: Any) -> tuple[list[Any], list[Any]]:
    """Return P_0 .. P_n and the derivatives, n being the number of nodes."""
    values, slopes = [mpmath.mpf(1), x], [mpmath.mpf(0), mpmath.mpf(1)]
    for j in range(1, _NODES):
        values.append(((2 * j + 1) * x * values[j] - j * values[j - 1]) / (j + 1))
        slopes.append(slopes[j - 1] + (2 * j + 1) * values[j])
    return values, slopes


def _root(number: int) -> Any:
    """Return a root of the highest Legendre polynomial, by Newton's iteration from a guess within the basin of
    attraction."""
    x = mpmath.cos(mpmath.pi * (number + mpmath.mpf(3) / 4) / (_NODES + mpmath.mpf(1) / 2))
    for _ in range(8):
        values, slopes = _legendre(x)
        x -= values[-1] / slopes[-1]
    return x


class QuadratureGrid:
    """Quadrature nodes and weights along a beam, in fixed-point numbers, on panels of at most 3 rad of the functions.

    Parameters
    ----------
    families : sequence of ShapeFunctions
        Functions to integrate; their breaks are edges of panels.
    ends : sequence of Fraction
        Ends of the integrals, and positions between that are to be edges of panels.

    Attributes
    ----------
    positions, weights : (m,)
    """

    def __init__(
        self, families: Sequence[ShapeFunctions], ends: Sequence[Fraction] = (Fraction(0), Fraction(1))
    ) -> None:
        breaks = {position for family in families for position in family.breaks if ends[0] < position < ends[-1]}
        edges = sorted({*ends, *breaks})
        wave = max((family.wave_number for family in families), default=0.0)
        self.edges = [edges[0]]
        for first, last in itertools.pairwise(edges):
            # 3 rad a panel: the quadrature error of products of four functions is below 1e-18
            count = max(1, math.ceil(wave * float(last - first) / 3.0))
            self.edges += [first + (last - first) * number / count for number in range(1, count + 1)]
        nodes, weights, _ = _rule()
        self.lengths = array(last - first for first, last in itertools.pairwise(self.edges))
        self.positions = (array(self.edges[:-1])[:, None] + times(self.lengths[:, None], nodes)).ravel()
        self.weights = times(self.lengths[:, None], weights).ravel()

    def integral(self, *factors: Fixed) -> int:
        """Return the integral of a product of (m,) values."""
        return int(np.sum(times(self.weights, *factors)))

    def from_origin(self, values: Fixed, origin: Fraction) -> Fixed:
        """Return the integrals of a function from ``origin``, an edge of panels, to each node, (m,), fixed-point.
        ``values``, (m,), are the function at the nodes."""
        _, weights, running = _rule()
        parts = values.reshape(len(self.lengths), _NODES)
        within = times(np.sum(times(parts[:, None, :], running), axis=-1), self.lengths[:, None])
        whole = times(np.sum(times(parts, weights), axis=-1), self.lengths)
        before = [0, *itertools.accumulate(whole)]
        start = before[self.edges.index(origin)]
        return np.asarray((np.array(before[:-1], dtype=object)[:, None] + within - start).ravel(), dtype=object)

    def weights_up_to(self, places: Sequence[Fraction]) -> Array:
        """Return weights, (p, m), with which values at the m nodes give integrals from the first edge to each of p
        places. In double precision. The interpolant through the nodes of a panel is integrated up to the place, by
        Legendre coefficients."""
        nodes, weights, _ = (round_to_doubles(part) for part in _rule())
        panels = list(itertools.pairwise(self.edges))
        parts = [
            [min(max((s - first) / (last - first), Fraction(0)), Fraction(1)) for first, last in panels] for s in places
        ]
        x = 2.0 * np.array(parts, dtype=float) - 1.0
        P = legvander(x, _NODES)
        risen = np.concatenate([(x + 1.0)[..., None], P[..., 2:] - P[..., :-2]], axis=-1)  # (2 j + 1) int_(-1)^x P_j
        shares = 0.5 * weights * (risen @ legvander(2.0 * nodes - 1.0, _NODES - 1).T)
        return np.asarray((shares * round_to_doubles(self.lengths)[:, None]).reshape(len(parts), -1), dtype=float)
