"""The ball on a shaking plate against parabolas from impact to impact, with their roots by Brent's method."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

import eomgen

SCENE = Path(eomgen.__file__).parents[1] / "examples" / "bouncing_ball" / "scene.toml"
G, E, SHAKE, FREQUENCY, TRAY, SPEED = 9.81, 0.8, 0.01, 12.0, 1.2, 0.5


def impacts() -> tuple[list[float], list[float], float]:
    """Return the times of the impacts, the velocities behind them, and the time at which the tray catches the ball."""
    t, z, v = 0.0, 0.6, 0.0
    times, speeds = [], []
    while True:

        def height(s: float, z: float = z, v: float = v) -> float:
            return z + v * s - 0.5 * G * s * s

        def gap(s: float, t: float = t) -> float:
            return height(s) - SHAKE * np.sin(FREQUENCY * (t + s))

        fall = (v + np.sqrt(v * v + 2.0 * G * z)) / G
        ahead = np.linspace(1e-6, fall + 0.1, 20_000)
        first = int(np.argmax([gap(s) < 0.0 for s in ahead]))
        s = brentq(gap, ahead[first - 1], ahead[first], xtol=1e-15)
        if SPEED * (t + s) >= TRAY:
            return times, speeds, t + fall
        t, z, before = t + s, height(s), v - G * s
        plate = SHAKE * FREQUENCY * np.cos(FREQUENCY * t)
        v = plate - E * (before - plate)
        times.append(t)
        speeds.append(v)


@pytest.mark.slow
@pytest.mark.parametrize(("method", "tolerance"), [("taylor", 1e-12), ("generalized_alpha", 1e-12), ("rk45", 1e-12)])
def test_impacts_are_at_the_roots_of_parabolas(method: str, tolerance: float) -> None:
    times, speeds, caught = impacts()
    events = eomgen.build(SCENE).simulate(2.6, method=method).events
    assert events is not None and len(times) == 8
    np.testing.assert_allclose(events["bounce"].t, times, atol=tolerance)
    np.testing.assert_allclose(events["bounce"].v[:, 1], speeds, atol=10.0 * tolerance)
    np.testing.assert_allclose(events["catch"].t, [caught], atol=tolerance)
    assert events.counts == {"bounce": 8, "top": 8, "catch": 1, "edge": 1}
