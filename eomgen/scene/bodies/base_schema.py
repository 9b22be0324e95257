"""Schema of the base that carries the tree."""

from __future__ import annotations

from typing import Literal

from eomgen.scene.formula.scope import TIME
from eomgen.scene.reading.key_metadata import Table, added_keys, key, optional
from eomgen.scene.reading.kinds import ORIGIN, Rotations, Triple


class BaseEntry(Table):
    """The prescribed motion of the frame that carries the tree."""

    position: Triple = key("origin in world axes; z from the surface if it follows one", ORIGIN, unit="m", names=TIME)
    acceleration: Triple | None = optional(
        "acceleration of the origin, in world axes; its second integral from rest at t = 0 is added to `position`,"
        " see [below](base.md#measured-accelerations)",
        unit="m/s^2",
        names=TIME,
        shown_default="none",
    )
    drift: Literal["keep", "remove"] | None = optional(
        "drift of the integral of `acceleration`, kept, or removed by a straight line in a record's acceleration",
        kind="`keep` or `remove`",
        shown_default="`keep`, with a note",
    )
    rotation: Rotations = key("intrinsic rotations in order, after the surface's tilt", ())
    __annotations__ |= {row.added: row.type for row in added_keys("base")}
    locals().update({row.added: row.field for row in added_keys("base")})
