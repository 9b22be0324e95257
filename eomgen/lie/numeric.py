"""Group functions on NumPy arrays, batched: the last axis (of matrices the last two) holds the components."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.lie import rotations
from eomgen.lie.algebra import NumpyAlgebra
from eomgen.lie.groups import Group
from eomgen.lie.rotations import Rows

Array = NDArray[Any]
_ALGEBRA = NumpyAlgebra()


def unit(quaternion: Array) -> Array:
    """Return quaternions (..., 4) divided by their lengths."""
    scaled: Array = quaternion / np.sqrt(np.sum(quaternion * quaternion, axis=-1, keepdims=True))
    return scaled


def quaternion_product(p: Array, r: Array) -> Array:
    """Return the Hamilton product p r of quaternions (w, x, y, z), (..., 4)."""
    return _join(rotations.quaternion_product(_split(p), _split(r)))


def rotated(quaternion: Array, r: Array) -> Array:
    """Return R(quaternion) r, (..., 3), for unit quaternions."""
    w, axis = quaternion[..., :1], quaternion[..., 1:]
    twice = 2.0 * np.cross(axis, r)
    result: Array = r + w * twice + np.cross(axis, twice)
    return result


def rotation_matrix(quaternion: Array) -> Array:
    """Return R (..., 3, 3) of unit quaternions (..., 4), body axes to reference axes."""
    return _matrix(rotations.rotation_matrix(_split(quaternion)), quaternion)


def skew(x: Array) -> Array:
    """Return the matrices (..., 3, 3) of the cross product with vectors x (..., 3)."""
    return _matrix(rotations.skew(_split(x)), x)


def exp(group: Group, theta: Array) -> Array:
    """Return exp of increments (..., v_size) as elements (..., q_size)."""
    return _join(group.exp(_ALGEBRA, _split(theta)))


def log(group: Group, q: Array) -> Array:
    """Return increments (..., v_size), angles of at most pi, with exp equal to q up to the quaternion's sign."""
    return _join(group.log(_ALGEBRA, _split(q)))


def compose(group: Group, first: Array, second: Array) -> Array:
    """Return first * second, (..., q_size)."""
    return _join(group.compose(_split(first), _split(second)))


def difference(group: Group, first: Array, second: Array) -> Array:
    """Return log(first^-1 * second), (..., v_size)."""
    return _join(group.log(_ALGEBRA, group.compose(group.inverse(_split(first)), _split(second))))


def inverse(group: Group, q: Array) -> Array:
    """Return q^-1, (..., q_size)."""
    return _join(group.inverse(_split(q)))


def adjoint(group: Group, q: Array) -> Array:
    """Return Ad(q), (..., v_size, v_size)."""
    return _matrix(group.adjoint(_split(q)), q)


def bracket_matrix(group: Group, v: Array) -> Array:
    """Return ad(v), (..., v_size, v_size), with ad(v) w = [v, w]."""
    return _matrix(group.bracket_matrix(_split(v)), v)


def tangent(group: Group, theta: Array) -> Array:
    """Return T(theta), (..., v_size, v_size)."""
    return _matrix(group.tangent(_ALGEBRA, _split(theta)), theta)


def tangent_inverse(group: Group, theta: Array) -> Array:
    """Return T(theta)^-1, (..., v_size, v_size), for rotation angles below 2 pi."""
    return _matrix(group.tangent_inverse(_ALGEBRA, _split(theta)), theta)


def update(group: Group, q: Array, theta: Array) -> Array:
    """Return q * exp(theta), (..., q_size), its quaternion scaled back to unit length, its sign kept."""
    return _join(group.update(_ALGEBRA, _split(q), _split(theta)))


def _split(x: Array) -> list[Array]:
    array = np.asarray(x)
    if not np.issubdtype(array.dtype, np.inexact):
        array = array.astype(float)
    return [array[..., index] for index in range(array.shape[-1])]


def _join(values: Sequence[Any]) -> Array:
    if not values:
        return np.zeros(0)
    result = np.empty((*np.broadcast_shapes(*map(np.shape, values)), len(values)), np.result_type(*values))
    for index, value in enumerate(values):
        result[..., index] = value
    return result


def _matrix(rows: Rows, of: Array) -> Array:
    """Return rows of values as matrices with the batch shape of ``of``, also if all entries are constant."""
    result = np.empty((*np.shape(of)[:-1], len(rows), len(rows)), np.result_type(of, float))
    for row, entries in enumerate(rows):
        for column, entry in enumerate(entries):
            result[..., row, column] = entry
    return result
