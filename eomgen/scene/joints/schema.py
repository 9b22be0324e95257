"""Schema of joints with their initial state, and of loop-closing constraints."""

from __future__ import annotations

from typing import Literal

from eomgen.scene.formula.scope import FIXED_PARAMETERS, PARAMETERS, TIME
from eomgen.scene.joint_types import (
    CONSTRAINTS,
    DRIVE_UNITS,
    JOINTS,
    ConstraintType,
    JointType,
    by_component,
    by_coordinate,
)
from eomgen.scene.joints.frame_schema import Frame
from eomgen.scene.reading.keys import Table, key
from eomgen.scene.reading.kinds import Bounds, Matrix, Triple, Value, Values
from eomgen.scene.reading.rotation_schema import Rotations

_OF_RANGE = "value or list of values of parameters, rad or m"
_LIMITED = by_coordinate("rad", "m")
_RATE, _EFFORT = by_coordinate("rad/s", "m/s"), by_coordinate("N m", "N")


class Limits(Table):
    """Compliant stops of a joint's coordinates."""

    lower: Bounds | None = key(
        "lower end of the range; -inf for none", None, unit=_LIMITED, names=PARAMETERS, kind=_OF_RANGE
    )
    upper: Bounds | None = key(
        "upper end of the range; inf for none", None, unit=_LIMITED, names=PARAMETERS, kind=_OF_RANGE
    )
    stiffness: Values = key("of the stop", unit=by_coordinate("N m/rad", "N/m"), names=PARAMETERS)
    damping: Values | None = key(
        "of the stop", None, unit=by_coordinate("N m s/rad", "N s/m"), names=PARAMETERS, shown_default="`0`"
    )
    onset: Values | None = key(
        "penetration over which the stop reaches its full stiffness",
        None,
        unit=_LIMITED,
        names=PARAMETERS,
        shown_default="1e-3 rad, 1e-4 m",
    )


class Friction(Table):
    """Dry friction of a joint's coordinates."""

    coulomb: Values = key("level of the friction", unit=_EFFORT, names=PARAMETERS)
    velocity: Values = key(
        "regularisation: well below this speed the joint counts as sticking", unit=_RATE, names=PARAMETERS
    )
    static: Values | None = key("level at which it breaks loose; with `stribeck`", None, unit=_EFFORT, names=PARAMETERS)
    stribeck: Values | None = key(
        "speed over which the static level falls to Coulomb's, above `velocity`", None, unit=_RATE, names=PARAMETERS
    )


_ORIGIN = (0.0, 0.0, 0.0)
_POSITION = by_coordinate("rad", "m") | {name: "m" for name, row in JOINTS.items() if row.group == "SE3"}


class Initial(Table):
    """The state of a joint at the start."""

    position: Values | None = key(
        "the coordinates, angles first; spherical: quaternion, 4 values; free: position of the child's frame, 3 values",
        None,
        unit=_POSITION,
        names=FIXED_PARAMETERS,
        shown_default="zeros",
    )
    orientation: Values | None = key(
        "free: quaternion, 4 values",
        None,
        names=FIXED_PARAMETERS,
        kind="4 values of fixed parameters",
        shown_default="not turned",
    )
    rotation: Rotations | None = key("spherical, free: in place of a quaternion", None)
    velocity: Values | None = key(
        "1 to 3, or 6 values; angular first, body axes where the joint is spherical or free",
        None,
        unit=by_component("rad/s", "m/s"),
        names=FIXED_PARAMETERS,
        shown_default="zeros",
    )


class Mimic(Table):
    """A coordinate that follows another: multiplier q_leader + offset."""

    joint: str = key("the leader, with one coordinate; it may follow another in its turn", refers="joints")
    multiplier: Value = key("coordinate per coordinate of the leader", 1.0, names=PARAMETERS)
    offset: Value = key("coordinate where the leader's is zero", 0.0, unit=by_coordinate("rad", "m"), names=PARAMETERS)


class Joint(Table):
    """What carries a body, and lets it move against its parent."""

    type: JointType = key("how the child moves against the parent")
    parent: str = key("where it hangs", refers="bodies", kind="body, or `base`")
    child: str = key("the body that this joint carries", refers="bodies")
    position: Triple = key("origin of the child's frame in the parent's frame", _ORIGIN, unit="m", names=PARAMETERS)
    rotation: Rotations | None = key(
        "axes of the child in the parent, angles of fixed parameters", None, shown_default="`[]`"
    )
    orientation: Matrix | None = key("the same as a matrix, child axes to parent axes; either this or `rotation`", None)
    axis: Triple | None = key(
        "in the child's axes; any length; the normal of a planar joint, the first axis of a universal one",
        None,
        names=FIXED_PARAMETERS,
        shown_default="required, but for fixed, spherical and free",
    )
    second_axis: Triple | None = key(
        "of a universal joint: the second axis, across the first, in the child's axes",
        None,
        names=FIXED_PARAMETERS,
        shown_default="required for universal",
    )
    x_axis: Triple | None = key(
        "of a planar joint: x is along the part of it in the plane, y to the left of x",
        None,
        names=FIXED_PARAMETERS,
        shown_default="coordinate axis farthest from `axis`",
    )
    pitch: Value | None = key(
        "of a helical joint: travel per radian; negative is left-handed",
        None,
        unit="m/rad",
        names=PARAMETERS,
        shown_default="required for helical",
    )
    stiffness: Values | None = key(
        "of a spring in the joint",
        None,
        unit=by_coordinate("N m/rad", "N/m"),
        names=PARAMETERS,
        shown_default="`0`",
    )
    damping: Values | None = key(
        "of a damper in the joint",
        None,
        unit=by_coordinate("N m s/rad", "N s/m"),
        names=PARAMETERS,
        shown_default="`0`",
    )
    rest: Values | None = key(
        "coordinate at which the spring is slack",
        None,
        unit=by_coordinate("rad", "m"),
        names=PARAMETERS,
        shown_default="`0`",
    )
    rotor_inertia: Values | None = key(
        "added to this joint's diagonal of M (a motor behind a gear)",
        None,
        unit=by_coordinate("kg m^2", "kg"),
        names=PARAMETERS,
        shown_default="`0`",
    )
    limits: Limits | None = key("compliant stops", None, kind="table, below")
    friction: Friction | None = key("dry friction", None, kind="table, below")
    mimic: Mimic | None = key("what the coordinate follows, in place of being free", None, kind="table, below")
    initial: Initial = key("state at the start", Initial(), shown_default="zeros")


class Constraint(Table):
    """What closes a loop between two frames."""

    type: ConstraintType = key("what it holds", kind="see below")
    first: Frame = key("a frame in one body", kind="frame, below")
    second: Frame = key("a frame in another, that can move against the first", kind="frame, below")
    drive: Value | None = key(
        "prescribes the angle of `revolute`, or the travel of `prismatic` and `cylindrical`",
        None,
        unit={name: DRIVE_UNITS[row.drive] for name, row in CONSTRAINTS.items() if row.drive},
        names=TIME,
    )
    length: Value | None = key(
        "between the origins", None, unit="m", names=PARAMETERS, shown_default="required for `distance`"
    )
    radius: Value | None = key(
        "of the disc or sphere", None, unit="m", names=PARAMETERS, shown_default="required for `rolling`"
    )
    shape: Literal["disc", "sphere"] | None = key("for `rolling`", None, shown_default="`disc`")
    pitch: Value | None = key(
        "travel per radian", None, unit="m/rad", names=PARAMETERS, shown_default="required for `helical`"
    )
