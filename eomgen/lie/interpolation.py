"""Quintic Hermite interpolation in the Lie algebra between two states with velocities and accelerations; cubics between
two values.

q(s) = q_0 o exp(theta(s)) and v = T(theta) theta', so theta'(0) = v_0, theta''(0) = a_0, theta'(1) = T^-1 v_1 and
theta''(1) = T^-1 (a_1 - T' theta'). Hermite, J. reine angew. Math. 84 (1878) 64; charts of a group by exp and T:
Iserles, Munthe-Kaas, Norsett and Zanna, Acta Numerica 9 (2000) 215.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from eomgen.lie import numeric
from eomgen.lie.groups import Group, group_named
from eomgen.lie.product import Array, Factor, difference, update

Curve = tuple[Array, Array, Array]
#: Weights over [0, 1] of the value at 1, of the first and of the second derivatives at 0 and at 1; the value at 0 is
#: zero.
_VALUE = (0.0, 0.0, 0.0, 10.0, -15.0, 6.0)
_FIRST = ((0.0, 1.0, 0.0, -6.0, 8.0, -3.0), (0.0, 0.0, 0.0, -4.0, 7.0, -3.0))
_SECOND = ((0.0, 0.0, 0.5, -1.5, 1.5, -0.5), (0.0, 0.0, 0.0, 0.5, -1.0, 0.5))
#: The same of a cubic through two values with first derivatives.
_CUBIC = ((1.0, 0.0, -3.0, 2.0), (0.0, 0.0, 3.0, -2.0), (0.0, 1.0, -2.0, 1.0), (0.0, 0.0, -1.0, 1.0))
#: For derivatives without cancellation, by an imaginary step.
_TINY = 1e-200


def group_curve(factors: Sequence[Factor], first: Curve, last: Curve, duration: Array, s: Array) -> Curve:
    """Return q, v and a at the fractions s of the way from the first state to the last.

    Parameters
    ----------
    first, last : q (n, nq), v (n, nv), a (n, nv)
        With rotations of less than a full turn in between; the shorter way round is taken.
    duration, s : (n,)
        s, and 0 to 1.
    """
    q0, v0, a0 = first
    q1, v1, a1 = last
    h, x = duration[:, np.newaxis], s[:, np.newaxis]
    theta1 = difference(factors, q0, q1)
    rate1 = _each(factors, numeric.tangent_inverse, theta1, v1)
    second1 = _each(factors, numeric.tangent_inverse, theta1, a1 - _tangent_rate(factors, theta1, rate1))
    parts = (theta1, h * v0, h * rate1, h * h * a0, h * h * second1)
    weights = (_VALUE, *_FIRST, *_SECOND)
    theta, rate, second = (_sum(weights, parts, x, order) / h**order for order in range(3))
    v = _each(factors, numeric.tangent, theta, rate)
    return (
        update(factors, q0, theta),
        v,
        _each(factors, numeric.tangent, theta, second) + _tangent_rate(factors, theta, rate),
    )


def cubic(first: tuple[Array, Array], last: tuple[Array, Array], duration: Array, s: Array) -> tuple[Array, Array]:
    """Return values and derivatives (n, size) of the cubics through two values with derivatives, in a vector space."""
    h, x = duration[:, np.newaxis], s[:, np.newaxis]
    parts = (first[0], last[0], h * first[1], h * last[1])
    return _sum(_CUBIC, parts, x, 0), _sum(_CUBIC, parts, x, 1) / h


def _sum(weights: Sequence[Sequence[float]], parts: Sequence[Array], x: Array, order: int) -> Array:
    """Return the derivative of some order of a weighted sum of parts."""
    from numpy.polynomial.polynomial import polyder, polyval  # noqa: PLC0415  # many modules, for curves between rows

    total = np.zeros_like(parts[0])
    for weight, part in zip(weights, parts, strict=True):
        total = total + polyval(x, polyder(np.array(weight), order)) * part
    return total


def _each(factors: Sequence[Factor], matrix: Callable[[Group, Array], Array], theta: Array, x: Array) -> Array:
    """Return the matrices of the factors at theta (n, nv), times x (n, nv); of R^n they are the identity."""
    result = np.array(x, dtype=np.result_type(x, theta))
    for factor in factors:
        if factor.group != "R":
            part = factor.v
            of_factor = matrix(group_named(factor.group, factor.v_size), theta[..., part])
            result[..., part] = np.einsum("...ij,...j->...i", of_factor, x[..., part])
    return result


def _tangent_rate(factors: Sequence[Factor], theta: Array, rate: Array) -> Array:
    """Return T' theta', the acceleration from the rate of the tangent operator, by a complex step."""
    moved = _each(factors, numeric.tangent, theta + 1j * _TINY * rate, rate.astype(complex))
    result: Array = moved.imag / _TINY
    return result
