"""Schema of force elements: springs, forces, efforts, joint stops and dry friction, bushings, tyres."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from eomgen.scene.formula.scope import FIXED_PARAMETERS, PARAMETERS, ROAD, SPRING_FORCE, STATE
from eomgen.scene.joint_types import by_component
from eomgen.scene.joints.frame_schema import Frame
from eomgen.scene.reading.keys import Table, key
from eomgen.scene.reading.kinds import SixBySix, Triple, Value, Values
from eomgen.scene.reading.rotation_schema import Rotations

_ZEROS = (0.0, 0.0, 0.0)
_NOTHING = "`[0, 0, 0]`"


class Bushing(Table):
    """A spring and damper in all six directions between two frames."""

    first: Frame = key("a frame in one body", kind="frame, see [constraints](#constraints)")
    second: Frame = key("a frame in another", kind="frame, see [constraints](#constraints)")
    stiffness: Triple | None = key(
        "along x, y, z of the first frame", None, unit="N/m", names=PARAMETERS, shown_default=_NOTHING
    )
    damping: Triple | None = key("along x, y, z", None, unit="N s/m", names=PARAMETERS, shown_default=_NOTHING)
    rotational_stiffness: Triple | None = key(
        "about x, y, z of the first frame", None, unit="N m/rad", names=PARAMETERS, shown_default=_NOTHING
    )
    rotational_damping: Triple | None = key("about x, y, z", None, unit="N m s/rad", names=PARAMETERS, shown_default=_NOTHING)
    stiffness_matrix: SixBySix | None = key("symmetric, rotations first, in place of both stiffnesses", None, kind="6x6 numbers")
    damping_matrix: SixBySix | None = key("rotations first, in place of both dampings", None, kind="6x6 numbers")
    rest: Triple = key("origin of the second frame in the first where the springs are slack", _ZEROS, unit="m", names=PARAMETERS)
    rest_rotation: Rotations = key("axes of the second frame in the first then, by angles of fixed parameters", ())
    preload: Triple = key("force on the second frame then, in the first one's axes", _ZEROS, unit="N", names=PARAMETERS)
    rotational_preload: Triple = key("moment on the second frame then", _ZEROS, unit="N m", names=PARAMETERS)


class Slip(Table):
    """Forces of a tyre in the plane of the road."""

    axis: Triple = key(
        "of the wheel's spin, in the axes of the centre's body; any length", (0.0, 1.0, 0.0), names=FIXED_PARAMETERS
    )
    stiffness: Values = key("force per slip and load; two values: longitudinal, lateral", names=PARAMETERS)
    friction: Value = key("largest force per load", 1.0, names=PARAMETERS)
    velocity: Value = key("added in squares to the rolling speed, for wheels at rest", 0.1, unit="m/s", names=PARAMETERS)


class Tyre(Table):
    """A point contact between a wheel and the road, which can lift off."""

    center: str = key("centre of the wheel", refers="points")
    radius: Value = key("of the wheel without load", unit="m", names=PARAMETERS)
    stiffness: Value = key("vertical", unit="N/m", names=PARAMETERS)
    damping: Value = key("vertical", 0.0, unit="N s/m", names=PARAMETERS)
    onset: Value = key("deflection over which the tyre reaches its full stiffness", 1e-3, unit="m", names=PARAMETERS)
    road: Value = key("height of the road under the centre, in the world", 0.0, unit="m", names=ROAD)
    road_rate: Value | None = key(
        "its rate from time and inputs; needed with `damping` where the road has an input", None, unit="m/s", names=ROAD
    )
    slip: Slip | None = key("forces in the plane of the road", None, kind="table, below")


class Spring(Table):
    """A spring, damper or actuator along the line between two points."""

    first: str = key("one end", refers="points")
    second: str = key("the other end", refers="points")
    stiffness: Value = key("tension by length beyond `length`", 0.0, unit="N/m", names=PARAMETERS)
    damping: Value = key("tension by rate of length", 0.0, unit="N s/m", names=PARAMETERS)
    length: Value = key("length at which the spring is slack", 0.0, unit="m", names=PARAMETERS)
    force: Value = key("an actuator in parallel", 0.0, unit="N", names=SPRING_FORCE)


class TorsionSpring(Table):
    """A spring and damper between the angles of two joints."""

    first: str = key("one angle", refers="joints", kind="joint that has an angle")
    second: str = key("the other angle", "", refers="joints", kind="joint that has an angle", shown_default='`""`, none')
    stiffness: Value = key("effort by angle", 0.0, unit="N m/rad", names=PARAMETERS)
    damping: Value = key("effort by rate", 0.0, unit="N m s/rad", names=PARAMETERS)
    rest: Value = key("difference of the angles at which the spring is slack", 0.0, unit="rad", names=PARAMETERS)
    first_index: int = key("of the angle where a joint has two, as a universal one", 0, ge=0, le=1)
    second_index: int = key("the same of the second", 0, ge=0, le=1)


class Force(Table):
    """A force and a torque on a body."""

    body: str = key("what they act on", refers="bodies", kind="body, not the base")
    point: Triple = key("where the force acts, in the body's frame", _ZEROS, unit="m", names=PARAMETERS)
    force: Triple = key("through the point", _ZEROS, unit="N", names=STATE)
    torque: Triple = key("beside the force's own moment", _ZEROS, unit="N m", names=STATE)
    axes: Literal["world", "body"] = key("axes of force and torque", "world")


class Effort(Table):
    """A generalized force on one component of a joint."""

    joint: str = key("what it drives", refers="joints")
    effort: Value = key(
        "positive drives the coordinate up",
        unit=by_component("N m", "N"),
        names=STATE,
    )
    index: Annotated[int, Field(ge=0, le=5)] = key(
        "component of the joint's velocity, angular ones first", 0
    )
