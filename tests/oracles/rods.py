"""Cantilevered Cosserat rods by shooting on their differential equations: no elements, no frames of a tree.

r' = R (gamma + e_x), R' = R skew(kappa + kappa_0), m' = -r' x n with (kappa, gamma) = C^-1 (R^T m, R^T n): Antman,
Nonlinear Problems of Elasticity, 1995, chapter 8; Simo, Comput. Methods Appl. Mech. Engrg. 49 (1985) 55.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import root

from tests.oracles.evaluation import Array


def skew(x: Array) -> Array:
    return np.array([[0.0, -x[2], x[1]], [x[2], 0.0, -x[0]], [-x[1], x[0], 0.0]])


def tip_of_rod(
    length: float,
    stiffness: Array,
    force: Array,
    curvature: Callable[[float], Array],
    *,
    axes: Array | None = None,
    speed: Callable[[float], float] = lambda _: 1.0,
    load_steps: int = 4,
) -> Array:
    """Return where the tip of a rod clamped at the origin is under a dead force, (3,).

    Parameters
    ----------
    length : of the parameter s along the rod
    stiffness : (6, 6), rotations first, section axes
    curvature : at rest, of s
    axes : (3, 3), columns of the first section; the world's where not given
    speed : arc length by s
    """
    compliance = np.linalg.inv(stiffness)

    def slopes(s: float, y: Array, load: Array) -> Array:
        R, moment = y[3:12].reshape(3, 3), y[12:]
        strain = compliance @ np.concatenate([R.T @ moment, R.T @ load])
        along = R @ (strain[3:] + np.array([1.0, 0.0, 0.0]))
        turning = R @ skew(strain[:3] + curvature(s))
        return speed(s) * np.concatenate([along, turning.ravel(), -np.cross(along, load)])

    def end(moment: Array, load: Array) -> Array:
        start = np.concatenate([np.zeros(3), (np.eye(3) if axes is None else axes).ravel(), moment])
        run = solve_ivp(slopes, (0.0, length), start, args=(load,), method="DOP853", rtol=1e-11, atol=1e-10)
        return np.asarray(run.y[:, -1])

    moment = np.zeros(3)
    for step in range(1, load_steps + 1):
        load = step / load_steps * force
        moment = root(lambda guess, load=load: end(guess, load)[12:], moment, tol=1e-12).x  # type: ignore[misc]  # bound
    return end(moment, force)[:3]
