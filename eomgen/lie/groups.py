"""The groups: R^n, SO(3), SE(3) and R^3 x SO(3), each defined once over an algebra of values.

Elements and increments are sequences of values. Rotations are unit quaternions (w, x, y, z), whose sign is never flipped;
poses are quaternion, then position; velocities and increments have their angular part first. Everything is left-trivialised:
q_dot = q * tilde(v), ad(v) w is the bracket [v, w], and exp(theta)^-1 d exp(theta) = (T(theta) d theta)~.
Iserles, Munthe-Kaas, Norsett and Zanna, Acta Numerica 9 (2000) 215; Bruls, Cardona and Arnold, Mech. Mach. Theory 48 (2012) 121.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from eomgen.lie.algebra import Algebra, Value
from eomgen.lie.coefficients import angle_factor, f2_to_f5, f6_f8, half_angle
from eomgen.symbolic.scalar import apply, cross, dot, matrix_plus, multiply, plus, scaled, transpose

Values = Sequence[Value]
Rows = list[list[Value]]
Matrix3 = Any  # rows of three values; the small matrices of symbolic.scalar do not care whether values are arrays or scalars


def quaternion_product(p: Values, r: Values) -> list[Value]:
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


def _times(factor: Value, A: Matrix3) -> Matrix3:
    return tuple(tuple(entry * factor for entry in row) for row in A)


def _sum(*matrices: Matrix3) -> Matrix3:
    total = matrices[0]
    for A in matrices[1:]:
        total = matrix_plus(total, A)
    return total


def _square(x: Values) -> Matrix3:
    """Return skew(x)^2 = x x^T - |x|^2 I."""
    return _symmetric_product(x, x)


def _symmetric_product(x: Values, y: Values) -> Matrix3:
    """Return (skew(x) skew(y) + skew(y) skew(x))/2 = (x y^T + y x^T)/2 - (x.y) I, exactly symmetric."""
    inner = dot(x, y)

    def entry(i: int, j: int) -> Value:
        mean = x[i] * y[i] if i == j else (x[i] * y[j] + x[j] * y[i]) * 0.5
        return mean - inner if i == j else mean

    upper = {(i, j): entry(i, j) for i in range(3) for j in range(i, 3)}
    return tuple(tuple(upper[min(i, j), max(i, j)] for j in range(3)) for i in range(3))


_IDENTITY: Matrix3 = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
_ZERO: Matrix3 = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def _blocks(upper_left: Matrix3, upper_right: Matrix3, lower_left: Matrix3, lower_right: Matrix3) -> Rows:
    top = [[*left, *right] for left, right in zip(upper_left, upper_right, strict=True)]
    return top + [[*left, *right] for left, right in zip(lower_left, lower_right, strict=True)]


def _tangent_so3(algebra: Algebra, omega: Values) -> Matrix3:
    f2, f3 = f2_to_f5(algebra, dot(omega, omega), up_to=3)
    return _sum(_IDENTITY, _times(f2, skew(omega)), _times(f3, _square(omega)))


def _tangent_inverse_so3(omega: Values) -> Matrix3:
    (f6,) = f6_f8(dot(omega, omega), up_to=6)
    return _sum(_IDENTITY, _times(0.5, skew(omega)), _times(f6, _square(omega)))


def _exp_so3(algebra: Algebra, omega: Values) -> list[Value]:
    sinc, cosine = half_angle(algebra, dot(omega, omega))
    return [cosine, *scaled(sinc * 0.5, tuple(omega))]


def _log_so3(algebra: Algebra, p: Values) -> list[Value]:
    return list(scaled(angle_factor(algebra, p[0], dot(p[1:], p[1:])), tuple(p[1:])))


def _conjugate(p: Values) -> list[Value]:
    return [p[0], *(x * (-1.0) for x in p[1:])]


@dataclass(frozen=True)
class Group:
    """A Lie group with its storage.

    Attributes
    ----------
    name : str
        ``R`` (of any size), ``SO3``, ``SE3`` or ``R3xSO3``.
    q_size, v_size : int
        Numbers stored for an element, and its dimension.
    identity : tuple of float
        The neutral element.
    quaternion : bool
        Whether an element begins with a unit quaternion.
    """

    name: str
    q_size: int
    v_size: int
    identity: tuple[float, ...]
    quaternion: bool

    def exp(self, algebra: Algebra, theta: Values) -> list[Value]:
        """Return exp of an increment. The quaternion has w = cos(|angle|/2): it starts at +1 and is never flipped."""
        raise NotImplementedError

    def log(self, algebra: Algebra, q: Values) -> list[Value]:
        """Return theta with exp(theta) = q up to the quaternion's sign, and rotation angle at most pi."""
        raise NotImplementedError

    def compose(self, first: Values, second: Values) -> list[Value]:
        """Return first * second."""
        raise NotImplementedError

    def update(self, algebra: Algebra, q: Values, theta: Values) -> list[Value]:
        """Return q * exp(theta), its quaternion scaled back to unit length, its sign kept."""
        moved = self.compose(q, self.exp(algebra, theta))
        if not self.quaternion:
            return moved
        length = algebra.sqrt(dot(moved[:4], moved[:4]))
        return [*(x / length for x in moved[:4]), *moved[4:]]

    def inverse(self, q: Values) -> list[Value]:
        """Return q^-1."""
        raise NotImplementedError

    def adjoint(self, q: Values) -> Rows:
        """Return Ad: (Ad(q) v)~ = q tilde(v) q^-1."""
        raise NotImplementedError

    def bracket_matrix(self, v: Values) -> Rows:
        """Return ad: ad(v) w = [v, w]."""
        raise NotImplementedError

    def tangent(self, algebra: Algebra, theta: Values) -> Rows:
        """Return T: exp(theta)^-1 d exp(theta) = (T(theta) d theta)~. Singular at a rotation angle of 2 pi."""
        raise NotImplementedError

    def tangent_inverse(self, algebra: Algebra, theta: Values) -> Rows:
        """Return T^-1, for rotation angles below 2 pi."""
        raise NotImplementedError


class RealSpace(Group):
    """R^n with addition."""

    def exp(self, algebra: Algebra, theta: Values) -> list[Value]:
        return list(theta)

    def log(self, algebra: Algebra, q: Values) -> list[Value]:
        return list(q)

    def compose(self, first: Values, second: Values) -> list[Value]:
        return [x + y for x, y in zip(first, second, strict=True)]

    def inverse(self, q: Values) -> list[Value]:
        return [x * (-1.0) for x in q]

    def adjoint(self, q: Values) -> Rows:
        return [[1.0 if i == j else 0.0 for j in range(len(q))] for i in range(len(q))]

    def bracket_matrix(self, v: Values) -> Rows:
        return [[0.0] * len(v) for _ in v]

    def tangent(self, algebra: Algebra, theta: Values) -> Rows:
        return self.adjoint(theta)

    def tangent_inverse(self, algebra: Algebra, theta: Values) -> Rows:
        return self.adjoint(theta)


class Rotations(Group):
    """SO(3) stored as a unit quaternion; v is the angular velocity in body axes."""

    def exp(self, algebra: Algebra, theta: Values) -> list[Value]:
        return _exp_so3(algebra, theta)

    def log(self, algebra: Algebra, q: Values) -> list[Value]:
        return _log_so3(algebra, q)

    def compose(self, first: Values, second: Values) -> list[Value]:
        return quaternion_product(first, second)

    def inverse(self, q: Values) -> list[Value]:
        return _conjugate(q)

    def adjoint(self, q: Values) -> Rows:
        return [list(row) for row in rotation_matrix(q)]

    def bracket_matrix(self, v: Values) -> Rows:
        return [list(row) for row in skew(v)]

    def tangent(self, algebra: Algebra, theta: Values) -> Rows:
        return [list(row) for row in _tangent_so3(algebra, theta)]

    def tangent_inverse(self, algebra: Algebra, theta: Values) -> Rows:
        return [list(row) for row in _tangent_inverse_so3(theta)]


class Poses(Group):
    """SE(3) stored as quaternion and position; v = (omega, R^T x_dot), the body twist. S^3 semidirect R^3 is this group."""

    def exp(self, algebra: Algebra, theta: Values) -> list[Value]:
        tangent = _tangent_so3(algebra, theta[:3])
        return [*_exp_so3(algebra, theta[:3]), *apply(transpose(tangent), theta[3:])]  # type: ignore[arg-type]

    def log(self, algebra: Algebra, q: Values) -> list[Value]:
        omega = _log_so3(algebra, q[:4])
        return [*omega, *apply(transpose(_tangent_inverse_so3(omega)), q[4:])]  # type: ignore[arg-type]

    def compose(self, first: Values, second: Values) -> list[Value]:
        position = plus(first[4:], apply(rotation_matrix(first[:4]), second[4:]))  # type: ignore[arg-type]
        return [*quaternion_product(first[:4], second[:4]), *position]

    def inverse(self, q: Values) -> list[Value]:
        position = apply(transpose(rotation_matrix(q[:4])), q[4:])  # type: ignore[arg-type]
        return [*_conjugate(q[:4]), *(x * (-1.0) for x in position)]

    def adjoint(self, q: Values) -> Rows:
        R = rotation_matrix(q[:4])
        return _blocks(R, _ZERO, multiply(skew(q[4:]), R), R)

    def bracket_matrix(self, v: Values) -> Rows:
        return _blocks(skew(v[:3]), _ZERO, skew(v[3:]), skew(v[:3]))

    def tangent(self, algebra: Algebra, theta: Values) -> Rows:
        omega, shift = theta[:3], theta[3:]
        f2, f3, f4, f5 = f2_to_f5(algebra, dot(omega, omega))
        square, inner = _square(omega), dot(omega, shift)
        diagonal = _sum(_IDENTITY, _times(f2, skew(omega)), _times(f3, square))
        coupling = _sum(
            _times(f2, skew(shift)), _times(f3 * 2.0, _symmetric_product(omega, shift)),
            _times(f4 * inner, skew(omega)), _times(f5 * inner * (-1.0), square),
        )  # fmt: skip
        return _blocks(diagonal, _ZERO, coupling, diagonal)

    def tangent_inverse(self, algebra: Algebra, theta: Values) -> Rows:
        omega, shift = theta[:3], theta[3:]
        f6, f8 = f6_f8(dot(omega, omega))
        square = _square(omega)
        diagonal = _sum(_IDENTITY, _times(0.5, skew(omega)), _times(f6, square))
        coupling = _sum(
            _times(0.5, skew(shift)), _times(f6 * 2.0, _symmetric_product(omega, shift)), _times(f8 * dot(omega, shift), square)
        )
        return _blocks(diagonal, _ZERO, coupling, diagonal)


class RotationsAndTranslations(Group):
    """R^3 x SO(3), a direct product, stored as quaternion and position; v = (omega in body axes, x_dot in reference axes)."""

    def exp(self, algebra: Algebra, theta: Values) -> list[Value]:
        return [*_exp_so3(algebra, theta[:3]), *theta[3:]]

    def log(self, algebra: Algebra, q: Values) -> list[Value]:
        return [*_log_so3(algebra, q[:4]), *q[4:]]

    def compose(self, first: Values, second: Values) -> list[Value]:
        return [*quaternion_product(first[:4], second[:4]), *(x + y for x, y in zip(first[4:], second[4:], strict=True))]

    def inverse(self, q: Values) -> list[Value]:
        return [*_conjugate(q[:4]), *(x * (-1.0) for x in q[4:])]

    def adjoint(self, q: Values) -> Rows:
        return _blocks(rotation_matrix(q[:4]), _ZERO, _ZERO, _IDENTITY)

    def bracket_matrix(self, v: Values) -> Rows:
        return _blocks(skew(v[:3]), _ZERO, _ZERO, _ZERO)

    def tangent(self, algebra: Algebra, theta: Values) -> Rows:
        return _blocks(_tangent_so3(algebra, theta[:3]), _ZERO, _ZERO, _IDENTITY)

    def tangent_inverse(self, algebra: Algebra, theta: Values) -> Rows:
        return _blocks(_tangent_inverse_so3(theta[:3]), _ZERO, _ZERO, _IDENTITY)


def real_space(size: int) -> Group:
    """Return R^size."""
    return RealSpace("R", size, size, (0.0,) * size, False)


SO3: Group = Rotations("SO3", 4, 3, (1.0, 0.0, 0.0, 0.0), True)
SE3: Group = Poses("SE3", 7, 6, (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), True)
R3xSO3: Group = RotationsAndTranslations("R3xSO3", 7, 6, (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), True)

_NAMED = {group.name: group for group in (SO3, SE3, R3xSO3)}


def group_named(name: str, size: int = 1) -> Group:
    """Return a group by the name that a Factor carries; ``size`` is that of R^n. Raises KeyError for an unknown name."""
    return real_space(size) if name == "R" else _NAMED[name]
