"""The law of drags, and the speed of winds, on the tape."""

from __future__ import annotations

from collections.abc import Sequence

from eomgen.extending import (
    Algebra,
    Law,
    Loads,
    Op,
    Quantities,
    Scalar,
    Vector,
    apply,
    dot,
    minus,
    push,
    scaled,
    transpose,
)
from tests.models.drags_for_eomgen import Drag, Wind


def _velocities(quantities: Quantities, drag: Drag) -> tuple[Vector, Vector, Scalar]:
    """Return the velocity of the point and its velocity relative to the wind, in world axes, and the relative speed."""
    velocity = quantities.kinematics.velocity(*quantities.at(quantities.points[drag.point]))
    relative = minus(velocity, quantities.vector(drag.wind))
    return velocity, relative, quantities.algebra.call(Op.SQRT, dot(relative, relative))


def _size(quantities: Quantities, drag: Drag) -> Scalar:
    _, relative, _ = _velocities(quantities, drag)
    return quantities.formula(drag.coefficient) * dot(relative, relative)


def add_drag(loads: Loads, drag: Drag, quantities: Quantities) -> None:
    """Add the force of a drag and its power."""
    velocity, relative, speed = _velocities(quantities, drag)
    force = scaled(-(quantities.formula(drag.coefficient) * speed), relative)
    loads.power = loads.power + dot(force, velocity)
    in_base = apply(transpose(quantities.kinematics.base.orientation), force)
    push(loads.wrenches, quantities, drag.point, in_base)
    push(loads.external, quantities, drag.point, in_base)


LAW = Law(Drag, add_drag, {"drag": _size})


def wind_speed(algebra: Algebra, wind: Wind, word: str, component: int, arguments: Sequence[Scalar]) -> Scalar:
    """Return the speed of a wind at a height and a time."""
    z, t = arguments
    grown = 1.0 - algebra.call(Op.EXP, t * (-1.0 / wind.time))
    height = algebra.call(Op.MAX, z, algebra.zero)
    return (wind.speed / 10.0**wind.exponent) * grown * algebra.call(Op.POW, height, algebra.scalar(wind.exponent))
