"""The elastic half car EV-1 from first principles: a free-free beam on two suspensions and wheels, as matrices.

Coordinates: heave of the centre z, pitch theta (a rise of theta per metre towards the front), elastic coordinates of
the body, front and rear wheel. The height of the body at distance s ahead of its centre is z + s theta + phi(1/2 +
s/L)^T eta.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from tests.oracles.beam_shapes import sampled

FRONT, REAR = 1.011, -1.803


@dataclass(frozen=True)
class HalfCar:
    """Matrices of M q'' + C q' + K q = E (front road, rear road); N, m, s, rad."""

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    road: np.ndarray

    def frequencies(self) -> np.ndarray:
        """Return undamped frequencies in Hz."""
        frequencies: np.ndarray = np.sqrt(eigh(self.stiffness, self.mass, eigvals_only=True)) / (2 * np.pi)
        return frequencies

    def eigenvalues(self) -> np.ndarray:
        n = len(self.mass)
        rates = np.hstack([np.zeros((n, n)), np.eye(n)])
        system = np.vstack([rates, -np.linalg.solve(self.mass, np.hstack([self.stiffness, self.damping]))])
        return np.linalg.eigvals(system)


def half_car(modes: int, *, bending: float = 1.0e6, modal_damping: float = 0.01) -> HalfCar:
    """Return the car with so many elastic modes; none is the rigid half car HC."""
    m, inertia, wheel = 730.0, 1230.0, (40.0, 35.5)
    springs, dampers, tyre = (19960.0, 17500.0), (1290.0, 1620.0), 175500.0
    length = np.sqrt(12 * inertia / m)
    nodes, weights = np.polynomial.legendre.leggauss(48)
    x, w = (nodes + 1) / 2, weights / 2
    phi, bend = (sampled("free-free", modes, x.tolist(), k) for k in (0, 2))
    n = modes + 4
    M, C, K, road = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, 2))
    fields = np.vstack([np.ones_like(x), (x - 0.5) * length, phi])
    M[:-2, :-2] = m * (fields * w) @ fields.T
    K[2:-2, 2:-2] = bending / length**3 * (bend * w) @ bend.T
    elastic = range(2, 2 + modes)
    C[elastic, elastic] = 2 * modal_damping * np.sqrt(np.diag(K)[elastic] * np.diag(M)[elastic])
    for side, place in enumerate((FRONT, REAR)):
        M[n - 2 + side, n - 2 + side] = wheel[side]
        stretch = np.zeros(n)
        stretch[:-2] = [1.0, place, *sampled("free-free", modes, [0.5 + place / length])[:, 0]]
        stretch[n - 2 + side] = -1.0
        K += springs[side] * np.outer(stretch, stretch)
        C += dampers[side] * np.outer(stretch, stretch)
        K[n - 2 + side, n - 2 + side] += tyre
        road[n - 2 + side, side] = tyre
    return HalfCar(M, C, K, road)
