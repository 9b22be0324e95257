"""Schema of frames, loop-closing constraints, and the points and axes of reactions."""

from __future__ import annotations

from typing import ClassVar

from pydantic import model_validator

from eomgen.scene.formula.scope import BETWEEN_FRAMES, POSITIONS, TIME, VELOCITIES
from eomgen.scene.joint_types import CONSTRAINTS, DRIVE_UNITS, ConstraintType
from eomgen.scene.joints import model as constraint_model
from eomgen.scene.joints.model import EquationUnit, Shape
from eomgen.scene.reading.key_metadata import Table, given_in, key, of_fixed_parameters, of_parameters, optional
from eomgen.scene.reading.kinds import Matrix, Rotations, Triple, Value


class FrameEntry(Table):
    """A frame that a constraint or a bushing holds: a point's name, or a table."""

    short: ClassVar[str] = "point"

    body: str | None = optional("body of the frame", refers="bodies", kind="body or `base`")
    point: str | None = optional("the same, by a point's name", refers="points")
    position: Triple | None = of_parameters("place of the frame in the body", unit="m", shown_default="`[0, 0, 0]`")
    rotation: Rotations | None = optional("the frame's axes, in place of `axis`")
    orientation: Matrix | None = optional("the same as a matrix, the frame's axes to the body's; in place of `axis`")
    axis: Triple | None = of_fixed_parameters("the frame's z axis, in the body's axes")
    x_axis: Triple | None = of_fixed_parameters("the frame's x axis is the part of it across `axis`")
    given_in: str | None = given_in("position and axes are given")

    @model_validator(mode="before")
    @classmethod
    def _from_point(cls, data: object) -> object:
        return {"point": data} if isinstance(data, str) else data


class ReactionEntry(Table):
    """Point and axes in which the reaction of a joint or a constraint is expressed."""

    joint: str | None = optional("joint of the reaction, which its parent exerts on its child", refers="joints")
    constraint: str | None = optional("constraint of the reaction of `first` on `second`", refers="constraints")
    point: str | None = optional(
        "point about which the moment is taken",
        refers="points",
        shown_default="the origin of the child's frame, or of the frame `second`",
    )
    axes: str = key("body whose axes the components are in", "world", refers="bodies", kind="body, `base` or `world`")


class ConstraintEntry(Table):
    """A constraint between two frames, which closes a loop, or an equation of coordinates and points."""

    type: ConstraintType = key("relative motion that it allows", kind="see below")
    first: FrameEntry | None = optional("frame in a body", kind="frame", shown_default="required, but for `formula`")
    second: FrameEntry | None = optional("frame in another", kind="frame", shown_default="required, but for `formula`")
    drive: Value | None = optional(
        "angle of `revolute`, or travel of `prismatic` and `cylindrical`, prescribed",
        unit={name: DRIVE_UNITS[row.drive] for name, row in CONSTRAINTS.items() if row.drive},
        names=TIME,
    )
    length: Value | None = optional(
        "length between the origins of a `distance`; a formula of time prescribes it",
        unit="m",
        names=TIME,
        shown_default="their distance at the [design position](conventions.md#design-position), with a note",
    )
    smooth: Value | None = of_fixed_parameters(
        "transition of a drive, or of a length over time, as of [joints](joints.md#motion-laws-that-jump)",
        unit="s",
        shown_default="jumps are refused",
    )
    radius: Value | None = of_parameters(
        "radius of the disc or sphere, or of the centre line of the torus",
        unit="m",
        shown_default="required for `rolling` and `sliding`, but for an ellipsoid",
    )
    shape: Shape | None = optional(
        "shape of the body that does `rolling` or `sliding`", shown_default=f"`{constraint_model.Constraint.shape}`"
    )
    semi_axes: Triple | None = of_parameters(
        "semi-axes along x, y and z of the second frame", unit="m", shown_default="required for `ellipsoid`"
    )
    tube_radius: Value | None = of_parameters("tube radius of a torus", unit="m", shown_default="required for `torus`")
    surface: Value | None = optional(
        "height of the surface of `rolling` and `sliding` over the plane of the first frame",
        unit="m",
        names=BETWEEN_FRAMES,
        kind="value of x, y and parameters",
        shown_default="the plane",
    )
    pitch: Value | None = of_parameters("travel per radian", unit="m/rad", shown_default="required for `helical`")
    equation: Value | None = optional(
        "expression of a `formula`, 0 on the constraint",
        names=POSITIONS,
        kind="value of coordinates, positions and time, or of x, y, z between two frames",
    )
    velocity_equation: Value | None = optional(
        "expression of a `formula` that is linear in velocities, 0 on the constraint",
        names=VELOCITIES,
        kind="value of velocities, coordinates, positions and time",
    )
    unit: EquationUnit | None = optional(
        "unit of the value of a `formula`", shown_default="known of a sum of coordinates, positions and others"
    )
