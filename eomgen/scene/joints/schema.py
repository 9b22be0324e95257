"""Schema of joints with initial states."""

from __future__ import annotations

from typing import Any

from pydantic import ValidatorFunctionWrapHandler, field_validator

from eomgen.scene.formula.scope import PARAMETERS, TIME
from eomgen.scene.joint_types import (
    JOINTS,
    JointType,
    by_component,
    by_coordinate,
)
from eomgen.scene.joints.model import ONSETS
from eomgen.scene.reading.key_metadata import (
    Table,
    given_in,
    key,
    of_fixed_parameters,
    of_parameters,
    optional,
    shown_power,
)
from eomgen.scene.reading.kinds import ORIGIN, Bounds, Matrix, Rotations, Triple, Value, Values

_OF_RANGE = "value or list of values of parameters, rad or m"
_LIMITED = by_coordinate("rad", "m")
_ONSETS = ", ".join(f"{shown_power(onset)} {unit}" for unit, onset in ONSETS.items())
_RATE, _EFFORT = by_coordinate("rad/s", "m/s"), by_coordinate("N m", "N")


class Limits(Table):
    """Compliant stops of a joint's coordinates."""

    lower: Bounds | None = optional("lower end; -inf for none", unit=_LIMITED, names=PARAMETERS, kind=_OF_RANGE)
    upper: Bounds | None = optional("upper end; inf for none", unit=_LIMITED, names=PARAMETERS, kind=_OF_RANGE)
    stiffness: Values = key("stiffness of the stop", unit=by_coordinate("N m/rad", "N/m"), names=PARAMETERS)
    damping: Values | None = of_parameters("its damping", unit=by_coordinate("N m s/rad", "N s/m"), shown_default="`0`")
    onset: Values | None = of_parameters("penetration to full stiffness", unit=_LIMITED, shown_default=_ONSETS)


class FrictionEntry(Table):
    """Dry friction of a joint's coordinates."""

    coulomb: Values = key("level of the friction", unit=_EFFORT, names=PARAMETERS, example="coulomb = 0.3")
    velocity: Values = key("regularisation: well below this speed the joint sticks", unit=_RATE, names=PARAMETERS)
    static: Values | None = of_parameters("level at which it breaks loose; with `stribeck`", unit=_EFFORT)
    stribeck: Values | None = of_parameters("speed over which it falls to Coulomb's, above `velocity`", unit=_RATE)


_POSITION = by_coordinate("rad", "m", free="m")


class Initial(Table):
    """The state of a joint at the start."""

    position: Values | None = of_fixed_parameters(
        "the coordinates, angles first; spherical: quaternion, 4 values; free: position of the child's frame, 3 values",
        unit=_POSITION,
        shown_default="zeros",
    )
    orientation: Values | None = of_fixed_parameters(
        "free: quaternion, 4 values", kind="4 values of fixed parameters", shown_default="not turned"
    )
    rotation: Rotations | None = optional("rotation in place of a quaternion, for spherical and free")
    velocity: Values | None = of_fixed_parameters(
        "1 to 3, or 6 values; angular first, body axes for spherical and free joints",
        unit=by_component("rad/s", "m/s"),
        shown_default="zeros",
    )
    hold: bool = key("refuse a start at which constraints change the position or velocity given here", False)


class MimicEntry(Table):
    """A coordinate that follows another: multiplier q_leader + offset."""

    joint: str = key("the leader, with one coordinate; it may follow another in its turn", refers="joints")
    multiplier: Value = key("coordinate per coordinate of the leader", 1.0, names=PARAMETERS)
    offset: Value = key("coordinate at the leader's zero", 0.0, unit=by_coordinate("rad", "m"), names=PARAMETERS)


class JointEntry(Table):
    """A joint, which carries a body and lets it move relative to its parent."""

    type: JointType = key("kind of motion of the child against the parent")
    parent: str = key("the body that carries the joint", refers="bodies", kind="body, or `base`")
    child: str = key("the body that this joint carries", refers="bodies")
    position: Triple = key("origin of the child's frame in the parent's frame", ORIGIN, unit="m", names=PARAMETERS)
    rotation: Rotations | None = optional(
        "axes of the child in the parent, angles of fixed parameters", shown_default="`[]`"
    )
    orientation: Matrix | None = optional("the same as a matrix, child axes to parent axes; either this or `rotation`")
    given_in: str | None = given_in("position and rotation are given, in place of the parent's")
    axis: Triple | None = of_fixed_parameters(
        "axis in the child's axes; any length; the normal of a planar joint, the first axis of a universal one",
        shown_default="required, but for fixed, spherical and free",
    )
    second_axis: Triple | None = of_fixed_parameters(
        "second axis of a universal joint, across the first, in the child's axes",
        shown_default="required for universal",
    )
    x_axis: Triple | None = of_fixed_parameters(
        "vector of a planar joint: x is along the part of it in the plane, y to the left of x",
        shown_default="coordinate axis farthest from `axis`",
    )
    pitch: Value | None = of_parameters(
        "travel per radian of a helical joint; negative is left-handed",
        unit="m/rad",
        shown_default="required for helical",
    )
    stiffness: Values | None = of_parameters(
        "stiffness of a spring in the joint", unit=by_coordinate("N m/rad", "N/m"), shown_default="`0`"
    )
    damping: Values | None = of_parameters(
        "damping of a damper in the joint", unit=by_coordinate("N m s/rad", "N s/m"), shown_default="`0`"
    )
    rest: Values | None = of_parameters("coordinate of no force", unit=by_coordinate("rad", "m"), shown_default="`0`")
    rotor_inertia: Values | None = of_parameters(
        "inertia that is added to this joint's diagonal of M (a motor with a gear)",
        unit=by_coordinate("kg m^2", "kg"),
        shown_default="`0`",
    )
    limits: Limits | None = optional("compliant stops")
    friction: FrictionEntry | None = optional("dry friction")
    drive: Values | None = optional(
        "coordinates over time, prescribed; they then have no initial state of their own",
        unit=by_coordinate("rad", "m"),
        names=TIME,
        kind="value or list of values of time, rad or m",
    )
    smooth: Value | None = of_fixed_parameters(
        "duration of the transition after a jump or a kink of a drive, see [motion laws that jump]"
        "(joints.md#motion-laws-that-jump)",
        unit="s",
        shown_default="jumps are refused",
    )
    mimic: MimicEntry | None = optional("leader that the coordinate follows, in place of being free")
    initial: Initial = key("state at the start", Initial.model_construct(), shown_default="zeros")

    @field_validator("type", mode="wrap")
    @classmethod
    def _accept_joint_type(cls, written: object, validator: ValidatorFunctionWrapHandler) -> Any:
        """Return the name of a joint type, eomgen's own or another distribution's."""
        return written if isinstance(written, str) and written in JOINTS else validator(written)
