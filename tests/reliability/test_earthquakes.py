"""Records of eight seconds under Kanai and Tajimi's ground: an oscillator's variance against Lyapunov's equation."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import expm, solve_continuous_lyapunov

import eomgen
from eomgen import random_vibration
from eomgen.base.arrays import Array
from tests.reliability.test_truncation import model_of

#: Natural frequency of the structure, rad/s, and its damping ratio; of the ground.
STRUCTURE, GROUND = (7.0, 0.05), (15.0, 0.6)
RECORD = 8.0
#: Times within the build-up, and at the end, s.
TIMES = (2.0, RECORD)


def deviations(times: tuple[float, ...]) -> list[float]:
    """Return the standard deviations of the structure's deflection, m, which starts at rest on ground that shakes.

    The ground is a filter of white noise, with a stationary acceleration of deviation 1 m/s^2; the covariance P of
    filter and structure solves dP/dt = A P + P A^T + D.
    """
    (w, damping), (ground, of_ground) = STRUCTURE, GROUND
    filtered = np.array([[0.0, 1.0], [-(ground**2), -2.0 * of_ground * ground]])
    acceleration = np.array([ground**2, 2.0 * of_ground * ground])
    noise = np.diag([0.0, 1.0])
    still = solve_continuous_lyapunov(filtered, -noise)
    scale = 1.0 / float(acceleration @ still @ acceleration)
    A, D, start = np.zeros((4, 4)), np.zeros((4, 4)), np.zeros((4, 4))
    A[:2, :2], A[2, 3], A[3] = filtered, 1.0, [*acceleration, -(w**2), -2.0 * damping * w]
    D[:2, :2], start[:2, :2] = scale * noise, scale * still
    end = solve_continuous_lyapunov(A, -D)

    def at(time: float) -> Array:
        moved = expm(time * A)
        return np.asarray(end - moved @ (end - start) @ moved.T)

    return [math.sqrt(at(time)[2, 2]) for time in times]


@pytest.fixture(scope="module")
def shaken() -> eomgen.Model:
    w, damping = STRUCTURE
    process = {"type": "kanai_tajimi", "frequency": GROUND[0], "damping": GROUND[1], "share": 0.8, "duration": RECORD}
    return model_of(process, f"force - {w * w} * q.slide - {2.0 * damping * w} * v.slide")


@pytest.mark.long
@pytest.mark.parametrize("time", TIMES)
def test_deviations_under_a_record_are_those_of_lyapunovs_equation(shaken: eomgen.Model, time: float) -> None:
    """Modes left out are told, and are less than 1e-3 here; steps have an error of (w step)^2 / 12, 4e-4."""
    assert len(shaken.parameters) > 60
    (expected,) = deviations((time,))
    found = random_vibration(shaken, "x", time, 0.01, points=False, thresholds=[0.02], method="trapezoidal")
    kept = found.moments["second_order"][1]
    assert found.moments["first_order"][1] == kept
    assert found.lost_variance < 0.005
    assert kept / math.sqrt(1.0 - found.lost_variance) == pytest.approx(expected, rel=2e-3)
