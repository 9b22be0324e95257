"""Joints of drafts as joints of a scene."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.rounding import COMPUTED
from eomgen.products.robots.draft import Axis, DraftJoint
from eomgen.products.robots.frames import Frames, Node
from eomgen.products.robots.scene_draft import LinkPlace
from eomgen.products.robots.tree import Edge
from eomgen.scene.joint_types import JOINTS
from eomgen.scene.joints.tree import joint_displacement
from eomgen.scene.rotations import frame_about, unit_axis

#: Deformation of a stop under the largest effort of its joint, by unit of the coordinate.
GIVE = {"rad": 0.01, "m": 0.001}
#: Speed well below which a joint with friction counts as sticking, by unit of the coordinate, per second.
STICKING = {"rad": 0.01, "m": 0.001}


def axes_in_link(frames: Frames, edge: Edge, link: Node, *, unit: bool = False) -> list[Array]:
    """Return vectors (3,) along a joint's axes, in the frame of ``link`` while coordinates are zero: as long as in the
    file, or ``unit`` vectors, z for an axis without direction."""
    path, name = edge.key
    result = []
    for axis in edge.joint.axes:
        vector = unit_axis(axis.vector) if unit else np.array(axis.vector)
        turn = frames.between(link, (path, axis.expressed_in or name)).orientation
        result.append(turn @ (np.array([0.0, 0.0, 1.0]) if vector is None else vector))
    return result


def displacement(joint: DraftJoint, value: float) -> tuple[Array, Array]:
    """Return rotation (3, 3) and shift (3,), m, in the joint's frame, of the child of a joint of one axis at the
    coordinate ``value``, rad or m."""
    axis = unit_axis(joint.axes[0].vector) if value else None
    if axis is None:
        return np.eye(3), np.zeros(3)
    return joint_displacement(JOINTS[joint.type], axis, np.zeros(3), [value])[:2]


def gap_of(kind: str, ends: Sequence[LinkPlace]) -> tuple[float, float]:
    """Return the distance, m, and the largest element of the turn (0 for none) by which two ends of a loop in one body
    do not meet, in the directions that a constraint of the type ``kind`` holds."""
    (first, start), (second, end) = ((end.orientation, end.position) for end in ends)
    gap = first.T @ (end - start)
    apart = {"prismatic": gap[:2], "planar": gap[2:]}.get(kind, gap)
    about = {"revolute": first[:, :2].T @ second[:, 2], "planar": first[:, :2].T @ second[:, 2]}
    about |= {"universal": first[:, 2:].T @ second[:, 2], "spherical": np.zeros(1)}
    turned = about.get(kind, first.T @ second - np.eye(3))
    return float(np.linalg.norm(apart)), float(np.max(np.abs(turned)))


def are_perpendicular(axes: Sequence[Array]) -> bool:
    """Return whether one universal joint can have two axes."""
    return bool(abs(axes[0] @ axes[1]) <= COMPUTED)


def loop_frame(kind: str, axes: Sequence[Array]) -> Array:
    """Return the axes (3, 3) of a constraint as columns in the world: z along the axis of the joint, but x and y along
    both axes of a universal joint. Without axes the identity."""
    if not axes:
        return np.eye(3)
    return frame_about(np.cross(axes[0], axes[1]), axes[0]) if kind == "universal" else frame_about(axes[0])


def forces_of(axes: Sequence[Axis]) -> dict[str, Any]:
    """Return springs and dampers as the keys ``damping``, ``stiffness`` and ``rest`` of a joint in a scene: numbers for
    one axis, lists for several; keys without a value other than 0 are left out."""
    values = {key: [getattr(axis, key) for axis in axes] for key in ("damping", "stiffness", "rest")}
    if not any(values["stiffness"]):
        del values["rest"]
    return {key: row[0] if len(row) == 1 else row for key, row in values.items() if any(row)}


def friction_of(axes: Sequence[Axis], unit: str) -> dict[str, Any] | None:
    """Return the dry friction of a joint as in a scene: ``coulomb``, the level(s) in N m or N, and ``velocity``, the
    sticking speed for coordinates in ``unit`` (rad or m). None without friction."""
    levels = [axis.friction for axis in axes]
    if not any(level > 0.0 for level in levels):
        return None
    return {"coulomb": levels[0] if len(levels) == 1 else levels, "velocity": STICKING[unit]}


def stops_of(axes: Sequence[Axis], unit: str) -> dict[str, Any] | None:
    """Return the limits of a joint as the key ``limits`` of a scene: lower, upper, stiffness and damping, lists for
    several axes. None without a finite limit, for an empty range, or if an axis has neither a stiffness of stops nor a
    largest effort in the file; under that effort a stop gives way by ``GIVE[unit]``."""
    bounded = [math.isfinite(axis.lower) or math.isfinite(axis.upper) for axis in axes]
    stops = [axis.stop or _by_effort(axis, unit) for axis in axes]
    if any(axis.lower >= axis.upper for axis in axes):
        return None
    if not any(bounded) or not all(stop for stop, some in zip(stops, bounded, strict=True) if some):
        return None
    stiff = [stop or (0.0, 0.0) for stop in stops]
    values = {end: [getattr(axis, end) for axis in axes] for end in ("lower", "upper")}
    values |= {"stiffness": [stop[0] for stop in stiff], "damping": [stop[1] for stop in stiff]}
    if len(axes) > 1:
        return values
    return {key: value for key, (value,) in values.items() if math.isfinite(value)}


def _by_effort(axis: Axis, unit: str) -> tuple[float, float] | None:
    if not math.isfinite(axis.effort) or axis.effort == 0.0:
        return None
    stiffness = axis.effort / GIVE[unit]
    return stiffness, 0.01 * stiffness  # a time of 0.01 s
