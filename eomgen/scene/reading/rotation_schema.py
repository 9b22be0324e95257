"""Schema of rotations: a list of rotations about axes, or one quaternion."""

from __future__ import annotations

from typing import Annotated, TypeGuard

from pydantic import BeforeValidator, Field
from pydantic_core import PydanticCustomError

from eomgen.scene.formula.scope import FIXED_PARAMETERS, TIME
from eomgen.scene.reading.key_metadata import Table, key
from eomgen.scene.reading.kinds import Triple, Value


class Rotation(Table):
    """A rotation by an angle about an axis."""

    axis: Triple = key("of any length", names=FIXED_PARAMETERS)
    angle: Value = key(
        "of the time for the base, of fixed parameters elsewhere", unit="rad", names=TIME, kind="value, rad"
    )


def plain_angles(value: object) -> TypeGuard[list[float]]:
    """Tell whether a value in place of rotations is three numbers, such as roll, pitch and yaw."""
    return isinstance(value, list | tuple) and len(value) == 3 and all(isinstance(part, int | float) for part in value)


def is_matrix(value: object) -> bool:
    """Tell whether a value in place of rotations is three rows of three numbers."""
    return isinstance(value, list | tuple) and len(value) == 3 and all(plain_angles(row) for row in value)


def _rotations(value: object) -> object:
    if plain_angles(value):
        raise PydanticCustomError("rotations", "angles alone say no axes and no order: a table is needed for each")
    if is_matrix(value):
        raise PydanticCustomError("rotations", "this is a matrix, and a list of turns about axes is needed")
    return value


Rotations = Annotated[tuple[Rotation, ...], Field(strict=False), BeforeValidator(_rotations)]
