"""The linear-quadratic regulator of a second-order model: the Riccati equation in blocks of the model's own size.

With S = M^-1 B R^-1 B^T M^-T and P = [[P11, P12], [P12^T, P22]] (cross terms of the cost taken into C, K and the
weights before):

    -P12 M^-1 K - K^T M^-T P12^T - P12 S P12^T + Q1 = 0
    P12 + P12^T - P22 M^-1 C - C^T M^-T P22 - P22 S P22 + Q2 = 0
    P11 = P12 M^-1 C + K^T M^-T P22 + P12 S P22 - Q12
    G_p = R^-1 B^T M^-T P12^T,  G_v = R^-1 B^T M^-T P22

They are solved as an equation of first order in scaled units (``riccati_equation``).
"""

from __future__ import annotations

import numpy as np

from eomgen.base.arrays import Array, Complex
from eomgen.base.data import dataclass
from eomgen.linear.control.plant import Plant, first_order
from eomgen.linear.control.riccati_equation import solution, whitening, without_cross_terms
from eomgen.linear.control.stabilisability import check_detectable, check_stabilisable
from eomgen.linear.control.weights import Weights


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
        Efforts without cost, or a cost that is not bounded below.
    ModelError
        A mode that does not decay and that no actuator moves; a mode on the imaginary axis without weight.
    NumericalError
        No solution with a residual below 1e-10.
    """
    half = whitening(weights.effort)
    check_stabilisable(plant)
    back, rate, n = plant.scales.state_back, plant.scales.rate, plant.n
    k, c, b = plant.scaled
    B = np.vstack([np.zeros_like(b), b]) @ half
    cross = back.T @ weights.cross @ half
    A = first_order(k, c) - B @ cross.T
    cost, root = without_cross_terms(back.T @ weights.state @ back, cross)
    check_detectable(plant, A, root)
    halves = (slice(0, n), slice(n, 2 * n))
    P, residual = solution(A, B, cost, ((halves[0], halves[0]), halves, (halves[1], halves[1])))
    there = plant.scales.state
    G = half @ (B.T @ P + cross.T) @ there
    # of extreme plants the cost is beyond doubles before the gains are
    with np.errstate(over="ignore", invalid="ignore"):
        P = there.T @ P @ there / rate
    eigenvalues = plant.eigenvalues(G[:, :n], G[:, n:])
    return Regulator(G[:, :n], G[:, n:], P[:n, :n], P[:n, n:], P[n:, n:], residual, eigenvalues)
