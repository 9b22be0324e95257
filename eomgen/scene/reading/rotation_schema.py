"""Schema of rotations: a list of rotations about axes, or one quaternion."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from eomgen.scene.formula.scope import FIXED_PARAMETERS, TIME
from eomgen.scene.reading.key_metadata import Table, key
from eomgen.scene.reading.kinds import Triple, Value


class Rotation(Table):
    """A rotation by an angle about an axis."""

    axis: Triple = key("of any length", names=FIXED_PARAMETERS)
    angle: Value = key(
        "of the time for the base, of fixed parameters elsewhere", unit="rad", names=TIME, kind="value, rad"
    )


Rotations = Annotated[tuple[Rotation, ...], Field(strict=False)]
