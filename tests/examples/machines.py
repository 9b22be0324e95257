"""Machines of one degree of freedom, solved by their energy alone: an independent road for the examples with loops.

A machine is a function of its angle that places all bodies; no equations of motion, no constraints, no multipliers:
rate^2 inertia(angle) / 2 + height(angle) = energy, and velocities are derivatives by a complex step.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.integrate import solve_ivp

TINY = 1e-30
GRAVITY = 9.81

#: Mass, inertia about the centre of mass in body axes (3,), place (3,) and axes (3, 3); the last two of complex
#: numbers.
Part = tuple[float, np.ndarray, np.ndarray, np.ndarray]
Machine = Callable[[complex], Sequence[Part]]


def turned(axis: int, angle: complex) -> np.ndarray:
    """Return the rotation about a coordinate axis, of complex numbers."""
    j, k = (axis + 1) % 3, (axis + 2) % 3
    R = np.eye(3, dtype=complex)
    R[j, j] = R[k, k] = np.cos(angle)
    R[k, j], R[j, k] = np.sin(angle), -np.sin(angle)
    return R


def reduced(machine: Machine, up: int, angle: float) -> tuple[float, float]:
    """Return the inertia that the angle's rate feels, kg m^2, and the potential energy, J; ``up`` is the axis against
    gravity."""
    inertia = potential = 0.0
    for mass, moments, place, axes in machine(complex(angle, TINY)):
        velocity, R = place.imag / TINY, axes.real
        omega = R.T @ (axes.imag / TINY)  # skew
        spin = np.array([omega[2, 1], omega[0, 2], omega[1, 0]])
        inertia += mass * velocity @ velocity + spin @ (moments * spin)
        potential += mass * GRAVITY * place[up].real
    return inertia, potential


def energy_of(machine: Machine, up: int, angle: float, rate: float) -> float:
    """Return kinetic and potential energy, J."""
    inertia, potential = reduced(machine, up, angle)
    return 0.5 * inertia * rate**2 + potential


def angles_at(machine: Machine, up: int, angle: float, rate: float, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return angles and rates at times from the first of them on, for a rate that never changes its sign."""
    energy = energy_of(machine, up, angle, rate)

    def pace(_: float, y: np.ndarray) -> list[float]:
        inertia, potential = reduced(machine, up, float(y[0]))
        return [np.copysign(np.sqrt(2.0 * (energy - potential) / inertia), rate)]

    solution = solve_ivp(pace, (times[0], times[-1]), [angle], method="DOP853", t_eval=times, rtol=1e-12, atol=1e-12)
    assert solution.success, solution.message
    return solution.y[0], np.array([pace(0.0, [value])[0] for value in solution.y[0]])
