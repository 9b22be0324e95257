"""Truncated Taylor series of second order in one variable: value, first derivative and half of the second.

Arrays of any shape; the three coefficients have the same shape. Formulas of scenes, kinematics and constraint rows are
evaluated on them, so velocities and accelerations follow without a second derivation.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]


class Jet:
    """c[0] + c[1] s + c[2] s^2 with arrays as coefficients."""

    __array_priority__ = 1000.0

    def __init__(self, c0: Any, c1: Any = 0.0, c2: Any = 0.0) -> None:
        c0, c1, c2 = np.broadcast_arrays(np.asarray(c0, float), np.asarray(c1, float), np.asarray(c2, float))
        self.c = (c0, c1, c2)

    @property
    def value(self) -> Array:
        return self.c[0]

    @property
    def rate(self) -> Array:
        return self.c[1]

    @property
    def second(self) -> Array:
        """Second derivative."""
        return 2.0 * self.c[2]

    @property
    def derivative(self) -> Jet:
        """The rate as a series; its second coefficient is unknown and set to nan."""
        return Jet(self.c[1], 2.0 * self.c[2], np.full_like(self.c[2], np.nan))

    def __getitem__(self, index: Any) -> Jet:
        return Jet(*(part[index] for part in self.c))

    def __add__(self, other: Any) -> Jet:
        other = jet(other)
        return Jet(*(a + b for a, b in zip(self.c, other.c, strict=True)))

    __radd__ = __add__

    def __neg__(self) -> Jet:
        return Jet(*(-a for a in self.c))

    def __pos__(self) -> Jet:
        return self

    def __sub__(self, other: Any) -> Jet:
        return self + (-jet(other))

    def __rsub__(self, other: Any) -> Jet:
        return jet(other) - self

    def _product(self, other: Any, multiply: Callable[[Array, Array], Array]) -> Jet:
        a, b = self.c, jet(other).c
        return Jet(
            multiply(a[0], b[0]),
            multiply(a[0], b[1]) + multiply(a[1], b[0]),
            multiply(a[0], b[2]) + multiply(a[1], b[1]) + multiply(a[2], b[0]),
        )

    def __mul__(self, other: Any) -> Jet:
        return self._product(other, np.multiply)

    __rmul__ = __mul__

    def __matmul__(self, other: Any) -> Jet:
        return self._product(other, np.matmul)

    def __rmatmul__(self, other: Any) -> Jet:
        return jet(other) @ self

    def __truediv__(self, other: Any) -> Jet:
        return self * jet(other).mapped(lambda x: (1 / x, -1 / x**2, 2 / x**3))

    def __rtruediv__(self, other: Any) -> Jet:
        return jet(other) / self

    def __pow__(self, other: Any) -> Jet:
        if isinstance(other, Jet) and np.any([np.any(part) for part in other.c[1:]]):
            return exp(other * log(self))
        n = float(other.value) if isinstance(other, Jet) else float(other)
        if n == int(n) and abs(n) <= 64:
            result = Jet(np.ones_like(self.c[0]))
            for _ in range(abs(int(n))):
                result = result * self
            return result if n >= 0 else 1.0 / result
        return self.mapped(lambda x: (x**n, n * x ** (n - 1), n * (n - 1) * x ** (n - 2)))

    def __rpow__(self, other: Any) -> Jet:
        return exp(self * math.log(other))

    def mapped(self, derivatives: Callable[[Array], tuple[Any, Any, Any]]) -> Jet:
        """Compose with a function of one argument that returns itself and its two derivatives."""
        f, f1, f2 = derivatives(self.c[0])
        return Jet(f, f1 * self.c[1], f1 * self.c[2] + 0.5 * f2 * self.c[1] ** 2)

    # Comparisons look at values; formulas of scenes compare single numbers.
    def __bool__(self) -> bool:
        return bool(self.c[0] != 0.0)

    def __lt__(self, other: Any) -> Any:
        return self.c[0] < jet(other).c[0]

    def __le__(self, other: Any) -> Any:
        return self.c[0] <= jet(other).c[0]

    def __gt__(self, other: Any) -> Any:
        return self.c[0] > jet(other).c[0]

    def __ge__(self, other: Any) -> Any:
        return self.c[0] >= jet(other).c[0]

    def transposed(self) -> Jet:
        """Swap the last two axes."""
        return Jet(*(np.swapaxes(part, -1, -2) for part in self.c))

    def sum(self) -> Jet:
        """Sum over the last axis."""
        return Jet(*(part.sum(axis=-1) for part in self.c))


def jet(value: Any) -> Jet:
    return value if isinstance(value, Jet) else Jet(value)


def stack(parts: list[Any], axis: int = -1) -> Jet:
    jets = [jet(part) for part in parts]
    return Jet(*(np.stack(np.broadcast_arrays(*(one.c[k] for one in jets)), axis=axis) for k in range(3)))


def sin(x: Any) -> Jet:
    return jet(x).mapped(lambda a: (np.sin(a), np.cos(a), -np.sin(a)))


def cos(x: Any) -> Jet:
    return jet(x).mapped(lambda a: (np.cos(a), -np.sin(a), -np.cos(a)))


def exp(x: Any) -> Jet:
    return jet(x).mapped(lambda a: (np.exp(a),) * 3)


def log(x: Any) -> Jet:
    return jet(x).mapped(lambda a: (np.log(a), 1 / a, -1 / a**2))


def sqrt(x: Any) -> Jet:
    return jet(x).mapped(lambda a: (np.sqrt(a), 0.5 / np.sqrt(a), -0.25 / np.sqrt(a) ** 3))


def tanh(x: Any) -> Jet:
    def derivatives(a: Array) -> tuple[Any, Any, Any]:
        y = np.tanh(a)
        return y, 1 - y**2, -2 * y * (1 - y**2)

    return jet(x).mapped(derivatives)


def atan(x: Any) -> Jet:
    return jet(x).mapped(lambda a: (np.arctan(a), 1 / (1 + a**2), -2 * a / (1 + a**2) ** 2))


def asin(x: Any) -> Jet:
    return jet(x).mapped(lambda a: (np.arcsin(a), (1 - a**2) ** -0.5, a * (1 - a**2) ** -1.5))


def absolute(x: Any) -> Jet:
    return jet(x).mapped(lambda a: (np.abs(a), np.sign(a), 0.0 * a))


def sign(x: Any) -> Jet:
    return jet(x).mapped(lambda a: (np.sign(a), 0.0 * a, 0.0 * a))


def atan2(y: Any, x: Any) -> Jet:
    """Angle of (x, y): value from NumPy, derivatives from x dy - y dx over the squared radius."""
    y, x = jet(y), jet(x)
    squared = x * x + y * y
    # d(angle) = (x y' - y x')/r^2, whose own derivative needs x'' and y'' only.
    first = (x.c[0] * y.c[1] - y.c[0] * x.c[1]) / squared.c[0]
    numerator_rate = x.c[0] * 2 * y.c[2] - y.c[0] * 2 * x.c[2]
    second = (numerator_rate - first * squared.c[1]) / squared.c[0]
    return Jet(np.arctan2(y.c[0], x.c[0]), first, 0.5 * second)


def minimum(*values: Any) -> Jet:
    result = jet(values[0])
    for value in map(jet, values[1:]):
        result = value if value.value < result.value else result
    return result


def maximum(*values: Any) -> Jet:
    return -minimum(*(-jet(value) for value in values))


def cross(a: Any, b: Any) -> Jet:
    return jet(a)._product(b, np.cross)


def dot(a: Any, b: Any) -> Jet:
    return (jet(a) * jet(b)).sum()


def rotated(R: Any, x: Any) -> Jet:
    """R x for matrices (..., 3, 3) and vectors (..., 3)."""
    return jet(R)._product(x, lambda A, b: np.einsum("...ij,...j->...i", A, b))


def rotation_vector(R: Any) -> Jet:
    """Rotation vector (..., 3) of matrices (..., 3, 3), angle in (0, pi), by the row of 4 p p^T of largest diagonal
    entry, p the quaternion: digits are kept up to half a turn."""
    R = jet(R)
    xx, yy, zz = (R[..., i, i] for i in range(3))
    x, y, z = (R[..., j, i] - R[..., i, j] for i, j in ((1, 2), (2, 0), (0, 1)))
    xy, xz, yz = (R[..., i, j] + R[..., j, i] for i, j in ((0, 1), (0, 2), (1, 2)))
    rows = (
        (1.0 + xx + yy + zz, x, y, z),
        (x, 1.0 + xx - yy - zz, xy, xz),
        (y, xy, 1.0 + yy - xx - zz, yz),
        (z, xz, yz, 1.0 + zz - xx - yy),
    )
    best = np.argmax(np.stack([row[i].value for i, row in enumerate(rows)], axis=-1), axis=-1)
    p = stack([_chosen([row[i] for row in rows], best) for i in range(4)])
    p = p * np.where(p.value[..., :1] < 0.0, -1.0, 1.0)
    length = sqrt(dot(p[..., 1:], p[..., 1:]))
    return p[..., 1:] * (2.0 * atan2(length, p[..., 0]) / length)[..., None]


def _chosen(values: list[Jet], best: Array) -> Jet:
    """Return by place the value of the number ``best``."""
    return Jet(*(np.choose(best, np.broadcast_arrays(*parts)) for parts in zip(*(v.c for v in values), strict=True)))
