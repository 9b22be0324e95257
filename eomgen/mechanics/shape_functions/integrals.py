"""Computation of a beam's shape integrals, by the family of shape functions that the scene chooses.

Everything is a sum of whole numbers (see ``fixed_point``) that is rounded once: a fraction becomes the double nearest
to it, and integrals that vanish by symmetry or orthogonality are zero.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import replace
from eomgen.mechanics.shape_functions import uniform_beams
from eomgen.mechanics.shape_functions.elements import elements
from eomgen.mechanics.shape_functions.families import QuadratureGrid, ShapeFunctions
from eomgen.mechanics.shape_functions.fixed_point import (
    BITS,
    ONE,
    WORKING,
    Fixed,
    array,
    from_fixed,
    polynomial,
    round_to_doubles,
    times,
    to_fixed,
)
from eomgen.mechanics.shape_functions.shape_integrals import ShapeIntegrals, Station
from eomgen.mechanics.shape_functions.uniform_beams import Coefficients, integrate, product
from eomgen.scene.bodies.model import Beam, Deformation, Ends, Normalisation


def normalise(family: ShapeFunctions, ends: Ends, normalisation: Normalisation) -> ShapeFunctions:
    """Return shape functions scaled: ``natural`` functions unchanged, ``unit`` functions to a greatest value of 1,
    other functions to a mean square of 1."""
    if normalisation == "natural":
        return family
    with mpmath.workprec(WORKING):
        if normalisation == "unit":
            return family.scale(array(1 / from_fixed(greatest) for greatest in _greatest(family, ends)))
        grid = QuadratureGrid([family])
        squares = [grid.integral(f, f) for f in family.values(grid.positions)[0]]
        return family.scale(array(1 / mpmath.sqrt(from_fixed(square)) for square in squares))


def _greatest(family: ShapeFunctions, ends: Ends) -> list[int]:
    """Return the value of each function at a free second end, with pins its largest magnitude, in fixed-point numbers.
    The sign of the latter is the sign of the function near the start."""
    if ends != "pinned_pinned":
        return [int(value) for value in family.values(np.array([ONE], dtype=object))[0][:, 0]]
    count = 40 * family.size  # enough for the largest half-wave
    positions = np.array([(number << BITS) // count for number in range(count + 1)], dtype=object)
    extremes = []
    for number, row in enumerate(family.values(positions)[0]):
        s = np.array([positions[int(np.argmax(np.abs(row)))]], dtype=object)
        greatest = 0
        for _ in range(9):  # Newton's iteration for f' = 0; no convergence at a kink between elements
            value, slope, curvature = (int(part[number, 0]) for part in family.values(s))
            greatest = max(greatest, abs(value))
            step = (slope << BITS) // curvature if curvature else 0
            s = s - (step if abs(step) * count < ONE else 0)
        extremes.append(greatest if row[1] > 0 else -greatest)
    return extremes


def shapes(deformation: Deformation, beam: Beam) -> ShapeFunctions:
    """Return the shape functions of a deformation, of s = (x - start) / length."""
    return normalise(*_natural(deformation, beam), deformation.normalisation)


def _natural(deformation: Deformation, beam: Beam) -> tuple[ShapeFunctions, Ends]:
    kind, size = deformation.kind, deformation.modes
    if deformation.shapes == "polynomial":
        return uniform_beams.family(kind, deformation.ends, size), deformation.ends
    if deformation.shapes == "finite_elements":
        return elements(deformation, beam), deformation.ends
    return uniform_beams.modes(kind.startswith("bending"), deformation.shapes, size), deformation.shapes


#: Whether an entry of a symmetric matrix may differ from 0, (n, n).
Pairs = np.ndarray[Any, np.dtype[np.bool_]]


def shape_integrals(beam: Beam) -> ShapeIntegrals:
    """Return the shape integrals of a beam; ``h1`` and ``h2`` are empty for ``beam.order`` 1."""
    return _Integrator(beam).integrals()


def weighted_integrals(beam: Beam, profile: tuple[float, ...]) -> ShapeIntegrals:
    """Return the integrals of a beam's shape functions over a polynomial in s in place of the mass; of the first
    order."""
    return _Integrator(replace(beam, order=1)).integrals(tuple(Fraction(entry) for entry in profile))


class _Integrator:
    def __init__(self, beam: Beam) -> None:
        self.beam = beam
        self.start, self.length = Fraction(beam.start), Fraction(beam.length)
        self.families: list[ShapeFunctions] = [shapes(deformation, beam) for deformation in beam.deformations]
        self.origin = self.place(0.0)
        self.grid = QuadratureGrid(self.families, [Fraction(0), self.origin, Fraction(1)])
        self.kinds = tuple(item.kind for item in beam.deformations for _ in range(item.modes))
        bends = np.array([kind.startswith("bending") for kind in self.kinds], bool)
        #: Whether two coordinates bend in the same plane, (n, n).
        self.planar = np.array([[first == second for second in self.kinds] for first in self.kinds], bool) & bends
        self.f, self.slope, self.curvature = self.values(self.grid.positions)

    def place(self, x: float) -> Fraction:
        """Return s = (x - start) / length in [0, 1]."""
        return min(max((Fraction(x) - self.start) / self.length, Fraction(0)), Fraction(1))

    def values(self, s: Fixed) -> tuple[Fixed, Fixed, Fixed]:
        """Return (n, m) values of the functions of all families, and of the derivatives by s."""
        parts = [family.values(s) for family in self.families]
        empty = np.zeros((0, len(s)), dtype=object)
        f, slope, curvature = (np.concatenate([empty, *(part[order] for part in parts)]) for order in range(3))
        return f, slope, curvature

    def integrals(self, weight: Coefficients | None = None) -> ShapeIntegrals:
        """Return the integrals over the shape functions of a beam, weighted by the profile of mass per length or by
        ``weight``. ``weight`` are the coefficients of a polynomial in s, constant first."""
        grid, length = self.grid, self.length
        mass = self.profile("mass") if weight is None else weight
        polar, arm = self.profile("polar"), (self.start, length)
        x, rho, rho_p = (polynomial(entry, grid.positions) for entry in (arm, mass, polar))
        deflects = np.array([kind != "torsion" for kind in self.kinds], bool)
        h1, h2 = self.second_order_terms(rho) if self.beam.order == 2 else (np.zeros((0, 0, 0)), np.zeros((0, 0, 0, 0)))
        return ShapeIntegrals(
            kinds=self.kinds,
            at=self.station,
            along=self.stations,
            mass=float(length * _over(mass)),
            first=float(length * _over(product(mass, arm))),
            second=float(length * _over(product(mass, product(arm, arm)))),
            d=self.vector(rho, deflects),
            e=self.vector(times(rho, x), deflects),
            m=self.matrix(self.f, rho, np.outer(deflects, deflects)),
            g0=self.shortening_integrals(mass),
            g1=self.shortening_integrals(product(mass, arm)),
            h1=h1,
            h2=h2,
            t0=self.vector(rho_p, ~deflects),
            t2=self.matrix(self.f, rho_p, np.outer(~deflects, ~deflects)),
            k=self.stiffness(),
            load=self.vector(array([1] * len(grid.positions)), np.ones(len(self.kinds), bool)),
        )

    def profile(self, name: str) -> Coefficients:
        """Return the polynomial in s of a property's profile, as a share of the property's value; 1 without a
        profile."""
        return tuple(Fraction(entry) for entry in self.beam.profiles.get(name, (1.0,)))

    @functools.cached_property
    def squares(self) -> list[tuple[int, int]]:
        """Integrals of the squares of each function and of the slope."""
        return [
            (self.grid.integral(f, f), self.grid.integral(slope, slope))
            for f, slope in zip(self.f, self.slope, strict=True)
        ]

    def vector(self, weight: Fixed, wanted: Array | np.ndarray[tuple[int], np.dtype[np.bool_]]) -> Array:
        """Return length times the integrals of the functions with a weight, (n,) doubles; 0 for functions not
        ``wanted``. ``weight`` is given at the nodes of the grid, fixed-point."""
        bound = self.grid.integral(weight, weight)
        result = np.zeros(len(self.kinds), dtype=object)
        for k in np.flatnonzero(wanted):
            result[k] = _unless_zero(self.grid.integral(self.f[k], weight), bound, self.squares[k][0])
        return round_to_doubles(result, self.length)

    def matrix(
        self,
        functions: Fixed,
        weight: Any,
        pairs: Pairs,
        scale: Fraction | None = None,
        grid: QuadratureGrid | None = None,
    ) -> Array:
        """Return integrals of products of two functions with a weight, (n, n) doubles, times a scale (default: the
        length). Functions and weight are given at the nodes of the grid, fixed-point; entries outside ``pairs``, and
        those negligible against the diagonal, are 0."""
        result = np.zeros(pairs.shape, dtype=object)
        for k, j in np.argwhere(np.tril(pairs)):
            result[k, j] = result[j, k] = (grid or self.grid).integral(functions[k], functions[j], weight)
        for k, j in np.argwhere(np.tril(pairs, -1)):
            result[k, j] = result[j, k] = _unless_zero(result[k, j], result[k, k], result[j, j])
        return round_to_doubles(result, self.length if scale is None else scale)

    def stiffness(self) -> Array:
        """Return the stiffness matrix, (n, n), for unit stiffness of each deformation with its profile. From curvatures
        for bending, from first derivatives for stretch and torsion; 0 between deformations of different kinds."""
        result = np.zeros((len(self.kinds), len(self.kinds)))
        for kind in dict.fromkeys(self.kinds):
            order = 2 if kind.startswith("bending") else 1
            strain = self.curvature if order == 2 else self.slope
            weight = polynomial(self.profile(kind), self.grid.positions)
            of_kind = np.array([each == kind for each in self.kinds])
            result += self.matrix(strain, weight, np.outer(of_kind, of_kind), 1 / self.length ** (2 * order - 1))
        return result

    def shortening_integrals(self, density: Coefficients) -> Array:
        """Return the integrals over a density of the shortening H_kl = int_0^x f_k' f_l' dx, (n, n). ``density`` are
        coefficients of a polynomial in s, constant first. Slopes at x displace all mass further out."""
        total = integrate(density)
        beyond = polynomial(total, self.grid.positions)
        outer = (self.grid.positions > to_fixed(self.origin)).astype(int).astype(object)
        beyond = outer * to_fixed(_over(density)) - beyond
        bound = self.grid.integral(beyond, beyond)
        result = np.zeros((len(self.kinds), len(self.kinds)), dtype=object)
        for k, j in np.argwhere(np.tril(self.planar)):
            value = self.grid.integral(self.slope[k], self.slope[j], beyond)
            steep = math.isqrt(self.squares[k][1] * self.squares[j][1])
            result[k, j] = result[j, k] = _unless_zero(value, steep, math.isqrt(bound << BITS))
        return round_to_doubles(result)

    def second_order_terms(self, rho: Fixed) -> tuple[Array, Array]:
        """Return the integrals h1, (n, n, n), and h2, (n, n, n, n), of ``ShapeIntegrals``. ``rho`` is the profile of
        the mass at the nodes of the grid, fixed-point."""
        size, grid = len(self.kinds), self.grid
        h1, h2 = np.zeros((size,) * 3, dtype=object), np.zeros((size,) * 4, dtype=object)
        pairs = [(k, j) for k, j in np.argwhere(np.tril(self.planar)).tolist()]
        H = {pair: grid.from_origin(times(self.slope[pair[0]], self.slope[pair[1]]), self.origin) for pair in pairs}
        squares = {pair: grid.integral(values, values, rho) for pair, values in H.items()}
        for (k, j), values in H.items():
            weighted = times(values, rho)
            for i in range(size):
                if self.kinds[i] != "torsion":
                    value = _unless_zero(grid.integral(weighted, self.f[i]), squares[k, j], self.squares[i][0])
                    h1[k, j, i] = h1[j, k, i] = value
            for (i, n), others in H.items():
                value = _unless_zero(grid.integral(weighted, others), squares[k, j], squares[i, n])
                h2[k, j, i, n] = h2[j, k, i, n] = h2[k, j, n, i] = h2[j, k, n, i] = value
        return round_to_doubles(h1), round_to_doubles(h2, 1 / self.length)

    def station(self, x: float) -> Station:
        """Return values, slopes and shortening of all shape functions at a position x, m, of the axis, each rounded
        once."""
        s = self.place(x)
        f, slope, _ = (part[:, 0] for part in self.values(array([s])))
        value, turn = np.zeros(len(self.kinds), dtype=object), np.zeros(len(self.kinds), dtype=object)
        for k, (square, steep) in enumerate(self.squares):
            value[k] = _unless_zero(int(f[k]), square, 1 << BITS)
            turn[k] = _unless_zero(int(slope[k]), steep, 1 << BITS) if self.kinds[k].startswith("bending") else 0
        return Station(round_to_doubles(value), round_to_doubles(turn, 1 / self.length), self.shortening(s))

    def stations(self, places: Sequence[float]) -> tuple[Station, ...]:
        """Return values, slopes and shortening of all shape functions at many positions x, m, of the axis. In double
        precision; all positions use the slopes at the quadrature nodes."""
        s = [self.place(x) for x in places]
        f, slope, _ = self.values(array(s))
        value, turn = round_to_doubles(f), round_to_doubles(slope, 1 / self.length) * np.diagonal(self.planar)[:, None]
        slopes = round_to_doubles(self.slope)
        weights = self.grid.weights_up_to(s) - self.grid.weights_up_to([self.origin])
        shortenings = [np.where(self.planar, (slopes * row) @ slopes.T / float(self.length), 0.0) for row in weights]
        return tuple(map(Station, value.T, turn.T, shortenings))

    def shortening(self, s: Fraction) -> Array:
        """Return H(s), (n, n), 1/m: integrals of products of slopes from the origin of the axis to s, which may be
        negative."""
        if s == self.origin:
            return np.zeros((len(self.kinds), len(self.kinds)))
        grid = QuadratureGrid(self.families, sorted((self.origin, s)))
        slope = self.values(grid.positions)[1]
        sign = 1 if s > self.origin else -1
        return self.matrix(slope, ONE, self.planar, sign / self.length, grid)


def _unless_zero(value: int, square: int, second: int) -> int:
    """Return a value, or 0 if the value is below the bound of Cauchy and Schwarz, the root of the product of two
    squares, by 54 bits: zero up to quadrature."""
    return 0 if (abs(value) << 54) ** 2 <= square * second else value


def _over(density: Coefficients) -> Fraction:
    """Return the integral over s = 0 .. 1."""
    return sum(integrate(density), Fraction(0))
