"""The unbalanced shaft against modes of linear Hermite elements, driven by the same unbalance."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import eigh

import eomgen
from tests.oracles.evaluation import Array

SCENE = Path(__file__).parents[2] / "examples" / "unbalanced_shaft" / "scene.toml"
ELEMENTS, LENGTH, EI, GA, MASS_PER_LENGTH = 16, 6.0, 354.5e3, 60.5e6, 11.64
DISC, ABOUT_DIAMETER, ECCENTRICITY = 70.573, 1.0163, 0.05
TIMES = np.linspace(0.0, 2.5, 5001)


def modes() -> tuple[Array, Array]:
    """Return the first three frequencies that deflect the middle, rad/s, and what they deflect it by."""
    size, length = 2 * ELEMENTS + 2, LENGTH / ELEMENTS
    shear = 12.0 * EI / (GA * length**2)
    a, b = (4.0 + shear) * length**2, (2.0 - shear) * length**2
    stiffness = np.array(
        [
            [12.0, 6.0 * length, -12.0, 6.0 * length],
            [6.0 * length, a, -6.0 * length, b],
            [-12.0, -6.0 * length, 12.0, -6.0 * length],
            [6.0 * length, b, -6.0 * length, a],
        ]
    )
    mass = np.array(
        [
            [156.0, 22.0 * length, 54.0, -13.0 * length],
            [22.0 * length, 4.0 * length**2, 13.0 * length, -3.0 * length**2],
            [54.0, 13.0 * length, 156.0, -22.0 * length],
            [-13.0 * length, -3.0 * length**2, -22.0 * length, 4.0 * length**2],
        ]
    )
    K, M = np.zeros((size, size)), np.zeros((size, size))
    for first in range(0, size - 2, 2):
        K[first : first + 4, first : first + 4] += EI / (length**3 * (1.0 + shear)) * stiffness
        M[first : first + 4, first : first + 4] += MASS_PER_LENGTH * length / 420.0 * mass
    M[ELEMENTS, ELEMENTS] += DISC
    M[ELEMENTS + 1, ELEMENTS + 1] += ABOUT_DIAMETER
    squares, shapes = eigh(K[2:-2, 2:-2], M[2:-2, 2:-2])
    middle = shapes[ELEMENTS - 2]
    felt = np.flatnonzero(np.abs(middle) > 1e-6 * np.abs(middle).max())[:3]
    return np.sqrt(squares[felt]), middle[felt]


def motion(t: float) -> tuple[float, float, float]:
    """Return angle, speed and acceleration of the motor."""
    if t < 0.5:
        w = 2.0 * np.pi
        return 24.0 * (t - np.sin(w * t) / w), 24.0 * (1.0 - np.cos(w * t)), 24.0 * w * np.sin(w * t)
    if t < 1.0:
        return 48.0 * (t - 0.25), 48.0, 0.0
    if t < 1.25:
        w, s = 4.0 * np.pi, t - 1.0
        angle = 36.0 + 60.0 * s - 12.0 / w * np.sin(w * s)
        return angle, 60.0 - 12.0 * np.cos(w * s), 12.0 * w * np.sin(w * s)
    return 51.0 + 72.0 * (t - 1.25), 72.0, 0.0


def linear_deflection() -> Array:
    """Return how far the middle is off over ``TIMES``, m; deflections y + i z are in the plane that stands still."""
    omega, middle = modes()

    def slopes(t: float, state: Array) -> Array:
        position, velocity = (half[:3] + 1j * half[3:] for half in (state[:6], state[6:]))
        angle, speed, acceleration = motion(t)
        force = DISC * ECCENTRICITY * (speed**2 - 1j * acceleration) * np.exp(1j * angle)
        change = middle * force - omega**2 * position
        return np.concatenate([velocity.real, velocity.imag, change.real, change.imag])

    run = solve_ivp(slopes, (0.0, 2.5), np.zeros(12), t_eval=TIMES, rtol=1e-9, atol=1e-12)
    return np.abs(middle @ (run.y[:3] + 1j * run.y[3:6]))


@pytest.mark.long
def test_it_passes_its_critical_speed_as_linear_modes_do() -> None:
    model = eomgen.build(SCENE)
    run = model.simulate()
    found, expected = np.hypot(*run.outputs["middle"][:, 1:].T), linear_deflection()
    assert modes()[0][0] == pytest.approx(56.86, abs=0.01)
    until = TIMES <= 1.4
    assert np.abs(found - expected)[until].max() < 0.03 * expected.max()
    assert found[until].max() == pytest.approx(expected[until].max(), rel=0.01)
