"""Riccati equations of optimal control and of optimal observers, in continuous time and sampled.

SciPy solves them; Newton's iteration removes rounding errors (D. L. Kleinman, On an iterative technique for
Riccati equation computations, IEEE Transactions on Automatic Control 13, 1968; sampled: G. A. Hewer, An iterative
technique for the computation of the steady state gains for the discrete optimal regulator, the same 16, 1971).
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from scipy.linalg import (
    solve_continuous_are,
    solve_continuous_lyapunov,
    solve_discrete_are,
    solve_discrete_lyapunov,
)

from eomgen.base.arrays import Array
from eomgen.errors import NumericalError, UsageError
from eomgen.products.linear.eigenvalues import balance

#: Rows and columns of blocks of a matrix.
Blocks = tuple[tuple[slice, slice], ...]
WHOLE: Blocks = ((slice(None), slice(None)),)
#: Relative residual of each block above which a solution is refused.
TOLERANCE = 1e-10
_NEWTON_STEPS = 8
_NEGATIVE = 1e-12


@contextmanager
def solvable() -> Iterator[None]:
    """Return a context in which errors of linear algebra and numbers that overflow are raised as NumericalError."""
    try:
        with np.errstate(over="raise", divide="ignore", invalid="ignore"):
            yield
    except (ArithmeticError, ValueError) as error:  # errors of linear algebra are of ValueError
        fault = f"the Riccati equation could not be solved: {str(error).splitlines()[0].rstrip('.')} [E0412]"
        raise NumericalError(fault, "weights that differ less in size") from None


def whitening(R: Array) -> Array:
    """Return H with H^T R H = 1 for a weight R (m, m) of efforts. Raises UsageError if R is not positive definite."""
    try:
        L = np.linalg.cholesky(R)
    except np.linalg.LinAlgError:
        L = np.zeros_like(R)
    diagonal = np.diag(L)
    if not len(R) or diagonal.min() <= np.finfo(float).eps * diagonal.max():
        fault = "some effort has zero weight, so the optimal gain is unbounded [E0409]"
        raise UsageError(fault, "a positive weight for every effort, or for accelerations that they give")
    return np.linalg.inv(L).T


def without_cross_terms(Q: Array, cross: Array) -> tuple[Array, Array]:
    """Return the state cost Q - cross cross^T (n, n), and a square root (n, n) with root^T root equal to this cost.
    `cross` (n, m) are cross terms with efforts of unit weight. Raises UsageError if the cost is not positive
    semidefinite."""
    cost = Q - cross @ cross.T
    values, vectors = np.linalg.eigh((cost + cost.T) / 2.0)
    if values[0] < -_NEGATIVE * max(float(np.linalg.norm(Q, 2)), abs(values[-1])):
        fault = "the cost has no minimum: its cross terms outweigh the weights of states and inputs [E0410]"
        raise UsageError(fault, "smaller cross terms")
    values = np.maximum(values, 0.0)
    return (vectors * values) @ vectors.T, (vectors * np.sqrt(values)).T


@solvable()
def solution(A: Array, B: Array, cost: Array, blocks: Blocks = WHOLE) -> tuple[Array, float]:
    """Return the stabilising P of A^T P + P A - P B B^T P + cost = 0, and the relative residual.

    Parameters
    ----------
    A, B, cost : (n, n), (n, m) and (n, n)
    blocks : rows and columns of the blocks with separately judged residuals

    Raises
    ------
    NumericalError
        No solution with a residual below 1e-10.
    """
    size = float(np.linalg.norm(cost, 2)) or 1.0
    reach = float(np.linalg.norm(B, 2)) or 1.0
    weight = size * reach**2  # of P B B^T P when cost and B have the norm 1
    unit, b = cost / size, B / reach
    P: Array = np.asarray(solve_continuous_are(A, b, unit, np.eye(B.shape[1]) / weight), dtype=float)
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
        fault = (
            f"the Riccati equation is solved with a relative residual of {residual:.1e} only, {TOLERANCE:g} is"
            f" needed [E0411]"
        )
        raise NumericalError(fault, "weights that differ less in size")
    return P * size, residual


def _residual(A: Array, b: Array, cost: Array, P: Array, weight: float, blocks: Blocks) -> float:
    """Return the largest residual of the Riccati equation's blocks, each relative to the sum of the norms of its
    terms."""
    terms = (A.T @ P, P @ A, -weight * P @ b @ b.T @ P, cost)
    worst = 0.0
    for block in blocks:
        scale = sum(float(np.linalg.norm(term[block])) for term in terms)
        left = float(np.linalg.norm(sum(term[block] for term in terms)))
        worst = max(worst, left / scale if scale > 0.0 else 0.0)
    return worst


@solvable()
def sampled_solution(A: Array, B: Array, Q: Array, R: Array, S: Array) -> tuple[Array, Array, float]:
    """Return the stabilising P of the Riccati equation of a sampled model, the gain (m, n) and the residual.

    P = A^T P A - (A^T P B + S) G + Q,  G = (R + B^T P B)^-1 (B^T P A + S^T)

    Parameters
    ----------
    A, B : (n, n) and (n, m) ndarray
        s[k+1] = A s[k] + B u[k].
    Q, R, S : (n, n), (m, m) and (n, m) ndarray
        Cost s^T Q s + u^T R u + 2 s^T S u of a sample.

    Raises
    ------
    NumericalError
        No solution with a relative residual below 1e-10.
    """
    _, scales = balance(A, permute=False)
    T = np.diag(scales)
    inputs = np.sqrt(np.diag(R + B.T @ Q @ B))
    inputs = 1.0 / np.where(inputs > 0.0, inputs, 1.0)
    a, b = A * T / T[:, np.newaxis], B * inputs / T[:, np.newaxis]
    q, r, s = Q * np.outer(T, T), R * np.outer(inputs, inputs), S * np.outer(T, inputs)
    size = float(np.linalg.norm(q, 2)) or float(np.linalg.norm(r, 2)) or 1.0
    q, r, s = q / size, r / size, s / size
    P = np.asarray(solve_discrete_are(a, b, q, r, s=s), dtype=float)
    gain, residual = _sampled_gain(a, b, q, r, s, P)
    for _ in range(_NEWTON_STEPS):
        closed = a - b @ gain
        if np.max(np.abs(np.linalg.eigvals(closed))) >= 1.0:
            break
        spent = q - s @ gain - gain.T @ s.T + gain.T @ r @ gain
        better = np.asarray(solve_discrete_lyapunov(closed.T, (spent + spent.T) / 2.0, "bilinear"), dtype=float)
        better = (better + better.T) / 2.0
        newer, reached = _sampled_gain(a, b, q, r, s, better)
        if not reached < 0.5 * residual:
            break
        P, gain, residual = better, newer, reached
    if not residual <= TOLERANCE or np.max(np.abs(np.linalg.eigvals(a - b @ gain)), initial=0.0) >= 1.0:
        fault = (
            f"the Riccati equation is solved with a relative residual of {residual:.1e} only, {TOLERANCE:g} is"
            f" needed [E0411]"
        )
        raise NumericalError(fault, "weights that differ less in size, or another sample")
    return size * P / np.outer(T, T), gain * inputs[:, np.newaxis] / T, residual


def _sampled_gain(A: Array, B: Array, Q: Array, R: Array, S: Array, P: Array) -> tuple[Array, float]:
    """Return the gain that belongs to P, and the residual of P relative to the sum of the norms of its terms."""
    gain = np.asarray(np.linalg.solve(R + B.T @ P @ B, B.T @ P @ A + S.T), dtype=float)
    terms = (A.T @ P @ A, -(A.T @ P @ B + S) @ gain, Q, -P)
    scale = sum(float(np.linalg.norm(term)) for term in terms)
    return gain, float(np.linalg.norm(sum(terms))) / (scale or 1.0)
