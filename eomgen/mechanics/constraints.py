"""Constraint equations on a tape, and everything the equations of motion need of them, by left-trivialised differentiation.

A row is holonomic, Phi(q, t) = 0, or at velocity level, psi(q, v, t) = 0 with psi affine in v. All else is calculus
on the tape: B, the velocity row Phi' = B v + Phi_t, and the part of its rate that is quadratic in v (with base motion
and drivers included) are derivatives along directions that the configuration, the base and time own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from eomgen.mechanics.directions import configuration_directions, rates_along
from eomgen.mechanics.quantities import Quantities
from eomgen.mechanics.tree import Tree
from eomgen.scene.constraint import Constraint, Frame
from eomgen.symbolic.configuration import Tangent, rotation
from eomgen.symbolic.derivatives import forward_partials, jacobian_vector
from eomgen.symbolic.scalar import Matrix, Scalar, Vector, apply, cross, dot, minus, multiply, plus, scaled, transpose
from eomgen.symbolic.tape import ONE, InputSymbol, Op, Ref, Tape
from eomgen.system import BASE_LAYOUT


@dataclass
class Rows:
    """Constraint rows with a name each; holonomic ones first when numbered."""

    names: list[str] = field(default_factory=list)
    holonomic: list[Scalar] = field(default_factory=list)
    velocity_names: list[str] = field(default_factory=list)
    velocity: list[Scalar] = field(default_factory=list)

    def without(self, numbers: Sequence[int]) -> Rows:
        """Return the rows but those of the given numbers."""
        left_out, first = set(numbers), len(self.holonomic)
        at_position = [k for k in range(first) if k not in left_out]
        at_velocity = [k for k in range(len(self.velocity)) if first + k not in left_out]
        return Rows(
            [self.names[k] for k in at_position], [self.holonomic[k] for k in at_position],
            [self.velocity_names[k] for k in at_velocity], [self.velocity[k] for k in at_velocity],
        )  # fmt: skip


@dataclass(frozen=True)
class Placed:
    """A frame of a constraint where it is now: axes as columns, origin, in base axes (world axes in absolute coordinates)."""

    axes: Matrix
    origin: Vector

    def axis(self, k: int) -> Vector:
        return (self.axes[0][k], self.axes[1][k], self.axes[2][k])


def place(quantities: Quantities, frame: Frame) -> Placed:
    """Return a constraint's frame in base axes."""
    algebra, kinematics = quantities.algebra, quantities.kinematics
    r = algebra.vector([quantities.formula(item) for item in frame.position])
    mount = quantities.mount(frame)
    R = multiply(kinematics.pose(mount.link)[0], multiply(mount.orientation, algebra.matrix(frame.orientation)))
    return Placed(R, kinematics.position_in_base(frame.body, r))


def constraint_rows(quantities: Quantities, constraints: Sequence[Constraint]) -> Rows:
    """Return the rows of all constraints."""
    rows = Rows()
    for item in constraints:
        with quantities.algebra.tape.block(f"constraint {item.name}"):
            first, second = place(quantities, item.first), place(quantities, item.second)
            for label, value in _holonomic(quantities, item, first, second):
                rows.names.append(f"{item.name}: {label}")
                rows.holonomic.append(value)
            if item.type == "rolling":
                for label, value in _rolling(quantities, item, first, second):
                    rows.velocity_names.append(f"{item.name}: {label}")
                    rows.velocity.append(value)
    return rows


def _holonomic(quantities: Quantities, item: Constraint, first: Placed, second: Placed) -> list[tuple[str, Scalar]]:
    gap = minus(first.origin, second.origin)
    local = apply(transpose(second.axes), gap)
    z1 = first.axis(2)
    meeting = [(f"origins meet along {axis}", local[k]) for k, axis in enumerate("xyz")]
    parallel = [(f"z stays perpendicular to {axis}", dot(z1, second.axis(k))) for k, axis in enumerate("xy")]
    spin = ("x stays perpendicular to y", dot(first.axis(0), second.axis(1)))
    match item.type:
        case "spherical":
            return meeting
        case "revolute":
            return meeting + parallel + _driven_angle(quantities, item, first, second)
        case "universal":
            return [*meeting, spin]
        case "cylindrical":
            return meeting[:2] + parallel + _driven_travel(quantities, item, local)
        case "helical":
            return [*meeting[:2], *parallel, ("travel follows the angle", _screwed(quantities, item, first, second, local))]
        case "prismatic":
            return [*meeting[:2], *parallel, spin, *_driven_travel(quantities, item, local)]
        case "planar":
            return [("origin stays in the plane", dot(gap, z1)), *parallel]
        case "fixed":
            return [*meeting, *parallel, spin]
        case "distance":
            length = quantities.algebra.call(Op.SQRT, dot(gap, gap))
            return [("distance", length - quantities.formula(item.length))]
        case "point_on_line":
            across = apply(transpose(first.axes), gap)
            return [(f"point stays on the line along {axis}", across[k]) for k, axis in enumerate("xy")]
        case _:
            return [("contact", dot(minus(_contact(quantities, item, first, second), first.origin), z1))]


def _driven_angle(quantities: Quantities, item: Constraint, first: Placed, second: Placed) -> list[tuple[str, Scalar]]:
    if item.drive is None:
        return []
    return [("driven angle", turned_past(quantities, quantities.formula(item.drive), first, second))]


def turned_past(quantities: Quantities, angle: Scalar, first: Placed, second: Placed) -> Scalar:
    """Return the sine of how far the second frame has turned about z beyond an angle: smooth over any number of turns."""
    cosine, sine = quantities.algebra.call(Op.COS, angle), quantities.algebra.call(Op.SIN, angle)
    return dot(first.axis(1), second.axis(0)) * cosine - dot(first.axis(0), second.axis(0)) * sine


def _screwed(quantities: Quantities, item: Constraint, first: Placed, second: Placed, local: Vector) -> Scalar:
    """Return the travel that an angle lacks on a screw, in m: the travel tells the turns, which frames alone do not."""
    pitch = quantities.formula(item.pitch)
    return pitch * turned_past(quantities, -local[2] / pitch, first, second)


def _driven_travel(quantities: Quantities, item: Constraint, local: Vector) -> list[tuple[str, Scalar]]:
    return [] if item.drive is None else [("driven travel", local[2] + quantities.formula(item.drive))]


def _contact(quantities: Quantities, item: Constraint, first: Placed, second: Placed) -> Vector:
    """Return the lowest point of a disc about the second frame's z axis, or of a sphere, over the first's plane."""
    normal, axis, radius = first.axis(2), second.axis(2), quantities.formula(item.radius)
    if item.shape == "sphere":
        return minus(second.origin, scaled(radius, normal))
    down = minus(normal, scaled(dot(normal, axis), axis))
    length = quantities.algebra.call(Op.SQRT, dot(down, down))
    return minus(second.origin, scaled(radius / length, down))


def _rolling(quantities: Quantities, item: Constraint, first: Placed, second: Placed) -> list[tuple[str, Scalar]]:
    contact = _contact(quantities, item, first, second)
    slip = minus(_velocity_at(quantities, item.second, contact), _velocity_at(quantities, item.first, contact))
    return [(f"no slip along {axis}", dot(slip, first.axis(k))) for k, axis in enumerate("xy")]


def _velocity_at(quantities: Quantities, frame: Frame, point: Vector) -> Vector:
    """Return the velocity (base axes) of what moves with a frame at ``point``, where it is now."""
    kinematics, link = quantities.kinematics, quantities.mount(frame).link
    R, origin = kinematics.pose(link)
    omega, velocity = kinematics.twist(link)
    return plus(apply(R, velocity), cross(apply(R, omega), minus(point, origin)))


class ConstraintCalculus:
    """Derivatives of constraint rows along velocities, base motion and time."""

    def __init__(self, tree: Tree, rows: Rows, moving_base: bool) -> None:
        self.algebra = tree.algebra
        self.tape: Tape = tree.algebra.tape
        self.nv = tree.nv
        self.rows = rows
        self.seeds = configuration_directions(tree)
        self.rates = rates_of(self.tape, self.seeds, moving_base)
        self.holonomic = [value.ref for value in rows.holonomic]
        self.level = [value.ref for value in rows.velocity]

    @cached_property
    def tangents(self) -> list[Tangent]:
        """The rows of B, nonzeros only, by velocity component."""
        by_v: dict[Ref | InputSymbol, Tangent] = {InputSymbol("v", k): {k: ONE} for k in range(self.nv)}
        return forward_partials(self.tape, self.holonomic, self.seeds) + forward_partials(self.tape, self.level, by_v)

    def jacobian(self) -> list[list[Scalar]]:
        """Return B, one row per constraint row, dense with structural zeros."""
        return self._dense(self.tangents)

    def _dense(self, tangents: Sequence[Tangent]) -> list[list[Scalar]]:
        zero = self.algebra.zero
        rows = [[zero] * self.nv for _ in tangents]
        for row, tangent in zip(rows, tangents, strict=True):
            for column, ref in tangent.items():
                row[column] = Scalar(self.tape, ref)
        return rows

    def velocity(self) -> list[Scalar]:
        """Return Phi' = B v + Phi_t of the holonomic rows, then the velocity rows themselves."""
        first = jacobian_vector(self.tape, self.holonomic, self.rates)
        return [Scalar(self.tape, ref) for ref in [*first, *self.level]]

    def bias(self) -> list[Scalar]:
        """Return the rate of ``velocity`` at vdot = 0: Z(v, v) with all terms of base motion and drivers."""
        velocity = [value.ref for value in self.velocity()]
        return [Scalar(self.tape, ref) for ref in jacobian_vector(self.tape, velocity, self.rates)]

    def forces(self) -> list[Scalar]:
        """Return B^T lam."""
        total = [self.algebra.zero] * self.nv
        for number, tangent in enumerate(self.tangents):
            multiplier = Scalar(self.tape, self.tape.input("lam", number))
            for column in sorted(tangent):
                total[column] = total[column] + Scalar(self.tape, tangent[column]) * multiplier
        return total

    def driving_power(self) -> Scalar:
        """Return lam times the partial derivatives of the holonomic rows in time: the power of drivers, not of the base."""
        rates = jacobian_vector(self.tape, self.holonomic, {InputSymbol("t", 0): ONE})
        total = self.algebra.zero
        for number, rate in enumerate(rates):
            total = total + Scalar(self.tape, self.tape.input("lam", number)) * Scalar(self.tape, rate)
        return total

    def by_configuration(self, values: Sequence[Scalar]) -> list[list[Scalar]]:
        """Return left-trivialised partials in q of any values, one row each."""
        return self._dense(forward_partials(self.tape, [value.ref for value in values], self.seeds))


def rates_of(
    tape: Tape, seeds: Mapping[Ref | InputSymbol, Tangent], moving_base: bool
) -> dict[Ref | InputSymbol, Ref]:
    """Return the time derivative of time, configuration and base, for directional derivatives with v held constant."""
    rates = rates_along(tape, seeds)
    return rates | _base_rates(tape) if moving_base else rates


def _base_rates(tape: Tape) -> dict[Ref | InputSymbol, Ref]:
    """Return the time derivatives of the base struct: pose by twist, twist by its own derivative, which is held constant."""
    start: dict[str, int] = {}
    offset = 0
    for name, size, _ in BASE_LAYOUT:
        start[name], offset = offset, offset + size
    rates: dict[Ref | InputSymbol, Ref] = {}

    def block(name: str, size: int) -> list[Ref]:
        return [tape.input("base", start[name] + k) for k in range(size)]

    quaternion, omega, velocity = block("quaternion", 4), block("omega", 3), block("velocity", 3)
    half = tape.constant(0.5)
    w, x, y, z = (tape.mul(half, ref) for ref in quaternion)
    a, b, c = omega
    rows = ((-x, -y, -z), (w, -z, y), (z, w, -x), (-y, x, w))
    for ref, row in zip(quaternion, rows, strict=True):
        rates[ref] = tape.add(tape.add(tape.mul(row[0], a), tape.mul(row[1], b)), tape.mul(row[2], c))
    R = rotation(tape, quaternion)
    for ref, line in zip(block("position", 3), R, strict=True):
        terms = [tape.mul(entry, part) for entry, part in zip(line, velocity, strict=True)]
        rates[ref] = tape.add(tape.add(terms[0], terms[1]), terms[2])
    rates |= dict(zip(omega, block("omega_dot", 3), strict=True))
    rates |= dict(zip(velocity, block("velocity_dot", 3), strict=True))
    return rates
