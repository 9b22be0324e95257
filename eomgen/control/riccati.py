"""The linear-quadratic regulator of a second-order model: the Riccati equation in blocks of the model's own size.

With S = M^-1 B R^-1 B^T M^-T and P = [[P11, P12], [P12^T, P22]] (cross terms of the cost taken into C, K and the
weights before):

    -P12 M^-1 K - K^T M^-T P12^T - P12 S P12^T + Q1 = 0
    P12 + P12^T - P22 M^-1 C - C^T M^-T P22 - P22 S P22 + Q2 = 0
    P11 = P12 M^-1 C + K^T M^-T P22 + P12 S P22 - Q12
    G_p = R^-1 B^T M^-T P12^T,  G_v = R^-1 B^T M^-T P22

SciPy solves the equation of first order in scaled units; Newton's iteration of D. L. Kleinman (On an iterative
technique for Riccati equation computations, IEEE Transactions on Automatic Control 13, 1968) takes off what rounding
left.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_continuous_are, solve_continuous_lyapunov

from eomgen.arrays import Array
from eomgen.control.plant import Complex, Plant, first_order
from eomgen.control.stabilisability import check_detectable, check_stabilisable
from eomgen.control.weights import Weights
from eomgen.errors import NumericalError, UsageError

#: Relative residual of each block above which a solution is refused.
TOLERANCE = 1e-10
_NEWTON_STEPS = 8
_NEGATIVE = 1e-12


@dataclass(frozen=True)
class Regulator:
    """Optimal gains u = -G_p q - G_v v, and the matrix of the cost that is left, [q, v]^T P [q, v].

    Attributes
    ----------
    G_p, G_v : (m, n)
    P11, P12, P22 : (n, n)
    residual : of the worst of the three block equations, relative to the sum of the norms of its terms.
    eigenvalues : (2n,) of the closed loop, 1/s.
    """

    G_p: Array
    G_v: Array
    P11: Array
    P12: Array
    P22: Array
    residual: float
    eigenvalues: Complex


def lqr(plant: Plant, weights: Weights) -> Regulator:
    """Return the gains that minimise the cost.

    Raises
    ------
    UsageError
        Efforts that cost nothing, or a cost that is not bounded below.
    ModelError
        A mode that does not decay and that no actuator moves; a mode on the imaginary axis without weight.
    NumericalError
        No solution with a residual below 1e-10.
    """
    half = _whitening(weights.effort)
    check_stabilisable(plant)
    back, rate, n = plant.scales.state_back, plant.scales.rate, plant.n
    k, c, b = plant.scaled
    B = np.vstack([np.zeros_like(b), b]) @ half
    cross = back.T @ weights.cross @ half
    A = first_order(k, c) - B @ cross.T
    cost, root = _without_cross_terms(back.T @ weights.state @ back, cross)
    check_detectable(plant, A, root)
    P, residual = _solution(A, B, cost)
    there = plant.scales.state
    G = half @ (B.T @ P + cross.T) @ there
    # of extreme plants the cost is beyond doubles before the gains are
    with np.errstate(over="ignore", invalid="ignore"):
        P = there.T @ P @ there / rate
    eigenvalues = plant.eigenvalues(G[:, :n], G[:, n:])
    return Regulator(G[:, :n], G[:, n:], P[:n, :n], P[:n, n:], P[n:, n:], residual, eigenvalues)


def _whitening(R: Array) -> Array:
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


def _without_cross_terms(Q: Array, cross: Array) -> tuple[Array, Array]:
    """Return the cost that cross terms leave when they are taken into the plant, and a square root of it."""
    cost = Q - cross @ cross.T
    values, vectors = np.linalg.eigh((cost + cost.T) / 2.0)
    if values[0] < -_NEGATIVE * max(float(np.linalg.norm(Q, 2)), abs(values[-1])):
        raise UsageError("the cost has no minimum: its cross terms outweigh what they couple", "smaller cross terms")
    values = np.maximum(values, 0.0)
    return (vectors * values) @ vectors.T, (vectors * np.sqrt(values)).T


def _solution(A: Array, B: Array, cost: Array) -> tuple[Array, float]:
    """Return the stabilising P of A^T P + P A - P B B^T P + cost = 0, and its residual."""
    size = float(np.linalg.norm(cost, 2)) or 1.0
    reach = float(np.linalg.norm(B, 2)) or 1.0
    weight = size * reach**2  # of P B B^T P when cost and B have the norm 1
    unit, b = cost / size, B / reach
    try:
        P: Array = np.asarray(solve_continuous_are(A, b, unit, np.eye(B.shape[1]) / weight), dtype=float)
    except (np.linalg.LinAlgError, ValueError) as error:
        what = f"the Riccati equation could not be solved: {str(error).splitlines()[0].rstrip('.')}"
        raise NumericalError(what, "weights that differ less in size") from None
    residual = _residual(A, b, unit, P, weight)
    for _ in range(_NEWTON_STEPS):
        gain = weight * b.T @ P
        closed = A - b @ gain
        if np.linalg.eigvals(closed).real.max() >= 0.0:
            break
        solved = np.asarray(solve_continuous_lyapunov(closed.T, -(unit + gain.T @ gain / weight)), dtype=float)
        better = (solved + solved.T) / 2.0
        reached = _residual(A, b, unit, better, weight)
        if not reached < 0.5 * residual:
            break
        P, residual = better, reached
    if not residual <= TOLERANCE or np.linalg.eigvals(A - weight * b @ (b.T @ P)).real.max() >= 0.0:
        what = (
            f"the Riccati equation is solved with a relative residual of {residual:.1e} only, {TOLERANCE:g} is needed"
        )
        raise NumericalError(what, "weights that differ less in size")
    return P * size, residual


def _residual(A: Array, b: Array, cost: Array, P: Array, weight: float) -> float:
    """Return the largest residual of the three blocks, each relative to the sum of the norms of its terms."""
    n = len(A) // 2
    terms = (A.T @ P, P @ A, -weight * P @ b @ b.T @ P, cost)
    worst = 0.0
    for block in (np.s_[:n, :n], np.s_[:n, n:], np.s_[n:, n:]):
        scale = sum(float(np.linalg.norm(term[block])) for term in terms)
        left = float(np.linalg.norm(sum(term[block] for term in terms)))
        worst = max(worst, left / scale if scale > 0.0 else 0.0)
    return worst
