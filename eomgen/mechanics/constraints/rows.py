"""Constraint equations on a tape, with Jacobian, rates, bias and forces by left-trivialised differentiation.

A row is holonomic, Phi(q, t) = 0, or at velocity level, psi(q, v, t) = 0 with psi affine in v. All else is calculus
on the tape: B, the velocity row Phi' = B v + Phi_t, and the part of its rate that is quadratic in v (with base motion
and drivers included) are derivatives along directions that the configuration, the base and time own.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Literal, Protocol

from eomgen.base.data import dataclass, field, replace
from eomgen.mechanics.forces.frame_pairs import FramePair, FramePose, frame_pair, magnitude
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.mechanics.kinematics.directions import configuration_directions, rates_of
from eomgen.mechanics.tree.base import BaseState
from eomgen.mechanics.tree.links import Tree
from eomgen.scene.joints.model import Constraint, Joint
from eomgen.symbolic.calculus.loops import Tangent
from eomgen.symbolic.calculus.partials import forward_partials, jacobian_vector
from eomgen.symbolic.operations import InputSymbol, Op
from eomgen.symbolic.scalar import Scalar, Vector, apply, dot, minus, scaled, transpose
from eomgen.symbolic.tape import ONE, Ref, Tape


@dataclass(frozen=True)
class Row:
    """One scalar constraint equation.

    Attributes
    ----------
    value : residual; at velocity level affine in v
    size : sum of the magnitudes of its summands, in the unit of ``value``, the scale of rounding errors; at velocity
        level of the lengths that multiply angular velocities
    extent : m, bound of the displacement that rotations of the joined bodies cause, wherever they slide or roll
    path_length : m, ``extent`` plus the distance between the bodies: the scale of point masses, which have no extent
    owner, number : owner of the equation and its number there, holonomic ones first: a constraint, or a joint
        with a drive for each coordinate; None for the equation of a joint that follows another
    group : source of the forces of its equations together, this one being ``number`` of them; None if they follow
        from B
    """

    name: str
    value: Scalar
    unit: Literal["m", "1", "m/s"]
    size: Scalar
    extent: Scalar
    path_length: Scalar
    owner: Constraint | Joint | None = None
    number: int = 0
    group: RowGroup | None = None


class RowGroup(Protocol):
    """Equations with forces recorded together.

    Attributes
    ----------
    count : how many equations there are
    """

    count: int

    def forces(self, multipliers: Sequence[Scalar]) -> list[Scalar]:
        """Return their part of B^T lam, (nv,)."""
        ...


@dataclass
class Rows:
    """Constraint equations; the holonomic ones are numbered first."""

    holonomic: list[Row] = field(default_factory=list)
    velocity: list[Row] = field(default_factory=list)

    @property
    def all(self) -> list[Row]:
        return [*self.holonomic, *self.velocity]

    def without(self, numbers: Sequence[int]) -> Rows:
        """Return all equations without the given numbers."""
        left_out, first = set(numbers), len(self.holonomic)
        at_velocity = [row for k, row in enumerate(self.velocity) if first + k not in left_out]
        return Rows([row for k, row in enumerate(self.holonomic) if k not in left_out], at_velocity)


def constraint_rows(quantities: Quantities, constraints: Sequence[Constraint]) -> Rows:
    """Return the equations of all constraints.

    Parameters
    ----------
    quantities : in joint or absolute coordinates, recorded on the same tape
    """
    rows = Rows()
    for item in constraints:
        with quantities.algebra.tape.block(f"constraint {item.name}"):
            pair = frame_pair(quantities, item.first, item.second)
            own = rows_of_pair(quantities, item, pair)
            marked = [replace(row, owner=item, number=number) for number, row in enumerate(own.all)]
            rows.holonomic += marked[: len(own.holonomic)]
            rows.velocity += marked[len(own.holonomic) :]
    return rows


def rows_of_pair(quantities: Quantities, item: Constraint, pair: FramePair) -> Rows:
    """Return the equations of one constraint between two frames."""
    return Rows(_holonomic(quantities, item, pair), _rolling(quantities, item, pair) if item.kind.rows[1] else [])


def _holonomic(quantities: Quantities, item: Constraint, pair: FramePair) -> list[Row]:
    first, second, one = pair.first, pair.second, quantities.algebra.one
    gap = minus(first.origin, second.origin)
    local = apply(transpose(second.axes), gap)
    z1 = first.axis(2)

    def length(label: str, value: Scalar, *more: Scalar) -> Row:
        return Row(
            f"{item.name}: {label}", value, "m", sum(map(magnitude, more), pair.size), pair.lever, pair.path_length
        )

    def angle(label: str, value: Scalar, *more: Scalar) -> Row:
        return Row(f"{item.name}: {label}", value, "1", sum(map(magnitude, more), one), pair.lever, pair.path_length)

    meeting = [length(f"origins meet along {axis}", local[k]) for k, axis in enumerate("xyz")]
    parallel = [angle(f"z stays perpendicular to {axis}", dot(z1, second.axis(k))) for k, axis in enumerate("xy")]
    spin = angle("x stays perpendicular to y", dot(first.axis(0), second.axis(1)))
    driven = []
    if item.drive is not None:
        drive = quantities.formula(item.drive)
        if item.kind.drive == "angle":
            driven = [angle("driven angle", sine_of_excess_rotation(quantities, drive, first, second), drive)]
        else:
            driven = [length("driven travel", local[2] + drive, drive)]
    match item.type:
        case "distance":
            apart, length_given = quantities.algebra.call(Op.SQRT, dot(gap, gap)), quantities.formula(item.length)
            return [length("distance", apart - length_given, length_given)]
        case "rolling":
            height = dot(minus(_contact(quantities, item, pair), first.origin), z1)
            size, lever, path_length = _on_wheel(quantities, item, pair)
            return [Row(f"{item.name}: contact", height, "m", size, lever, path_length)]
    kind, turns = item.kind, len(item.kind.turned_about)
    turned = [[*parallel, spin], parallel, [spin]][turns] if not kind.has("ball") else []
    if kind.has("screw"):
        travel = length(
            "travel follows the angle", _screwed(quantities, item, pair, local), quantities.formula(item.pitch)
        )
        return [*meeting[:2], *turned, travel]
    along = [kind.frame_axes[axis] for axis in kind.travels]
    if len(along) > 1:
        position_rows = [
            length("origin stays in the plane", dot(gap, first.axis(k))) for k in range(3) if k not in along
        ]
    elif along and (kind.has("ball") or turns > 1):  # along an axis of the first frame alone
        across = apply(transpose(first.axes), gap)
        position_rows = [
            length(f"point stays on the line along {'xyz'[k]}", across[k]) for k in range(3) if k not in along
        ]
    else:
        position_rows = [meeting[k] for k in range(3) if k not in along]
    return [*position_rows, *turned, *driven]


def sine_of_excess_rotation(quantities: Quantities, angle: Scalar, first: FramePose, second: FramePose) -> Scalar:
    """Return sin(rotation of the second frame about z - angle), smooth over any number of revolutions."""
    cosine, sine = quantities.algebra.call(Op.COS, angle), quantities.algebra.call(Op.SIN, angle)
    return dot(first.axis(1), second.axis(0)) * cosine - dot(first.axis(0), second.axis(0)) * sine


def _screwed(quantities: Quantities, item: Constraint, pair: FramePair, local: Vector) -> Scalar:
    """Return the residual of a screw in m; the travel selects the revolution of the angle."""
    pitch = quantities.formula(item.pitch)
    return pitch * sine_of_excess_rotation(quantities, -local[2] / pitch, pair.first, pair.second)


def _contact(quantities: Quantities, item: Constraint, pair: FramePair) -> Vector:
    """Return the lowest point, (3,), above the first frame's plane, of a disc about the second's z axis or a sphere."""
    normal, axis, radius = pair.first.axis(2), pair.second.axis(2), quantities.formula(item.radius)
    if item.shape == "sphere":
        return minus(pair.second.origin, scaled(radius, normal))
    down = minus(normal, scaled(dot(normal, axis), axis))
    length = quantities.algebra.call(Op.SQRT, dot(down, down))
    return minus(pair.second.origin, scaled(radius / length, down))


def _on_wheel(quantities: Quantities, item: Constraint, pair: FramePair) -> tuple[Scalar, Scalar, Scalar]:
    """Return size, lever and path length of a pair with the wheel's radius; the position on the plane is no lever."""
    radius = magnitude(quantities.formula(item.radius))
    return pair.size + radius, pair.lever + radius, pair.path_length + radius


def _rolling(quantities: Quantities, item: Constraint, pair: FramePair) -> list[Row]:
    contact = _contact(quantities, item, pair)
    slip = minus(pair.velocity_at(pair.second, contact), pair.velocity_at(pair.first, contact))
    size, lever, path_length = _on_wheel(quantities, item, pair)
    return [
        Row(f"{item.name}: no slip along {axis}", dot(slip, pair.first.axis(k)), "m/s", size, lever, path_length)
        for k, axis in enumerate("xy")
    ]


class ConstraintCalculus:
    """Jacobian, rates, bias and forces of constraint equations, recorded on the tree's tape.

    Parameters
    ----------
    tree : links in joint or absolute coordinates
    rows : n holonomic, then m velocity equations
    base : the prescribed base
    """

    def __init__(self, tree: Tree, rows: Rows, base: BaseState) -> None:
        self.algebra = tree.algebra
        self.tape: Tape = tree.algebra.tape
        self.nv = tree.nv
        self.rows = rows
        self.seeds = configuration_directions(tree)
        self.rates = rates_of(self.tape, self.seeds, base)
        self.holonomic = [row.value.ref for row in rows.holonomic]
        self.level = [row.value.ref for row in rows.velocity]

    @cached_property
    def tangents(self) -> list[Tangent]:
        """Rows of B as {velocity component: nonzero}, one mapping per equation."""
        by_v: dict[Ref | InputSymbol, Tangent] = {InputSymbol("v", k): {k: ONE} for k in range(self.nv)}
        with self.tape.block("Jacobian of the constraints"):
            return forward_partials(self.tape, self.holonomic, self.seeds) + forward_partials(
                self.tape, self.level, by_v
            )

    def jacobian(self) -> list[list[Scalar]]:
        """Return B, (rows, nv), left-trivialised in q, with structural zeros."""
        return self._dense(self.tangents)

    def _dense(self, tangents: Sequence[Tangent]) -> list[list[Scalar]]:
        zero = self.algebra.zero
        rows = [[zero] * self.nv for _ in tangents]
        for row, tangent in zip(rows, tangents, strict=True):
            for column, ref in tangent.items():
                row[column] = Scalar(self.tape, ref)
        return rows

    def velocity(self) -> list[Scalar]:
        """Return Phi' = B v + Phi_t of the holonomic equations, then the residuals of the velocity equations."""
        with self.tape.block("rates of the constraints"):
            first = jacobian_vector(self.tape, self.holonomic, self.rates)
        return [Scalar(self.tape, ref) for ref in [*first, *self.level]]

    def bias(self) -> list[Scalar]:
        """Return d/dt of ``velocity`` at vdot = 0, (rows,): Z(v, v) including base motion and prescribed motions."""
        velocity = [value.ref for value in self.velocity()]
        with self.tape.block("accelerations of the constraints at vdot = 0"):
            return [Scalar(self.tape, ref) for ref in jacobian_vector(self.tape, velocity, self.rates)]

    def forces(self) -> list[Scalar]:
        """Return the generalized constraint forces B^T lam, (nv,)."""
        tangents = self.tangents
        multipliers = [Scalar(self.tape, self.tape.input("lam", number)) for number in range(len(self.rows.all))]
        total = self._forces_of_groups(multipliers)
        with self.tape.block("constraint forces"):
            for row, tangent, multiplier in zip(self.rows.all, tangents, multipliers, strict=True):
                for column in sorted(tangent) if row.group is None else ():
                    total[column] = total[column] + Scalar(self.tape, tangent[column]) * multiplier
        return total

    def _forces_of_groups(self, multipliers: Sequence[Scalar]) -> list[Scalar]:
        """Return the part of B^T lam, (nv,), of the equations with forces recorded together."""
        zero = self.algebra.zero
        total = [zero] * self.nv
        for group in dict.fromkeys(row.group for row in self.rows.all):
            if group is None:
                continue
            of_row = {
                row.number: value for row, value in zip(self.rows.all, multipliers, strict=True) if row.group is group
            }
            forces = group.forces([of_row.get(number, zero) for number in range(group.count)])
            total = [x + y for x, y in zip(total, forces, strict=True)]
        return total

    def driving_power(self) -> Scalar:
        """Return lam . Phi_t of the holonomic equations, W: power of prescribed motions, without the base's."""
        rates = jacobian_vector(self.tape, self.holonomic, {InputSymbol("t", 0): ONE})
        total = self.algebra.zero
        for number, rate in enumerate(rates):
            total = total + Scalar(self.tape, self.tape.input("lam", number)) * Scalar(self.tape, rate)
        return total

    def by_configuration(self, values: Sequence[Scalar]) -> list[list[Scalar]]:
        """Return left-trivialised partials in q of n values, (n, nv)."""
        return self._dense(forward_partials(self.tape, [value.ref for value in values], self.seeds))
