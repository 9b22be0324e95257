"""Quantities of SymPy's systems besides equations: poses and twists of bodies, energies and powers, a drawing.

Poses are of mass centres, in the axes of the bodies' frames. A load is conservative if the rate of its potential is
minus its power at random states: a constant force at a place, a spring along a pathway; power of all other loads is
non-conservative. If time moves places or constraints, drivers give the rest of the rate of the energy.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import sympy
from sympy.core.function import AppliedUndef
from sympy.physics import mechanics

from eomgen.base.messages import legal_name
from eomgen.base.rounding import COMPUTED
from eomgen.formula.nodes import Number
from eomgen.lie.rotations import quaternion_product
from eomgen.products.sympy_mechanics.expressions import name_of
from eomgen.products.sympy_mechanics.kane import (
    KaneKinematics,
    center_of,
    frame_of,
    inertia_of,
    is_rigid,
    joined_points,
    reachable,
)
from eomgen.products.sympy_mechanics.rows import Samples, values_at
from eomgen.symbolic.calculus.partials import jacobian_vector
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.map import splice
from eomgen.symbolic.operations import InputSymbol, Op
from eomgen.symbolic.scalar import Algebra, Matrix, Scalar, Vector, apply, cross, dot, minus, transpose
from eomgen.symbolic.tape import ONE, ZERO, Ref
from eomgen.system.description import BASE, Drawing, Hinge, Line, Point, Solid

#: Joint of SymPy -> type in drawings, whether the joint turns, and whether the joint slides.
_HINGES: Mapping[type[Any], tuple[str, bool, bool]] = {
    mechanics.PinJoint: ("revolute", True, False),
    mechanics.PrismaticJoint: ("prismatic", False, True),
    mechanics.CylindricalJoint: ("cylindrical", True, True),
    mechanics.PlanarJoint: ("planar", False, False),
    mechanics.SphericalJoint: ("spherical", False, False),
    mechanics.WeldJoint: ("fixed", False, False),
}

Scalars = Sequence[Scalar]


class Energies(NamedTuple):
    """Kinetic and potential energy, J, and power of non-conservative loads, W."""

    kinetic: Scalar
    potential: Scalar
    power: Scalar


class Observed:
    """Places, poses and energies of a system.

    Parameters
    ----------
    kinematics : KaneKinematics
    bodies : sequence of RigidBody and Particle
    origin : Point or None
        At rest, the origin of places; None: a point at rest from which most places follow.
    samples : sequence of mappings
        Values of the input blocks in states at which equalities are checked.
    """

    def __init__(self, kinematics: KaneKinematics, bodies: Sequence[Any], origin: Any, samples: Samples) -> None:
        """Choose the origin, and the bodies that move or rest relative to the origin."""
        self.kinematics, self.samples = kinematics, samples
        self.algebra, self.tape, self.record = kinematics.algebra, kinematics.tape, kinematics.expressions
        self.origin = origin
        every = list(dict.fromkeys(bodies))
        if origin is None:
            self.origin = self._best_origin(every)
        self.resting = [body for body in every if self._rests(body)]
        self.bodies = [body for body in every if body not in self.resting]
        self.names: list[str] = []
        for body in self.bodies:
            self.names.append(legal_name(name_of(sympy.Symbol(str(body.name))), self.names))
        self._quaternions: dict[Any, list[Scalar]] = {}
        #: Bodies with a place that is not known against the origin.
        self.adrift = [name for body, name in zip(self.bodies, self.names, strict=True) if not self._is_placed(body)]

    # -- places -------------------------------------------------------------------------------------------------------

    def _best_origin(self, bodies: Sequence[Any]) -> Any:
        """Return the point at rest from which the places of most bodies agree with velocities; None without one."""
        inertial = self.kinematics.inertial
        points = dict.fromkeys(point for body in bodies for point in joined_points(center_of(body)))
        best, most = None, -1
        for candidate in points:
            velocity = candidate._vel_dict.get(inertial)
            if velocity is None or any(getattr(velocity, "args", ())):
                continue
            self.origin = candidate
            placed = sum(self._is_placed(body) for body in bodies)
            if placed > most:
                best, most = candidate, placed
        return best

    def _is_placed(self, body: Any) -> bool:
        """Return whether the rate of the place of a mass centre equals its velocity at all samples."""
        position, velocity = self.place(center_of(body)), self.kinematics.velocity(center_of(body))
        return self._cancels([[rate, -v] for rate, v in zip(self.kinematics.rates(position), velocity, strict=True)])

    def place(self, point: Any) -> Vector:
        """Return the position of a point from the origin in inertial axes, m. If no way leads to the origin, the
        position is relative to the first point on the ways with a given velocity."""
        first, *others = points = joined_points(point)
        moved = (item for item in others if self.kinematics.inertial in item._vel_dict)
        return self.kinematics.way(point, self.origin if self.origin in points else next(moved, first))

    def twisted(self) -> list[str]:
        """Return the names of body frames whose given angular velocity is not the orientation's rate."""
        faults = []
        for body in self.bodies:
            frame = frame_of(body, self.kinematics)
            if not is_rigid(body) or frame is not body.frame:
                continue
            omega = self.kinematics.angular_velocity(frame)
            sums = []
            for column in transpose(self.kinematics.axes(frame)):
                turned = cross(omega, column)
                sums += [[rate, -target] for rate, target in zip(self.kinematics.rates(column), turned, strict=True)]
            if not self._cancels(sums, 1.0):
                faults.append(str(frame.name))
        return faults

    def _cancels(self, sums: Sequence[Sequence[Scalar]], size: float = 0.0) -> bool:
        """Return whether the summands of each sum add up to rounding at all samples, relative to the largest summand or
        ``size``. Samples with values that are not finite do not count."""
        refs = [item.ref for summands in sums for item in summands]
        for sample in self.samples:
            known = values_at(self.tape, refs, sample)
            if not np.all(np.isfinite(known)):  # an angle may be singular there
                continue
            values = iter(known)
            for summands in sums:
                parts = np.array([next(values) for _ in summands])
                if not abs(parts.sum()) <= COMPUTED * np.abs(parts).max(initial=max(size, 1e-300)):
                    return False
        return True

    def _rests(self, body: Any) -> bool:
        moving = list(self.kinematics.velocity(center_of(body)))
        if is_rigid(body):
            moving += self.kinematics.angular_velocity(body.frame)
        return all(item.is_zero for item in moving)

    # -- poses --------------------------------------------------------------------------------------------------------

    def poses(self) -> list[Scalar]:
        """Return quaternion, to inertial axes, and place of each body."""
        return [
            item
            for body in self.bodies
            for item in (*self._quaternion(frame_of(body, self.kinematics)), *self.place(center_of(body)))
        ]

    def twists(self) -> list[Scalar]:
        """Return for each body 6 numbers in body axes: angular velocity, then velocity of the mass centre."""
        result: list[Scalar] = []
        for body in self.bodies:
            turning = body.frame if is_rigid(body) else frame_of(body, self.kinematics)
            result += self._in_axes_of(body, self.kinematics.angular_velocity(turning))
            result += self._in_axes_of(body, self.kinematics.velocity(center_of(body)))
        return result

    def _in_axes_of(self, body: Any, vector: Vector) -> Vector:
        """Return a vector in inertial axes in the axes of a body."""
        return apply(transpose(self.kinematics.axes(frame_of(body, self.kinematics))), vector)

    def _quaternion(self, frame: Any) -> list[Scalar]:
        """Return the quaternion (w, x, y, z) from axes of a frame to inertial axes, recorded once."""
        if frame is self.kinematics.inertial:
            return [self.algebra.one, *self.algebra.zero_vector]
        if frame not in self._quaternions:
            above = frame._dict_list(self.kinematics.inertial, 0)[1]
            local_quaternion = self._turn(above.dcm(frame))
            product = quaternion_product(self._quaternion(above), local_quaternion)
            self._quaternions[frame] = [self.algebra.scalar(item) for item in product]
        return self._quaternions[frame]

    def _turn(self, matrix: Any) -> list[Scalar]:
        """Return the quaternion of a SymPy rotation matrix, by the half angle if it turns about a coordinate axis."""
        for axis in range(3):
            i, j = (axis + 1) % 3, (axis + 2) % 3
            cosine, sine = matrix[i, i], matrix[j, i]
            if matrix[axis, axis] == 1 and isinstance(cosine, sympy.cos):
                angle = cosine.args[0]
                if sine in (sympy.sin(angle), -sympy.sin(angle)):
                    half = self.record(angle if sine == sympy.sin(angle) else -angle) * 0.5
                    result = [self.algebra.call(Op.COS, half), *self.algebra.zero_vector]
                    result[1 + axis] = self.algebra.call(Op.SIN, half)
                    return result
        return quaternion_of(self.algebra, self.record.matrix(matrix))

    # -- energies -----------------------------------------------------------------------------------------------------

    def energies(self, loads: Sequence[tuple[Any, Any]], actuators: Sequence[Any]) -> Energies:
        """Return kinetic energy, potential energy of constant forces and springs, and the power of all other loads.

        Parameters
        ----------
        loads : points and forces, frames and torques, without the loads of actuators
        actuators : of a System
        """
        kinetic = potential = power = self.algebra.zero
        for body in self.bodies:
            velocity = self.kinematics.velocity(center_of(body))
            kinetic = kinetic + 0.5 * (self.record(body.mass) * dot(velocity, velocity))
            if is_rigid(body):
                omega = self._in_axes_of(body, self.kinematics.angular_velocity(body.frame))
                kinetic = kinetic + 0.5 * dot(omega, apply(inertia_of(body, self.kinematics), omega))
        groups: list[tuple[list[Any], Scalar | None]] = []
        for location, load in loads:
            value = self.kinematics.vector(load)
            constant = {symbol.block for symbol in self.tape.depends_on([item.ref for item in value])} <= {"p"}
            has_potential = constant and isinstance(location, mechanics.Point)
            groups.append(([(location, load)], -dot(value, self.place(location)) if has_potential else None))
        for actuator in actuators:
            pairs = [(item[0], item[1]) for item in actuator.to_loads()]
            stored = stored_energy(actuator)
            groups.append((pairs, None if stored is None else self.record(stored)))
        for pairs, stored_there in groups:
            load_power = self.algebra.zero
            for location, load in pairs:
                load_power = load_power + dot(self.kinematics.vector(load), self.kinematics.motion(location))
            if stored_there is not None and self._cancels([[*self.kinematics.rates([stored_there]), load_power]]):
                potential = potential + stored_there
            else:
                power = power + load_power
        return Energies(kinetic, potential, power)

    # -- drawing ------------------------------------------------------------------------------------------------------

    def drawing(self, joints: Sequence[Any], actuators: Sequence[Any]) -> Drawing:
        """Return solids with the inertia of the bodies, hinges of joints, and springs, at the first sample."""
        hinges = tuple(hinge for joint in joints for hinge in self._hinge(joint))
        points: dict[Any, Point] = {}
        lines: list[Line] = []
        for actuator in actuators:
            attachments = getattr(getattr(actuator, "pathway", None), "attachments", ())
            ends = [self._point(item) for item in attachments]
            known = [item for item in ends if item is not None]
            if len(ends) == 2 and len(known) == 2:
                points |= dict(zip(attachments, known, strict=True))
                elastic = isinstance(actuator, mechanics.LinearSpring | mechanics.DuffingSpring)
                lines.append(Line(f"actuator_{len(lines) + 1}", known[0].name, known[1].name, elastic=elastic))
        solids = tuple(self._solid(body, name) for body, name in zip(self.bodies, self.names, strict=True))
        return Drawing(solids=solids, hinges=hinges, points=tuple(dict.fromkeys(points.values())), lines=tuple(lines))

    def _numbers(self, values: Sequence[Scalar]) -> list[float]:
        return [float(item) for item in evaluate(self.tape, [value.ref for value in values], self.samples[0])]

    def _solid(self, body: Any, name: str) -> Solid:
        entries = [self.algebra.zero] * 6
        if is_rigid(body):
            matrix = inertia_of(body, self.kinematics)
            entries = [matrix[i][j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
        mass, *inertia = map(Number, self._numbers([self.record(body.mass), *entries]))
        xx, yy, zz, xy, xz, yz = inertia
        return Solid(name, mass, inertia=(xx, yy, zz, xy, xz, yz), hub="center")

    def _hinge(self, joint: Any) -> Iterator[Hinge]:
        kind, turns, slides = _HINGES.get(type(joint), ("", False, False))
        anchor = self._point(joint.parent_point, joint.parent)
        child = self._owner(joint.child)
        if not kind or anchor is None or child == BASE:
            return
        axis = getattr(joint, "joint_axis", None)
        direction = (0.0, 0.0, 1.0)
        if axis is not None:
            x, y, z = self._numbers(self._in_axes_of(joint.parent, self.kinematics.vector(axis)))
            direction = (x, y, z)
        name = name_of(sympy.Symbol(str(joint.name)))
        yield Hinge(name, kind, anchor.body, child, anchor.position, direction, turns, slides)

    def _owner(self, body: Any) -> str:
        return BASE if body in self.resting or body not in self.bodies else self.names[self.bodies.index(body)]

    def _point(self, point: Any, owner: Any = None) -> Point | None:
        """Return a point in the axes of the body that holds the point fixed, at the first sample; None if no body does.
        ``owner`` restricts the search to one body; bodies at rest are the base."""
        for body in [owner] if owner is not None else [*self.bodies, *self.resting]:
            if not _is_fixed(point, center_of(body), frame_of(body, self.kinematics)):
                continue
            position = self.place(point)
            if self._owner(body) != BASE:
                position = self._in_axes_of(body, minus(position, self.place(center_of(body))))
            x, y, z = map(Number, self._numbers(position))
            return Point(name_of(sympy.Symbol(str(point.name))), self._owner(body), (x, y, z))
        return None


def stored_energy(actuator: Any) -> Any:
    """Return the energy that a spring of SymPy stores, J; None for other actuators."""
    if isinstance(actuator, mechanics.LinearSpring):
        return actuator.stiffness * (actuator.pathway.length - actuator.equilibrium_length) ** 2 / 2
    if isinstance(actuator, mechanics.DuffingSpring):
        stretch = actuator.pathway.length - actuator.equilibrium_length
        return actuator.linear_stiffness * stretch**2 / 2 + actuator.nonlinear_stiffness * stretch**4 / 4
    return None


def lagrangian_energies(algebra: Algebra, lagrangian: Ref, v: Scalars, forces: Scalars) -> Energies:
    """Return energies by a Lagrangian: the kinetic part vanishes with v, the potential is minus the rest; and the power
    of generalized forces."""
    (rest,) = splice(algebra.tape, algebra.tape, [lagrangian], {}, known={item.ref: ZERO for item in v})
    at_rest = Scalar(algebra.tape, rest)
    return Energies(Scalar(algebra.tape, lagrangian) - at_rest, -at_rest, dot(list(forces), list(v)))


def power_of_drivers(algebra: Algebra, energies: Energies, q: Scalars, v: Scalars, a: Scalars) -> Scalar:
    """Return the rate of kinetic and potential energy along accelerations a, less non-conservative power, W."""
    along: dict[Ref | InputSymbol, Ref] = {entry.ref: rate.ref for entry, rate in zip((*q, *v), (*v, *a), strict=True)}
    along[InputSymbol("t", 0)] = ONE
    (rate,) = jacobian_vector(algebra.tape, [(energies.kinetic + energies.potential).ref], along)
    return Scalar(algebra.tape, rate) - energies.power


def quaternion_of(algebra: Algebra, matrix: Matrix) -> list[Scalar]:
    """Return the quaternion (w, x, y, z), w not negative, of a rotation matrix: of the largest of four rows."""
    unity, m = algebra.one, matrix
    x, y, z = m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]
    xy, xz, yz = m[0][1] + m[1][0], m[0][2] + m[2][0], m[1][2] + m[2][1]
    rows = [
        [unity + m[0][0] + m[1][1] + m[2][2], x, y, z],
        [x, unity + m[0][0] - m[1][1] - m[2][2], xy, xz],
        [y, xy, unity - m[0][0] + m[1][1] - m[2][2], yz],
        [z, xz, yz, unity - m[0][0] - m[1][1] + m[2][2]],
    ]
    chosen, size = rows[0], rows[0][0]
    for index in (1, 2, 3):
        larger = algebra.call(Op.LT, size, rows[index][index])
        chosen = [algebra.select(larger, new, old) for new, old in zip(rows[index], chosen, strict=True)]
        size = algebra.select(larger, rows[index][index], size)
    turned = algebra.call(Op.LT, chosen[0], algebra.zero)
    scale = algebra.scalar(0.5) / algebra.call(Op.SQRT, size)
    scale = algebra.select(turned, -scale, scale)
    return [item * scale for item in chosen]


def _is_fixed(point: Any, center: Any, frame: Any) -> bool:
    """Return whether constant vectors of a frame lead from a point to a mass centre."""

    def fixed_neighbours(here: Any) -> Iterator[Any]:
        for neighbour, vector in here._pos_dict.items():
            parts = getattr(vector, "args", ())
            if all(axes is frame and not components.atoms(AppliedUndef) for components, axes in parts):
                yield neighbour

    return center in reachable([point], fixed_neighbours)
