"""Riccati equations of optimal control and of optimal observers, in continuous time and sampled.

SciPy solves them; Newton's iteration removes rounding errors (D. L. Kleinman, On an iterative technique for
Riccati equation computations, IEEE Transactions on Automatic Control 13, 1968; sampled: G. A. Hewer, An iterative
technique for the computation of the steady state gains for the discrete optimal regulator, the same 16, 1971).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import numpy as np
from scipy.linalg import (
    solve_continuous_are,
    solve_continuous_lyapunov,
    solve_discrete_are,
    solve_discrete_lyapunov,
)

from eomgen.base.arrays import Array, Complex
from eomgen.base.rounding import SUMMED
from eomgen.errors import NumericalError, UsageError
from eomgen.products.linear.eigenvalues import balance


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
    if values[0] < -SUMMED * max(float(np.linalg.norm(Q, 2)), abs(values[-1])):
        fault = "the cost has no minimum: its cross terms outweigh the weights of states and inputs [E0410]"
        raise UsageError(fault, "smaller cross terms")
    values = np.maximum(values, 0.0)
    return (vectors * values) @ vectors.T, (vectors * np.sqrt(values)).T


@solvable()
def solution(A: Array, B: Array, cost: Array) -> Array:
    """Return the stabilising P of A^T P + P A - P B B^T P + cost = 0.

    Parameters
    ----------
    A, B, cost : (n, n), (n, m) and (n, n)

    Raises
    ------
    NumericalError
        No solution with a residual below 1e-10.
    """
    size = float(np.linalg.norm(cost, 2)) or 1.0
    reach = float(np.linalg.norm(B, 2)) or 1.0
    weight = size * reach**2  # of P B B^T P when cost and B have the norm 1
    unit, b = cost / size, B / reach

    def gain_of(P: Array) -> tuple[Array, float]:
        return weight * b.T @ P, _relative((A.T @ P, P @ A, -weight * P @ b @ b.T @ P, unit))

    def improve(closed: Array, gain: Array) -> Array:
        return np.asarray(solve_continuous_lyapunov(closed.T, -(unit + gain.T @ gain / weight)), dtype=float)

    first = np.asarray(solve_continuous_are(A, b, unit, np.eye(B.shape[1]) / weight), dtype=float)
    return _refine(first, A, b, gain_of, improve, lambda values: float(values.real.max()))[0] * size


@solvable()
def sampled_solution(A: Array, B: Array, Q: Array, R: Array, S: Array) -> tuple[Array, Array]:
    """Return the stabilising P of the Riccati equation of a sampled model, and the gain (m, n).

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

    def gain_of(P: Array) -> tuple[Array, float]:
        gain = np.asarray(np.linalg.solve(r + b.T @ P @ b, b.T @ P @ a + s.T), dtype=float)
        return gain, _relative((a.T @ P @ a, -(a.T @ P @ b + s) @ gain, q, -P))

    def improve(closed: Array, gain: Array) -> Array:
        spent = q - s @ gain - gain.T @ s.T + gain.T @ r @ gain
        return np.asarray(solve_discrete_lyapunov(closed.T, (spent + spent.T) / 2.0, "bilinear"), dtype=float)

    first = np.asarray(solve_discrete_are(a, b, q, r, s=s), dtype=float)
    P, gain = _refine(first, a, b, gain_of, improve, lambda values: float(np.abs(values).max()) - 1.0)
    return size * P / np.outer(T, T), gain * inputs[:, np.newaxis] / T


def _refine(
    P: Array,
    A: Array,
    B: Array,
    gain_of: Callable[[Array], tuple[Array, float]],
    improve: Callable[[Array, Array], Array],
    growth: Callable[[Complex], float],
) -> tuple[Array, Array]:
    """Return a solution after Newton's steps, and its gain.

    Parameters
    ----------
    P, A, B : a solution, and the model (n, n), (n, m)
    gain_of : returns the gain of a solution, and the relative residual
    improve : returns the next solution, given the matrix of the closed loop and the gain
    growth : returns how far the eigenvalues of a closed loop are beyond the border of stability

    Raises
    ------
    NumericalError
        A residual above 1e-10, or a closed loop that does not decay.
    """
    gain, residual = gain_of(P)
    for _ in range(8):
        closed = A - B @ gain
        if growth(np.linalg.eigvals(closed).astype(complex)) >= 0.0:
            break
        better = improve(closed, gain)
        better = (better + better.T) / 2.0
        newer, reached = gain_of(better)
        if not reached < 0.5 * residual:
            break
        P, gain, residual = better, newer, reached
    if not residual <= 1e-10 or growth(np.linalg.eigvals(A - B @ gain).astype(complex)) >= 0.0:
        fault = f"the Riccati equation is solved to a relative residual of {residual:.1e} only [E0411]"
        raise NumericalError(fault, "weights that differ less in size, or another sample")
    return P, gain


def _relative(terms: Sequence[Array]) -> float:
    """Return the norm of a sum of terms relative to the sum of their norms."""
    return float(np.linalg.norm(sum(terms))) / (sum(float(np.linalg.norm(term)) for term in terms) or 1.0)
