"""Paths: components of a vector in moving axes with their time derivatives, and their change of frame.

For y = R^T x with R' = R w~, the k-th derivative of x seen in the child is (d/dt + w~)^k y. So
only R itself and cross products with w and its derivatives are needed. With Y[k][m] = d^m/dt^m (d/dt + w~)^k
y,

    Y[k+1][m] = Y[k][m+1] + sum_i binomial(m, i) w^(i) x Y[k][m-i]

leads from Y[k][0], the parent's derivatives, to Y[0][m], the child's, and back. Summed along k + m = constant, each
w^(i) is crossed with one sum only, which saves operations against the product rule for R^T x: a second
derivative of a planar rotation costs 16 instead of 22.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from eomgen.mechanics.kinematics.fields import Field
from eomgen.symbolic.rotation import Rotation
from eomgen.symbolic.scalar import Matrix, Scalar, Vector, apply, cross, matrix_plus, minus, plus, scaled, skew

#: Derivatives from order 0 on.
Numbers = Sequence[Scalar]
Path = list[Vector]
Entry = Callable[[int, int], Vector]


def to_child(rotation: Rotation, turn: Sequence[Vector], x: Sequence[Vector]) -> Path:
    """Return the path of R^T x, as long as the path of x; ``turn`` is the path of w in child axes."""
    return in_rotating_axes([rotation.rotate_back(value) for value in x], turn)


def in_rotating_axes(rotated: Sequence[Vector], turn: Sequence[Vector]) -> Path:
    """Return the path of y in axes that rotate with w, from the derivatives Y[k][0] = (d/dt + w~)^k y."""
    table = {(k, 0): value for k, value in enumerate(rotated)}

    def entry(k: int, m: int) -> Vector:
        if (k, m) not in table:
            last = k + m - 1
            table[k, m] = minus(rotated[k + m], _crossed(turn, entry, range(k, last + 1), last))
        return table[k, m]

    return [entry(0, m) for m in range(len(rotated))]


def to_parent(rotation: Rotation, turn: Sequence[Vector], y: Sequence[Vector]) -> Path:
    """Return the path of R y, as long as the path of y; ``turn`` is the path of w in child axes."""
    table = {(0, m): value for m, value in enumerate(y)}

    def entry(k: int, m: int) -> Vector:
        if (k, m) not in table:
            table[k, m] = plus(y[k + m], _crossed(turn, entry, range(k), k + m - 1))
        return table[k, m]

    return [rotation.rotate(entry(k, 0)) for k in range(len(y))]


def _crossed(turn: Sequence[Vector], entry: Entry, rows: range, last: int) -> Vector:
    """Return the sum over rows k and orders i of binomial(last - k, i) w^(i) x Y[k][last - k - i]."""
    total: Vector | None = None
    for i in range(last - rows.start + 1):
        sources = [(math.comb(last - k, i), entry(k, last - k - i)) for k in rows if last - k >= i]
        product = cross(turn[i], _weighted(sources))
        total = product if total is None else plus(total, product)
    if total is None:
        raise ValueError("a derivative of order zero is given, not summed")
    return total


def _weighted(sources: Sequence[tuple[int, Vector]]) -> Vector:
    """Return a sum with small integer weights, the plain sum first: that one occurs at the order below as well."""
    total = sources[0][1]
    for _, vector in sources[1:]:
        total = plus(total, vector)
    for weight, vector in sources:
        if weight == 2:
            total = plus(total, vector)
        elif weight > 2:
            total = plus(total, scaled(weight - 1, vector))
    return total


def product(x: Numbers, y: Numbers, order: int) -> Scalar:
    """Return d^order/dt^order (x y) by Leibniz' rule; equal weights are multiplied once."""
    total = x[0] * y[order]
    if order:
        total = x[order] * y[0] + total
    for k in range(1, (order + 1) // 2):
        total = total + math.comb(order, k) * (x[k] * y[order - k] + x[order - k] * y[k])
    if order and order % 2 == 0:
        half = order // 2
        total = total + (math.comb(order, half) * x[half]) * y[half]
    return total


def square(x: Numbers, order: int) -> Scalar:
    """Return d^order/dt^order x^2."""
    if order == 0:
        return x[0] * x[0]
    if order % 2:
        total = (2.0 * x[order]) * x[0]
        for k in range(1, (order + 1) // 2):
            total = total + (2.0 * math.comb(order, k)) * (x[k] * x[order - k])
        return total
    half = order // 2
    total = 2.0 * (x[0] * x[order])
    for k in range(1, half):
        total = total + (2.0 * math.comb(order, k)) * (x[k] * x[order - k])
    return total + (math.comb(order, half) * x[half]) * x[half]


def cross_path(x: Sequence[Vector], y: Sequence[Vector], order: int) -> Vector:
    """Return d^order/dt^order (x cross y)."""
    total = cross(x[0], y[order])
    for k in range(1, order + 1):
        total = plus(total, scaled(math.comb(order, k), cross(x[k], y[order - k])))
    return total


def centripetal_path(omega: Sequence[Vector], order: int) -> Matrix:
    """Return d^order/dt^order (omega~ omega~), (3, 3), symmetric by structure."""
    x, y, z = ([value[k] for value in omega] for k in range(3))
    xx, yy, zz = (square(component, order) for component in (x, y, z))
    xy, xz, yz = product(x, y, order), product(x, z, order), product(y, z, order)
    return ((-(yy + zz), xy, xz), (xy, -(xx + zz), yz), (xz, yz, -(xx + yy)))


def at_path(fields: Sequence[Field], position: Sequence[Vector], order: int) -> Vector:
    """Return d^order/dt^order of the acceleration at a position that moves in the field's axes."""
    total = fields[order].at(position[0])
    for k in range(1, order + 1):
        if any(not value.is_zero for value in position[k]):
            gradient = matrix_plus(fields[order - k].symmetric, skew(fields[order - k].alpha))
            total = plus(total, scaled(math.comb(order, k), apply(gradient, position[k])))
    return total
