"""Effort inputs of a URDF: one for each joint with one independent coordinate, and one for each actuator."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from eomgen.formula.words import RESERVED
from eomgen.scene.sources.urdf.reading import Joint
from eomgen.scene.sources.urdf.transmissions import Actuation

#: Unit of an effort by the unit of the coordinate.
_EFFORT_UNITS = {"rad": "N m", "m": "N"}


def effort_inputs(joints: Sequence[Joint], actuators: Actuation) -> dict[str, Any]:
    """Return the sections ``inputs`` and ``efforts``: first of actuators, then of driven joints, in their order.

    An input has the name of its joint, with ``_effort`` appended if this is a word of formulas or an actuator. Empty
    sections are left out.
    """
    inputs, efforts = dict(actuators.inputs), dict(actuators.efforts)
    for joint in joints:
        if joint.unit not in _EFFORT_UNITS:
            continue
        name = f"{joint.name}_effort" if joint.name in RESERVED | inputs.keys() else joint.name
        inputs[name] = {"unit": _EFFORT_UNITS[joint.unit], "description": f"effort of joint {joint.name}"}
        efforts[joint.name] = {"joint": joint.name, "effort": name}
    return {name: section for name, section in (("inputs", inputs), ("efforts", efforts)) if section}
