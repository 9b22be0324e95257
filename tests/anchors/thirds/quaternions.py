"""Quaternions of third solutions, written for them: (w, x, y, z), from body axes to the world."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def matrix(quaternion: Array) -> Array:
    """Return the rotation from body axes to the world of a quaternion (w, x, y, z)."""
    w, x, y, z = quaternion / np.linalg.norm(quaternion)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + 2.0 * w * cross + 2.0 * cross @ cross)


def turned(quaternion: Array, turning: Array) -> Array:
    """Return the rate of a quaternion at an angular velocity in body axes."""
    w, vector = quaternion[0], quaternion[1:]
    return 0.5 * np.append(-vector @ turning, w * turning + np.cross(vector, turning))


def product(first: Any, second: Any) -> Array:
    """Return the product of two quaternions."""
    (v, *a), (w, *b) = first, second
    return np.append(v * w - np.dot(a, b), v * np.array(b) + w * np.array(a) + np.cross(a, b))
