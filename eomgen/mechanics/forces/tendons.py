"""Tendons: springs, dampers and actuators along a path of points that wraps around spheres and cylinders.

Without friction the same tension acts along the whole path. A wrapped path is a geodesic of the obstacle, so that its
length is stationary in the points of contact: forces and rates are equal to the ones of straight lines from point to
point, with the points of contact as points of the obstacle. On a cylinder the geodesic is a helix: a plane path about
the axis, and a progress along the axis in proportion to the length of the plane path. The plane path consists of two
tangents of a circle and the arc between them: Scholz, Sherman, Stavness, Delp and Kecskemethy, Multibody Syst. Dyn. 36
(2016) 195. A path through a ring touches the circle at one point, at which both lines have equal angles to the radius.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise

from eomgen.base.data import dataclass
from eomgen.errors import ModelError, Problem
from eomgen.mechanics.forces.frame_pairs import FramePose, frame_pose
from eomgen.mechanics.forces.loads import Law, Loads, add_wrench
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.mechanics.tree.links import WORLD_NAME
from eomgen.scene.forces.tendons import Tendon, Wrap
from eomgen.symbolic.operations import Op
from eomgen.symbolic.scalar import Algebra, Scalar, Vector, apply, cross, dot, minus, negative, plus, scaled, transpose

Plane = tuple[Scalar, Scalar]
#: Whether a path in the plane touches a circle (1 or 0), the points of contact, and the length of the arc between them.
_Contacts = tuple[Scalar, tuple[Plane, Plane], Scalar]
#: From the ends of a path in the plane, and the direction of the side.
_OnCircle = Callable[[Sequence[Plane], Plane | None], _Contacts]


@dataclass(frozen=True)
class _PathPoint:
    """A point of a link on the path: place and velocity in base axes."""

    link: int
    body: str
    position: Vector
    velocity: Vector


@dataclass(frozen=True)
class _Path:
    """A path: pairs of points that straight lines join, with unit vectors, the length, and the rate of the length."""

    lines: Sequence[tuple[_PathPoint, _PathPoint, Vector]]
    length: Scalar
    rate: Scalar


def _path(quantities: Quantities, tendon: Tendon) -> _Path:
    """Record the path of a tendon through points and around obstacles, with length, m, and rate, m/s. Raises ModelError
    if two successive points coincide for all coordinates."""
    algebra = quantities.algebra
    points = [_point(quantities, name) for name in tendon.points]
    wraps = {wrap.after: wrap for wrap in tendon.wraps}
    lines: list[tuple[_PathPoint, _PathPoint, Vector]] = []
    length = rate = algebra.zero
    for index, (first, second) in enumerate(pairwise(points)):
        ends = [(first, second)]
        if index in wraps:
            leaves, arrives, arc = _contacts(quantities, wraps[index], first, second)
            ends = [(first, leaves), (arrives, second)]
            length = length + arc
        for start, end in ends:
            span = minus(end.position, start.position)
            distance = algebra.length(span)
            if distance.is_zero:
                names = " and ".join(tendon.points[index : index + 2])
                fault = (
                    f"the points {names} coincide for all coordinates, so the path has no direction between"
                    f" them [E0505]"
                )
                raise ModelError(Problem(f"tendon {tendon.name}", fault, "one of the points"))
            direction = scaled(algebra.one / distance, span)
            lines.append((start, end, direction))
            length = length + distance
            rate = rate + dot(direction, minus(end.velocity, start.velocity))
    return _Path(lines, length, rate)


def _point(quantities: Quantities, name: str) -> _PathPoint:
    point = quantities.points[name]
    at = quantities.at(point)
    kinematics = quantities.kinematics
    link, _ = kinematics.local(*at)
    return _PathPoint(link, point.body, kinematics.position_in_base(*at), kinematics.velocity_in_base(*at))


def _contacts(
    quantities: Quantities, wrap: Wrap, first: _PathPoint, second: _PathPoint
) -> tuple[_PathPoint, _PathPoint, Scalar]:
    """Return the points at which the path reaches and leaves an obstacle, and the length of the path between them, m.
    If the path does not touch the obstacle, these points divide the straight line in three equal parts: their forces on
    the obstacle cancel."""
    algebra = quantities.algebra
    frame = frame_pose(quantities, wrap.frame)
    back = transpose(frame.axes)
    ends = [apply(back, minus(point.position, frame.origin)) for point in (first, second)]
    side = None
    if wrap.side:
        side = apply(back, minus(_point(quantities, wrap.side).position, frame.origin))
    radius = quantities.formula(wrap.radius)

    def on_circle(plane: Sequence[Plane], direction: Plane | None) -> _Contacts:
        return (
            _through_ring(algebra, plane, radius) if wrap.inside else _around_circle(algebra, plane, direction, radius)
        )

    touches, contacts, arc = (_on_cylinder if wrap.cylinder else _on_sphere)(algebra, ends, side, on_circle)
    span = minus(ends[1], ends[0])
    third = algebra.length(span) / 3.0
    places = []
    for part, contact in zip((1.0 / 3.0, 2.0 / 3.0), contacts, strict=True):
        straight = plus(ends[0], scaled(part, span))
        places.append(_choice(algebra, touches, contact, straight))
    leaves, arrives = (_point_of_frame(quantities, frame, wrap.frame.body, point) for point in places)
    return leaves, arrives, algebra.select(touches, arc, third)


def _point_of_frame(quantities: Quantities, frame: FramePose, body: str, point: Vector) -> _PathPoint:
    """Return the point of an obstacle's link at ``point``, (3,), m, in the axes of the obstacle's frame."""
    position = plus(frame.origin, apply(frame.axes, point))
    R, origin = quantities.kinematics.pose(frame.link)
    omega, velocity = (apply(R, part) for part in quantities.kinematics.twist(frame.link))
    return _PathPoint(frame.link, body, position, plus(velocity, cross(omega, minus(position, origin))))


def _on_sphere(
    algebra: Algebra, ends: Sequence[Vector], side: Vector | None, on_circle: _OnCircle
) -> tuple[Scalar, tuple[Vector, Vector], Scalar]:
    """Return whether the path wraps around a sphere about the origin (1 or 0), the two points of contact, and the arc,
    m. ``ends`` and ``side`` are in the axes of the sphere; ``on_circle`` solves the problem in the plane of ends and
    centre."""
    toward = _unit(algebra, ends[0])
    normal = cross(ends[0], ends[1])
    size = dot(normal, normal)
    # below a sine of 1e-12 between both directions the plane of the path is undetermined
    apart = _less(algebra, 1e-24 * dot(ends[0], ends[0]) * dot(ends[1], ends[1]), size)
    size = algebra.select(apart, size, algebra.one)
    across = cross(scaled(algebra.one / algebra.call(Op.SQRT, size), normal), toward)
    plane = [(dot(point, toward), dot(point, across)) for point in ends]
    on_side = None if side is None else (dot(side, toward), dot(side, across))
    touches, contacts, arc = on_circle(plane, on_side)
    first, second = (plus(scaled(x, toward), scaled(y, across)) for x, y in contacts)
    return touches, (first, second), arc


def _on_cylinder(
    algebra: Algebra, ends: Sequence[Vector], side: Vector | None, on_circle: _OnCircle
) -> tuple[Scalar, tuple[Vector, Vector], Scalar]:
    """Return whether the path wraps around a cylinder about the z axis (1 or 0), the two points of contact, and the
    length of the helix, m. ``ends`` and ``side`` are in the axes of the cylinder; ``on_circle`` solves the problem in
    the plane."""
    plane = [(x, y) for x, y, _ in ends]
    touches, contacts, arc = on_circle(plane, None if side is None else (side[0], side[1]))
    before, behind = (_distance(algebra, end, contact) for end, contact in zip(plane, contacts, strict=True))
    rise = (ends[1][2] - ends[0][2]) / (before + arc + behind)
    heights = ends[0][2] + rise * before, ends[0][2] + rise * (before + arc)
    first, second = ((*contact, height) for contact, height in zip(contacts, heights, strict=True))
    return touches, (first, second), algebra.call(Op.SQRT, arc * arc * (1.0 + rise * rise))


def _around_circle(algebra: Algebra, ends: Sequence[Plane], side: Plane | None, radius: Scalar) -> _Contacts:
    """Return whether a path wraps around a circle about the origin (1 or 0), the two points of contact, and the arc, m.

    The path does not cross the ray from the centre away from the side, or else goes the shorter way: so if the straight
    line crosses the ray, the path goes the longer way, and otherwise wraps if the straight line meets the circle.
    Numbers of a path that does not wrap are finite and have no meaning.

    Parameters
    ----------
    ends : of the path
    side : direction from the centre; None for the shorter way
    """
    (ax, ay), (bx, by) = ends
    squares = [x * x + y * y for x, y in ends]
    outside = _less(algebra, radius * radius, squares[0]) * _less(algebra, radius * radius, squares[1])
    squares = [algebra.select(outside, square, 2.0 * radius * radius) for square in squares]
    long_way = algebra.zero if side is None else _crosses_ray(algebra, ends, (-side[0], -side[1]))
    sense = _less(algebra, ax * by, ay * bx)  # clockwise is the shorter way
    clockwise = algebra.select(long_way, 1.0 - sense, sense)
    turn = 2.0 * clockwise - 1.0
    contacts = []
    for (x, y), square, way in zip(ends, squares, (turn, -turn), strict=True):
        root = algebra.call(Op.SQRT, square - radius * radius)
        factor = radius / square
        contacts.append((factor * (radius * x + way * (root * y)), factor * (radius * y - way * (root * x))))
    touches = outside * algebra.call(Op.MAX, long_way, _meets_circle(algebra, ends, radius))
    both = contacts[0], contacts[1]
    return touches, both, radius * _angle(algebra, both, turn)


def _through_ring(algebra: Algebra, ends: Sequence[Plane], radius: Scalar) -> _Contacts:
    """Return whether a path through a ring about the origin touches the ring (1 or 0), the point of contact twice, and
    0.

    The lines from both ends make the angle x with the radius at the point of contact, and by the law of sines the
    angles a and b with the directions of the ends, sin a = radius / distance sin x; g = a + b - 2 x + G = 0 with the
    angle G between the directions. g is concave and falls, so that Newton's method from x = pi / 2 does not overshoot.
    """
    (ax, ay), (bx, by) = ends
    squares = [x * x + y * y for x, y in ends]
    outside = _less(algebra, radius * radius, squares[0]) * _less(algebra, radius * radius, squares[1])
    shares = [
        radius / algebra.call(Op.SQRT, algebra.select(outside, square, 4.0 * radius * radius)) for square in squares
    ]
    turn = ax * by - ay * bx
    between = algebra.call(Op.ATAN2, algebra.call(Op.ABS, turn), ax * bx + ay * by)
    touches = outside * (1.0 - _meets_circle(algebra, ends, radius))
    between = algebra.select(touches, between, algebra.one)
    x = algebra.scalar(0.5 * math.pi)
    for _ in range(8):  # the last step is below rounding
        sine, cosine = algebra.call(Op.SIN, x), algebra.call(Op.COS, x)
        value, slope = between - 2.0 * x, algebra.scalar(-2.0)
        for share in shares:
            part = share * sine
            value = value + algebra.call(Op.ASIN, part)
            slope = slope + share * cosine / algebra.call(Op.SQRT, 1.0 - part * part)
        x = x - value / slope
    angle = algebra.call(Op.SIGN, turn) * (x - algebra.call(Op.ASIN, shares[0] * algebra.call(Op.SIN, x)))
    cosine, sine = algebra.call(Op.COS, angle), algebra.call(Op.SIN, angle)
    contact = shares[0] * (cosine * ax - sine * ay), shares[0] * (sine * ax + cosine * ay)
    return touches, (contact, contact), algebra.zero


def _crosses_ray(algebra: Algebra, ends: Sequence[Plane], ray: Plane) -> Scalar:
    """Return 1 if the straight line between two points crosses a ray from the origin, else 0; all in the plane."""
    first, second = (ray[0] * y - ray[1] * x for x, y in ends)
    along_first, along_second = (ray[0] * x + ray[1] * y for x, y in ends)
    opposite = _less(algebra, first * second, algebra.zero)
    before = _less(algebra, algebra.zero, (first * along_second - second * along_first) * (first - second))
    return opposite * before


def _meets_circle(algebra: Algebra, ends: Sequence[Plane], radius: Scalar) -> Scalar:
    """Return 1 if the straight line between two points meets the circle about the origin, else 0."""
    (ax, ay), (bx, by) = ends
    dx, dy = bx - ax, by - ay
    square = dx * dx + dy * dy
    some = _less(algebra, algebra.zero, square)
    share = -(dx * ax + dy * ay) / algebra.select(some, square, algebra.one)
    share = algebra.call(Op.MAX, algebra.zero, algebra.call(Op.MIN, algebra.one, share))
    x, y = ax + share * dx, ay + share * dy
    return some * algebra.call(Op.LE, x * x + y * y, radius * radius)


def _angle(algebra: Algebra, contacts: tuple[Plane, Plane], turn: Scalar) -> Scalar:
    """Return the angle of the arc between two points of contact, 0 to 2 pi; ``turn`` is 1 for clockwise, or -1."""
    (ax, ay), (bx, by) = contacts
    turned = algebra.call(Op.ATAN2, turn * (ay * bx - ax * by), ax * bx + ay * by)
    return algebra.select(_less(algebra, turned, algebra.zero), turned + 2.0 * math.pi, turned)


def _less(algebra: Algebra, x: Scalar, y: Scalar) -> Scalar:
    return algebra.call(Op.LT, x, y)


def _length(algebra: Algebra, x: Plane) -> Scalar:
    """Return the length of a vector in the plane, 1 for the zero vector, whose direction has no meaning."""
    square = x[0] * x[0] + x[1] * x[1]
    return algebra.call(Op.SQRT, algebra.select(_less(algebra, algebra.zero, square), square, algebra.one))


def _distance(algebra: Algebra, x: Plane, y: Plane) -> Scalar:
    return _length(algebra, (x[0] - y[0], x[1] - y[1]))


def _unit(algebra: Algebra, x: Vector) -> Vector:
    return scaled(algebra.one / algebra.length(x), x)


def _choice(algebra: Algebra, condition: Scalar, then: Vector, otherwise: Vector) -> Vector:
    x, y, z = (algebra.select(condition, first, second) for first, second in zip(then, otherwise, strict=True))
    return x, y, z


def tension(quantities: Quantities, tendon: Tendon) -> Scalar:
    """Return the tension of a tendon, N: spring, damper and actuator together."""
    return _tension(quantities, tendon, _path(quantities, tendon))


def _tension(quantities: Quantities, tendon: Tendon, path: _Path) -> Scalar:
    elastic = quantities.formula(tendon.stiffness) * (path.length - quantities.formula(tendon.length))
    return elastic + quantities.formula(tendon.damping) * path.rate + quantities.formula(tendon.force)


def add_tendon(loads: Loads, tendon: Tendon, quantities: Quantities) -> None:
    """Add to ``loads``, in place, the tension on all points of a path, the potential of the spring, and the power of
    damper and actuator. A tendon between base and world adds none."""
    path = _path(quantities, tendon)
    if all(point.link < 0 for start, end, _ in path.lines for point in (start, end)):
        return  # between base and world: strained by the prescribed motion of the base
    force = _tension(quantities, tendon, path)
    for quantity, value in (("length", path.length), ("rate", path.rate), ("tension", force)):
        value.tape.name(value.ref, f"path_{quantity}_{tendon.name}")
    for start, end, direction in path.lines:
        pull = scaled(force, direction)
        for point, far, load in ((start, end, pull), (end, start, negative(pull))):
            _push(loads, quantities, point, load, external=far.body == WORLD_NAME)
    extension = path.length - quantities.formula(tendon.length)
    loads.potential = loads.potential + 0.5 * (quantities.formula(tendon.stiffness) * (extension * extension))
    dissipative = quantities.formula(tendon.damping) * path.rate + quantities.formula(tendon.force)
    loads.power = loads.power - dissipative * path.rate


def _push(loads: Loads, quantities: Quantities, point: _PathPoint, force: Vector, *, external: bool) -> None:
    """Add a force through a point, N, in base axes, to the wrench on the point's link; ``external``: the world exerts
    the force."""
    if point.link < 0:
        return
    R, origin = quantities.kinematics.pose(point.link)
    back = transpose(R)
    force = apply(back, force)
    wrench = cross(apply(back, minus(point.position, origin)), force), force
    add_wrench(loads.wrenches, point.link, wrench)
    if external:
        add_wrench(loads.external, point.link, wrench)


#: Quantities of tendons in formulas.
_QUANTITIES = {
    "path_length": lambda quantities, tendon: _path(quantities, tendon).length,
    "path_rate": lambda quantities, tendon: _path(quantities, tendon).rate,
    "path_tension": tension,
}
LAW = Law(Tendon, add_tendon, _QUANTITIES, before_joints=True)
