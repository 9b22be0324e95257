"""Numbers with an infinitesimal part: exact derivatives of group functions, of complex numbers too."""

from __future__ import annotations

from typing import Any

import numpy as np

from eomgen.lie.algebra import NumpyAlgebra
from eomgen.lie.groups import Group
from eomgen.lie.numeric import Array
from eomgen.lie.rotations import Rows


class FirstOrder:
    """x + e y with e^2 = 0, x and y arrays of any batch shape, real or complex (Clifford's dual numbers).

    Sums, products, differences and quotients with numbers and arrays; a number stands left of + and * only.
    """

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
    """Functions of them; comparisons look at real parts."""

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
        one, other = _parts(then), _parts(otherwise)
        return FirstOrder(np.where(condition, one[0], other[0]), np.where(condition, one[1], other[1]))


def _parts(x: Any) -> tuple[Any, Any]:
    return (x.value, x.slope) if isinstance(x, FirstOrder) else (x, 0.0)


def tangent_along(group: Group, theta: Array, direction: Array, *, inverse: bool = False) -> Array:
    """Return the derivative of T(theta), or of its inverse, along a direction of theta, (..., v_size, v_size).

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
