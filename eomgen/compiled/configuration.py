"""Rates and rotations on stored configurations: what a caller needs who integrates q as a plain vector."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from eomgen.lie.product import FactorLike

Array = NDArray[np.float64]


def configuration_rate(factors: Sequence[FactorLike], q: Array, v: Array) -> Array:
    """Return qdot (..., nq) of velocities v (..., nv): quaternions by p * (0, omega) / 2, positions by R xdot.

    References of angles, which are no part of the factors, stay.
    """
    result = np.zeros((*np.broadcast_shapes(q.shape[:-1], v.shape[:-1]), q.shape[-1]))
    for factor in factors:
        velocity = v[..., factor.v_start : factor.v_start + factor.v_size]
        if factor.group == "R":
            result[..., factor.q_start : factor.q_start + factor.q_size] = velocity
            continue
        p, omega = q[..., factor.q_start : factor.q_start + 4], velocity[..., :3]
        w, axis = p[..., :1], p[..., 1:]
        result[..., factor.q_start] = -0.5 * np.sum(axis * omega, axis=-1)
        result[..., factor.q_start + 1 : factor.q_start + 4] = 0.5 * (w * omega + np.cross(axis, omega))
        if factor.q_size == 7:
            position_rate = rotated(unit(p), velocity[..., 3:]) if factor.group == "SE3" else velocity[..., 3:]
            result[..., factor.q_start + 4 : factor.q_start + 7] = position_rate
    return result


def with_unit_quaternions(factors: Sequence[FactorLike], q: Array) -> Array:
    """Return q with its quaternions scaled to unit length."""
    result = np.array(q)
    for factor in factors:
        if factor.group != "R":
            part = slice(factor.q_start, factor.q_start + 4)
            result[..., part] = unit(q[..., part])
    return result


def unit(quaternion: Array) -> Array:
    """Return a quaternion divided by its length."""
    scaled: Array = quaternion / np.sqrt(np.sum(quaternion * quaternion, axis=-1, keepdims=True))
    return scaled


def rotated(quaternion: Array, r: Array) -> Array:
    """Return R(quaternion) r, (..., 3), for unit quaternions."""
    w, axis = quaternion[..., :1], quaternion[..., 1:]
    twice = 2.0 * np.cross(axis, r)
    result: Array = r + w * twice + np.cross(axis, twice)
    return result
