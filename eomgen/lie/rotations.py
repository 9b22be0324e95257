"""Rotations by unit quaternions (w, x, y, z): product, matrix, exp, log and the tangent of exp, on values of any
algebra."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from eomgen.lie.algebra import Algebra, Value
from eomgen.lie.coefficients import angle_factor, f2_to_f5, f6_f8, half_angle
from eomgen.symbolic.scalar import cross, dot, matrix_plus, plus, scaled

Values = Sequence[Value]
Rows = list[list[Value]]
# rows of three values; the small matrices of symbolic.scalar do not care whether values are arrays or scalars
Matrix3 = Any


def quaternion_product(p: Values, r: Values) -> list[Value]:
    """Return the Hamilton product p r."""
    vector = plus(plus(scaled(p[0], r[1:]), scaled(r[0], p[1:])), cross(p[1:], r[1:]))  # type: ignore[arg-type]
    return [p[0] * r[0] - dot(p[1:], r[1:]), *vector]


def rotation_matrix(p: Values) -> Matrix3:
    """Return R(p) of a unit quaternion, body axes to reference axes."""
    w, x, y, z = p
    return (
        ((y * y + z * z) * (-2.0) + 1.0, (x * y - w * z) * 2.0, (x * z + w * y) * 2.0),
        ((x * y + w * z) * 2.0, (x * x + z * z) * (-2.0) + 1.0, (y * z - w * x) * 2.0),
        ((x * z - w * y) * 2.0, (y * z + w * x) * 2.0, (x * x + y * y) * (-2.0) + 1.0),
    )


def skew(x: Values) -> Matrix3:
    """Return the matrix of the cross product with x; its diagonal is zero by structure."""
    return ((0.0, x[2] * (-1.0), x[1]), (x[2], 0.0, x[0] * (-1.0)), (x[1] * (-1.0), x[0], 0.0))


def times(factor: Value, A: Matrix3) -> Matrix3:
    """Return factor A."""
    return tuple(tuple(entry * factor for entry in row) for row in A)


def total(*matrices: Matrix3) -> Matrix3:
    """Return the sum of matrices."""
    result = matrices[0]
    for A in matrices[1:]:
        result = matrix_plus(result, A)
    return result


def skew_square(x: Values) -> Matrix3:
    """Return skew(x)^2 = x x^T - |x|^2 I."""
    return skew_product(x, x)


def skew_product(x: Values, y: Values) -> Matrix3:
    """Return (skew(x) skew(y) + skew(y) skew(x))/2 = (x y^T + y x^T)/2 - (x.y) I, 3 x 3, exactly symmetric."""
    inner = dot(x, y)

    def entry(i: int, j: int) -> Value:
        mean = x[i] * y[i] if i == j else (x[i] * y[j] + x[j] * y[i]) * 0.5
        return mean - inner if i == j else mean

    upper = {(i, j): entry(i, j) for i in range(3) for j in range(i, 3)}
    return tuple(tuple(upper[min(i, j), max(i, j)] for j in range(3)) for i in range(3))


IDENTITY: Matrix3 = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
ZERO: Matrix3 = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def blocks(upper_left: Matrix3, upper_right: Matrix3, lower_left: Matrix3, lower_right: Matrix3) -> Rows:
    """Return the 6 x 6 matrix with four 3 x 3 blocks, as rows.

    Parameters
    ----------
    upper_left, upper_right, lower_left, lower_right : 3 x 3 nested sequences
        Values of any algebra.
    """
    top = [[*left, *right] for left, right in zip(upper_left, upper_right, strict=True)]
    return top + [[*left, *right] for left, right in zip(lower_left, lower_right, strict=True)]


def tangent(algebra: Algebra, omega: Values) -> Matrix3:
    """Return T = I + f2 skew + f3 skew^2."""
    f2, f3 = f2_to_f5(algebra, dot(omega, omega), up_to=3)
    return total(IDENTITY, times(f2, skew(omega)), times(f3, skew_square(omega)))


def tangent_inverse(omega: Values) -> Matrix3:
    """Return T^-1 = I + skew/2 + f6 skew^2."""
    (f6,) = f6_f8(dot(omega, omega), up_to=6)
    return total(IDENTITY, times(0.5, skew(omega)), times(f6, skew_square(omega)))


def exponential(algebra: Algebra, omega: Values) -> list[Value]:
    """Return (cos(x/2), sin(x/2) omega/x), x = |omega|."""
    sinc, cosine = half_angle(algebra, dot(omega, omega))
    return [cosine, *scaled(sinc * 0.5, tuple(omega))]


def logarithm(algebra: Algebra, p: Values) -> list[Value]:
    """Return the rotation vector of length at most pi."""
    return list(scaled(angle_factor(algebra, p[0], dot(p[1:], p[1:])), tuple(p[1:])))


def conjugate(p: Values) -> list[Value]:
    """Return (w, -x, -y, -z)."""
    return [p[0], *(x * (-1.0) for x in p[1:])]
