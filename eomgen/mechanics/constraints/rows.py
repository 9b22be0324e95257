"""Constraint equations on a tape, with Jacobian, rates, bias and forces by left-trivialised differentiation.

A row is holonomic, Phi(q, t) = 0, or at velocity level, psi(q, v, t) = 0 with psi affine in v. All else is calculus
on the tape: B, the velocity row Phi' = B v + Phi_t, and the part of its rate that is quadratic in v (with base motion
and drivers included) are derivatives along directions that the configuration, the base and time own.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property, partial
from typing import Literal, Protocol

from eomgen.base.data import dataclass, field, replace
from eomgen.errors import ModelError, Problem
from eomgen.formula.features import summands
from eomgen.formula.nodes import Symbol
from eomgen.formula.recording import record
from eomgen.mechanics.forces.contact_pairs import body_contact
from eomgen.mechanics.forces.frame_pairs import FramePair, FramePose, frame_pair, magnitude
from eomgen.mechanics.forces.symbols import DetachedSymbols, Quantities
from eomgen.mechanics.kinematics.directions import Seeds, block_directions, configuration_directions, rates_of
from eomgen.mechanics.tree.base import BaseState
from eomgen.mechanics.tree.links import Tree
from eomgen.scene.joint_types import Connection
from eomgen.scene.joints.model import Constraint, Frame, Joint
from eomgen.symbolic.calculus.loops import Tangent
from eomgen.symbolic.calculus.partials import forward_partials, jacobian_vector
from eomgen.symbolic.map import splice
from eomgen.symbolic.operations import InputSymbol, Op
from eomgen.symbolic.scalar import Scalar, Vector, apply, dot, minus, transpose
from eomgen.symbolic.tape import ONE, ZERO, Tape
from eomgen.system.description import BASE

#: Block of the quantities of motion on the separate tape.
_MOTION = "motion"


#: A link (base or world for negative numbers), a point, m, and a force on it, N, in the axes of the link.
PointForce = tuple[int, Vector, Vector]


@dataclass(frozen=True)
class ConstraintRow:
    """One scalar constraint equation.

    Attributes
    ----------
    value : residual; at velocity level affine in v
    size : sum of the magnitudes of the summands, in the unit of ``value``, the scale of rounding errors; at velocity
        level, of the lengths that multiply angular velocities
    extent : m, bound of the displacement by rotations of the joined bodies, for any sliding or rolling
    path_length : m, ``extent`` plus the distance between the bodies, or the machine for travels: the scale of point
        masses, which have no extent
    owner, number : owner of the equation and the number of the equation, holonomic equations first: a constraint, or a
        joint with a drive for each coordinate; None for the equation of a joint that follows another
    driving : at velocity level, the part of ``value`` that time prescribes; None without one
    group, in_group : source of the forces of several equations together, and the number of this equation among them;
        None if the forces follow from B
    """

    name: str
    value: Scalar
    unit: Literal["m", "1", "m/s", "1/s"]
    size: Scalar
    extent: Scalar
    path_length: Scalar
    owner: Constraint | Joint | None = None
    number: int = 0
    group: RowGroup | None = None
    in_group: int = 0
    driving: Scalar | None = None


class RowGroup(Protocol):
    """Constraint equations whose forces are recorded together, such as by a loop over joints.

    Attributes
    ----------
    count : number of equations
    """

    count: int

    def forces(self, multipliers: Sequence[Scalar]) -> list[Scalar]:
        """Return the rows' part of B^T lam, (nv,)."""
        ...


@dataclass
class ConstraintRows:
    """Constraint equations at position level (``holonomic``), numbered first, and at velocity level."""

    holonomic: list[ConstraintRow] = field(default_factory=list)
    velocity: list[ConstraintRow] = field(default_factory=list)

    @property
    def all(self) -> list[ConstraintRow]:
        return [*self.holonomic, *self.velocity]

    def without(self, numbers: Sequence[int]) -> ConstraintRows:
        """Return all equations but the equations with the given numbers. Numbers count the holonomic equations first,
        then the equations at velocity level."""
        left_out, first = set(numbers), len(self.holonomic)
        at_velocity = [row for k, row in enumerate(self.velocity) if first + k not in left_out]
        return ConstraintRows([row for k, row in enumerate(self.holonomic) if k not in left_out], at_velocity)


def constraint_rows(
    quantities: Quantities, constraints: Sequence[Constraint], recorded_rows: Mapping[int, Sequence[ConstraintRow]]
) -> ConstraintRows:
    """Return the equations of all constraints, with the constraint as ``owner`` and ``number`` from 0 for each
    constraint.

    Parameters
    ----------
    quantities : in joint or absolute coordinates, recorded on the same tape
    recorded_rows : holonomic equations that are recorded already, by position in ``constraints``
    """
    rows = ConstraintRows()
    for position, item in enumerate(constraints):
        with quantities.algebra.tape.block(f"constraint {item.name}"):
            if position in recorded_rows:
                item_rows = ConstraintRows(list(recorded_rows[position]))
            elif item.framed:
                item_rows = rows_of_pair(quantities, item, frame_pair(quantities, item.first, item.second))
            else:
                row = _formula_row(quantities, item)
                item_rows = ConstraintRows([], [row]) if item.at_velocity else ConstraintRows([row])
            marked = [replace(row, owner=item, number=number) for number, row in enumerate(item_rows.all)]
            rows.holonomic += marked[: len(item_rows.holonomic)]
            rows.velocity += marked[len(item_rows.holonomic) :]
    return rows


def _formula_row(quantities: Quantities, item: Constraint) -> ConstraintRow:
    """Return the equation of a constraint that the user writes as a formula of coordinates and points."""
    equation = Equation(quantities, item)
    level = "1" if item.unit.startswith("rad") else "m"
    unit: Literal["m", "1", "m/s", "1/s"] = level if not item.at_velocity else "1/s" if level == "1" else "m/s"  # type: ignore[assignment]
    return ConstraintRow(f"{item.name}: formula", equation.value, unit, *equation.scales(), driving=equation.driving)


def forces_at_points(quantities: Quantities, rows: ConstraintRows) -> list[PointForce]:
    """Return the forces of the multipliers on points in equations that the user writes as formulas. Each is (link,
    point in m, force in N), in link axes, with negative numbers for base and world. Other constraints are left out."""
    result: list[PointForce] = []
    for number, row in enumerate(rows.all):
        if isinstance(row.owner, Constraint) and not row.owner.framed:
            result += Equation(quantities, row.owner).forces(quantities.input("lam", number))
    return result


def rows_of_pair(quantities: Quantities, item: Constraint, pair: FramePair) -> ConstraintRows:
    """Return the equations of one constraint between two frames."""
    return ConstraintRows(
        _holonomic(quantities, item, pair), _rolling(quantities, item, pair) if item.kind.rows[1] else []
    )


# one case for each type of constraint: each picks from the same rows of the two frames
def _holonomic(quantities: Quantities, item: Constraint, pair: FramePair) -> list[ConstraintRow]:
    """Return the equations at position level of a constraint between two frames, by its type. The driven angle or
    travel comes last. A constraint with a formula has that equation alone, distance, rolling and sliding constraints
    have one.
    """
    first, second = pair.first, pair.second
    gap = quantities.algebra.named(f"gap_{item.name}", minus(first.origin, second.origin))
    local = apply(transpose(second.axes), gap)
    z1 = first.axis(2)

    def row(unit: Literal["m", "1"], least: Scalar, label: str, value: Scalar, *more: Scalar) -> ConstraintRow:
        size = sum(map(magnitude, more), least)
        return ConstraintRow(f"{item.name}: {label}", value, unit, size, pair.lever, pair.path_length)

    length, angle = partial(row, "m", pair.size), partial(row, "1", quantities.algebra.one)

    parallel = [angle(f"z stays perpendicular to {axis}", dot(z1, second.axis(k))) for k, axis in enumerate("xy")]
    spin = angle("x stays perpendicular to y", dot(first.axis(0), second.axis(1)))
    driven = []
    if item.drive is not None:
        drive = quantities.formula(item.drive)
        if item.kind.drive == "angle":
            driven = [angle("driven angle", sine_of_excess_rotation(quantities, drive, first, second), drive)]
        else:
            driven = [length("driven travel", local[2] + drive, drive)]
    if item.equation is not None:
        position = apply(transpose(first.axes), minus(second.origin, first.origin))
        equation = Equation(quantities, item, position)
        return [(length if item.unit == "m" else angle)("formula", equation.value, equation.size)]
    match item.type:
        case "distance":
            apart, length_given = quantities.algebra.length(gap), quantities.formula(item.length)
            return [length("distance", apart - length_given, length_given)]
        case "rolling" | "sliding":
            height = body_contact(quantities, item, pair).height
            size, lever, path_length = _on_wheel(quantities, item, pair)
            contact = "contact" if item.surface is None else "contact with the surface"
            return [ConstraintRow(f"{item.name}: {contact}", height, "m", size, lever, path_length)]
    kind, turns = item.kind, len(item.kind.turned_about)
    turned = [[*parallel, spin], parallel, [spin]][turns] if not kind.has("ball") else []
    if kind.has("screw"):
        pitch = quantities.formula(item.pitch)  # times the sine of the rotation beyond travel / pitch: any revolution
        residual = pitch * sine_of_excess_rotation(quantities, -local[2] / pitch, pair.first, pair.second)
        driven = [length("travel follows the angle", residual, pitch)]
    return [*(length(label, value) for label, value in _across(kind, first, gap, local)), *turned, *driven]


def _across(kind: Connection, first: FramePose, gap: Vector, local: Vector) -> Iterator[tuple[str, Scalar]]:
    """Yield the label and the length, m, of each position equation, across the travels of a joint. ``gap`` is from the
    second origin to the first, ``local`` the same in axes of the second frame."""
    along = {2} if kind.has("screw") else {kind.frame_axes[axis] for axis in kind.travels}
    from_first = bool(along) and (kind.has("ball") or len(kind.turned_about) > 1)  # along an axis of the first alone
    for k, axis in enumerate("xyz"):
        if k in along:
            continue
        if len(along) > 1:
            yield "origin stays in the plane", dot(gap, first.axis(k))
        elif from_first:
            yield f"point stays on the line along {axis}", apply(transpose(first.axes), gap)[k]
        else:
            yield f"origins meet along {axis}", local[k]


def sine_of_excess_rotation(quantities: Quantities, angle: Scalar, first: FramePose, second: FramePose) -> Scalar:
    """Return sin(rotation of the second frame about z - angle), smooth over any number of revolutions."""
    cosine, sine = quantities.algebra.call(Op.COS, angle), quantities.algebra.call(Op.SIN, angle)
    return dot(first.axis(1), second.axis(0)) * cosine - dot(first.axis(0), second.axis(0)) * sine


def _on_wheel(quantities: Quantities, item: Constraint, pair: FramePair) -> tuple[Scalar, Scalar, Scalar]:
    """Return size, lever and path length of a pair with the size of a rolling or sliding body, without the position on
    the plane. That size, m, is the sum of an ellipsoid's semi-axes, else of radius and tube radius."""
    lengths = item.semi_axes if item.shape == "ellipsoid" else (item.radius, item.tube_radius)
    first, *others = (magnitude(quantities.formula(length)) for length in lengths)
    radius = sum(others, first)
    return pair.size + radius, pair.lever + radius, pair.path_length + radius


def _rolling(quantities: Quantities, item: Constraint, pair: FramePair) -> list[ConstraintRow]:
    contact = body_contact(quantities, item, pair)
    slip = minus(pair.velocity_at(pair.second, contact.point), pair.velocity_at(pair.first, contact.point))
    size, lever, path_length = _on_wheel(quantities, item, pair)
    return [
        ConstraintRow(f"{item.name}: no slip along {axis}", dot(slip, tangent), "m/s", size, lever, path_length)
        for axis, tangent in zip("xy", contact.tangents, strict=True)
    ]


class Equation:
    """A constraint equation that the user writes as a formula, with partials in the coordinates and points of the
    formula.

    The partials are differentiated on a separate tape, on which every quantity of motion is an input. The partials give
    the forces of the multiplier on points and joints, and the scales of rounding errors.

    Parameters
    ----------
    position : m, coordinates of the second frame's origin in the first frame, of an equation between two frames

    Attributes
    ----------
    value : residual in m or rad, or in m/s or rad/s for an equation of velocities
    """

    def __init__(self, quantities: Quantities, item: Constraint, position: Vector | None = None) -> None:
        assert item.equation is not None  # asked for by the caller
        self.quantities, self.item, self.formula, self.place = quantities, item, item.equation, position
        self.value = record(quantities.algebra, self.formula, self._resolve)

    def _resolve(self, symbol: Symbol) -> Scalar:
        if symbol.kind == "local" and self.place is not None:
            return self.place[symbol.index]
        return self.quantities(symbol)

    @cached_property
    def partials(self) -> Mapping[Symbol, Scalar]:
        """Partials of the residual by symbol: coordinates and positions, or velocities at velocity level."""
        moving, target = self.item.moving, self.quantities.algebra.tape
        tape = Tape()
        detached = DetachedSymbols(self.quantities, tape)
        inputs = {symbol: Scalar(tape, tape.input(_MOTION, number)) for number, symbol in enumerate(moving)}

        def resolve(symbol: Symbol) -> Scalar:
            return inputs[symbol] if symbol in inputs else detached(symbol)

        value = record(detached.algebra, self.formula, resolve)
        held = {number: symbol for number, symbol in enumerate(moving) if self.item.at_velocity == _is_rate(symbol)}
        seeds: Seeds = {InputSymbol(_MOTION, number): {number: ONE} for number in held}
        (tangent,) = forward_partials(tape, [value.ref], seeds)
        bound = {InputSymbol(_MOTION, number): self._resolve(symbol).ref for number, symbol in enumerate(moving)}
        refs = splice(target, tape, [tangent.get(number, ZERO) for number in held], bound)
        return {symbol: Scalar(target, ref) for symbol, ref in zip(held.values(), refs, strict=True)}

    def forces(self, multiplier: Scalar) -> Iterator[PointForce]:
        """Yield the forces of a multiplier on the points in the equation, (link, point in m, force in N), in link
        axes."""
        kinematics, zero = self.quantities.kinematics, self.quantities.algebra.zero
        for symbol, slope in self.partials.items():
            if symbol.kind in ("position", "velocity"):
                link, at = kinematics.local(*self.quantities.at(self.quantities.points[symbol.name]))
                x, y, z = (-(multiplier * slope) if symbol.index == k else zero for k in range(3))
                in_base = apply(transpose(kinematics.base.orientation), (x, y, z))
                yield link, at, apply(transpose(kinematics.pose(link)[0]), in_base)

    @property
    def driving(self) -> Scalar | None:
        """The residual at zero velocities, the part that time prescribes; None for an equation at position level."""
        if not self.item.at_velocity:
            return None
        zero = self.quantities.algebra.zero

        def at_rest(symbol: Symbol) -> Scalar:
            return zero if _is_rate(symbol) else self.quantities(symbol)

        return record(self.quantities.algebra, self.formula, at_rest)

    @cached_property
    def size(self) -> Scalar:
        """Sum of the magnitudes of the formula's summands, and of the quantities times their partials, in the
        equation's unit."""
        parts = [magnitude(record(self.quantities.algebra, part, self._resolve)) for part in summands(self.formula)]
        changes = (magnitude(slope * self._resolve(symbol)) for symbol, slope in self.partials.items())
        return sum(changes, sum(parts[1:], parts[0]))

    def scales(self) -> tuple[Scalar, Scalar, Scalar]:
        """Return the scalars size, extent and path length of the equation, as of ``ConstraintRow``. A coordinate counts
        with its partial: an angle as 1 rad, a travel as the machine, a point as the summands of its position. So the
        sizes do not vanish at states in which all summands do."""
        zero, in_metres = self.quantities.algebra.zero, self.item.unit.startswith("m")
        size, extent, path = self.size, zero, zero
        for symbol, slope in self.partials.items():
            weight = magnitude(slope)
            if symbol.kind in ("position", "velocity"):
                point = self.quantities.points[symbol.name]
                pair = frame_pair(self.quantities, Frame(BASE), Frame(point.body, point.position))
                size, extent = size + weight * pair.size, extent + weight * pair.lever
                path = path + weight * pair.path_length
            elif self._turns(symbol):
                size, path = size + weight, path + weight
                extent = extent + weight if in_metres else extent
            else:
                size, path = size + weight * self.quantities.machine, path + weight * self.quantities.machine
        return extent if self.item.at_velocity else size, extent, path

    def _turns(self, symbol: Symbol) -> bool:
        joint = next((joint for joint in self.quantities.scene.joints if joint.name == symbol.name), None)
        units = joint.kind.units if joint is not None else ()
        return symbol.index < len(units) and units[symbol.index] == "rad"


def _is_rate(symbol: Symbol) -> bool:
    return symbol.kind in ("v", "velocity")


class ConstraintCalculus:
    """Jacobian, rates, bias and forces of constraint equations, recorded on the tree's tape.

    Parameters
    ----------
    tree : links in joint or absolute coordinates
    rows : n holonomic, then m velocity equations
    base : the prescribed base, whose motion counts in rates
    """

    def __init__(self, tree: Tree, rows: ConstraintRows, base: BaseState) -> None:
        self.algebra = tree.algebra
        self.tape: Tape = tree.algebra.tape
        self.nv = tree.nv
        self.rows = rows
        self.seeds = configuration_directions(tree)
        self.rates = rates_of(self.tape, self.seeds, base)
        self.holonomic = [row.value.ref for row in rows.holonomic]
        self.level = [row.value.ref for row in rows.velocity]
        for symbol, refs in (("Phi", self.holonomic), ("psi", self.level)):
            for number, ref in enumerate(refs):
                self.tape.name(ref, f"{symbol}_{number}")

    @cached_property
    def tangents(self) -> list[Tangent]:
        """Rows of B as {velocity component: nonzero}, one mapping per equation, holonomic equations first. Raises
        ModelError for an equation written as a formula without a moving coordinate or point."""
        with self.tape.block("Jacobian of the constraints"):
            result = forward_partials(self.tape, self.holonomic, self.seeds)
            result += forward_partials(self.tape, self.level, block_directions("v", self.nv))
        for row, tangent in zip(self.rows.all, result, strict=True):
            if isinstance(row.owner, Constraint) and row.owner.equation is not None and not tangent:
                fault = "the equation names no coordinate of a moving joint and no point of a moving body [E0490]"
                raise ModelError(Problem(f"constraints.{row.owner.name}", fault, "a coordinate that it may hold"))
        return result

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
        """Return the constraint velocities, (rows,): Phi' = B v + Phi_t of holonomic equations, then velocity-level
        residuals."""
        with self.tape.block("rates of the constraints"):
            first = jacobian_vector(self.tape, self.holonomic, self.rates)
        return [Scalar(self.tape, ref) for ref in [*first, *self.level]]

    def bias(self) -> list[Scalar]:
        """Return d/dt of ``velocity`` at vdot = 0, (rows,): Z(v, v) including base motion and prescribed motions."""
        velocity = [value.ref for value in self.velocity()]
        with self.tape.block("accelerations of the constraints at vdot = 0"):
            return [Scalar(self.tape, ref) for ref in jacobian_vector(self.tape, velocity, self.rates)]

    def forces(self) -> list[Scalar]:
        """Return the generalized constraint forces B^T lam, (nv,), with inputs "lam" of the tape as multipliers."""
        tangents = self.tangents
        multipliers = [Scalar(self.tape, self.tape.input("lam", number)) for number in range(len(self.rows.all))]
        total = self._forces_of_groups(multipliers)
        with self.tape.block("constraint forces"):
            for row, tangent, multiplier in zip(self.rows.all, tangents, multipliers, strict=True):
                for column in sorted(tangent) if row.group is None else ():
                    total[column] = total[column] + Scalar(self.tape, tangent[column]) * multiplier
        return total

    def _forces_of_groups(self, multipliers: Sequence[Scalar]) -> list[Scalar]:
        """Return the part of B^T lam, (nv,), of the equations that belong to a ``RowGroup``, which records their forces
        together. ``multipliers`` has one number for each equation of all groups and others; equations that are absent
        have 0."""
        zero = self.algebra.zero
        total = [zero] * self.nv
        for group in dict.fromkeys(row.group for row in self.rows.all):
            if group is None:
                continue
            of_row = {
                row.in_group: value for row, value in zip(self.rows.all, multipliers, strict=True) if row.group is group
            }
            forces = group.forces([of_row.get(number, zero) for number in range(group.count)])
            total = [x + y for x, y in zip(total, forces, strict=True)]
        return total

    def driving_power(self) -> Scalar:
        """Return lam . Phi_t, W: the power of prescribed motions, without the power of the base. At velocity level the
        part of the equation without velocities stands for Phi_t. ``lam`` is an input of the tape."""
        rates = jacobian_vector(self.tape, self.holonomic, {InputSymbol("t", 0): ONE})
        total = self.algebra.zero
        driven = [Scalar(self.tape, rate) for rate in rates]
        driven += [self.algebra.zero if row.driving is None else row.driving for row in self.rows.velocity]
        for number, rate in enumerate(driven):
            total = total + Scalar(self.tape, self.tape.input("lam", number)) * rate
        return total

    def by_configuration(self, values: Sequence[Scalar]) -> list[list[Scalar]]:
        """Return left-trivialised partials in q of n values, (n, nv)."""
        return self._dense(forward_partials(self.tape, [value.ref for value in values], self.seeds))
