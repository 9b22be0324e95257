"""Schema of bodies, and of points and frames fixed in bodies."""

from __future__ import annotations

from typing import Literal

from eomgen.scene.formula.scope import PARAMETERS
from eomgen.scene.reading.key_metadata import Table, given_in, key, optional
from eomgen.scene.reading.kinds import ORIGIN, Inertia, Matrix, Rotations, Triple, Value


class BodyEntry(Table):
    """A rigid body."""

    mass: Value = key("0 is allowed if the body carries others with mass", unit="kg", names=PARAMETERS)
    center_of_mass: Triple = key("centre of mass in the body's frame", ORIGIN, unit="m", names=PARAMETERS)
    inertia: Inertia = key(
        "inertia **about the centre of mass**, in the body's axes",
        (0.0,) * 6,
        unit="kg m^2",
        names=PARAMETERS,
        kind="see below, kg m²",
        shown_default="zero, a point mass",
    )
    check_inertia: bool = key(
        "`false` accepts any inertia with positive moments, as of rotors and gears lumped into a body", True
    )
    given_in: str | None = given_in("centre of mass and inertia are given")
    group: Literal["SE3", "R3xSO3"] | None = optional(
        "group of the coordinates, for [absolute coordinates](absolute_coordinates.md) only", shown_default="`SE3`"
    )


class BodyFrame(Table):
    """A frame fixed in a body, in the base or in the world; its origin is a point of the same name."""

    body: str = key("the body that carries it", refers="bodies", kind="body, `base` or `world`")
    position: Triple = key("place of its origin, in the body's frame", ORIGIN, unit="m", names=PARAMETERS)
    rotation: Rotations | None = optional(
        "its axes in the body, angles of fixed parameters; intrinsic rotations in order", shown_default="`[]`"
    )
    orientation: Matrix | None = optional("the same as a matrix, its axes to the body's; either this or `rotation`")
    given_in: str | None = given_in("position and axes are given")


class PointEntry(Table):
    """A point fixed in a body, in the base or in the world; its position may be in another body's frame (``in``)."""

    body: str = key("the body that carries it", refers="bodies", kind="body, `base` or `world`")
    position: Triple = key("place in the body's frame", ORIGIN, unit="m", names=PARAMETERS)
    given_in: str | None = given_in("the position is given")
