"""The groups: R^n, SO(3), SE(3) and R^3 x SO(3), each defined once over an algebra of values.

Elements and increments are sequences of values. Rotations are unit quaternions (w, x, y, z) of continuous sign, never
flipped; poses are quaternion, then position; velocities and increments have their angular part first. Everything is
left-trivialised:
q_dot = q * tilde(v), ad(v) w is the bracket [v, w], and exp(theta)^-1 d exp(theta) = (T(theta) d theta)~.
Iserles, Munthe-Kaas, Norsett and Zanna, Acta Numerica 9 (2000) 215; Bruls, Cardona and Arnold, Mech. Mach. Theory 48
(2012) 121.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

from eomgen.base.data import dataclass
from eomgen.lie import rotations
from eomgen.lie.algebra import Algebra, Value
from eomgen.lie.coefficients import f2_to_f5, f6_f8
from eomgen.lie.rotations import (
    IDENTITY,
    ZERO,
    Rows,
    Values,
    blocks,
    conjugate,
    quaternion_product,
    rotation_matrix,
    skew,
    skew_product,
    skew_square,
    times,
    total,
)
from eomgen.symbolic.scalar import apply, dot, multiply, plus, transpose


@dataclass(frozen=True)
class Group(ABC):
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

    @abstractmethod
    def exp(self, algebra: Algebra, theta: Values) -> list[Value]:
        """Return exp of an increment. The quaternion has w = cos(|angle|/2): it starts at +1 and is never flipped."""

    @abstractmethod
    def log(self, algebra: Algebra, q: Values) -> list[Value]:
        """Return theta with exp(theta) = q up to the quaternion's sign, and rotation angle at most pi."""

    @abstractmethod
    def compose(self, first: Values, second: Values) -> list[Value]:
        """Return first * second."""

    def update(self, algebra: Algebra, q: Values, theta: Values) -> list[Value]:
        """Return q * exp(theta), with the quaternion scaled back to unit length and the sign kept."""
        moved = self.compose(q, self.exp(algebra, theta))
        if not self.quaternion:
            return moved
        length = algebra.sqrt(dot(moved[:4], moved[:4]))
        return [*(x / length for x in moved[:4]), *moved[4:]]

    @abstractmethod
    def inverse(self, q: Values) -> list[Value]:
        """Return q^-1."""

    @abstractmethod
    def adjoint(self, q: Values) -> Rows:
        """Return Ad: (Ad(q) v)~ = q tilde(v) q^-1."""

    @abstractmethod
    def bracket_matrix(self, v: Values) -> Rows:
        """Return ad: ad(v) w = [v, w]."""

    @abstractmethod
    def tangent(self, algebra: Algebra, theta: Values) -> Rows:
        """Return T: exp(theta)^-1 d exp(theta) = (T(theta) d theta)~. Singular at a rotation angle of 2 pi."""

    @abstractmethod
    def tangent_inverse(self, algebra: Algebra, theta: Values) -> Rows:
        """Return T^-1, for rotation angles below 2 pi."""


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
        return rotations.exponential(algebra, theta)

    def log(self, algebra: Algebra, q: Values) -> list[Value]:
        return rotations.logarithm(algebra, q)

    def compose(self, first: Values, second: Values) -> list[Value]:
        return quaternion_product(first, second)

    def inverse(self, q: Values) -> list[Value]:
        return conjugate(q)

    def adjoint(self, q: Values) -> Rows:
        return [list(row) for row in rotation_matrix(q)]

    def bracket_matrix(self, v: Values) -> Rows:
        return [list(row) for row in skew(v)]

    def tangent(self, algebra: Algebra, theta: Values) -> Rows:
        return [list(row) for row in rotations.tangent(algebra, theta)]

    def tangent_inverse(self, algebra: Algebra, theta: Values) -> Rows:
        return [list(row) for row in rotations.tangent_inverse(theta)]


class Poses(Group):
    """SE(3), stored as quaternion and position, S^3 semidirect R^3; v = (omega, R^T x_dot) is the body twist."""

    def exp(self, algebra: Algebra, theta: Values) -> list[Value]:
        tangent = rotations.tangent(algebra, theta[:3])
        return [*rotations.exponential(algebra, theta[:3]), *apply(transpose(tangent), theta[3:])]  # type: ignore[arg-type]

    def log(self, algebra: Algebra, q: Values) -> list[Value]:
        omega = rotations.logarithm(algebra, q[:4])
        return [*omega, *apply(transpose(rotations.tangent_inverse(omega)), q[4:])]  # type: ignore[arg-type]

    def compose(self, first: Values, second: Values) -> list[Value]:
        position = plus(first[4:], apply(rotation_matrix(first[:4]), second[4:]))  # type: ignore[arg-type]
        return [*quaternion_product(first[:4], second[:4]), *position]

    def inverse(self, q: Values) -> list[Value]:
        position = apply(transpose(rotation_matrix(q[:4])), q[4:])  # type: ignore[arg-type]
        return [*conjugate(q[:4]), *(x * (-1.0) for x in position)]

    def adjoint(self, q: Values) -> Rows:
        R = rotation_matrix(q[:4])
        return blocks(R, ZERO, multiply(skew(q[4:]), R), R)

    def bracket_matrix(self, v: Values) -> Rows:
        return blocks(skew(v[:3]), ZERO, skew(v[3:]), skew(v[:3]))

    def tangent(self, algebra: Algebra, theta: Values) -> Rows:
        omega, shift = theta[:3], theta[3:]
        f2, f3, f4, f5 = f2_to_f5(algebra, dot(omega, omega))
        square, inner = skew_square(omega), dot(omega, shift)
        diagonal = total(IDENTITY, times(f2, skew(omega)), times(f3, square))
        coupling = total(
            times(f2, skew(shift)),
            times(f3 * 2.0, skew_product(omega, shift)),
            times(f4 * inner, skew(omega)),
            times(f5 * inner * (-1.0), square),
        )
        return blocks(diagonal, ZERO, coupling, diagonal)

    def tangent_inverse(self, algebra: Algebra, theta: Values) -> Rows:
        omega, shift = theta[:3], theta[3:]
        f6, f8 = f6_f8(dot(omega, omega))
        square = skew_square(omega)
        diagonal = total(IDENTITY, times(0.5, skew(omega)), times(f6, square))
        coupling = total(
            times(0.5, skew(shift)), times(f6 * 2.0, skew_product(omega, shift)), times(f8 * dot(omega, shift), square)
        )
        return blocks(diagonal, ZERO, coupling, diagonal)


class RotationsAndTranslations(Group):
    """R^3 x SO(3) as quaternion and position; v = (omega in body axes, x_dot in reference axes)."""

    def exp(self, algebra: Algebra, theta: Values) -> list[Value]:
        return [*rotations.exponential(algebra, theta[:3]), *theta[3:]]

    def log(self, algebra: Algebra, q: Values) -> list[Value]:
        return [*rotations.logarithm(algebra, q[:4]), *q[4:]]

    def compose(self, first: Values, second: Values) -> list[Value]:
        return [
            *quaternion_product(first[:4], second[:4]),
            *(x + y for x, y in zip(first[4:], second[4:], strict=True)),
        ]

    def inverse(self, q: Values) -> list[Value]:
        return [*conjugate(q[:4]), *(x * (-1.0) for x in q[4:])]

    def adjoint(self, q: Values) -> Rows:
        return blocks(rotation_matrix(q[:4]), ZERO, ZERO, IDENTITY)

    def bracket_matrix(self, v: Values) -> Rows:
        return blocks(skew(v[:3]), ZERO, ZERO, ZERO)

    def tangent(self, algebra: Algebra, theta: Values) -> Rows:
        return blocks(rotations.tangent(algebra, theta[:3]), ZERO, ZERO, IDENTITY)

    def tangent_inverse(self, algebra: Algebra, theta: Values) -> Rows:
        return blocks(rotations.tangent_inverse(theta[:3]), ZERO, ZERO, IDENTITY)


def real_space(size: int) -> Group:
    """Return R^size."""
    return RealSpace("R", size, size, (0.0,) * size, False)


SO3: Group = Rotations("SO3", 4, 3, (1.0, 0.0, 0.0, 0.0), True)
SE3: Group = Poses("SE3", 7, 6, (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), True)
R3xSO3: Group = RotationsAndTranslations("R3xSO3", 7, 6, (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), True)

_NAMED = {group.name: group for group in (SO3, SE3, R3xSO3)}


def group_named(name: str, size: int = 1) -> Group:
    """Return a group by name in a Factor; ``size``: dimension of R^n. Raises KeyError for an unknown name."""
    return real_space(size) if name == "R" else _NAMED[name]
