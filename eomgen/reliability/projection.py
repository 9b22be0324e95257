"""Quadratic forms that stand for a response over its whole distribution, and those of fewer directions."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.stats import qmc

from eomgen.arrays import Array
from eomgen.reliability.quadratic_form import QuadraticForm
from eomgen.reliability.response import Response


def hermite_projection(response: Response, pairs: int, seed: int) -> QuadraticForm:
    """Return the response's projection onto Hermite polynomials of degree 2: E grad y and E Hess y (Stein's identity).

    Averages are over ``pairs`` antithetic pairs of a scrambled Sobol sequence, so odd parts cancel.
    """
    n = response.size
    points = qmc.MultivariateNormalQMC(np.zeros(n), rng=seed).random(pairs)
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


def projected_hessian(product: Callable[[Array], Array], directions: Array) -> Array:
    """Return a Hessian (n, n) from its products with orthonormal directions (n, r): exact for all pairs of which one
    lies in their span, zero for the others."""
    products = np.column_stack([product(direction) for direction in directions.T])
    inner = directions.T @ products
    crossed = products @ directions.T
    return crossed + crossed.T - directions @ (0.5 * (inner + inner.T)) @ directions.T
