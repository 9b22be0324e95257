"""Kane's equations on a tape: velocities of bodies from SymPy's frames and points, differentiated operation by
operation.

With J the partial velocities of a body, M = sum J^T m J and h = sum J^T (m a + ...) at vdot = 0: Kane and Levinson,
Dynamics: Theory and Applications (1985), sections 2.14 and 6.1. Directions and positions are composed on the tape, so
no expression of SymPy grows with the length of a chain.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

from sympy.physics.mechanics import ReferenceFrame, RigidBody

from eomgen.errors import DescriptionError, Problem
from eomgen.products.sympy_mechanics.expressions import Expressions
from eomgen.symbolic.calculus.partials import forward_partials, jacobian_vector
from eomgen.symbolic.operations import InputSymbol
from eomgen.symbolic.scalar import Matrix, Scalar, Vector, apply, cross, dot, multiply, plus, scaled, transpose
from eomgen.symbolic.tape import ONE, ZERO, Ref


class KaneTerms(NamedTuple):
    """M, (n, n) row by row; h and Q, (n,)."""

    mass: list[Scalar]
    coupling: list[Scalar]
    force: list[Scalar]


class KaneKinematics:
    """Directions, velocities and partial velocities in an inertial frame.

    Parameters
    ----------
    expressions : Expressions
        Knows coordinates, speeds and rates as scalars of q and v.
    inertial : ReferenceFrame
    q, v : lists of Scalar
        Blocks of the coordinates and of the rates.
    """

    def __init__(self, expressions: Expressions, inertial: Any, q: Sequence[Scalar], v: Sequence[Scalar]) -> None:
        self.expressions, self.inertial = expressions, inertial
        self.algebra, self.tape = expressions.algebra, expressions.algebra.tape
        self.count = len(v)
        self._seeds: dict[Ref | InputSymbol, dict[int, Ref]] = {item.ref: {index: ONE} for index, item in enumerate(v)}
        self._along: dict[Ref | InputSymbol, Ref] = {entry.ref: rate.ref for entry, rate in zip(q, v, strict=True)}
        self._along[self.expressions.known[expressions.time].ref] = ONE
        self._axes: dict[Any, Matrix] = {inertial: self.algebra.identity}

    def axes(self, frame: Any) -> Matrix:
        """Return the rotation matrix from axes of a frame to inertial axes, recorded once per frame."""
        if frame not in self._axes:
            path = self._path(frame, 0)
            self._axes[frame] = multiply(self.axes(path[1]), self.expressions.matrix(path[1].dcm(frame)))
        return self._axes[frame]

    def is_oriented(self, frame: Any) -> bool:
        """Return whether rotations lead from a frame to the inertial frame."""
        try:
            frame._dict_list(self.inertial, 0)
        except ValueError:
            return False
        return True

    def _path(self, frame: Any, kind: int) -> Sequence[Any]:
        try:
            path: Sequence[Any] = frame._dict_list(self.inertial, kind)
        except ValueError:
            word = "orientation" if kind == 0 else "angular velocity"
            remark = ", another frame of this name" if str(frame.name) == str(self.inertial.name) else ""
            fault = f"the frame {frame.name} has no {word} in {self.inertial.name}{remark} [E1148]"
            raise DescriptionError(Problem(self.expressions.name, fault, f"{frame.name}.orient_axis")) from None
        return path

    def vector(self, vector: Any) -> Vector:
        """Return a vector of SymPy in inertial axes."""
        result = self.algebra.zero_vector
        for components, frame in getattr(vector, "args", ()):
            local_vector = self.algebra.vector([self.expressions(item) for item in components])
            result = plus(result, apply(self.axes(frame), local_vector))
        return result

    def angular_velocity(self, frame: Any) -> Vector:
        """Return the angular velocity of a frame in inertial axes."""
        path = self._path(frame, 1)
        result = self.algebra.zero_vector
        for moving_frame, reference_frame in pairwise(path):
            result = plus(result, self.vector(moving_frame._ang_vel_dict[reference_frame]))
        return result

    def velocity(self, point: Any) -> Vector:
        """Return the velocity of a point in the inertial frame, in inertial axes. This is the given velocity, or the
        one of the nearest point with a given velocity plus the rate of the way from there. Raises DescriptionError
        without such a point."""
        points = joined_points(point)
        nearest = next((item for item in points if self.inertial in item._vel_dict), None)
        if nearest is None:
            for item in points:  # a frame without an orientation explains more
                self.way(point, item)
            fault = f"the velocity of the point {point.name} in {self.inertial.name} is not known [E1149]"
            hint = f"{point.name}.set_vel, or a place relative to a point with a velocity"
            raise DescriptionError(Problem(self.expressions.name, fault, hint))
        return plus(self.vector(nearest._vel_dict[self.inertial]), self.rate(self.way(point, nearest)))

    def way(self, point: Any, origin: Any) -> Vector:
        """Return the position of a point from another one that is joined with it, along the shortest way."""
        before, way = joined_points(point), [origin]
        while way[-1] is not point:
            way.append(before[way[-1]])
        result = self.algebra.zero_vector
        for start, end in pairwise(reversed(way)):
            result = plus(result, self.vector(start.pos_from(end)))
        return result

    def motion(self, location: Any) -> Vector:
        """Return the velocity of a point, or the angular velocity of a frame."""
        return (self.angular_velocity if isinstance(location, ReferenceFrame) else self.velocity)(location)

    def rate(self, vector: Vector) -> Vector:
        """Return the time derivative of components along the motion, at constant v."""
        return self.algebra.vector(self.rates(vector))

    def rates(self, values: Sequence[Scalar]) -> list[Scalar]:
        """Return time derivatives of values along the motion, at constant v. Raises DescriptionError for inputs."""
        refs = [item.ref for item in values]
        if any(symbol.block == "u" for symbol in self.tape.depends_on(refs)):
            fault = "a place or a mass depends on an input, whose rate is unknown [E1150]"
            raise DescriptionError(Problem(self.expressions.name, fault, "a coordinate, or a formula of time"))
        return [Scalar(self.tape, ref) for ref in jacobian_vector(self.tape, refs, self._along)]

    def rows_of(self, values: Sequence[Scalar]) -> list[list[Scalar]]:
        """Return the partials of values in v, a row for each value."""
        rows = forward_partials(self.tape, [item.ref for item in values], self._seeds)
        return [[Scalar(self.tape, row.get(column, ZERO)) for column in range(self.count)] for row in rows]

    def partials(self, vector: Vector) -> list[Vector]:
        """Return the partial velocities: the derivative of a velocity (3,) in each component of v, n vectors."""
        return [self.algebra.vector(column) for column in zip(*self.rows_of(vector), strict=True)]


def reachable(starts: Iterable[Any], neighbours: Callable[[Any], Iterable[Any]]) -> dict[Any, Any]:
    """Return the nodes of a graph that are reached from ``starts``, the nearest first, each with the node before it."""
    before: dict[Any, Any] = dict.fromkeys(starts)
    waiting = list(before)
    for node in waiting:
        for neighbour in neighbours(node):
            if neighbour not in before:
                before[neighbour] = node
                waiting.append(neighbour)
    return before


def joined_points(*points: Any) -> dict[Any, Any]:
    """Return the points of SymPy that given positions join with some points, the nearest first, each with the point
    before it."""
    return reachable(points, lambda point: point._pos_dict)


def is_rigid(body: Any) -> bool:
    """Return whether a body has an inertia: SymPy's ``Body`` is a rigid body or a particle."""
    return isinstance(body, RigidBody) and bool(getattr(body, "is_rigidbody", True))


def center_of(body: Any) -> Any:
    """Return the mass centre of a body."""
    return body.masscenter if isinstance(body, RigidBody) else body.point


def frame_of(body: Any, kinematics: KaneKinematics) -> Any:
    """Return the frame of a SymPy body in which the inertia is taken. For a particle this is the inertial frame; for a
    body without an orientation, as a wheel, the frame of the inertia."""
    if not is_rigid(body):
        return kinematics.inertial
    candidates = [body.frame, *(vector.args[0][1] for _, vector, _ in body.central_inertia.args)]
    return next((frame for frame in candidates if kinematics.is_oriented(frame)), body.frame)


def inertia_of(body: Any, kinematics: KaneKinematics) -> Matrix:
    """Return the inertia about the mass centre in the axes of ``frame_of``, kg m^2."""
    return kinematics.expressions.matrix(body.central_inertia.to_matrix(frame_of(body, kinematics)))


def kane(kinematics: KaneKinematics, bodies: Sequence[Any], loads: Sequence[tuple[Any, Any]]) -> KaneTerms:
    """Return the terms M, h and Q of Kane's equations, projected onto the rates of the coordinates. ``loads`` are pairs
    of a point and a force, or of a frame and a torque."""
    algebra, count = kinematics.algebra, kinematics.count
    terms = KaneTerms([algebra.zero] * count**2, [algebra.zero] * count, [algebra.zero] * count)
    for body in bodies:
        _add_body(kinematics, body, terms)
    for target, load in loads:
        motion, value = kinematics.motion(target), kinematics.vector(load)
        for number, partial in enumerate(kinematics.partials(motion)):
            terms.force[number] = terms.force[number] + dot(partial, value)
    return terms


def augmented(kinematics: KaneKinematics, terms: KaneTerms, rows: Sequence[Scalar]) -> KaneTerms:
    """Return the terms with M + B^T B and Q - B^T g, of constraints w(q, v, t) = 0 with rates B vdot + g.

    These change no acceleration with B vdot = -g, and no multiplier, and give an inertia to coordinates that
    constraints alone move.
    """
    count = len(terms.coupling)
    mass, force = list(terms.mass), list(terms.force)
    for row, bias in zip(kinematics.rows_of(rows), kinematics.rates(rows), strict=True):
        for i in range(count):
            force[i] = force[i] - row[i] * bias
            for j in range(count):
                mass[i * count + j] = mass[i * count + j] + row[i] * row[j]
    return terms._replace(mass=mass, force=force)


def _add_body(kinematics: KaneKinematics, body: Any, terms: KaneTerms) -> None:
    """Add the inertia of a body to M and h of ``terms``, in place; masses and inertias may change with time."""
    record, count = kinematics.expressions, len(terms.coupling)
    mass, velocity = record(body.mass), kinematics.velocity(center_of(body))
    (growth,) = kinematics.rates([mass])
    momentum = plus(scaled(mass, kinematics.rate(velocity)), scaled(growth, velocity))
    parts: list[tuple[list[Vector], Callable[[Vector], Vector], Vector]] = [
        (kinematics.partials(velocity), lambda x: scaled(mass, x), momentum)
    ]
    if is_rigid(body):
        frame = frame_of(body, kinematics)
        turned, turning = transpose(kinematics.axes(frame)), kinematics.angular_velocity(body.frame)
        omega, inertia = apply(turned, turning), inertia_of(body, kinematics)
        rate = kinematics.rate(omega) if frame is body.frame else apply(turned, kinematics.rate(turning))
        growing = kinematics.algebra.matrix([kinematics.rates(list(row)) for row in inertia])
        gyroscopic = plus(apply(inertia, rate), cross(omega, apply(inertia, omega)))
        gyroscopic = plus(gyroscopic, apply(growing, omega))
        parts.append((kinematics.partials(omega), lambda x: apply(inertia, x), gyroscopic))
    for partials, weighted, bias in parts:
        moving = [k for k, partial in enumerate(partials) if any(not item.is_zero for item in partial)]
        for i in moving:
            terms.coupling[i] = terms.coupling[i] + dot(partials[i], bias)
            for j in (j for j in moving if j <= i):
                entry = dot(partials[i], weighted(partials[j]))
                terms.mass[i * count + j] = terms.mass[i * count + j] + entry
                if i != j:
                    terms.mass[j * count + i] = terms.mass[j * count + i] + entry
