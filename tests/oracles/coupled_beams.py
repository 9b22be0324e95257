"""Uniform cantilevers of coupled sections: exact frequencies at rest, and the deformed shape at a steady rotation.

Sections are 6 x 6 matrices, forces and translations first. Frequencies are where transfer matrices have a free end
(Hodges, *Nonlinear Composite Beam Theory*, AIAA 2006, for the equations); shapes are integrated from the root.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq, root

from tests.oracles.evaluation import Array

#: Of forces and moments, N: states are of like size.
_SCALE = 1e6


def cross(vector: Array) -> Array:
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


_ALONG = np.array([1.0, 0.0, 0.0])


def frequencies(stiffness: Array, inertia: Array, length: float, highest: float, count: int) -> Array:
    """Return the lowest frequencies of a cantilever, rad/s, found on a grid up to the highest one."""
    flexibility = np.linalg.inv(stiffness)
    kinematics, statics = np.zeros((6, 6)), np.zeros((6, 6))
    kinematics[:3, 3:] = -cross(_ALONG)  # u' = strain + theta x e1
    statics[3:, :3] = -cross(_ALONG)  # M' = -e1 x F - what accelerates

    def free_end(omega: float) -> float:
        A = np.block([[kinematics, flexibility * _SCALE], [-(omega**2) * inertia / _SCALE, statics]])
        return float(np.linalg.det(expm(A * length)[6:, 6:]))

    grid = np.linspace(1e-3, highest, 500)
    values = [free_end(omega) for omega in grid]
    found = [
        brentq(free_end, a, b, xtol=1e-11)
        for a, b, fa, fb in zip(grid[:-1], grid[1:], values[:-1], values[1:], strict=True)
        if fa * fb < 0.0
    ]
    return np.array(found[:count])


def turning_tip(stiffness: Array, inertia: Array, length: float, speed: float) -> tuple[Array, Array]:
    """Return the place of the tip, m, and the loads of the root section (force, moment), of a blade along x from the
    axis z of a rotor that turns steadily."""
    flexibility, omega = np.linalg.inv(stiffness), np.array([0.0, 0.0, speed])
    mass = inertia[0, 0]
    center = np.array([0.0, -inertia[0, 5], inertia[0, 4]]) / mass

    def slopes(_: float, state: Array) -> Array:
        place, R, force, moment = state[:3], state[3:12].reshape(3, 3), state[12:15], state[15:]
        strain = flexibility @ np.concatenate([R.T @ force, R.T @ moment])
        along = R @ (_ALONG + strain[:3])
        off = R @ center
        turned = R.T @ omega
        gyroscopic = R @ np.cross(turned, inertia[3:, 3:] @ turned)
        pull = np.cross(omega, np.cross(omega, place))
        body = mass * (pull + np.cross(omega, np.cross(omega, off)))
        couple = mass * np.cross(off, pull) + gyroscopic
        return np.concatenate([along, (R @ cross(strain[3:])).ravel(), body, couple - np.cross(along, force)])

    def tip(loads: Array) -> Array:
        start = np.concatenate([np.zeros(3), np.eye(3).ravel(), loads * _SCALE])
        end: Array = solve_ivp(slopes, (0.0, length), start, rtol=1e-9, atol=1e-9).y[:, -1]
        return end

    guess = np.array([0.5 * mass * (speed * length) ** 2, 0.0, 0.0, 0.0, 0.0, 0.0]) / _SCALE
    solved = root(lambda loads: tip(loads)[12:] / _SCALE, guess, tol=1e-12)
    if not solved.success:
        raise RuntimeError(solved.message)
    return tip(solved.x)[:3], solved.x * _SCALE
