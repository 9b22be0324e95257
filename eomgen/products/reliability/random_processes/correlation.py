"""Correlation matrices: the nearest one to a matrix that is none."""

from __future__ import annotations

import numpy as np

from eomgen.base.arrays import Array

#: Projections at most; change by which they end.
_PROJECTIONS, _SETTLED = 2000, 1e-12
#: Least eigenvalue of a returned matrix, so that it has a Cholesky factor.
_LEAST = 1e-10


def nearest_correlation(matrix: Array) -> Array:
    """Return the nearest positive matrix with 1 on the diagonal to a symmetric one, in the norm of Frobenius.

    References
    ----------
    Higham: Computing the nearest correlation matrix, IMA J. Numer. Anal. 22 (2002), algorithm 3.3.
    """
    here, correction = matrix.copy(), np.zeros_like(matrix)
    for _ in range(_PROJECTIONS):
        shifted = here - correction
        values, vectors = np.linalg.eigh(shifted)
        positive = (vectors * np.maximum(values, 0.0)) @ vectors.T
        correction = positive - shifted
        before, here = here, positive.copy()
        np.fill_diagonal(here, 1.0)
        if np.linalg.norm(here - before) <= _SETTLED:
            break
    share = max(0.0, _LEAST - float(np.linalg.eigvalsh(here)[0]))
    return np.asarray((here + share * np.eye(len(here))) / (1.0 + share))
