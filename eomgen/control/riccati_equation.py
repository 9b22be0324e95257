"""Riccati equations of optimal control and of optimal observers, in continuous time and sampled.

SciPy solves them; Newton's iteration of D. L. Kleinman (On an iterative technique for Riccati equation computations,
IEEE Transactions on Automatic Control 13, 1968) takes off what rounding left.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_continuous_are, solve_continuous_lyapunov, solve_discrete_are

from eomgen.arrays import Array
from eomgen.errors import NumericalError, UsageError

#: Rows and columns of blocks of a matrix.
Blocks = tuple[tuple[slice, slice], ...]
WHOLE: Blocks = ((slice(None), slice(None)),)
#: Relative residual of each block above which a solution is refused.
TOLERANCE = 1e-10
_NEWTON_STEPS = 8
_NEGATIVE = 1e-12


def whitening(R: Array) -> Array:
    """Return H with H^T R H = 1."""
    try:
        L = np.linalg.cholesky(R)
    except np.linalg.LinAlgError:
        L = np.zeros_like(R)
    diagonal = np.diag(L)
    if not len(R) or diagonal.min() <= np.finfo(float).eps * diagonal.max():
        what = "some effort has zero weight, so the optimal gain is unbounded"
        raise UsageError(what, "a positive weight for every effort, or for accelerations that they give")
    return np.linalg.inv(L).T


def without_cross_terms(Q: Array, cross: Array) -> tuple[Array, Array]:
    """Return the cost that cross terms leave when they are taken into the plant, and a square root of it."""
    cost = Q - cross @ cross.T
    values, vectors = np.linalg.eigh((cost + cost.T) / 2.0)
    if values[0] < -_NEGATIVE * max(float(np.linalg.norm(Q, 2)), abs(values[-1])):
        raise UsageError("the cost has no minimum: its cross terms outweigh what they couple", "smaller cross terms")
    values = np.maximum(values, 0.0)
    return (vectors * values) @ vectors.T, (vectors * np.sqrt(values)).T


def solution(A: Array, B: Array, cost: Array, blocks: Blocks = WHOLE) -> tuple[Array, float]:
    """Return the stabilising P of A^T P + P A - P B B^T P + cost = 0, and its residual.

    Parameters
    ----------
    blocks : rows and columns of the blocks whose residuals are looked at one by one

    Raises
    ------
    NumericalError
        No solution with a residual below 1e-10.
    """
    size = float(np.linalg.norm(cost, 2)) or 1.0
    reach = float(np.linalg.norm(B, 2)) or 1.0
    weight = size * reach**2  # of P B B^T P when cost and B have the norm 1
    unit, b = cost / size, B / reach
    try:
        P: Array = np.asarray(solve_continuous_are(A, b, unit, np.eye(B.shape[1]) / weight), dtype=float)
    except (np.linalg.LinAlgError, ValueError) as error:
        what = f"the Riccati equation could not be solved: {str(error).splitlines()[0].rstrip('.')}"
        raise NumericalError(what, "weights that differ less in size") from None
    residual = _residual(A, b, unit, P, weight, blocks)
    for _ in range(_NEWTON_STEPS):
        gain = weight * b.T @ P
        closed = A - b @ gain
        if np.linalg.eigvals(closed).real.max() >= 0.0:
            break
        solved = np.asarray(solve_continuous_lyapunov(closed.T, -(unit + gain.T @ gain / weight)), dtype=float)
        better = (solved + solved.T) / 2.0
        reached = _residual(A, b, unit, better, weight, blocks)
        if not reached < 0.5 * residual:
            break
        P, residual = better, reached
    if not residual <= TOLERANCE or np.linalg.eigvals(A - weight * b @ (b.T @ P)).real.max() >= 0.0:
        what = (
            f"the Riccati equation is solved with a relative residual of {residual:.1e} only, {TOLERANCE:g} is needed"
        )
        raise NumericalError(what, "weights that differ less in size")
    return P * size, residual


def _residual(A: Array, b: Array, cost: Array, P: Array, weight: float, blocks: Blocks) -> float:
    """Return the largest residual of the blocks, each relative to the sum of the norms of its terms."""
    terms = (A.T @ P, P @ A, -weight * P @ b @ b.T @ P, cost)
    worst = 0.0
    for block in blocks:
        scale = sum(float(np.linalg.norm(term[block])) for term in terms)
        left = float(np.linalg.norm(sum(term[block] for term in terms)))
        worst = max(worst, left / scale if scale > 0.0 else 0.0)
    return worst


def sampled_solution(A: Array, B: Array, Q: Array, R: Array, S: Array) -> tuple[Array, Array, float]:
    """Return the stabilising P of the equation of a sampled model, its gain (m, n) and its residual.

    P = A^T P A - (A^T P B + S) G + Q,  G = (R + B^T P B)^-1 (B^T P A + S^T)

    Raises
    ------
    NumericalError
        No solution with a relative residual below 1e-10.
    """
    size = float(np.linalg.norm(Q, 2)) or float(np.linalg.norm(R, 2)) or 1.0
    try:
        P = np.asarray(solve_discrete_are(A, B, Q / size, R / size, s=S / size), dtype=float) * size
        P = (P + P.T) / 2.0
        gain = np.asarray(np.linalg.solve(R + B.T @ P @ B, B.T @ P @ A + S.T), dtype=float)
    except (np.linalg.LinAlgError, ValueError) as error:
        what = f"the Riccati equation could not be solved: {str(error).splitlines()[0].rstrip('.')}"
        raise NumericalError(what, "weights that differ less in size") from None
    terms = (A.T @ P @ A, -(A.T @ P @ B + S) @ gain, Q, -P)
    residual = float(np.linalg.norm(sum(terms))) / (sum(float(np.linalg.norm(term)) for term in terms) or 1.0)
    if not residual <= TOLERANCE or np.max(np.abs(np.linalg.eigvals(A - B @ gain)), initial=0.0) >= 1.0:
        what = (
            f"the Riccati equation is solved with a relative residual of {residual:.1e} only, {TOLERANCE:g} is needed"
        )
        raise NumericalError(what, "weights that differ less in size, or another sample")
    return P, gain, residual
