"""A strip that a sudden moment rolls up, in the plane: elements of constant strain, in NumPy and SciPy's LSODA alone.

Nodes have an angle and a place, their inertia is lumped, and a clamp holds the first one. So it is the benchmark of
Hante, Tumiotto and Arnold (2022), whose section forces are C strain + 2 Cd rate: their Cd is half of a damping.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]
LENGTH, INERTIA = 10.0, np.array([10.0, 1.0, 1.0])
#: Against curvature, stretch and shear.
STIFFNESS = np.array([500.0, 1e4, 1e4])
MOMENT = 2.0 * np.pi * 500.0 / LENGTH


@dataclass(frozen=True)
class Strip:
    """The strip in so many elements.

    Attributes
    ----------
    damping : by rates of all strains, N m^2 s and N s
    linear_moments : whether moments vary along an element as equilibrium has it, in place of one wrench: elements then
        bend under shear, which adds length^2/(12 EI) to their flexibility against it
    """

    elements: int
    damping: float
    linear_moments: bool = False

    def loads(self, strain: Array, rate: Array) -> Array:
        """Return moments, axial and shear forces of elements."""
        ds, (bending, _, shear) = LENGTH / self.elements, STIFFNESS
        resists, damps = STIFFNESS.copy(), np.full(3, self.damping)
        if self.linear_moments:
            resists[2] = 1.0 / (1.0 / shear + ds**2 / (12.0 * bending))
            own, bent = resists[2] / shear, resists[2] / bending
            damps[2] = self.damping * (own**2 + ds**2 / 12.0 * bent**2)
        return np.asarray(resists * (strain - [0.0, 1.0, 0.0]) + damps * rate)

    def strains(self, q: Array) -> tuple[Array, Array]:
        """Return curvature, stretch and shear of elements, and their derivatives in both nodes, (n, 3, 6)."""
        ds, turn, away = LENGTH / self.elements, np.diff(q[:, 0]), np.diff(q[:, 1:], axis=0)
        c, s = np.cos(q[:-1, 0]), np.sin(q[:-1, 0])
        back = np.array([[c, s], [-s, c]]).transpose(2, 0, 1)
        x, y = np.einsum("eij,ej->ie", back, away)
        half = 0.5 * turn
        small = np.abs(half) < 1e-3
        safe = np.where(small, 1.0, half)
        along = np.where(small, 1.0 - half**2 / 3.0, safe / np.tan(safe))
        slope = np.where(small, -half / 3.0, 0.5 / np.tan(safe) - 0.5 * safe / np.sin(safe) ** 2)
        straightened = np.array([[along, half], [-half, along]]).transpose(2, 0, 1)
        strain = np.column_stack([turn, along * x + half * y, along * y - half * x]) / ds
        J = np.zeros((self.elements, 3, 6))
        J[:, 0, 0], J[:, 0, 3] = -1.0, 1.0
        by_turn = np.column_stack([slope * x + 0.5 * y, slope * y - 0.5 * x])
        J[:, 1:, 3] = by_turn
        J[:, 1:, 0] = np.einsum("eij,je->ei", straightened, np.array([y, -x])) - by_turn
        J[:, 1:, 4:] = straightened @ back
        J[:, 1:, 1:3] = -J[:, 1:, 4:]
        return strain, J / ds

    def moved(self, times: Array) -> Array:
        """Return angle and place of the end at these times, (times, 3), from rest along x."""
        n, ds = self.elements, LENGTH / self.elements
        shares = np.ones(n)
        shares[-1] = 0.5
        M = ds * shares[:, None] * INERTIA

        def rates(_: float, state: Array) -> Array:
            q, v = np.zeros((2, n + 1, 3))
            q[1:], v[1:] = state.reshape(n, 2, 3).transpose(1, 0, 2)
            strain, J = self.strains(q)
            rate = np.einsum("eij,ej->ei", J, np.concatenate([v[:-1], v[1:]], axis=1))
            transmitted = ds * np.einsum("eij,ei->ej", J, self.loads(strain, rate))
            forces = -transmitted[:, 3:]
            forces[:-1] -= transmitted[1:, :3]
            forces[-1, 0] += MOMENT
            return np.stack([v[1:], forces / M], axis=1).ravel()

        rest = np.zeros((n, 2, 3))
        rest[:, 0, 1] = ds * np.arange(1, n + 1)
        run = solve_ivp(
            rates, (0.0, times[-1]), rest.ravel(), method="LSODA", t_eval=times, rtol=1e-8, atol=1e-10, lband=11,
            uband=11,
        )  # fmt: skip  # options
        return np.asarray(run.y.T.reshape(-1, n, 2, 3)[:, -1, 0])


def away_from_clamp(end: Array) -> Array:
    """Return by how much an end misses the clamp, m, and one whole turn, as its quaternion misses -1, together."""
    quaternion = np.column_stack([np.cos(0.5 * end[:, 0]) + 1.0, np.sin(0.5 * end[:, 0])])
    return np.asarray(np.linalg.norm(end[:, 1:], axis=1) + np.linalg.norm(quaternion, axis=1))
