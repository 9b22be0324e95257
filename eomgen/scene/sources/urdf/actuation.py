"""Effort inputs of a URDF: one for each joint of one coordinate that moves on its own."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from eomgen.formula.words import RESERVED
from eomgen.scene.sources.urdf.elements import Joint

#: Unit of an effort by the unit of the coordinate.
_EFFORT_UNITS = {"rad": "N m", "m": "N"}


def effort_inputs(joints: Sequence[Joint]) -> dict[str, Any]:
    """Return the sections ``inputs`` and ``efforts`` that drive joints, in their order.

    An input is called like its joint; where that is a word of formulas, with ``_effort`` behind.
    """
    inputs: dict[str, Any] = {}
    efforts: dict[str, Any] = {}
    for joint in joints:
        if joint.unit not in _EFFORT_UNITS:
            continue
        name = f"{joint.name}_effort" if joint.name in RESERVED else joint.name
        inputs[name] = {"unit": _EFFORT_UNITS[joint.unit], "description": f"effort of joint {joint.name}"}
        efforts[joint.name] = {"joint": joint.name, "effort": name}
    return {"inputs": inputs, "efforts": efforts}
