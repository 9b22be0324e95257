"""Examples of random excitation: their linear forms against frequency responses and Lyapunov's equation by SciPy."""

from __future__ import annotations

import runpy
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import eomgen
from tests.examples.demos import EXAMPLES


def _linear(example: str, output: str, *of_scene: float) -> eomgen.RandomVibration:
    scene = runpy.run_path(str(EXAMPLES / example / "demo.py"))["scene"](*of_scene)
    return eomgen.random_vibration(eomgen.build(scene), output, thresholds=[0.01], points=False)


@pytest.mark.long
def test_the_frame_has_the_spread_of_lyapunovs_equation() -> None:
    """dP/dt = A P + P A' + B B' of the frame with the soil's filter of white noise, which is stationary from the
    start."""
    mass, storey, damper, w, ratio, end = 2000.0, 2e5, 2000.0, 15.0, 0.6, 5.0
    drifts = np.tril(np.ones((3, 3)))  # of floors, by storeys
    stiffness, damping = (value * np.eye(3) for value in (storey, damper))
    inertia = mass * drifts.T @ drifts
    # soil: x'' + 2 z w x' + w^2 x = white noise, acceleration w^2 x + 2 z w x'
    variance = np.diag([1.0, w**2])  # of x and x', x of variance 1
    ground = np.array([w**2, 2.0 * ratio * w])
    noise = 4.0 * ratio * w**3
    scale = 1.0 / float(ground @ variance @ ground)

    def rates(t: float, flat: Any) -> Any:
        covariance = flat.reshape(8, 8)
        matrix = np.zeros((8, 8))
        matrix[:3, 3:6] = np.eye(3)
        matrix[3:6, :3], matrix[3:6, 3:6] = -np.linalg.solve(inertia, stiffness), -np.linalg.solve(inertia, damping)
        envelope = t / 2.0 * np.exp(1.0 - t / 2.0)
        matrix[3:6, 6:] = -np.outer(np.linalg.solve(inertia, mass * drifts.sum(axis=0)), ground) * envelope
        matrix[6, 7], matrix[7, 6:] = 1.0, (-(w**2), -2.0 * ratio * w)
        found = matrix @ covariance + covariance @ matrix.T
        found[7, 7] += noise * scale
        return found.ravel()

    start = np.zeros((8, 8))
    start[6:, 6:] = variance * scale
    run = solve_ivp(rates, (0.0, end), start.ravel(), rtol=1e-9, atol=1e-14)
    deviation = float(np.sqrt(run.y[0, -1]))
    found = _linear("frame_in_earthquake", "drift", 0.0).moments["second_order"]
    assert found[1] == pytest.approx(deviation, rel=5e-3)
