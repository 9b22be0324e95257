"""Displacement of a child body by its joint and its motion subspace, as numbers, for checks of a scene."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from eomgen.base.arrays import Array
from eomgen.lie.numeric import rotation_matrix, skew
from eomgen.scene.geometry.rotations import about_axis
from eomgen.scene.joint_types import Connection, ElementaryMotion

Vector = Sequence[float] | Array


def displaced(
    kind: Connection, axis: Vector, second_axis: Vector, q: Vector, pitch: float = 0.0
) -> tuple[Array, Array, Array]:
    """Return the pose of a joint's child at coordinates q, relative to neutral coordinates, and its motion subspace.

    Parameters
    ----------
    axis, second_axis : (3,) in the child's frame
    q : (nq,) coordinates; orientations as quaternions (w, x, y, z)
    pitch : of screws, m/rad

    Returns
    -------
    rotation : (3, 3) child axes to the axes at neutral q
    shift : (3,) of the child's origin, in the axes at neutral q
    subspace : (6, nv) motion subspace in the child's frame, angular part first
    """
    directions = np.array([axis, second_axis, np.cross(axis, second_axis)])
    rotation, shift, subspace = np.eye(3), np.zeros(3), np.zeros((6, kind.v_size))
    for motion in kind.chain:
        turn, travel, columns = _moved(motion, directions[list(motion.axes)], q, pitch)
        subspace = twist_transform(turn, travel) @ subspace
        subspace[:, motion.components] = columns
        rotation, shift = rotation @ turn, shift + rotation @ travel
    return rotation, shift, subspace


def _moved(motion: ElementaryMotion, axes: Array, q: Vector, pitch: float) -> tuple[Array, Array, Array]:
    """Return the same of one elementary motion; axes (n, 3)."""
    none = np.zeros(3)
    match motion.kind:
        case "ball":
            return rotation_matrix(np.asarray(q[:4])), none, np.eye(6)[:, :3]
        case "free":
            return rotation_matrix(np.asarray(q[:4])), np.asarray(q[4:7]), np.eye(6)
    x = np.array([q[k] for k in motion.components])
    if motion.kind == "travel":
        return np.eye(3), x @ axes, np.hstack([np.zeros_like(axes), axes]).T
    along = pitch * axes[0] if motion.kind == "screw" else none
    return about_axis(axes[0], x[0]), x[0] * along, np.concatenate([axes[0], along])[:, np.newaxis]


def twist_transform(rotation: Array, position: Array) -> Array:
    """Return the (6, 6) map from a body's twist to the twist of a frame placed on it, each in its own axes."""
    R = rotation.T
    return np.block([[R, np.zeros((3, 3))], [-R @ skew(position), R]])
