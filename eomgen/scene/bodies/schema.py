"""Schema of bodies, body-fixed points, and the base that carries the tree."""

from __future__ import annotations

from typing import Literal

from eomgen.scene.formula.scope import PARAMETERS, TIME
from eomgen.scene.reading.key_metadata import Table, added_keys, given_in, key, optional
from eomgen.scene.reading.kinds import Inertia, Matrix, Rotations, Triple, Value

_ORIGIN = (0.0, 0.0, 0.0)


class Base(Table):
    """The prescribed motion of the frame that carries the tree."""

    position: Triple = key(
        "of the base's origin, in world axes; z from the surface if it follows one", _ORIGIN, unit="m", names=TIME
    )
    acceleration: Triple | None = optional(
        "of the origin, in world axes; its second integral from rest at t = 0 is added to `position`, see"
        " [below](base.md#measured-accelerations)",
        unit="m/s^2",
        names=TIME,
        shown_default="none",
    )
    drift: Literal["keep", "remove"] | None = optional(
        "of the integral of `acceleration`: kept as it is, or removed by a straight line in a record's acceleration",
        kind="`keep` or `remove`",
        shown_default="`keep`, with a note",
    )
    rotation: Rotations = key("intrinsic rotations in order, after the surface's tilt", ())
    __annotations__ |= {row.added: row.type for row in added_keys("base")}
    locals().update({row.added: row.field for row in added_keys("base")})


class Body(Table):
    """A rigid body."""

    mass: Value = key("0 is allowed if the body carries others with mass", unit="kg", names=PARAMETERS)
    center_of_mass: Triple = key("in the body's frame", _ORIGIN, unit="m", names=PARAMETERS)
    inertia: Inertia = key(
        "**about the centre of mass**, in the body's axes",
        (0.0,) * 6,
        unit="kg m^2",
        names=PARAMETERS,
        kind="see below, kg m²",
        shown_default="zero, a point mass",
    )
    given_in: str | None = given_in(
        "frame in which centre of mass and inertia are given, at the [design position](conventions.md#design-position)"
    )
    group: Literal["SE3", "R3xSO3"] | None = optional(
        "for [absolute coordinates](absolute_coordinates.md) only", shown_default="`SE3`"
    )


class BodyFrame(Table):
    """A frame fixed in a body, in the base or in the world; its origin is a point of the same name."""

    body: str = key("the body that carries it", refers="bodies", kind="body, `base` or `world`")
    position: Triple = key("of its origin, in the body's frame", _ORIGIN, unit="m", names=PARAMETERS)
    rotation: Rotations | None = optional(
        "its axes in the body, angles of fixed parameters; intrinsic rotations in order", shown_default="`[]`"
    )
    orientation: Matrix | None = optional("the same as a matrix, its axes to the body's; either this or `rotation`")
    given_in: str | None = given_in(
        "frame in which position and axes are given, at the [design position](conventions.md#design-position)"
    )


class Point(Table):
    """A point fixed in a body, in the base or in the world."""

    body: str = key("the body that carries it", refers="bodies", kind="body, `base` or `world`")
    position: Triple = key("in the body's frame", _ORIGIN, unit="m", names=PARAMETERS)
    given_in: str | None = given_in(
        "frame in which the position is given, at the [design position](conventions.md#design-position)"
    )
