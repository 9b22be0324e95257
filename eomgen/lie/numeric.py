"""Group functions on NumPy arrays, batched: the last axis (of matrices the last two) holds the components; and numbers
with an infinitesimal part, which give exact derivatives of group functions, of complex arguments too."""

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


class FirstOrder:
    """Dual number x + e y with e^2 = 0, x (``value``) and y (``slope``) arrays of any batch shape, real or complex.
    Sums, products, differences and quotients with numbers and arrays; a number stands left of + and * only."""

    __array_ufunc__ = None  # products with arrays are defined by this class

    def __init__(self, value: Any, slope: Any) -> None:
        self.value, self.slope = value, slope

    def __add__(self, other: Any) -> FirstOrder:
        value, slope = _parts(other)
        return FirstOrder(self.value + value, self.slope + slope)

    def __mul__(self, other: Any) -> FirstOrder:
        value, slope = _parts(other)
        return FirstOrder(self.value * value, self.slope * value + self.value * slope)

    def __truediv__(self, other: Any) -> FirstOrder:
        value, slope = _parts(other)
        quotient = self.value / value
        return FirstOrder(quotient, (self.slope - quotient * slope) / value)

    def __sub__(self, other: Any) -> FirstOrder:
        value, slope = _parts(other)
        return FirstOrder(self.value - value, self.slope - slope)

    __radd__, __rmul__ = __add__, __mul__


class FirstOrderAlgebra:
    """Functions on dual numbers (``FirstOrder``); comparisons look at the real parts of values."""

    def sqrt(self, x: FirstOrder) -> FirstOrder:
        root = np.sqrt(x.value)
        return FirstOrder(root, 0.5 * x.slope / root)

    def sin(self, x: FirstOrder) -> FirstOrder:
        return FirstOrder(np.sin(x.value), np.cos(x.value) * x.slope)

    def cos(self, x: FirstOrder) -> FirstOrder:
        return FirstOrder(np.cos(x.value), -np.sin(x.value) * x.slope)

    def atan2(self, y: FirstOrder, x: FirstOrder) -> FirstOrder:
        slope = (x.value * y.slope - y.value * x.slope) / (x.value * x.value + y.value * y.value)
        return FirstOrder(NumpyAlgebra().atan2(y.value, x.value), slope)

    def less(self, x: Any, y: Any) -> Any:
        return np.real(_parts(x)[0]) < np.real(_parts(y)[0])

    def select(self, condition: Any, then: Any, otherwise: Any) -> FirstOrder:
        first, second = _parts(then), _parts(otherwise)
        return FirstOrder(np.where(condition, first[0], second[0]), np.where(condition, first[1], second[1]))


def _parts(x: Any) -> tuple[Any, Any]:
    return (x.value, x.slope) if isinstance(x, FirstOrder) else (x, 0.0)


def tangent_along(group: Group, theta: Array, direction: Array, *, inverse: bool = False) -> Array:
    """Return the derivative of T(theta), or with ``inverse`` of T(theta)^-1, along a direction of theta.

    The result has the shape (..., v_size, v_size).

    Parameters
    ----------
    theta, direction : (..., v_size), of the same shape or one that broadcasts
    """
    theta, direction = np.broadcast_arrays(theta, direction)
    moved = [FirstOrder(theta[..., k], direction[..., k]) for k in range(theta.shape[-1])]
    function = group.tangent_inverse if inverse else group.tangent
    rows: Rows = function(FirstOrderAlgebra(), moved)
    entries = [np.broadcast_to(_parts(entry)[1], theta.shape[:-1]) for row in rows for entry in row]
    return np.stack(entries, axis=-1).reshape(*theta.shape[:-1], len(rows), len(rows))
