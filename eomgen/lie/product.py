"""The configuration, a product of groups: steps (``update``), differences and tangents of flat vectors q and v, also in
batches, factor by factor; and curves between two states.

Curves are quintic Hermite interpolations in the Lie algebra between two states with velocities and accelerations, and
cubics between two values. q(s) = q_0 o exp(theta(s)) and v = T(theta) theta', so theta'(0) = v_0, theta''(0) = a_0,
theta'(1) = T^-1 v_1 and theta''(1) = T^-1 (a_1 - T' theta'). Hermite, J. reine angew. Math. 84 (1878) 64; charts of a
group by exp and T: Iserles, Munthe-Kaas, Norsett and Zanna, Acta Numerica 9 (2000) 215.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.base.data import dataclass
from eomgen.lie import numeric
from eomgen.lie.groups import Group, group_named

Array = NDArray[Any]
Places = slice | NDArray[np.intp]
#: Components of increments at once: each takes some twenty numbers on the way.
_LARGE = 2**18


@dataclass(frozen=True)
class Factor:
    """A factor of the configuration group: ``R`` (any size), ``SO3`` (4 numbers of q, 3 of v) or ``SE3`` (7, 6)."""

    group: str
    name: str
    q_start: int
    q_size: int
    v_start: int
    v_size: int

    @property
    def q(self) -> slice:
        return slice(self.q_start, self.q_start + self.q_size)

    @property
    def v(self) -> slice:
        return slice(self.v_start, self.v_start + self.v_size)


def turned(factors: Sequence[Factor], v: Array, before: Array, after: Array) -> Array:
    """Return velocities (nv,) in body axes at another configuration: vectors that stay the same in the axes of the
    parents.

    Parameters
    ----------
    factors : of the configuration, a product of groups; components of R are unchanged
    v : (nv,) velocities at ``before``, rad/s and m/s, left-trivialised
    before, after : (nq,) configurations; quaternions (w, x, y, z)
    """
    result = v.copy()
    for factor in factors:
        if factor.group == "R":
            continue
        inverse = after[factor.q][:4] * [1.0, -1.0, -1.0, -1.0]
        for first in range(factor.v.start, factor.v.stop, 3):
            part = slice(first, first + 3)
            result[part] = numeric.rotated(inverse, numeric.rotated(before[factor.q][:4], v[part]))
    return result


def update(factors: Sequence[Factor], q: Array, theta: Array) -> Array:
    """Return q * exp(theta), with quaternions normalised.

    Parameters
    ----------
    factors : of the configuration, a product of groups
    q : (..., nq) configurations; quaternions (w, x, y, z)
    theta : (..., nv) increments in body axes, angular first, rad and m

    Returns
    -------
    (..., nq), with the broadcast leading axes of q and theta
    """
    result = np.array(q, dtype=np.result_type(q, theta, float))
    for group, of_q, of_v in by_group(tuple(factors)):
        first, step = q[..., of_q], theta[..., of_v]
        if group is None:
            result[..., of_q] = first + step
        else:
            moved = numeric.update(group, elements(first, group.q_size), elements(step, group.v_size))
            result[..., of_q] = moved.reshape(result[..., of_q].shape)
    return result


def difference(factors: Sequence[Factor], first: Array, second: Array) -> Array:
    """Return log(first^-1 * second): the increment that leads from first to second.

    Parameters
    ----------
    factors : of the configuration, a product of groups
    first, second : (..., nq) configurations

    Returns
    -------
    (..., nv) increments in the body axes of ``first``, angular first, rad and m
    """
    batch = np.broadcast_shapes(np.shape(first)[:-1], np.shape(second)[:-1])
    nv = sum(factor.v_size for factor in factors)
    if len(batch) == 1 and batch[0] > 1 and batch[0] * nv > _LARGE:
        rows = max(1, _LARGE // nv)
        ends = [np.broadcast_to(q, (*batch, q.shape[-1])) for q in (first, second)]
        parts = [[q[start : start + rows] for q in ends] for start in range(0, batch[0], rows)]
        return np.concatenate([difference(factors, *part) for part in parts])
    result = np.zeros((*batch, nv), dtype=np.result_type(first, second, float))
    for group, of_q, of_v in by_group(tuple(factors)):
        begin, end = first[..., of_q], second[..., of_q]
        if group is None:
            result[..., of_v] = end - begin
        else:
            apart = numeric.difference(group, elements(begin, group.q_size), elements(end, group.q_size))
            result[..., of_v] = apart.reshape(result[..., of_v].shape)
    return result


def tangent(factors: Sequence[Factor], theta: Array) -> Array:
    """Return the block diagonal T(theta), (..., nv, nv): exp(theta)^-1 d exp(theta) = (T(theta) d theta)~.

    This is the right Jacobian of exp, for changes in the axes after the increment; theta (..., nv), rad and m.
    """
    return _block_diagonal(factors, theta, 1.0, numeric.tangent)


def bracket_matrix(factors: Sequence[Factor], v: Array) -> Array:
    """Return the block diagonal ad(v), (..., nv, nv)."""
    return _block_diagonal(factors, v, 0.0, numeric.bracket_matrix)


def transport(factors: Sequence[Factor], theta: Array) -> Array:
    """Return the block diagonal Ad(exp(theta))^-1, (..., nv, nv), which transforms velocities along an increment."""
    return _block_diagonal(factors, -theta, 1.0, lambda group, x: numeric.adjoint(group, numeric.exp(group, x)))


def moved_frames(factors: Sequence[Factor], q: Array) -> Array:
    """Return the block diagonal Ad(q)^-1 of rotations and poses, (..., nv, nv); blocks of factors R are zero. On
    rotations this transforms velocities in world axes to body axes."""
    return _block_diagonal(factors, q, 0.0, lambda group, x: numeric.adjoint(group, numeric.inverse(group, x)))


def _block_diagonal(factors: Sequence[Factor], x: Array, of_numbers: float, of_group: Any) -> Array:
    """Return the block diagonal matrix, (..., nv, nv), of ``of_group(group, elements)``; all factors of one group at
    once.

    Factors R have ``of_numbers`` on the diagonal.

    Parameters
    ----------
    x : (..., nv) or (..., nq)
        Arguments of ``of_group``, increments or elements.
    """
    factors = tuple(factors)
    size = sum(factor.v_size for factor in factors)
    result = np.zeros((*x.shape[:-1], size, size), dtype=np.result_type(x, float))
    for group, of_q, of_v in by_group(factors):
        if group is None:
            places = np.arange(size)[of_v]
            result[..., places, places] = of_numbers
            continue
        of_x, size_of_x = (of_v, group.v_size) if x.shape[-1] == size else (of_q, group.q_size)
        rows = np.arange(size)[of_v].reshape(-1, group.v_size)
        blocks = of_group(group, elements(x[..., of_x], size_of_x))
        result[..., rows[:, :, np.newaxis], rows[:, np.newaxis, :]] = blocks
    return result


def elements(x: Array, size: int) -> Array:
    """Return the components of elements side by side as (..., elements, size)."""
    return x.reshape(*x.shape[:-1], x.shape[-1] // size, size)


@lru_cache(maxsize=64)
def by_group(factors: tuple[Factor, ...]) -> list[tuple[Group | None, Places, Places]]:
    """Return (group, places in q, places in v) for each group once, with the elements of the group side by side. The
    group is None for R. Places are a slice if all are adjacent, else an array of indices."""
    members: dict[str, list[Factor]] = {}
    for factor in factors:
        members.setdefault(factor.group, []).append(factor)
    return [
        (
            None if name == "R" else group_named(name),
            _places([factor.q for factor in elements]),
            _places([factor.v for factor in elements]),
        )
        for name, elements in members.items()
    ]


def _places(parts: Sequence[slice]) -> Places:
    """Return the places in several slices, as one slice if all follow each other."""
    if all(before.stop == after.start for before, after in pairwise(parts)):
        return slice(parts[0].start, parts[-1].stop)
    return np.concatenate([np.arange(part.start, part.stop) for part in parts])


Curve = tuple[Array, Array, Array]
#: Weights over [0, 1] of the value at 1, of the first and of the second derivatives at 0 and at 1; the value at 0 is
#: zero.
_VALUE = (0.0, 0.0, 0.0, 10.0, -15.0, 6.0)
_FIRST = ((0.0, 1.0, 0.0, -6.0, 8.0, -3.0), (0.0, 0.0, 0.0, -4.0, 7.0, -3.0))
_SECOND = ((0.0, 0.0, 0.5, -1.5, 1.5, -0.5), (0.0, 0.0, 0.0, 0.5, -1.0, 0.5))
#: The same of a cubic through two values with first derivatives.
_CUBIC = ((1.0, 0.0, -3.0, 2.0), (0.0, 0.0, 3.0, -2.0), (0.0, 1.0, -2.0, 1.0), (0.0, 0.0, -1.0, 1.0))


def group_curve(factors: Sequence[Factor], first: Curve, last: Curve, duration: Array, s: Array) -> Curve:
    """Return q, v and a at the fractions s of the way from the first state to the last, (n, nq), (n, nv) and (n, nv).

    Parameters
    ----------
    factors : of the configuration
    first, last : q (n, nq), v (n, nv), a (n, nv)
        With rotations of less than a full turn in between; the shorter way round is taken.
    duration, s : (n,)
        Time between both states, s; fraction of the way, 0 to 1.
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
    """Return the values and derivatives (n, size) of cubics through two values with derivatives, in a vector space.

    Parameters
    ----------
    first, last : pair of (n, size) ndarray
        Value and derivative per s at both ends.
    duration : (n,) ndarray
        Time from the first to the last value, s.
    s : (n,) ndarray
        Part of the duration, 0 to 1.
    """
    h, x = duration[:, np.newaxis], s[:, np.newaxis]
    parts = (first[0], last[0], h * first[1], h * last[1])
    return _sum(_CUBIC, parts, x, 0), _sum(_CUBIC, parts, x, 1) / h


def _sum(weights: Sequence[Sequence[float]], parts: Sequence[Array], x: Array, order: int) -> Array:
    """Return the derivative by x, of the given order, of the sum of polynomials in x times ``parts``, (n, size).
    ``weights`` are the coefficients of each polynomial, constant first; ``x`` has the shape (n, 1)."""
    from numpy.polynomial.polynomial import polyder, polyval  # noqa: PLC0415  # many modules, for curves between rows

    total = np.zeros_like(parts[0])
    for weight, part in zip(weights, parts, strict=True):
        total = total + polyval(x, polyder(np.array(weight), order)) * part
    return total


def _each(factors: Sequence[Factor], matrix: Callable[[Group, Array], Array], theta: Array, x: Array) -> Array:
    """Return the product of the factors' matrices at theta (n, nv) and x (n, nv); on factors R the matrix is the
    identity."""
    result = np.array(x, dtype=np.result_type(x, theta))
    for factor in factors:
        if factor.group != "R":
            part = factor.v
            of_factor = matrix(group_named(factor.group, factor.v_size), theta[..., part])
            result[..., part] = np.einsum("...ij,...j->...i", of_factor, x[..., part])
    return result


def _tangent_rate(factors: Sequence[Factor], theta: Array, rate: Array) -> Array:
    """Return T' theta', the acceleration from the rate of the tangent operator, by a complex step."""
    step = 1e-200
    moved = _each(factors, numeric.tangent, theta + 1j * step * rate, rate.astype(complex))
    return np.asarray(moved.imag / step)
