"""Scenes that stand elsewhere in the world and are turned, gravity included: the same motion."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np


def moved(data: Mapping[str, Any], place: Sequence[float], axis: Sequence[float], angle: float) -> dict[str, Any]:
    """Return a scene on a body that is fixed at a place and turned, with gravity turned alike.

    Parameters
    ----------
    data : a scene as nested data, without formulas of places in the world
    place : (3,) m
    axis, angle : (3,) and rad, of the rotation
    """
    scene, unit = copy.deepcopy(dict(data)), np.array(axis) / np.linalg.norm(axis)
    gravity = np.array(scene["gravity"])
    turned = (
        gravity * np.cos(angle)
        + np.cross(unit, gravity) * np.sin(angle)
        + unit * (unit @ gravity) * (1.0 - np.cos(angle))
    )
    frames = [side for item in scene.get("constraints", {}).values() for side in (item["first"], item["second"])]
    for entry in (*scene.get("points", {}).values(), *frames):
        if entry["body"] == "base":
            entry["body"] = "ground"
    for joint in scene["joints"].values():
        if joint["parent"] == "base":
            joint["parent"] = "ground"
    weld = {"type": "fixed", "parent": "base", "child": "ground", "position": list(place)}
    scene["joints"]["weld"] = weld | {"rotation": [{"axis": list(axis), "angle": angle}]}
    scene["bodies"]["ground"] = {"mass": 0.0}
    return scene | {"gravity": turned.tolist()}
