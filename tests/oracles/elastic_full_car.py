"""A full car with a body that bends and twists, from first principles, as matrices: a free-free beam on suspensions and
wheels.

Coordinates: heave of the centre z, pitch p (about y, lowers the front), roll r (about x, raises the left), bending b,
twist a, wheels front left, front right, rear left, rear right. A point of the body at x ahead and y left of its centre
is at the height z - x p + y r + phi(1/2 + x/L)^T b + y psi(1/2 + x/L)^T a, with psi_k = cos k pi s.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import eigh, solve_continuous_are

from tests.oracles.beam_shapes import sampled

BODY, ROLL, PITCH, WHEEL, TYRE = 1500.0, 460.0, 2160.0, 59.0, 190000.0
ALONG, ACROSS = np.array([1.4, 1.4, -1.7, -1.7]), np.array([0.75, -0.75, 0.75, -0.75])
SPRINGS, DAMPERS = np.array([35e3, 35e3, 38e3, 38e3]), np.array([1000.0, 1000.0, 1100.0, 1100.0])
LENGTH = float(np.sqrt(12 * PITCH / BODY))
BENDING, TWISTING, MODAL_DAMPING, MODES = 2.5e6, 6.0e6, 0.01, 2
RIGID, SIZE = 3, 3 + 2 * MODES + 4
#: What the regulator knows of the wheels above the road: both axles and the left side.
KNOWN = np.array([[0.5, 0.5, 0.0, 0.0], [0.0, 0.0, 0.5, 0.5], [0.5, 0.0, 0.5, 0.0]])


@dataclass(frozen=True)
class FullCar:
    """Matrices of M q'' + C q' + K q = B u + E w; N, m, s, rad.

    ``wheels`` (n, 4) is E of the road under each wheel, ``actuators`` (n, 4) B of tensions, ``corners`` (4, n) the
    heights of the body above the wheels.
    """

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    wheels: np.ndarray
    actuators: np.ndarray
    corners: np.ndarray

    def frequencies(self) -> np.ndarray:
        """Return undamped frequencies in Hz."""
        frequencies: np.ndarray = np.sqrt(eigh(self.stiffness, self.mass, eigvals_only=True)) / (2 * np.pi)
        return frequencies

    def with_skyhook(self, gain: float) -> FullCar:
        """Return the car with tensions of ``gain`` times the body's velocity above each wheel."""
        return replace(self, damping=self.damping - gain * self.actuators @ self.corners)

    def regulated(self, middle: float, corner: float, travel: float, load: float, effort: float) -> FullCar:
        """Return the car under the optimal regulator, which knows travels, ``KNOWN`` tyre deflections, elastic
        coordinates.

        What it knows is y = Y q - Y_w w; it gives -G Y^-1 y for -G q, so the road enters through it too.
        """
        by_position, by_velocity = self._gains(middle, corner, travel, load, effort)
        elastic = np.eye(SIZE)[RIGID : RIGID + 2 * MODES]
        told = np.vstack([-self.actuators.T, KNOWN @ self.wheels.T / TYRE, elastic])
        of_road = np.vstack([np.zeros((4, 4)), KNOWN, np.zeros((2 * MODES, 4))])
        return replace(
            self,
            damping=self.damping + self.actuators @ by_velocity,
            stiffness=self.stiffness + self.actuators @ by_position,
            wheels=self.wheels + self.actuators @ by_position @ np.linalg.solve(told, of_road),
        )

    def _gains(
        self, middle: float, corner: float, travel: float, load: float, effort: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the gains (4, n) of positions and of velocities that minimise the weighted squares, by Riccati's
        equation."""
        n = len(self.mass)
        inverse = np.linalg.inv(self.mass)
        A = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ self.stiffness, -inverse @ self.damping]])
        B = np.vstack([np.zeros((n, 4)), inverse @ self.actuators])
        center = height(0.0, 0.0)
        accelerations = np.vstack([np.sqrt(middle) * center, np.sqrt(corner) * self.corners])
        places = np.vstack([np.sqrt(travel) * -self.actuators.T, np.sqrt(load) * self.wheels.T])
        y = np.vstack([accelerations @ A[n:], np.hstack([places, np.zeros((8, n))])])
        u = np.vstack([accelerations @ B[n:], np.zeros((8, 4))])
        R = u.T @ u + effort * np.eye(4)
        P = solve_continuous_are(A, B, y.T @ y, R, s=y.T @ u)
        G = np.linalg.solve(R, B.T @ P + u.T @ y)
        return G[:, :n], G[:, n:]


def height(x: float, y: float) -> np.ndarray:
    """Return the row (n,) of the height of a point of the body."""
    s = 0.5 + x / LENGTH
    twist = [y * np.cos((k + 1) * np.pi * s) for k in range(MODES)]
    return np.array([1.0, -x, y, *sampled("free-free", MODES, [s])[:, 0], *twist, 0.0, 0.0, 0.0, 0.0])


def full_car(*, stiffer: float = 1.0) -> FullCar:
    """Return the car, its body stiffer by a factor; integrals by Gauss's rule."""
    nodes, weights = np.polynomial.legendre.leggauss(48)
    s, w = (nodes + 1) / 2, weights / 2
    orders = np.pi * np.arange(1, MODES + 1)[:, np.newaxis]
    phi, bend = (sampled("free-free", MODES, s.tolist(), derivative) for derivative in (0, 2))
    lifts = np.vstack([np.ones_like(s), -(s - 0.5) * LENGTH, 0 * s, phi, 0 * orders * s])
    turns = np.vstack([0 * s, 0 * s, np.ones_like(s), 0 * phi, np.cos(orders * s)])
    M, C, K = (np.zeros((SIZE, SIZE)) for _ in range(3))
    M[:-4, :-4] = BODY * (lifts * w) @ lifts.T + ROLL * (turns * w) @ turns.T
    slopes = -orders * np.sin(orders * s)
    bent, twisted = slice(RIGID, RIGID + MODES), slice(RIGID + MODES, RIGID + 2 * MODES)
    K[bent, bent] = stiffer * BENDING / LENGTH**3 * (bend * w) @ bend.T
    K[twisted, twisted] = stiffer * TWISTING / LENGTH * (slopes * w) @ slopes.T
    elastic = range(RIGID, RIGID + 2 * MODES)
    C[elastic, elastic] = 2 * MODAL_DAMPING * np.sqrt(np.diag(K)[elastic] * np.diag(M)[elastic])
    wheels = np.vstack([np.zeros((SIZE - 4, 4)), np.eye(4)])
    M += WHEEL * wheels @ wheels.T
    corners = np.array([height(x, y) for x, y in zip(ALONG, ACROSS, strict=True)])
    stretch = corners - wheels.T
    K += stretch.T @ np.diag(SPRINGS) @ stretch + TYRE * wheels @ wheels.T
    C += stretch.T @ np.diag(DAMPERS) @ stretch
    return FullCar(M, C, K, TYRE * wheels, -stretch.T, corners)
