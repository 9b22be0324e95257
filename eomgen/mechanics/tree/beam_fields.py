"""Vector fields along a beam, separated into functions of x and of time, and mass integrals of their products.

Each component of position, velocity, acceleration and variation of the axis is c x + sum_k c_k f_k(x) + sum_r w_r a_r^T
H(x) b_r:
shape functions f and shortening H = int_0^x f' f'^T carry all that depends on x, so constants carry all integration
(Lieh 1994). The *weight* of a summand counts elastic coordinates, their rates and variations: 0, 1, 2. Leaving out
products of more than 2 is the truncation of kinetic energy at second order: Lagrange's equations of it are these, term
by term.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from eomgen.base.arrays import Array
from eomgen.mechanics.shape_functions.shape_integrals import ShapeIntegrals
from eomgen.symbolic.scalar import Algebra, Scalar, dot

Amplitudes = tuple[Scalar, ...]


@dataclass(frozen=True)
class Component:
    """One component of a separated field.

    Attributes
    ----------
    along : coefficient of x, 0 or 1
    shapes : (n,) coefficients of the shape functions
    pairs : tuples (w, a, b), each w a^T H(x) b with (n,) amplitudes a and b
    """

    along: float
    shapes: Amplitudes
    pairs: tuple[tuple[float, Amplitudes, Amplitudes], ...] = ()


#: Components along x, y and z of the beam.
SeparatedField = tuple[Component, Component, Component]


@dataclass(frozen=True)
class DistributedMass:
    """Integrals over the mass of one beam, times a factor that is one unless mass per length is a parameter.

    Attributes
    ----------
    unit : factor of the shape integrals: mass per length if it is a constant, else 1
    second_order : whether products of weight 3 and 4 are kept
    beyond : (n, n) added to the integrals of products of shape functions, for coordinates of a kind that has more
        inertia among themselves than their mass; None if no kind has
    """

    algebra: Algebra
    integrals: ShapeIntegrals
    unit: float
    second_order: bool
    beyond: tuple[Amplitudes, ...] | None = None

    def first(self, component: Component) -> Scalar:
        """Return int component dm; of position without the term x."""
        total = self._weighted(self.integrals.d, component.shapes)
        for weight, a, b in component.pairs:
            total = total + weight * self._quadratic(self.integrals.g0, a, b)
        return total

    def inertia_of(self, k: int) -> Scalar:
        """Return int f_k^2 dm."""
        own = self.algebra.one * (self.unit * float(self.integrals.m[k, k]))
        return own if self.beyond is None else own + self.beyond[k][k]

    def product(self, left: Component, right: Component) -> Scalar:
        """Return int left right dm; of two positions without the term x^2."""
        total = self.algebra.zero
        for one, other in ((left, right), (right, left)):
            if one.along:
                total = total + self._weighted(self.integrals.e, other.shapes)
                for weight, a, b in other.pairs:
                    total = total + weight * self._quadratic(self.integrals.g1, a, b)
        total = total + self._quadratic(self.integrals.m, left.shapes, right.shapes)
        if self.beyond is not None:
            total = total + self._quadratic(self.beyond, left.shapes, right.shapes)
        return total + self._of_higher_order(left, right) if self.second_order else total

    def _of_higher_order(self, left: Component, right: Component) -> Scalar:
        total = self.algebra.zero
        for one, other in ((left, right), (right, left)):
            for weight, a, b in other.pairs:
                total = total + weight * self._quadratic(self._contracted(self.integrals.h1, one.shapes), a, b)
        for weight, a, b in left.pairs:
            for other_weight, c, d in right.pairs:
                inner = [self._contracted(row, d) for row in self._rows]
                shortened = tuple(tuple(dot(line, c) for line in row) for row in inner)
                total = total + (weight * other_weight) * self._quadratic(shortened, a, b)
        return total

    @cached_property
    def _rows(self) -> list[Array]:
        return list(self.integrals.h2)

    def _contracted(self, tensor: Array, amplitudes: Amplitudes) -> tuple[tuple[Scalar, ...], ...]:
        """Return a tensor contracted over its last index."""
        return tuple(tuple(self._weighted(line, amplitudes) for line in row) for row in tensor)

    def _weighted(self, numbers: Array, amplitudes: Amplitudes) -> Scalar:
        total = self.algebra.zero
        for number, amplitude in zip(numbers, amplitudes, strict=True):
            total = total + amplitude * (self.unit * float(number))
        return total

    def _quadratic(self, matrix: Array | Sequence[Sequence[Scalar]], left: Amplitudes, right: Amplitudes) -> Scalar:
        """Return left^T matrix right; the product with ``right`` is one that other quantities share."""
        total = self.algebra.zero
        for amplitude, row in zip(left, matrix, strict=True):
            if not amplitude.is_zero:
                inner = self._weighted(row, right) if isinstance(row, np.ndarray) else dot(row, right)
                total = total + amplitude * inner
        return total


@dataclass(frozen=True)
class Deflections:
    """The separated fields of one beam's axis: position, and its derivatives in time and along each coordinate.

    Attributes
    ----------
    integrals : integrals of the shape functions of the coordinates
    shortens : whether the axis keeps its length when it bends
    q, v, a : (n,) elastic coordinates, velocities, accelerations
    """

    algebra: Algebra
    integrals: ShapeIntegrals
    shortens: bool
    q: Amplitudes
    v: Amplitudes
    a: Amplitudes

    def resting(self) -> Deflections:
        """Return the same deflections with v = a = 0."""
        still = (self.algebra.zero,) * len(self.q)
        return replace(self, v=still, a=still)

    def position(self) -> SeparatedField:
        """Return the position of the axis in beam axes, m, to second order in q."""
        x, y, z = self._linear(self.q)
        return (replace(x, along=1.0, pairs=self._pairs((-0.5, self.q, self.q))), y, z)

    def velocity(self) -> SeparatedField:
        """Return its velocity in beam axes, m/s."""
        x, y, z = self._linear(self.v)
        return (replace(x, pairs=self._pairs((-1.0, self.v, self.q))), y, z)

    def acceleration(self) -> SeparatedField:
        """Return its acceleration in beam axes, m/s^2."""
        x, y, z = self._linear(self.a)
        return (replace(x, pairs=self._pairs((-1.0, self.a, self.q), (-1.0, self.v, self.v))), y, z)

    def variation(self, k: int) -> SeparatedField:
        """Return the field of a unit variation of coordinate k."""
        unit = tuple(self.algebra.one if j == k else self.algebra.zero for j in range(len(self.q)))
        x, y, z = self._linear(unit)
        return (replace(x, pairs=self._pairs((-1.0, unit, self.q))), y, z)

    def _linear(self, amplitudes: Amplitudes) -> SeparatedField:
        zero = self.algebra.zero
        axes = [
            tuple(a if kind == wanted else zero for a, kind in zip(amplitudes, self.integrals.kinds, strict=True))
            for wanted in ("stretch", "bending_y", "bending_z")
        ]
        return (Component(0.0, axes[0]), Component(0.0, axes[1]), Component(0.0, axes[2]))

    def _pairs(self, *pairs: tuple[float, Amplitudes, Amplitudes]) -> tuple[tuple[float, Amplitudes, Amplitudes], ...]:
        """Return pairs in which coordinates without shortening count as zero; an empty tuple without shortening."""
        if not self.shortens:
            return ()
        return tuple((weight, self._bending(a), self._bending(b)) for weight, a, b in pairs)

    def _bending(self, amplitudes: Amplitudes) -> Amplitudes:
        zero = self.algebra.zero
        bends = (kind.startswith("bending") for kind in self.integrals.kinds)
        return tuple(a if bending else zero for a, bending in zip(amplitudes, bends, strict=True))
