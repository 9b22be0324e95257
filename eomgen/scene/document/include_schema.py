"""The shape of an include: another scene file, or a URDF, as a part of a scene."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from eomgen.scene.formula.scope import PARAMETERS
from eomgen.scene.joints.frame_schema import Rotations
from eomgen.scene.reading.keys import Table, key
from eomgen.scene.reading.kinds import Triple, Value


class Include(Table):
    """Another scene file, or a URDF, as a part of this scene."""

    file: Annotated[str, Field(min_length=1, max_length=1000)] = key("path, from the folder of this file", kind="text", path=True)
    prefix: Annotated[str, Field(max_length=64)] | None = key(
        "goes before every name of the file", None, kind="text", shown_default="the entry's name and `_`"
    )
    parent: str = key("what the file's base is in this scene", "base", refers="bodies", kind="body, or `base`")
    position: Triple = key("of the file's base in the parent's frame", (0.0, 0.0, 0.0), unit="m", names=PARAMETERS)
    rotation: Rotations | None = key(
        "axes of the file's base in the parent, angles of fixed parameters", None, shown_default="`[]`"
    )
    parameters: dict[str, Value] = key(
        "in place of the file's own: numbers, numbers with a unit, or formulas of parameters of this scene",
        {},
        kind="values by name",
        shown_default="`{}`",
    )
    root: Literal["fixed", "free"] = key("URDF: whether the root link is fixed to the parent, or free", "fixed")
    lock: Annotated[tuple[str, ...], Field(strict=False)] = key(
        "URDF: moving joints that are held at zero", (), kind="list of names"
    )
    limits: bool = key("URDF: limits of position become compliant stops", False)
    friction: bool = key("URDF: dry friction of joints is taken, regularised", False)
