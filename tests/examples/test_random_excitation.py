"""Examples of random excitation: their linear forms against frequency responses and Lyapunov's equation by SciPy."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import eomgen
from eomgen.base.random_inputs import FREQUENCY_RANGE, REFERENCE_FREQUENCY, ROUGHNESS
from tests.examples.demos import EXAMPLES, run_demo


def _linear(example: str, output: str, *of_scene: float) -> eomgen.RandomVibration:
    scene = runpy.run_path(str(EXAMPLES / example / "demo.py"))["scene"](*of_scene)
    return eomgen.random_vibration(eomgen.build(scene), output, thresholds=[0.01], points=False)


@pytest.mark.long
def test_the_quarter_car_has_the_spread_of_its_frequency_responses() -> None:
    """The deviation is the integral of the road's spectrum times the square of what a wave of one frequency makes of
    the travel at 2.5 s, from rest; the modes leave out 1 % of the variance of the road, in short waves."""
    mass, spring, damper, tyre, speed, end = np.array([36.0, 240.0]), 16000.0, 980.0, 160000.0, 15.0, 2.5
    waves = np.geomspace(*FREQUENCY_RANGE, 400)

    def rates(t: float, x: Any) -> Any:
        wheel, body, wheel_rate, body_rate = x.reshape(4, -1)
        force = spring * (body - wheel) + damper * (body_rate - wheel_rate)
        road = (1.0 - np.exp(-((t / 0.5) ** 2))) * np.exp(2j * np.pi * waves * speed * t)
        lower = (force + tyre * (road - wheel)) / mass[0]
        return np.concatenate([wheel_rate, body_rate, lower, -force / mass[1]])

    run = solve_ivp(rates, (0.0, end), np.zeros(4 * waves.size, dtype=complex), rtol=1e-7, atol=1e-9)
    wheel, body, *_ = run.y[:, -1].reshape(4, -1)
    density = ROUGHNESS["D"] * (REFERENCE_FREQUENCY / waves) ** 2
    deviation = float(np.sqrt(np.trapezoid(density * np.abs(body - wheel) ** 2, waves)))
    found = _linear("quarter_car_on_random_road", "travel", 0.0, 0.0).moments["second_order"]
    assert 0.99 * deviation < found[1] < deviation
    np.testing.assert_allclose([found[0], *found[2:]], 0.0, atol=1e-9)


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


@pytest.mark.long_cases("frame_in_earthquake-first passage of 60 mm", "quarter_car_on_random_road-with stops")
@pytest.mark.slow
@pytest.mark.parametrize(
    ("example", "says"),
    [("quarter_car_on_random_road", "with stops"), ("frame_in_earthquake", "first passage of 60 mm")],
)
def test_the_demo_draws_its_distribution(example: str, says: str, tmp_path: Path) -> None:
    assert says in run_demo(example, "--samples", "400", "--out", tmp_path)
    assert (tmp_path / f"{example}.png").stat().st_size > 20_000
