"""The configuration: a product of groups, factor by factor, on flat vectors q and v."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.lie import numeric
from eomgen.lie.groups import group_named

Array = NDArray[Any]


@dataclass(frozen=True)
class Factor:
    """A factor of the configuration group with its slices: ``R`` (1), ``SO3`` (4 of q, 3 of v), ``SE3`` (7, 6)."""

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


def update(factors: Sequence[Factor], q: Array, theta: Array) -> Array:
    """Return q * exp(theta), quaternions scaled back to unit length; q is (..., nq), theta (..., nv)."""
    result = np.array(q, dtype=np.result_type(q, theta, float))
    for factor in factors:
        group = group_named(factor.group, factor.v_size)
        part = factor.q
        result[..., part] = numeric.update(group, q[..., part], theta[..., factor.v])
    return result


def difference(factors: Sequence[Factor], first: Array, second: Array) -> Array:
    """Return log(first^-1 * second), (..., nv): the increment that leads from first to second."""
    batch = np.broadcast_shapes(np.shape(first)[:-1], np.shape(second)[:-1])
    result = np.zeros((*batch, sum(factor.v_size for factor in factors)), dtype=np.result_type(first, second, float))
    for factor in factors:
        group = group_named(factor.group, factor.v_size)
        part = factor.q
        step = numeric.log(group, numeric.compose(group, numeric.inverse(group, first[..., part]), second[..., part]))
        result[..., factor.v] = step
    return result


def tangent(factors: Sequence[Factor], theta: Array) -> Array:
    """Return the block diagonal T(theta), (..., nv, nv)."""
    return _block_diagonal(factors, theta, numeric.tangent)


def bracket_matrix(factors: Sequence[Factor], v: Array) -> Array:
    """Return the block diagonal ad(v), (..., nv, nv)."""
    return _block_diagonal(factors, v, numeric.bracket_matrix)


def transport(factors: Sequence[Factor], theta: Array) -> Array:
    """Return the block diagonal Ad(exp(theta))^-1, (..., nv, nv), which transforms velocities along an increment."""
    return _block_diagonal(factors, -theta, lambda group, x: numeric.adjoint(group, numeric.exp(group, x)))


def _block_diagonal(factors: Sequence[Factor], x: Array, of_group: Any) -> Array:
    size = x.shape[-1]
    result = np.zeros((*x.shape, size), dtype=np.result_type(x, float))
    for factor in factors:
        part = factor.v
        result[..., part, part] = of_group(group_named(factor.group, factor.v_size), x[..., part])
    return result
