"""Inertia matrices of machines in which some parts have no inertia, and constraints determine their motion."""

from __future__ import annotations

import numpy as np

from eomgen.base.arrays import Array


def inertia_with_rows(M: Array, B: Array, sizes: Array) -> Array:
    """Return M + B^T w B, (..., nv, nv), with w > 0 by lengths of rows of B (..., rows, nv) and the largest inertia.

    The sum is positive definite if [M B^T; B 0] is regular: parts without inertia may follow from constraints. Along
    motions that B allows the sum is M, so frequencies, and the nearest motions with given B v, do not change (augmented
    Lagrangians: Glowinski and Le Tallec 1989).

    Parameters
    ----------
    sizes : (nv,) velocity components of unit displacement, which make w independent of units
    """
    displaced = B * sizes
    squares = np.einsum("...ij,...ij->...i", displaced, displaced)
    largest = np.max(np.diagonal(M, axis1=-2, axis2=-1) * sizes**2, axis=-1, initial=0.0)
    weights = np.divide(largest[..., np.newaxis], squares, out=np.zeros_like(squares), where=squares > 0.0)
    return np.asarray(M + np.swapaxes(B, -1, -2) @ (weights[..., np.newaxis] * B))


def regular_inertia(M: Array, B: Array, sizes: Array) -> Array:
    """Return M, with the rows of B if coordinates have no inertia; see ``inertia_with_rows``."""
    if not B.shape[-2] or np.all(np.diagonal(M, axis1=-2, axis2=-1) > 0.0):
        return M
    return inertia_with_rows(M, B, sizes)
