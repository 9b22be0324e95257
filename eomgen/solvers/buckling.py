"""Linear buckling: load factors at which the stiffness, extrapolated along the path of a preload, is singular.

(K + mu K') phi = 0, K' being the derivative of the tangent stiffness along the path: Z. P. Bazant and L. Cedolin,
Stability of Structures (1991), section 4.4.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from scipy.sparse import csc_array
from scipy.sparse.linalg import LinearOperator, eigs

from eomgen.base.arrays import Array
from eomgen.solvers.bordered_newton import LoadedStatics, Rest, corrected, direction, held_factor, sparse
from eomgen.solvers.critical_points import scaled_mode
from eomgen.solvers.tangent_stiffness import compliance

Complex = NDArray[np.complex128]
#: First change of the load factor along which the stiffness is differentiated, as a part of its reach, and later ones
#: as a part of the lowest buckling load; trials.
_FIRST, _PART, _TRIALS = 1e-2, 0.02, 3
#: Loads among which the one is looked for that is told from elsewhere.
_NEIGHBOURS = 4
#: Largest number of velocity components for dense eigenvalues.
WHOLE = 60
#: Part of its size below which an eigenvalue has no imaginary part.
_REAL = 1e-6
#: Buckling factors beyond so many times the lowest are rounding.
_FAR = 1e8
#: Part by which sizes may differ that are the same.
_ALIKE = 1e-6


def linear_buckling(statics: LoadedStatics, rest: Rest, count: int) -> tuple[Array, Array]:
    """Return changes mu of the load factor by size, (n,), and modes, (nv, n), their largest components 1 or lengths.

    Raises
    ------
    ArithmeticError
        The stiffness is singular already, the path has no tangent, or there is no rest beside the preload.
    """
    change = _FIRST * statics.reach
    factors, modes = np.zeros(0), np.zeros((len(statics.sizes), 0))
    for _ in range(_TRIALS):
        rate = _rate(statics, rest, change)
        tangents = statics.tangents(rest)
        factors, modes = _factors(sparse(tangents.K), sparse(tangents.B), rate, count)
        if not len(factors):
            break
        wanted = _PART * float(np.abs(factors[0]))
        if 0.5 * change <= wanted <= 2.0 * change:
            break
        change = wanted
    scaled = [scaled_mode(statics.sizes, mode) for mode in modes.T]
    return factors, np.array(scaled).T.reshape(len(statics.sizes), len(scaled))


def half_way(statics: LoadedStatics, rest: Rest, factor: float) -> float | None:
    """Return the change of the load factor predicted half way to one by ``linear_buckling``, the nearest to it.

    If the structure keeps its shape both are the same. None if half way there is no rest, or no prediction.
    """
    onwards = direction(statics, rest, held_factor(statics, rest))
    if onwards is None or onwards.s == 0.0:
        return None
    point = corrected(statics, rest, onwards, 0.5 * factor / onwards.s, held_factor(statics, rest))
    if point.trouble:
        return None
    try:
        tangents = statics.tangents(point.rest)
        rate = _rate(statics, point.rest, _PART * abs(factor))
        factors, _ = _factors(sparse(tangents.K), sparse(tangents.B), rate, _NEIGHBOURS)
    except ArithmeticError:
        return None
    changes = point.rest.s - rest.s + factors
    return float(changes[np.argmin(np.abs(changes - factor))]) if len(changes) else None


def _rate(statics: LoadedStatics, rest: Rest, change: float) -> csc_array:
    """Return the derivative of the stiffness along the path, by central differences."""
    onwards = direction(statics, rest, held_factor(statics, rest))
    if onwards is None or onwards.s == 0.0:
        raise ArithmeticError("the tangent stiffness is singular there")
    ends = []
    for sign in (1.0, -1.0):
        way = sign * change / onwards.s
        point = corrected(statics, rest, onwards, way, held_factor(statics, rest))
        if point.trouble:
            raise ArithmeticError(f"there is no equilibrium beside it: {point.trouble}")
        ends.append(sparse(statics.tangents(point.rest).K))
    return csc_array((ends[0] - ends[1]) / (2.0 * change))


def _factors(K: csc_array, B: csc_array, rate: csc_array, count: int) -> tuple[Array, Array]:
    """Return the real mu of (K + mu K') phi = 0 under constraints, by size, and the phi."""
    nv = K.shape[0]
    solve = compliance(K, B)
    if solve is None:
        raise ArithmeticError("the tangent stiffness is singular there")
    if nv <= WHOLE:
        values, vectors = scipy.linalg.eig(solve(rate.toarray()))
    else:
        operator = LinearOperator((nv, nv), matvec=lambda x: solve(rate @ x), dtype=float)
        values, vectors = eigs(operator, k=min(2 * count + 4, nv - 2), which="LM", v0=np.ones(nv))
    inverse: Complex = np.asarray(values, complex)
    mu = -np.divide(1.0, inverse, out=np.full_like(inverse, np.inf), where=inverse != 0.0)
    kept = np.isfinite(mu) & (np.abs(mu.imag) <= _REAL * np.abs(mu))
    kept &= np.abs(inverse) > np.max(np.abs(inverse), initial=0.0) / _FAR
    sizes = np.abs(mu) * np.where(mu.real < 0.0, 1.0 + _ALIKE, 1.0)  # of two of the same size the positive one first
    order = [k for k in np.argsort(sizes, kind="stable") if kept[k]][:count]
    return mu.real[order], np.asarray(vectors).real[:, order]
