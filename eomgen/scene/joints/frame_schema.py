"""Schema of rotations and frames, which several sections share, and of units by joint coordinate."""

from __future__ import annotations

from pydantic import model_validator

from eomgen.scene.reading.key_metadata import Table, of_fixed_parameters, of_parameters, optional
from eomgen.scene.reading.kinds import Triple
from eomgen.scene.reading.rotation_schema import Rotations


class Frame(Table):
    """A frame that a constraint or a bushing holds: a point's name, or a table."""

    body: str | None = optional("body of the frame", refers="bodies", kind="body or `base`")
    point: str | None = optional("the same, by a point's name", refers="points")
    position: Triple | None = of_parameters("in the body", unit="m", shown_default="`[0, 0, 0]`")
    rotation: Rotations | None = optional("the frame's axes, in place of `axis`")
    axis: Triple | None = of_fixed_parameters("the frame's z axis, in the body's axes")
    x_axis: Triple | None = of_fixed_parameters("the frame's x axis is the part of it across `axis`")

    @model_validator(mode="before")
    @classmethod
    def _from_point(cls, data: object) -> object:
        return {"point": data} if isinstance(data, str) else data
