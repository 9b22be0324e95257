"""The elastic slider-crank of Simeon (Bari test set "crank"), by quadrature of its kinematics and in independent
coordinates.

A rigid crank turns at a given rate; the connecting rod bends (two sines between its ends) and stretches (quadratic
nodes at its middle and end). Coordinates are phi1, phi2 (both from the line of the slider), x3 and q1..q4. A point of
the rod at x is at

    L1 (cos phi1, sin phi1) + R(phi2) (x + psi(x)^T (q3, q4), phi(x)^T (q1, q2))

The constraints put its end on the line and the slider there. Axial load does not stiffen the rod: the problem is
published so. The published programs write the mass matrix of the stretch 15 times too large, wherever it enters, and pi
as 3.1415927: the option `published` adds the kinetic energy (1/2) 14 (r'^T m r' + phi2'^2 r^T m r) of r = (q3, q4), m
being the consistent matrix.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp

L1, L2, CRANK, ROD, SLIDER = 0.15, 0.30, 0.36, 0.151104, 0.075552
J1, J2 = 0.002727, 0.0045339259
MODULUS, SIDE, DENSITY, RATE = 0.20e12, 0.0080, 7870.0, 150.0

START = np.array([0.0, 0.0, 0.103339863e-4, 0.169327969e-4])
START_RATE = np.array([0.444896105, 0.463434311e-2, -0.178591076e-5, -0.268938672e-5])


class Crank:
    """Terms of M q'' + c + K q + Phi_q^T lambda = 0 and its motion under phi1 = RATE t."""

    def __init__(self, *, published: bool, stiffness: float = 1.0) -> None:
        """Choose the published variant or the consistent one; `stiffness` multiplies the modulus."""
        turn = 3.1415927 if published else np.pi
        nodes, weights = np.polynomial.legendre.leggauss(20)
        s, area, modulus = (nodes + 1) / 2, SIDE**2, MODULUS * stiffness
        lengths = L2 * weights / 2
        self.published, self.x, self.root = published, L2 * s, np.sqrt(DENSITY * area * lengths)
        self.phi_x = np.array([np.sin(turn * s), np.sin(2 * turn * s)]).T
        self.psi_x = np.array([4 * s * (1 - s), s * (2 * s - 1)]).T
        bend = np.array([turn**2 * np.sin(turn * s), 4 * turn**2 * np.sin(2 * turn * s)]) / L2**2
        stretch = np.array([4 - 8 * s, 4 * s - 1]) / L2
        self.K = np.zeros((7, 7))
        self.K[3:5, 3:5] = modulus * SIDE**4 / 12 * (bend * lengths) @ bend.T
        self.K[5:, 5:] = modulus * area * (stretch * lengths) @ stretch.T
        self.more = 14.0 * DENSITY * area * (self.psi_x.T * lengths) @ self.psi_x

    def mass_and_coupling(self, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return M (7, 7) and the inertia forces quadratic in v.

        Rows of J and bias are the points of the rod, first their x and then their y, times the root of the weight of
        each.
        """
        root = self.root
        along, across = self.x + self.psi_x @ q[5:], self.phi_x @ q[3:5]
        along_rate, across_rate = self.psi_x @ v[5:], self.phi_x @ v[3:5]
        turn, cosine, sine = v[1], np.cos(q[1]), np.sin(q[1])
        crank = L1 * np.cos(q[0]), L1 * np.sin(q[0])
        n = len(root)
        J, bias = np.zeros((2 * n, 7)), np.zeros(2 * n)
        axes = (slice(n), cosine, -sine, crank[0], -crank[1]), (slice(n, 2 * n), sine, cosine, crank[1], crank[0])
        for part, e, other, here, there in axes:
            J[part, 0] = there * root
            J[part, 1] = (along * other - across * e) * root
            J[part, 3:5] = self.phi_x * (other * root)[:, np.newaxis]
            J[part, 5:] = self.psi_x * (e * root)[:, np.newaxis]
            inward = -(v[0] ** 2) * here - turn**2 * (along * e + across * other)
            bias[part] = (inward + 2 * turn * (along_rate * other - across_rate * e)) * root
        M, c = J.T @ J, J.T @ bias
        M[0, 0] += J1
        M[1, 1] += J2 - root**2 @ self.x**2  # what the sections' own inertia adds
        M[2, 2] += SLIDER
        if self.published:
            more, r, r_rate = self.more, q[5:], v[5:]
            M[5:, 5:] += more
            M[1, 1] += r @ more @ r
            c[1] += 2 * turn * (r @ more @ r_rate)
            c[5:] -= turn**2 * (more @ r)
        return M, c

    @staticmethod
    def constraint(q: np.ndarray) -> np.ndarray:
        end = L2 + q[6]
        return np.array([L1 * np.sin(q[0]) + end * np.sin(q[1]), q[2] - L1 * np.cos(q[0]) - end * np.cos(q[1])])

    @staticmethod
    def constraint_jacobian(q: np.ndarray) -> np.ndarray:
        """Return the rows of both loop equations, and of phi1 = RATE t as the third."""
        end, B = L2 + q[6], np.zeros((3, 7))
        B[0, [0, 1, 6]] = L1 * np.cos(q[0]), end * np.cos(q[1]), np.sin(q[1])
        B[1, [0, 1, 2, 6]] = L1 * np.sin(q[0]), end * np.sin(q[1]), 1.0, -np.cos(q[1])
        B[2, 0] = 1.0
        return B

    @staticmethod
    def constraint_bias(q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return what the constraints' second time derivatives are besides B a."""
        end, cosine, sine = L2 + q[6], np.cos(q[1]), np.sin(q[1])
        crank = L1 * v[0] ** 2
        return np.array(
            [
                -crank * np.sin(q[0]) - end * v[1] ** 2 * sine + 2 * v[6] * v[1] * cosine,
                crank * np.cos(q[0]) + end * v[1] ** 2 * cosine + 2 * v[6] * v[1] * sine,
                0.0,
            ]
        )

    def state(self, t: float, elastic: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return all coordinates and velocities where q1..q4 and their rates are given."""
        q, v = np.zeros(7), np.zeros(7)
        q[0], v[0], q[3:], v[3:] = RATE * t, RATE, elastic[:4], elastic[4:]
        q[1] = -np.arcsin(L1 * np.sin(q[0]) / (L2 + q[6]))
        q[2] = -self.constraint(q)[1]
        B = self.constraint_jacobian(q)
        v[1:3] = np.linalg.solve(B[:2, 1:3], -B[:2] @ v)
        return q, v

    def acceleration(self, t: float, elastic: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return accelerations (7) and multipliers (3), from equations projected on the motions that constraints
        allow."""
        q, v = self.state(t, elastic)
        B, bias = self.constraint_jacobian(q), self.constraint_bias(q, v)
        M, c = self.mass_and_coupling(q, v)
        R, extra = np.zeros((7, 4)), np.zeros(7)
        R[3:] = np.eye(4)
        R[1:3] = -np.linalg.solve(B[:2, 1:3], B[:2, 3:])
        extra[1:3] = -np.linalg.solve(B[:2, 1:3], bias[:2])
        a = R @ np.linalg.solve(R.T @ M @ R, -R.T @ (c + self.K @ q + M @ extra)) + extra
        return a, np.linalg.solve(B[:, :3].T, -(M @ a + c + self.K @ q)[:3])

    def simulate(self, times: np.ndarray, *, rtol: float = 1e-8) -> np.ndarray:
        """Return q1..q4 and their rates at times, shape (times, 8), from the published start."""

        def rate(t: float, elastic: np.ndarray) -> np.ndarray:
            return np.concatenate([elastic[4:], self.acceleration(t, elastic)[0][3:]])

        start = np.concatenate([START, START_RATE])
        scale = np.array([1e-4, 1e-5, 1e-5, 1e-5, 1e-1, 1e-2, 1e-2, 1e-2])
        end = (0.0, float(times[-1]))
        run = solve_ivp(rate, end, start, method="DOP853", t_eval=times, rtol=rtol, atol=rtol * scale)
        found: np.ndarray = run.y.T
        return found
