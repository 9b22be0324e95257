"""Joints of SDF as joints of a scene."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.products.robots.sdf.elements import SdfAxis
from eomgen.products.robots.sdf.frames import Frames
from eomgen.products.robots.sdf.tree import Edge
from eomgen.products.robots.urdf.notes import DAMPING_TIME, GIVE, STICKING
from eomgen.scene.rotations import frame_about, unit_axis

#: Types of joints, and of constraints that close loops.
SCENE_TYPES = {
    "revolute": "revolute",
    "continuous": "revolute",
    "prismatic": "prismatic",
    "screw": "helical",
    "universal": "universal",
    "revolute2": "universal",
    "ball": "spherical",
    "fixed": "fixed",
}
#: Unit of the coordinates of joints by type.
UNITS = {"prismatic": "m"}
#: Cosine of an angle between axes below which they are perpendicular.
_ACROSS = 1e-9


def axes_in_world(frames: Frames, edge: Edge) -> list[Array]:
    """Return the unit vectors of the axes of a joint in the world, in the configuration of the file."""
    path, _ = edge.key
    result = []
    for axis in edge.joint.axes:
        name = axis.expressed_in or edge.joint.name
        known = frames.known(path, name, axis.place, "expressed_in")
        vector = unit_axis(axis.vector)
        turned = frames.pose((path, name)).orientation if known else np.eye(3)
        result.append(turned @ (np.array([0.0, 0.0, 1.0]) if vector is None else vector))
    return result


def are_perpendicular(axes: Sequence[Array]) -> bool:
    """Return whether one universal joint can have two axes."""
    return bool(abs(axes[0] @ axes[1]) <= _ACROSS)


def loop_frame(kind: str, axes: Sequence[Array]) -> Array:
    """Return the frame of a constraint in the world: z along the axis, but of a universal joint x and y along both."""
    if not axes:
        return np.eye(3)
    if kind == "universal":
        return frame_about(np.cross(axes[0], axes[1]), axes[0])
    return frame_about(axes[0])


def forces_of(axes: Sequence[SdfAxis]) -> dict[str, Any]:
    """Return springs and dampers of a joint as keys of a scene."""
    entry: dict[str, Any] = {}
    for key, values in (("damping", [a.damping for a in axes]), ("stiffness", [a.stiffness for a in axes])):
        if any(values):
            entry[key] = values[0] if len(values) == 1 else values
    if "stiffness" in entry and any(axis.rest for axis in axes):
        rests = [axis.rest for axis in axes]
        entry["rest"] = rests[0] if len(rests) == 1 else rests
    return entry


def friction_of(axes: Sequence[SdfAxis], unit: str) -> dict[str, Any] | None:
    """Return the dry friction of a joint as a key of a scene; None without."""
    levels = [axis.friction for axis in axes]
    if not any(level > 0.0 for level in levels):
        return None
    return {"coulomb": levels[0] if len(levels) == 1 else levels, "velocity": STICKING[unit]}


def stops_of(axes: Sequence[SdfAxis], unit: str) -> dict[str, Any] | None:
    """Return the limits of a joint as a key of a scene; None without a range, for one of no width, or without a measure
    of the stops: the stiffness of the file, or the largest effort, under which they give way as in URDF."""
    bounded = [math.isfinite(axis.lower) or math.isfinite(axis.upper) for axis in axes]
    stops = [axis.stop or _by_effort(axis, unit) for axis in axes]
    if any(axis.lower >= axis.upper for axis in axes):
        return None
    if not any(bounded) or not all(stop for stop, some in zip(stops, bounded, strict=True) if some):
        return None
    stiff = [stop or (0.0, 0.0) for stop in stops]
    values = {
        "lower": [axis.lower for axis in axes],
        "upper": [axis.upper for axis in axes],
        "stiffness": [stop[0] for stop in stiff],
        "damping": [stop[1] for stop in stiff],
    }
    return {key: several[0] if len(several) == 1 else several for key, several in values.items()}


def _by_effort(axis: SdfAxis, unit: str) -> tuple[float, float] | None:
    if not math.isfinite(axis.effort) or axis.effort == 0.0:
        return None
    stiffness = axis.effort / GIVE[unit]
    return stiffness, DAMPING_TIME * stiffness
