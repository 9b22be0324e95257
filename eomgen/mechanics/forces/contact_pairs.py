"""Contact of a body of a simple shape with a plane or a surface z = h(x, y), for constraints and force elements."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from eomgen.base.data import dataclass
from eomgen.formula.nodes import Formula, Symbol
from eomgen.formula.recording import record
from eomgen.mechanics.forces.frame_pairs import FramePair
from eomgen.mechanics.forces.symbols import DetachedSymbols, Quantities
from eomgen.mechanics.kinematics.directions import block_directions
from eomgen.symbolic.calculus.partials import forward_partials
from eomgen.symbolic.map import splice
from eomgen.symbolic.operations import InputSymbol, Op
from eomgen.symbolic.scalar import Algebra, Matrix, Scalar, Vector, apply, cross, dot, minus, plus, scaled, transpose
from eomgen.symbolic.tape import ONE, ZERO, Ref, Tape

#: Block of the place and the pose on the separate tape.
_MOTION = "motion"


class TouchingBody(Protocol):
    """Shape of the body that the second frame carries, and the surface of the first frame, as a ``Constraint`` has
    both: z = ``surface`` of x and y, or the plane for None."""

    @property
    def shape(self) -> str: ...
    @property
    def radius(self) -> Formula: ...
    @property
    def tube_radius(self) -> Formula: ...
    @property
    def semi_axes(self) -> tuple[Formula, Formula, Formula]: ...
    @property
    def surface(self) -> Formula | None: ...


@dataclass(frozen=True)
class BodyContact:
    """Contact of a body with a surface, in the axes of the pair: ``point`` on the body, surface ``tangents`` and
    normal, and ``height`` (m) of the point above the surface along the normal."""

    point: Vector
    tangents: tuple[Vector, Vector]
    height: Scalar

    @property
    def normal(self) -> Vector:
        return cross(*self.tangents)


def body_contact(quantities: Quantities, item: TouchingBody, pair: FramePair) -> BodyContact:
    """Return the contact of a rolling or sliding body with ``item.surface``, else the first frame's x-y plane."""
    if item.surface is not None:
        return _contact_with_surface(quantities, item, pair)
    normal = pair.first.axis(2)
    point = LOWEST[item.shape](quantities, item, _Pose(normal, pair.second.origin, pair.second.axes))
    height = dot(minus(point, pair.first.origin), normal)
    return BodyContact(point, (pair.first.axis(0), pair.first.axis(1)), height)


@dataclass(frozen=True)
class _Pose:
    """Place of a body at which its lowest point along a unit ``normal`` is asked for: ``origin``, the centre, (3,), m,
    and ``axes``, (3, 3), by columns."""

    normal: Vector
    origin: Vector
    axes: Matrix


def _lowest_of_sphere(quantities: Quantities, item: TouchingBody, at: _Pose) -> Vector:
    return minus(at.origin, scaled(quantities.formula(item.radius), at.normal))


def _lowest_of_disc(quantities: Quantities, item: TouchingBody, at: _Pose) -> Vector:
    axis = (at.axes[0][2], at.axes[1][2], at.axes[2][2])
    radius = quantities.formula(item.radius)
    down = minus(at.normal, scaled(dot(at.normal, axis), axis))
    return minus(at.origin, scaled(radius / quantities.algebra.length(down), down))


def _lowest_of_torus(quantities: Quantities, item: TouchingBody, at: _Pose) -> Vector:
    return minus(_lowest_of_disc(quantities, item, at), scaled(quantities.formula(item.tube_radius), at.normal))


def _lowest_of_ellipsoid(quantities: Quantities, item: TouchingBody, at: _Pose) -> Vector:
    """Return -D n / sqrt(n . D n) in the axes of the ellipsoid, with the squares D of its semi-axes."""
    algebra, direction = quantities.algebra, apply(transpose(at.axes), at.normal)
    x, y, z = (a * a * n for a, n in zip(quantities.vector(item.semi_axes), direction, strict=True))
    reach = algebra.call(Op.SQRT, dot((x, y, z), direction))
    return minus(at.origin, scaled(algebra.one / reach, apply(at.axes, (x, y, z))))


#: The point of a body that is lowest along the normal, (3,), m, by shape; there the normal of the body is the normal of
#: the surface. A disc and a torus are about the z axis; a point is a sphere without radius.
LOWEST: dict[str, Callable[[Quantities, TouchingBody, _Pose], Vector]] = {
    "point": _lowest_of_sphere,
    "sphere": _lowest_of_sphere,
    "disc": _lowest_of_disc,
    "torus": _lowest_of_torus,
    "ellipsoid": _lowest_of_ellipsoid,
}
#: Shapes without axes.
ROUND = ("point", "sphere")


def _contact_with_surface(quantities: Quantities, item: TouchingBody, pair: FramePair) -> BodyContact:
    """Return the contact of a body with a surface z = h(x, y) in the first frame.

    The place (x, y) of the contact is the place whose normal leads to the body's lowest point along this normal. A
    fixed number of steps of Newton's method, from the place below the centre, is recorded on the tape. If the steps do
    not converge, or converge to a place in a valley narrower than the body, the height is not a number.
    """
    step, residual, final = _surface_functions(quantities, item)
    algebra, tape, axes = quantities.algebra, quantities.algebra.tape, pair.first.axes
    pose = list(apply(transpose(axes), minus(pair.second.origin, pair.first.origin)))
    if item.shape not in ROUND:
        pose += [dot(pair.first.axis(row), pair.second.axis(column)) for row in range(3) for column in range(3)]
    contact, conditions, first_node = pose[:2], list[Scalar](), len(tape.op)
    before, after = (3, 3) if item.shape in ROUND else (5, 4)  # the curvature of other shapes varies
    inverse = minors = list[Scalar]()
    for number in range(before + after):
        x, y, off, *inverse = _call(tape, step, [*contact, *pose])
        contact, inverse, minors = [x, y], inverse[:4], inverse[4:]
        if number == before:
            size = 0.01 * _curved_size(quantities, item)  # the steps after the check square this to round-off
            conditions.append(size * size - off)
    unit = touches = algebra.one
    for condition in (*conditions, *minors):
        if condition.constant is None:
            missed = algebra.call(Op.SQRT, -unit - condition * condition)
            touches = touches * algebra.select(algebra.call(Op.LT, algebra.zero, condition), unit, missed)
    results = [abs(value.ref) for value in (*contact, *inverse, touches)]
    tape.converged |= {node for node in results if node >= first_node}
    for _ in range(3):  # with one matrix; each has derivatives of the place to an order more, and Phi and B need three
        off_x, off_y = _call(tape, residual, [*contact, *pose])
        x, y = (inverse[k] * off_x + inverse[k + 1] * off_y for k in (0, 2))
        contact = [contact[0] - x, contact[1] - y]
    height, *parts = _call(tape, final, [*contact, *pose])
    point, first, second = (apply(axes, (parts[k], parts[k + 1], parts[k + 2])) for k in (0, 3, 6))
    return BodyContact(plus(pair.first.origin, point), (first, second), touches * height)


#: Results of a function on a tape of its own.
_Function = tuple[Tape, list[Ref]]


def _call(tape: Tape, refs: _Function, arguments: Sequence[Scalar]) -> list[Scalar]:
    """Record a function from another tape on ``tape``, and return its values for the given arguments."""
    source, values = refs
    bound = {InputSymbol(_MOTION, number): argument.ref for number, argument in enumerate(arguments)}
    return [Scalar(tape, ref) for ref in splice(tape, source, values, bound)]


def _surface_functions(quantities: Quantities, item: TouchingBody) -> tuple[_Function, _Function, _Function]:
    """Return three functions of a place (x, y) and a body's pose in the first frame, on a separate tape: the centre,
    and the axes of shapes other than spheres.

    The first gives the next place by Newton's method, the square of the residual, m^2, the inverse of the residual's
    partials, and two numbers that are positive if body and surface touch at one point; the second the residual, m; the
    third the height, and point and tangents of the contact.
    """
    assert item.surface is not None  # asked for by the caller
    tape = Tape()
    count = 5 if item.shape in ROUND else 14
    x, y, *pose = (Scalar(tape, tape.input(_MOTION, number)) for number in range(count))
    detached, h = _height(quantities, item.surface, tape)
    algebra = detached.algebra
    ((hx, hy),) = _partials(algebra, [h])
    normal, origin = _unit(algebra, (-hx, -hy, algebra.one)), (pose[0], pose[1], pose[2])
    rows = [(pose[k], pose[k + 1], pose[k + 2]) for k in (3, 6, 9)] if item.shape not in ROUND else []
    axes = (rows[0], rows[1], rows[2]) if rows else algebra.identity
    point = LOWEST[item.shape](detached, item, _Pose(normal, origin, axes))
    # of a sphere the radius is along the normal, and has no part along the surface
    gap = minus((x, y, h), origin if item.shape in ROUND else point)
    off = (gap[0] + gap[2] * hx, gap[1] + gap[2] * hy)
    (a, b), (c, d) = _partials(algebra, off)
    minor = a * d - b * c
    inverse = [d / minor, -b / minor, -c / minor, a / minor]
    moved = [x - (d * off[0] - b * off[1]) / minor, y - (a * off[1] - c * off[0]) / minor]
    # 1 + R S, of the body's radii of curvature R and the surface's curvatures S, has positive eigenvalues
    trace = a if item.shape in ROUND else a * (1 + hy * hy) - (b + c) * hx * hy + d * (1 + hx * hx)
    height = dot(normal, minus(point, (x, y, h)))
    tangent = _unit(algebra, (algebra.one, algebra.zero, hx))
    outputs = [height, *point, *tangent, *cross(normal, tangent)]
    step = [*moved, dot(off, off), *inverse, trace, minor]
    by_step, by_residual, by_final = ([value.ref for value in values] for values in (step, off, outputs))
    return (tape, by_step), (tape, by_residual), (tape, by_final)


def _height(quantities: Quantities, surface: Formula, tape: Tape) -> tuple[DetachedSymbols, Scalar]:
    """Return the quantities of a scene on a separate tape, and the height of a surface there, of the inputs x and y."""
    detached = DetachedSymbols(quantities, tape)

    def resolve(symbol: Symbol) -> Scalar:
        return Scalar(tape, tape.input(_MOTION, symbol.index)) if symbol.kind == "local" else detached(symbol)

    return detached, record(detached.algebra, surface, resolve)


def surface_at(quantities: Quantities, surface: Formula, x: Scalar, y: Scalar) -> list[Scalar]:
    """Return the height of a surface, m, at a place of the first frame, and its partials in x, in y, and explicitly in
    time. The partials are taken on a separate tape, on which x and y are independent."""
    tape = Tape()
    _, h = _height(quantities, surface, tape)
    seeds = block_directions(_MOTION, 2) | {InputSymbol("t", 0): {2: ONE}}
    (tangent,) = forward_partials(tape, [h.ref], seeds)
    return _call(quantities.algebra.tape, (tape, [h.ref, *(tangent.get(k, ZERO) for k in range(3))]), [x, y])


def _partials(algebra: Algebra, values: Sequence[Scalar]) -> list[tuple[Scalar, Scalar]]:
    """Return the partials of values in x and y, the first two inputs of a surface's functions."""
    tangents = forward_partials(algebra.tape, [value.ref for value in values], block_directions(_MOTION, 2))
    x, y = ([Scalar(algebra.tape, tangent.get(k, ZERO)) for tangent in tangents] for k in range(2))
    return list(zip(x, y, strict=True))


def _unit(algebra: Algebra, vector: Vector) -> Vector:
    return scaled(algebra.one / algebra.length(vector), vector)


def _curved_size(quantities: Quantities, item: TouchingBody) -> Scalar:
    """Return the mean semi-axis of an ellipsoid, m, or the radius of a body of another shape; 0.1 m for a point."""
    if item.shape != "ellipsoid":
        radius = quantities.formula(item.radius)
        return quantities.algebra.scalar(0.1) if radius.is_zero else radius
    x, y, z = quantities.vector(item.semi_axes)
    return (x + y + z) * (1 / 3)
