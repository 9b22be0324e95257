"""Gauss-Legendre quadrature on panels: exact polynomials, and order of convergence of a smooth integral."""

from __future__ import annotations

import numpy as np
import pytest

from eomgen.solvers.quadrature import gauss_legendre

EDGES = np.array([-0.3, 0.1, 1.7, 2.0])


@pytest.mark.parametrize("count", [1, 2, 5, 16])
def test_polynomials_are_exact_on_every_panel(count: int) -> None:
    nodes, weights = gauss_legendre(EDGES, count)
    assert nodes.shape == weights.shape == (3, count)
    assert np.all((nodes > EDGES[:-1, None]) & (nodes < EDGES[1:, None]))
    for degree in range(2 * count):
        exact = (EDGES[1:] ** (degree + 1) - EDGES[:-1] ** (degree + 1)) / (degree + 1)
        np.testing.assert_allclose(np.sum(weights * nodes**degree, axis=1), exact, rtol=1e-12, atol=1e-13)
