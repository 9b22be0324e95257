"""The Duffing oscillator under the square of a Gaussian process by NumPy alone: an oracle for distributions.

q'' + 2 zeta q' + q + eps q^3 = F0 (1 + delta g)^2, covariance of g exp(-tau^2 / 2), 15 s, from rest at the static
equilibrium; trapezoidal rule with 301 nodes, gradient by its adjoint, Hessian by its tangents.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.products.reliability.tails.quadratic_form import ResponseExpansion

ZETA, FORCE, SPAN, NODES, VARIABLES = 0.1, 0.5, 15.0, 301, 21


class Duffing:
    """The displacement at node ``last`` as a response to the process's 21 variables."""

    size = VARIABLES

    def __init__(self, cubic: float, depth: float, last: int = NODES - 1) -> None:
        self.cubic, self.depth, self.last, self.step = cubic, depth, last, SPAN / (NODES - 1)
        t = np.linspace(0.0, SPAN, NODES)
        weights = np.full(NODES, self.step)
        weights[[0, -1]] *= 0.5
        root = np.sqrt(weights)
        kernel = np.exp(-0.5 * (t[:, None] - t) ** 2)
        values, vectors = np.linalg.eigh(root[:, None] * kernel * root)
        self.modes: Array = np.sqrt(values[::-1][:VARIABLES]) * vectors[:, ::-1][:, :VARIABLES] / root[:, None]
        self.rest = 0.5
        for _ in range(50):
            self.rest -= (self.rest + cubic * self.rest**3 - FORCE) / (1.0 + 3.0 * cubic * self.rest**2)

    def trajectories(self, points: NDArray[np.inexact]) -> NDArray[np.inexact]:
        """Return q (nodes, m) of points (m, 21); complex ones too."""
        force = FORCE * (1.0 + self.depth * (self.modes @ points.T)) ** 2
        h, q = self.step, np.full(len(points), self.rest, dtype=points.dtype)
        v, found = np.zeros_like(q), [q]
        for before, behind in pairwise(force):
            pull = q + 0.5 * h * v
            push = v + 0.5 * h * (before - 2.0 * ZETA * v - q - self.cubic * q**3 + behind)
            for _ in range(4):
                spring = 1.0 + 3.0 * self.cubic * q**2
                residual = v + 0.5 * h * (2.0 * ZETA * v + q + self.cubic * q**3) - push
                shift = q - 0.5 * h * v - pull
                change = (residual - 0.5 * h * spring * shift) / (1.0 + h * ZETA + 0.25 * h * h * spring)
                q, v = q - shift - 0.5 * h * change, v - change
            found.append(q)
        return np.array(found)

    def values(self, points: Array) -> Array:
        return np.array(self.trajectories(points)[self.last], dtype=float)

    def gradient(self, point: Array) -> tuple[float, Array]:
        found = self.expansion(point)
        return found.value, found.gradient

    def expansion(self, point: Array) -> ResponseExpansion:
        h, last, one = self.step, self.last, np.eye(2)
        q = np.array(self.trajectories(point[None])[:, 0], dtype=float)
        slope = 2.0 * FORCE * self.depth * (1.0 + self.depth * self.modes @ point)[:, None] * self.modes
        rates = np.zeros((NODES, 2, 2))
        rates[:, 0, 1], rates[:, 1, 1] = 1.0, -2.0 * ZETA
        rates[:, 1, 0] = -1.0 - 3.0 * self.cubic * q**2
        ahead, behind = one - 0.5 * h * rates, one + 0.5 * h * rates
        pushed = np.zeros((NODES - 1, 2, VARIABLES))
        pushed[:, 1] = 0.5 * h * (slope[:-1] + slope[1:])
        carried, given = np.linalg.solve(ahead[1:], behind[:-1]), np.linalg.solve(ahead[1:], pushed)
        tangents = np.zeros((NODES, 2, VARIABLES))
        for k in range(last):
            tangents[k + 1] = carried[k] @ tangents[k] + given[k]
        adjoint = np.zeros((NODES + 1, 2))
        adjoint[last] = np.linalg.solve(ahead[last].T, [1.0, 0.0])
        returned = np.linalg.solve(ahead.transpose(0, 2, 1), behind.transpose(0, 2, 1))
        for k in range(last - 1, 0, -1):
            adjoint[k] = returned[k] @ adjoint[k + 1]
        weights = 0.5 * h * (adjoint[:-1] + adjoint[1:])[:, 1]
        bent = -6.0 * self.cubic * q * weights
        forced = 2.0 * FORCE * self.depth**2 * weights
        hessian = np.einsum("n,ni,nj->ij", bent, tangents[:, 0], tangents[:, 0])
        hessian += np.einsum("n,ni,nj->ij", forced, self.modes, self.modes)
        return ResponseExpansion(float(q[last]), weights @ slope, hessian)
