"""The configuration: a product of groups, factor by factor, on flat vectors q and v."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from eomgen.lie import numeric
from eomgen.lie.groups import group_named

Array = NDArray[Any]


class FactorLike(Protocol):
    """Attributes of a factor of the configuration (implemented by ``system.Factor``)."""

    @property
    def group(self) -> str: ...
    @property
    def q_start(self) -> int: ...
    @property
    def q_size(self) -> int: ...
    @property
    def v_start(self) -> int: ...
    @property
    def v_size(self) -> int: ...


def update(factors: Sequence[FactorLike], q: Array, theta: Array) -> Array:
    """Return q * exp(theta), quaternions scaled back to unit length; q is (..., nq), theta (..., nv)."""
    result = np.array(q, dtype=np.result_type(q, theta, float))
    for factor in factors:
        group = group_named(factor.group, factor.v_size)
        part = slice(factor.q_start, factor.q_start + factor.q_size)
        result[..., part] = numeric.update(
            group, q[..., part], theta[..., factor.v_start : factor.v_start + factor.v_size]
        )
    return result


def difference(factors: Sequence[FactorLike], first: Array, second: Array) -> Array:
    """Return log(first^-1 * second), (..., nv): the increment that leads from first to second."""
    batch = np.broadcast_shapes(np.shape(first)[:-1], np.shape(second)[:-1])
    result = np.zeros((*batch, sum(factor.v_size for factor in factors)), dtype=np.result_type(first, second, float))
    for factor in factors:
        group = group_named(factor.group, factor.v_size)
        part = slice(factor.q_start, factor.q_start + factor.q_size)
        step = numeric.log(group, numeric.compose(group, numeric.inverse(group, first[..., part]), second[..., part]))
        result[..., factor.v_start : factor.v_start + factor.v_size] = step
    return result


def tangent(factors: Sequence[FactorLike], theta: Array) -> Array:
    """Return the block diagonal T(theta), (..., nv, nv)."""
    return _block_diagonal(factors, theta, numeric.tangent)


def bracket_matrix(factors: Sequence[FactorLike], v: Array) -> Array:
    """Return the block diagonal ad(v), (..., nv, nv)."""
    return _block_diagonal(factors, v, numeric.bracket_matrix)


def transport(factors: Sequence[FactorLike], theta: Array) -> Array:
    """Return the block diagonal Ad(exp(theta))^-1, (..., nv, nv), which transforms velocities along an increment."""
    return _block_diagonal(factors, -theta, lambda group, x: numeric.adjoint(group, numeric.exp(group, x)))


def _block_diagonal(factors: Sequence[FactorLike], x: Array, of_group: Any) -> Array:
    size = x.shape[-1]
    result = np.zeros((*x.shape, size), dtype=np.result_type(x, float))
    for factor in factors:
        part = slice(factor.v_start, factor.v_start + factor.v_size)
        result[..., part, part] = of_group(group_named(factor.group, factor.v_size), x[..., part])
    return result
