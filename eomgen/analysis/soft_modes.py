"""Stiffnesses far below the largest one, which a whole matrix has lost to rounding: slender beams bend so.

The sparse equations of rest keep them: inverse iteration gives their squared frequencies, and strains tell whether
anything opposes a direction at all, since energies of strains are sums of squares, which do not cancel.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import block_array
from scipy.sparse.linalg import splu

from eomgen.base.arrays import Array
from eomgen.solvers.bordered_newton import LoadedStatics, Rest, sparse
from eomgen.solvers.tangent_stiffness import ROUNDING

#: Inverse iterations, and the part of the largest squared frequency below which strains have no stiffness.
_ITERATIONS, _NOTHING = 4, 1e-24


def soft_modes(statics: LoadedStatics, rest: Rest, mass: Array, shapes: Array, largest: float) -> tuple[Array, Array]:
    """Return squared frequencies, (modes,), of directions and the directions, (nv, modes), none opposed as 0.

    Parameters
    ----------
    mass : (nv, nv)
    shapes : (nv, modes) directions that span the soft ones, as they are known
    largest : squared frequency of the stiffest direction
    """
    strains = statics.strains(rest.s)
    if strains is None or not shapes.shape[1]:
        return np.zeros(shapes.shape[1]), shapes
    tangents, rows = statics.tangents(rest), len(rest.multipliers)
    try:
        K, B = sparse(tangents.K), sparse(tangents.B)
        factors = splu(block_array([[K, B.T], [B, None]], format="csc"))
    except RuntimeError:
        return np.zeros(shapes.shape[1]), shapes
    values = np.zeros(shapes.shape[1])
    for _ in range(_ITERATIONS):
        right = np.concatenate([mass @ shapes, np.zeros((rows, shapes.shape[1]))])
        solution = factors.solve(right)[: len(mass)]
        if not np.all(np.isfinite(solution)):
            return values, shapes
        inverse, turn = np.linalg.eigh(0.5 * (shapes.T @ mass @ solution + solution.T @ mass @ shapes))
        values = np.divide(1.0, inverse, out=np.zeros_like(inverse), where=inverse != 0.0)
        shapes = np.linalg.qr(np.linalg.cholesky(mass).T @ solution @ turn)[0]
        shapes = np.linalg.solve(np.linalg.cholesky(mass).T, shapes)
    d = strains.values(rest.q)
    change = (strains.derivative(rest.q, d) @ shapes).reshape(*d.shape, -1)
    energy = np.einsum("eik,eij,ejk->k", change, strains.stiffness, change)
    every = np.abs(shapes)
    rounding = ROUNDING * np.einsum("ij,ij->j", every, abs(K) @ every)
    return np.where((energy > _NOTHING * largest) & (np.abs(values) > rounding), values, 0.0), shapes
