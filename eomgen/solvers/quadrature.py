"""Gauss-Legendre quadrature on consecutive panels."""

from __future__ import annotations

import numpy as np

from eomgen.base.arrays import Array


def gauss_legendre(edges: Array, count: int) -> tuple[Array, Array]:
    """Return nodes and weights of Gauss-Legendre quadrature on consecutive panels.

    Parameters
    ----------
    edges : (panels + 1,)
        Increasing ends of the panels.
    count : int
        Nodes on each panel; polynomials of degree 2 count - 1 are integrated exactly.

    Returns
    -------
    nodes, weights : (panels, count)
    """
    points, shares = np.polynomial.legendre.leggauss(count)
    half = 0.5 * np.diff(edges)[:, np.newaxis]
    return edges[:-1, np.newaxis] + half * (1.0 + points), half * shares
