"""Quadratic forms that approximate a response over its whole distribution, and forms of fewer directions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from eomgen.base.arrays import Array
from eomgen.products.reliability.tails.quadratic_form import QuadraticForm
from eomgen.products.reliability.tails.response import Expansion, Multiplied, Response


def hermite_projection(response: Response, pairs: int, seed: int) -> QuadraticForm:
    """Return the response's projection onto Hermite polynomials of degree 2: E grad y and E Hess y (Stein's identity).

    Averages are over ``pairs`` antithetic pairs of a scrambled Sobol sequence, so odd parts cancel.
    """
    from scipy.stats import qmc  # noqa: PLC0415  # it takes half a second to import

    n = response.size
    whole = 1 << (pairs - 1).bit_length()  # of a power of 2 alone SciPy takes its sequence for balanced
    points = qmc.MultivariateNormalQMC(np.zeros(n), rng=seed).random(whole)[:pairs]
    value, gradient, hessian = 0.0, np.zeros(n), np.zeros((n, n))
    for point in points:
        for z in (point, -point):
            found = response.expansion(z)
            value += found.value / (2 * pairs)
            gradient += found.gradient / (2 * pairs)
            hessian += found.hessian / (2 * pairs)
    return QuadraticForm(value - 0.5 * float(np.trace(hessian)), gradient, hessian)


def leading_directions(gradients: Array, share: float) -> Array:
    """Return the directions (n, r), orthonormal, that hold a share of the squares of gradients (m, n): as many as it
    takes."""
    _, values, rows = np.linalg.svd(gradients, full_matrices=False)
    held = np.cumsum(values**2) / np.sum(values**2)
    count = int(np.searchsorted(held, share - 1e-15) + 1)
    return rows[: min(count, len(rows))].T


def projected_hessian(products: Array, directions: Array) -> Array:
    """Return a Hessian (n, n) from its products (n, r) with orthonormal directions (n, r): exact for all pairs of which
    one lies in their span, zero for the others."""
    inner = directions.T @ products
    crossed = products @ directions.T
    result: Array = crossed + crossed.T - directions @ (0.5 * (inner + inner.T)) @ directions.T
    return result


@dataclass(frozen=True)
class Projected:
    """A response with Hessians of a few directions alone (second-order projected differentiation).

    Attributes
    ----------
    response : whose Hessians are multiplied by directions
    directions : (n, r), orthonormal; at each point the gradient's is added
    """

    response: Multiplied
    directions: Array

    @property
    def size(self) -> int:
        return self.response.size

    def values(self, points: Array) -> Array:
        return self.response.values(points)

    def gradient(self, point: Array) -> tuple[float, Array]:
        return self.response.gradient(point)

    def expansion(self, point: Array) -> Expansion:
        value, gradient = self.response.gradient(point)
        directions = _widened(self.directions, gradient)
        return Expansion(value, gradient, projected_hessian(self.response.products(point, directions), directions))


def _widened(directions: Array, vector: Array) -> Array:
    """Return directions and, if it is none of their span, one more along a vector."""
    rest = vector - directions @ (directions.T @ vector)
    rest = rest - directions @ (directions.T @ rest)
    length = float(np.linalg.norm(rest))
    if length <= 1e-8 * float(np.linalg.norm(vector)):
        return directions
    return np.column_stack([directions, rest / length])
