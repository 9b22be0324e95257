"""RATTLie in dense NumPy, from the equations of Hante and Arnold alone, with closed forms of its own for the groups.

Systems are closures: momenta, what changes them, constraints. Newton's matrix is found by differences.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
#: A rotation matrix and a position, or whatever a group moves.
Place = tuple[Array, ...]


def skew(a: Array) -> Array:
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def coefficients(square: float) -> tuple[float, float, float]:
    """Return f1, f2, f6 of the angle's square; their closed forms from 1/2 rad on."""
    if square < 0.25:
        f1 = 1 - square / 6 + square**2 / 120 - square**3 / 5040 + square**4 / 362880
        f2 = -(0.5 - square / 24 + square**2 / 720 - square**3 / 40320 + square**4 / 3628800)
        f6 = 1 / 12 + square / 720 + square**2 / 30240 + square**3 / 1209600 + square**4 / 47900160
        return f1, f2, f6 + 691 * square**5 / 1307674368000
    x = np.sqrt(square)
    return np.sin(x) / x, (np.cos(x) - 1) / square, (2 - x / np.tan(x / 2)) / (2 * square)


def turned(angle: Array) -> Array:
    """Return exp of a rotation vector, a matrix."""
    f1, f2, _ = coefficients(float(angle @ angle))
    S = skew(angle)
    return np.asarray(np.eye(3) + f1 * S - f2 * S @ S)


def inverse_tangent(angle: Array) -> Array:
    *_, f6 = coefficients(float(angle @ angle))
    S = skew(angle)
    return np.asarray(np.eye(3) + 0.5 * S + f6 * S @ S)


@dataclass(frozen=True)
class OracleGroup:
    """Dimension, q o exp(theta), and T(theta)^-1."""

    size: int
    moved: Callable[[Place, Array], Place]
    tangent_inverse: Callable[[Array], Array]


def real_space(size: int) -> OracleGroup:
    return OracleGroup(size, lambda q, theta: (q[0] + theta,), lambda theta: np.eye(size))


def _of_pair(angle: Array) -> Array:
    found = np.eye(6)
    found[:3, :3] = inverse_tangent(angle[:3])
    return found


SO3 = OracleGroup(3, lambda q, theta: (q[0] @ turned(theta),), inverse_tangent)
R3xSO3 = OracleGroup(6, lambda q, theta: (q[0] @ turned(theta[:3]), q[1] + theta[3:]), _of_pair)


@dataclass(frozen=True)
class Motion:
    """A system: momenta p(q, w) = M w, the forces dT/dq + Q at (q, w, t), and the constraints Phi with their B."""

    group: OracleGroup
    mass: Callable[[Place], Array]
    forces: Callable[[Place, Array, float], Array]
    Phi: Callable[[Place], Array] = lambda _: np.zeros(0)
    B: Callable[[Place], Array] | None = None

    def jacobian(self, q: Place) -> Array:
        return np.zeros((0, self.group.size)) if self.B is None else self.B(q)


@dataclass(frozen=True)
class Step:
    """Where a step ends, and the multipliers from its side at its start and at its end."""

    q: Place
    v: Array
    unknown: Array
    after: Array
    before: Array


def step(motion: Motion, q: Place, v: Array, t: float, h: float, guess: Array | None = None) -> Step:
    """Return a step of the variational integrator, its equations solved to rounding."""
    group, size = motion.group, motion.group.size
    p, B = motion.mass(q) @ v, motion.jacobian(q)

    def ends(w: Array) -> tuple[Place, Array]:
        there = group.moved(q, h * w)
        return there, 0.5 * (motion.mass(q) + motion.mass(there)) @ w

    def equations(x: Array) -> Array:
        w = x[:size]
        there, middle = ends(w)
        r = group.tangent_inverse(-h * w).T @ middle - 0.5 * h * motion.forces(q, w, t) - p + 0.5 * B.T @ x[size:]
        return np.concatenate([r, motion.Phi(there) / h])

    x = np.concatenate([v, np.zeros(len(B))]) if guess is None else guess.copy()
    matrix, before = differences(equations, x), np.inf
    for _ in range(60):
        change = np.linalg.solve(matrix, -equations(x))
        x = x + change
        length = float(np.linalg.norm(change))
        if length == 0.0 or (length > 0.5 * before and length < 1e-7 * (1.0 + np.linalg.norm(x))):
            break
        before = length
    else:
        raise ArithmeticError("the oracle's Newton iteration does not converge")
    w = x[:size]
    there, middle = ends(w)
    c = group.tangent_inverse(h * w).T @ middle + 0.5 * h * motion.forces(there, w, t + h)
    B_there = motion.jacobian(there)
    rows = len(B_there)
    matrix = np.block([[motion.mass(there), B_there.T], [B_there, np.zeros((rows, rows))]])
    y = np.linalg.solve(matrix, np.concatenate([c, np.zeros(rows)]))
    return Step(there, y[:size], x, x[size:] / h, 2.0 * y[size:] / h)


def differences(function: Callable[[Array], Array], x: Array) -> Array:
    columns: list[Any] = []
    for k in range(len(x)):
        d = np.zeros(len(x))
        d[k] = 1e-6 * max(1.0, abs(x[k]))
        columns.append((function(x + d) - function(x - d)) / (2.0 * d[k]))
    return np.array(columns).T
