"""Effort inputs of a URDF: one for each joint of one coordinate that moves on its own, and those of actuators."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from eomgen.formula.words import RESERVED
from eomgen.scene.sources.urdf.reading import Joint
from eomgen.scene.sources.urdf.transmissions import Actuation

#: Unit of an effort by the unit of the coordinate.
_EFFORT_UNITS = {"rad": "N m", "m": "N"}


def effort_inputs(joints: Sequence[Joint], actuators: Actuation) -> dict[str, Any]:
    """Return the sections ``inputs`` and ``efforts``: those of actuators, then those that drive joints, in their order.

    An input is called like its joint; where that is a word of formulas or an actuator, with ``_effort`` behind. What
    is empty is not there.
    """
    inputs, efforts = dict(actuators.inputs), dict(actuators.efforts)
    for joint in joints:
        if joint.unit not in _EFFORT_UNITS:
            continue
        name = f"{joint.name}_effort" if joint.name in RESERVED | inputs.keys() else joint.name
        inputs[name] = {"unit": _EFFORT_UNITS[joint.unit], "description": f"effort of joint {joint.name}"}
        efforts[joint.name] = {"joint": joint.name, "effort": name}
    return {name: section for name, section in (("inputs", inputs), ("efforts", efforts)) if section}
