"""Vector fields along a beam, separated into functions of x and of time, with mass integrals of their products, and
the stations: frames on a beam to which something is attached.

Each component of position, velocity, acceleration and variation of the axis is c x + sum_k c_k f_k(x) + sum_r w_r a_r^T
H(x) b_r:
shape functions f and shortening H = int_0^x f' f'^T carry all that depends on x, so constants carry all integration
(Lieh 1994). The *weight* of a summand counts elastic coordinates, their rates and variations: 0, 1, 2. Leaving out
products of more than 2 is the truncation of kinetic energy at second order: Lagrange's equations of it are these, term
by term.

A station at x sits at (x + u - shortening, v, w) and is turned by exp of (twist, -w', v'). Both are kept whole: the
load from an attached body then stiffens the beam without further terms (Kane, Ryan and Banerjee 1987, shortening).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, replace
from eomgen.lie import rotations
from eomgen.lie.algebra import TapeAlgebra
from eomgen.mechanics.shape_functions.shape_integrals import ShapeIntegrals, Station
from eomgen.mechanics.tree.joints import JointCoordinates, SubspaceColumn, quaternion_matrix
from eomgen.scene.bodies.model import DeformationKind
from eomgen.symbolic.calculus.partials import jacobian_vector
from eomgen.symbolic.operations import InputSymbol, Op
from eomgen.symbolic.rotation import FactoredRotation, MatrixFactor, PlanarFactor
from eomgen.symbolic.scalar import Algebra, Matrix, Scalar, Vector, apply, dot, plus, scaled
from eomgen.symbolic.tape import Ref

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
    unit : factor of the shape integrals: mass per length if constant, else 1
    second_order : whether products of weight 3 and 4 are kept
    beyond : (n, n) added to the integrals of products of shape functions, for coordinates of a kind with more inertia
        than the inertia of mass; None if no kind has
    """

    algebra: Algebra
    integrals: ShapeIntegrals
    unit: float
    second_order: bool
    beyond: tuple[Amplitudes, ...] | None = None

    def first(self, component: Component) -> Scalar:
        """Return the integral of a component over the mass, by ``unit``; of position without the term x."""
        total = self._weighted_sum(self.integrals.d, component.shapes)
        for weight, a, b in component.pairs:
            total = total + weight * self._quadratic(self.integrals.g0, a, b)
        return total

    def inertia_of(self, k: int) -> Scalar:
        """Return int f_k^2 dm."""
        entry = self.algebra.one * (self.unit * float(self.integrals.m[k, k]))
        return entry if self.beyond is None else entry + self.beyond[k][k]

    def product(self, left: Component, right: Component) -> Scalar:
        """Return the integral over the mass of the product of two components, by ``unit``; of two positions without the
        term x^2. Products of weight 3 and 4 are included with ``second_order`` only."""
        total = self.algebra.zero
        for first, second in ((left, right), (right, left)):
            if first.along:
                total = total + self._weighted_sum(self.integrals.e, second.shapes)
                for weight, a, b in second.pairs:
                    total = total + weight * self._quadratic(self.integrals.g1, a, b)
        total = total + self._quadratic(self.integrals.m, left.shapes, right.shapes)
        if self.beyond is not None:
            total = total + self._quadratic(self.beyond, left.shapes, right.shapes)
        return total + self._higher_order_product(left, right) if self.second_order else total

    def _higher_order_product(self, left: Component, right: Component) -> Scalar:
        total = self.algebra.zero
        for first, second in ((left, right), (right, left)):
            for weight, a, b in second.pairs:
                total = total + weight * self._quadratic(self._contract(self.integrals.h1, first.shapes), a, b)
        for weight, a, b in left.pairs:
            for other_weight, c, d in right.pairs:
                inner = [self._contract(row, d) for row in self._rows]
                shortened = tuple(tuple(dot(line, c) for line in row) for row in inner)
                total = total + (weight * other_weight) * self._quadratic(shortened, a, b)
        return total

    @cached_property
    def _rows(self) -> list[Array]:
        return list(self.integrals.h2)

    def _contract(self, tensor: Array, amplitudes: Amplitudes) -> tuple[tuple[Scalar, ...], ...]:
        """Return a tensor, (n, n, n), contracted with amplitudes, (n,), over the last index."""
        return tuple(tuple(self._weighted_sum(line, amplitudes) for line in row) for row in tensor)

    def _weighted_sum(self, numbers: Array, amplitudes: Amplitudes) -> Scalar:
        total = self.algebra.zero
        for number, amplitude in zip(numbers, amplitudes, strict=True):
            total = total + amplitude * (self.unit * float(number))
        return total

    def _quadratic(self, matrix: Array | Sequence[Sequence[Scalar]], left: Amplitudes, right: Amplitudes) -> Scalar:
        """Return left^T matrix right, evaluated as left . (matrix right), since other quantities share the product with
        ``right``."""
        total = self.algebra.zero
        for amplitude, row in zip(left, matrix, strict=True):
            if not amplitude.is_zero:
                inner = self._weighted_sum(row, right) if isinstance(row, np.ndarray) else dot(row, right)
                total = total + amplitude * inner
        return total


@dataclass(frozen=True)
class Deflections:
    """The separated fields of the axis of one beam: position, and derivatives in time and along each coordinate.

    Attributes
    ----------
    integrals : integrals of the shape functions of the coordinates
    shortens : whether the axis has constant length in bending
    q, v, a : (n,) elastic coordinates, velocities, accelerations
    """

    algebra: Algebra
    integrals: ShapeIntegrals
    shortens: bool
    q: Amplitudes
    v: Amplitudes
    a: Amplitudes

    def resting(self) -> Deflections:
        """Return these deflections with v = a = 0."""
        still = (self.algebra.zero,) * len(self.q)
        return replace(self, v=still, a=still)

    def position(self) -> SeparatedField:
        """Return the position of the axis in beam axes, m, to second order in q."""
        x, y, z = self._linear(self.q)
        return (replace(x, along=1.0, pairs=self._pairs((-0.5, self.q, self.q))), y, z)

    def velocity(self) -> SeparatedField:
        """Return the velocity of the axis in beam axes, m/s."""
        x, y, z = self._linear(self.v)
        return (replace(x, pairs=self._pairs((-1.0, self.v, self.q))), y, z)

    def acceleration(self) -> SeparatedField:
        """Return the acceleration of the axis in beam axes, m/s^2."""
        x, y, z = self._linear(self.a)
        return (replace(x, pairs=self._pairs((-1.0, self.a, self.q), (-1.0, self.v, self.v))), y, z)

    def variation(self, k: int) -> SeparatedField:
        """Return the partial of the position in coordinate k, a field along the axis."""
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


#: Axis of deflection, axis of rotation and sign of the rotation, for each kind.
DEFLECTS: dict[DeformationKind, int] = {"stretch": 0, "bending_y": 1, "bending_z": 2}
ROTATIONS: dict[DeformationKind, tuple[int, float]] = {
    "torsion": (0, 1.0),
    "bending_z": (1, -1.0),
    "bending_y": (2, 1.0),
}


@dataclass(frozen=True)
class StationMotion:
    """Pose of a station in the beam's frame, and motion subspace of the station.

    Attributes
    ----------
    angle : rotation vector (twist, -w', v')
    columns : (n,) motion subspace in the station's axes, a function of the coordinates
    bias : angular and linear acceleration in the station's axes that rates alone give
    shortening : (n, n) H(x), zero without stiffening
    """

    rotation: FactoredRotation
    angle: Vector
    position: Vector
    columns: tuple[SubspaceColumn, ...]
    bias: tuple[Vector, Vector]
    shortening: tuple[Amplitudes, ...]


def moves(station: Station) -> bool:
    """Return whether any elastic coordinate translates or rotates a station."""
    return bool(station.value.any() or station.slope.any())


def station_motion(
    algebra: Algebra,
    kinds: tuple[DeformationKind, ...],
    station: Station,
    x: float,
    coordinates: JointCoordinates,
    *,
    shortens: bool,
) -> StationMotion:
    """Return pose and motion subspace of the station at x, m, on a beam's axis, in the beam's frame. ``station`` holds
    the values of the shape functions at x; ``shortens``: the axis shortens when the beam bends."""
    q, v = coordinates.q, coordinates.v
    zero = algebra.zero
    shortening = [
        tuple(algebra.scalar(float(entry) if shortens else 0.0) for entry in row) for row in station.shortening
    ]
    shortened = [_product(row, q, zero) for row in shortening]
    moving, turning = [], []
    for k, kind in enumerate(kinds):
        value, slope = float(station.value[k]), float(station.slope[k])
        deflects, turns = [zero, zero, zero], [zero, zero, zero]
        if kind in DEFLECTS:
            deflects[DEFLECTS[kind]] = algebra.scalar(value)
        if kind in ROTATIONS:
            axis, sign = ROTATIONS[kind]
            turns[axis] = algebra.scalar(sign * (value if kind == "torsion" else slope))
        moving.append((deflects[0] - shortened[k], deflects[1], deflects[2]))
        turning.append((turns[0], turns[1], turns[2]))
    linear = [algebra.vector([m[0] + 0.5 * s, m[1], m[2]]) for m, s in zip(moving, shortened, strict=True)]
    position = _combine((algebra.scalar(x), zero, zero), linear, q)
    angle = _combine(algebra.zero_vector, turning, q)
    rotation, tangent = _rotation_and_tangent(algebra, angle)
    columns = tuple(
        SubspaceColumn(apply(tangent, turns) if tangent is not None else turns, rotation.rotate_back(moved))
        for turns, moved in zip(turning, moving, strict=True)
    )
    drawn_in = zero
    for rate, row in zip(v, shortening, strict=True):
        drawn_in = drawn_in - rate * _product(row, v, zero)
    twisting = algebra.zero_vector
    if tangent is not None:
        rate_of_turn = apply(tangent, _combine(algebra.zero_vector, turning, v))
        rates: dict[Ref | InputSymbol, Ref] = {
            InputSymbol("q", number): rate.ref for number, rate in zip(coordinates.components, v, strict=True)
        }
        accelerations = jacobian_vector(algebra.tape, [component.ref for component in rate_of_turn], rates)
        twisting = algebra.vector([Scalar(algebra.tape, ref) for ref in accelerations])
    bias = twisting, rotation.rotate_back((drawn_in, zero, zero))
    return StationMotion(rotation, angle, position, columns, bias, tuple(shortening))


def _rotation_and_tangent(algebra: Algebra, angle: Vector) -> tuple[FactoredRotation, Matrix | None]:
    """Return the rotation exp(angle) and the tangent operator, (3, 3), of the rotation vector ``angle``. The tangent is
    None if the angle has one component at most: the axis of rotation is then fixed."""
    axes = [k for k in range(3) if not angle[k].is_zero]
    if not axes:
        return FactoredRotation(()), None
    if len(axes) == 1:
        (axis,) = axes
        return (
            FactoredRotation(
                (PlanarFactor(axis, algebra.call(Op.COS, angle[axis]), algebra.call(Op.SIN, angle[axis])),)
            ),
            None,
        )
    on_tape = TapeAlgebra(algebra.tape)
    quaternion = [on_tape.scalar(part) for part in rotations.exponential(on_tape, angle)]
    tangent = algebra.matrix(rotations.tangent(on_tape, angle))
    return FactoredRotation((MatrixFactor(quaternion_matrix(algebra, quaternion)),)), tangent


def _combine(start: Vector, columns: list[Vector], amplitudes: Amplitudes) -> Vector:
    total = start
    for column, amplitude in zip(columns, amplitudes, strict=True):
        total = plus(total, scaled(amplitude, column))
    return total


def _product(row: Amplitudes, amplitudes: Amplitudes, zero: Scalar) -> Scalar:
    return dot(row, amplitudes) if row else zero
