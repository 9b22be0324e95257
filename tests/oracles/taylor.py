"""Numbers with their first two time derivatives, over NumPy: accelerations of anything that is written as positions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from tests.oracles.evaluation import Array


@dataclass(frozen=True)
class Moving:
    """A quantity x(t) by x, x' and x'' now; arrays of any shape, real or complex."""

    x: Any
    v: Any = 0.0
    a: Any = 0.0

    def __add__(self, other: Moving | Any) -> Moving:
        y = moving(other)
        return Moving(self.x + y.x, self.v + y.v, self.a + y.a)

    __radd__ = __add__

    def __neg__(self) -> Moving:
        return Moving(-self.x, -self.v, -self.a)

    def __sub__(self, other: Moving | Any) -> Moving:
        return self + (-moving(other))

    def __rsub__(self, other: Any) -> Moving:
        return moving(other) - self

    def __mul__(self, other: Moving | Any) -> Moving:
        y = moving(other)
        return Moving(self.x * y.x, self.v * y.x + self.x * y.v, self.a * y.x + 2.0 * self.v * y.v + self.x * y.a)

    __rmul__ = __mul__

    def applied(self, value: Array, first: Array, second: Array) -> Moving:
        """Return f(x) from f, f' and f'' at x."""
        return Moving(value, first * self.v, first * self.a + second * self.v**2)


def moving(value: Moving | Any) -> Moving:
    return value if isinstance(value, Moving) else Moving(value)


def sin(y: Moving) -> Moving:
    return y.applied(np.sin(y.x), np.cos(y.x), -np.sin(y.x))


def cos(y: Moving) -> Moving:
    return y.applied(np.cos(y.x), -np.sin(y.x), -np.cos(y.x))


def sqrt(y: Moving) -> Moving:
    root = np.sqrt(y.x)
    return y.applied(root, 0.5 / root, -0.25 / (root * y.x))


def reciprocal(y: Moving) -> Moving:
    return y.applied(1.0 / y.x, -1.0 / y.x**2, 2.0 / y.x**3)


#: Three components, and three rows of three.
Vector = tuple[Moving, Moving, Moving]
Matrix = tuple[Vector, Vector, Vector]


def rotated(R: Matrix, s: Vector) -> Vector:
    x, y, z = (row[0] * s[0] + row[1] * s[1] + row[2] * s[2] for row in R)
    return (x, y, z)


def product(R: Matrix, S: Matrix) -> Matrix:
    columns = [rotated(R, (S[0][k], S[1][k], S[2][k])) for k in range(3)]
    rows = [(columns[0][i], columns[1][i], columns[2][i]) for i in range(3)]
    return (rows[0], rows[1], rows[2])


def shifted(p: Vector, s: Vector) -> Vector:
    return (p[0] + s[0], p[1] + s[1], p[2] + s[2])


def vector(values: Any) -> Vector:
    x, y, z = (moving(value) for value in values)
    return (x, y, z)


def rotation(theta: Vector) -> Matrix:
    """Return exp of a rotation vector that is not zero, by Rodrigues' formula."""
    angle = sqrt(theta[0] * theta[0] + theta[1] * theta[1] + theta[2] * theta[2])
    share = reciprocal(angle)
    n = [part * share for part in theta]
    c, s = cos(angle), sin(angle)
    skew = ((0.0, -n[2], n[1]), (n[2], 0.0, -n[0]), (-n[1], n[0], 0.0))
    rows = []
    for i in range(3):
        row = []
        for j in range(3):
            row.append(moving((1.0 - c) * n[i] * n[j] + s * skew[i][j] + (c if i == j else 0.0)))
        rows.append((row[0], row[1], row[2]))
    return (rows[0], rows[1], rows[2])
