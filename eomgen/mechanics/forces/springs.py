"""Springs, dampers and actuators along the line between two points."""

from __future__ import annotations

from eomgen.errors import ModelError, Problem
from eomgen.mechanics.forces.loads import Law, Loads, push
from eomgen.mechanics.forces.spring_loops import add_loops
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.mechanics.tree.links import WORLD_NAME
from eomgen.scene.forces.springs import Spring
from eomgen.symbolic.operations import Op
from eomgen.symbolic.scalar import Scalar, Vector, dot, minus, negative, scaled


def stretch(quantities: Quantities, spring: Spring) -> tuple[Scalar, Scalar, Vector]:
    """Return length, m, rate of length, m/s, and unit vector from first to second point, (3,), in base axes."""
    first, second = quantities.at(quantities.points[spring.first]), quantities.at(quantities.points[spring.second])
    span = minus(quantities.kinematics.position_in_base(*second), quantities.kinematics.position_in_base(*first))
    speed = minus(quantities.kinematics.velocity_in_base(*second), quantities.kinematics.velocity_in_base(*first))
    length = quantities.algebra.call(Op.SQRT, dot(span, span))
    if length.is_zero:
        fault = f"the points {spring.first} and {spring.second} coincide for all coordinates, so it has no direction"
        raise ModelError(Problem(f"spring {spring.name}", fault, "points that can move apart, or a torsion spring"))
    direction = scaled(quantities.algebra.one / length, span)
    return length, dot(direction, speed), direction


def tension(quantities: Quantities, spring: Spring) -> Scalar:
    """Return spring, damper and actuator together."""
    length, rate, _ = stretch(quantities, spring)
    elastic = quantities.formula(spring.stiffness) * (length - quantities.formula(spring.length))
    return elastic + quantities.formula(spring.damping) * rate + quantities.formula(spring.force)


def add_spring(loads: Loads, spring: Spring, quantities: Quantities) -> None:
    """Add the tension on both ends, the potential of the spring, and the power of damper and actuator."""
    mounts = quantities.tree.mounts
    if all(mounts[quantities.points[name].body].link < 0 for name in (spring.first, spring.second)):
        return  # between base and world: whoever moves the base strains it
    length, rate, direction = stretch(quantities, spring)
    force = tension(quantities, spring)
    for quantity, value in (("length", length), ("rate", rate), ("tension", force)):
        value.tape.name(value.ref, f"{quantity}_{spring.name}")
    pull = scaled(force, direction)
    ends = ((spring.first, spring.second, pull), (spring.second, spring.first, negative(pull)))
    for name, other, end_force in ends:
        push(loads.wrenches, quantities, name, end_force)
        if quantities.points[other].body == WORLD_NAME:
            push(loads.external, quantities, name, end_force)
    extension = length - quantities.formula(spring.length)
    loads.potential = loads.potential + 0.5 * (quantities.formula(spring.stiffness) * (extension * extension))
    dissipative = quantities.formula(spring.damping) * rate + quantities.formula(spring.force)
    loads.power = loads.power - dissipative * rate


def _length(quantities: Quantities, spring: Spring) -> Scalar:
    return stretch(quantities, spring)[0]


def _rate(quantities: Quantities, spring: Spring) -> Scalar:
    return stretch(quantities, spring)[1]


LAW = Law(Spring, add_spring, {"length": _length, "rate": _rate, "tension": tension}, add_loops, before_joints=True)
