"""The spin-up cantilever in its rotating frame: a linear equation with time-dependent matrices, integrated by DOP853.

A beam along x turns about z by a given law; deflection v is in the plane. With shapes phi (dossier 1.5, equation 11):

    int rhoA phi phi^T eta'' + [K + Omega^2 (G1 - M)] eta = -Omega' int rhoA x phi,    v = phi^T eta

Integrals are Gauss-Legendre sums of sampled shapes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar

from tests.oracles.beam_shapes import sampled


@dataclass(frozen=True)
class Beam:
    """Data of a case: bending stiffness (N m^2), mass per length (kg/m), length (m), final rate (rad/s), time to reach
    it (s)."""

    bending: float
    mass: float
    length: float
    rate: float
    rise: float = 15.0

    def speed(self, t: np.ndarray | float) -> np.ndarray:
        s = np.minimum(np.asarray(t) / self.rise, 1.0)
        return self.rate * (s - np.sin(2 * np.pi * s) / (2 * np.pi))

    def angle(self, t: np.ndarray | float) -> np.ndarray:
        t = np.asarray(t)
        s, late = np.minimum(t / self.rise, 1.0), np.maximum(t - self.rise, 0.0)
        return self.rate * (self.rise * (s**2 / 2 + (np.cos(2 * np.pi * s) - 1.0) / (2 * np.pi) ** 2) + late)

    def acceleration(self, t: np.ndarray | float) -> np.ndarray:
        s = np.minimum(np.asarray(t) / self.rise, 1.0)
        return self.rate / self.rise * (1.0 - np.cos(2 * np.pi * s))


SET_A = Beam(bending=1.4e4, mass=1.2, length=10.0, rate=6.0)
SET_B = Beam(bending=6.895e10 * 8.2189e-9, mass=2766.67 * 7.2968e-5, length=8.0, rate=4.0)


@dataclass(frozen=True)
class Motion:
    """Tip deflection over time, its extreme, and the amplitude left after the spin-up; metres and seconds."""

    deflection: Callable[[Sequence[float]], np.ndarray]
    peak: float
    peak_time: float
    residual: float


def simulate(beam: Beam, modes: int, end: float = 40.0, *, stiffening: bool = True) -> Motion:
    """Integrate from rest with the first clamped-free shapes; without stiffening the shortening is left out, as one
    must not."""
    nodes, weights = np.polynomial.legendre.leggauss(48)
    x, w = (nodes + 1) / 2, weights / 2
    phi, slope, bend = (sampled("clamped-free", modes, x.tolist(), derivative) for derivative in range(3))
    m, L = beam.mass, beam.length
    mass = m * L * (phi * w) @ phi.T
    lever = m * L**2 * (phi * w) @ x
    stiffness = beam.bending / L**3 * (bend * w) @ bend.T
    centrifugal = m * L * (slope * w * (1 - x**2) / 2) @ slope.T
    tip = sampled("clamped-free", modes, [1.0])[:, 0]
    turning = (centrifugal if stiffening else 0.0) - mass

    def rate(t: float, state: np.ndarray) -> np.ndarray:
        eta, eta_rate = state[:modes], state[modes:]
        force = -beam.acceleration(t) * lever - (stiffness + beam.speed(t) ** 2 * turning) @ eta
        return np.concatenate([eta_rate, np.linalg.solve(mass, force)])

    stops = [0.0, *([beam.rise] if end > beam.rise else []), end]  # the law has a jump in its third derivative
    state, pieces = np.zeros(2 * modes), []
    for start, stop in pairwise(stops):
        run = solve_ivp(rate, (start, stop), state, method="DOP853", rtol=1e-11, atol=1e-13, dense_output=True)
        pieces.append(run.sol)
        state = run.y[:, -1]

    def deflection(t: Sequence[float]) -> np.ndarray:
        return np.array([tip @ pieces[0 if moment <= stops[1] else -1](moment)[:modes] for moment in t])

    found = minimize_scalar(
        lambda t: float(deflection([t])[0]), bounds=(5.5, 8.0), method="bounded", options={"xatol": 1e-9}
    )
    late = deflection(np.linspace(beam.rise, end, 20001)) if end > beam.rise else np.zeros(1)
    return Motion(deflection, float(found.fun), float(found.x), float(np.abs(late).max()))
