"""Collocation at Gauss's points: symplectic and symmetric implicit steps of any even order, for any H."""

from __future__ import annotations

import functools

import numpy as np
from numpy.polynomial import Legendre

#: Orders up to which collocation is offered.
HIGHEST_ORDER = 12


@functools.cache
def gauss_collocation(stages: int) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return A, row by row, and b of the Runge-Kutta method whose stages are at the roots of the Legendre polynomial.

    Its order is twice the number of stages; one stage is the implicit midpoint rule. Hairer, Lubich and Wanner,
    Geometric Numerical Integration (2006), sections II.1.3 and VI.4.2.
    """
    nodes, weights = np.polynomial.legendre.leggauss(stages)
    # column j: weight j times the sum over k of (2 k + 1) P_k(node j) times the integral of P_k, on [-1, 1]
    series = [Legendre.basis(k) for k in range(stages)]
    integrals = np.array([one.integ(lbnd=-1)(nodes) for one in series])
    values = np.array([(2 * k + 1) * one(nodes) for k, one in enumerate(series)])
    A = np.einsum("ki,kj,j->ij", integrals, values, weights) / 4
    return tuple(A.ravel().tolist()), tuple((weights / 2).tolist())
