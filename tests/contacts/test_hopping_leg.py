"""The hopping leg against two masses on a spring by hand in SciPy, and its hops against the wanted height."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import eomgen

SCENE = Path(__file__).parents[2] / "examples" / "hopping_leg" / "system" / "hopper.toml"


def vertical_hop(t: float, state: list[float]) -> list[float]:
    """Return the rates of the heights of body and foot, and of their velocities, as the leg hops on the spot."""
    body, foot, body_rate, foot_rate = state
    shortened, rate = foot - (body - 0.58), foot_rate - body_rate
    sunk = max(0.02 - foot, 0.0)
    load = 2e6 * sunk**1.5 * max(1.0 - 0.45 * foot_rate, 0.0)
    stance = load / (load + 5.0)
    lack = 88.29 * (0.75 - body) - 4.5 * body_rate**2 - 1500.0 * shortened**2
    push = (6.0 * lack * stance - 20.0 * (1.0 - stance)) * rate - 3000.0 * shortened
    return [body_rate, foot_rate, -9.81 - push / 8.8, -9.81 + (push + load) / 0.2]


@pytest.mark.slow
def test_hops_on_the_spot_are_those_of_two_masses_by_hand() -> None:
    run = eomgen.build(SCENE, profile="quick").simulate(
        0.7, 5e-5, parameters={"speed": 0.0, "rise": 0.0}, record_every=100
    )
    exact = solve_ivp(vertical_hop, (0.0, run.t[-1]), [0.75, 0.17, 0.0, 0.0], "LSODA", run.t, rtol=1e-9, atol=1e-11)
    assert np.abs(run.outputs["hip"][:, 1] - exact.y[0]).max() < 1e-5
    assert exact.y[0].min() < 0.5 and np.abs(run.outputs["hip"][:, 0]).max() < 1e-9


@pytest.mark.long
def test_the_leg_hops_at_a_stable_height_and_speed() -> None:
    model = eomgen.build(SCENE, profile="quick")
    run = model.simulate(12.0)
    assert run.events is not None
    tops = run.events["apex"]
    before = tops.q[(tops.t > 1.0) & (tops.t < 4.0), 1]
    assert np.all((before > 0.72) & (before < 0.75))
    assert np.ptp(tops.q[-3:, 1]) < 1e-3 and 0.87 < tops.q[-1, 1] < 0.90  # of 0.9 m wanted
    assert np.abs(tops.v[-3:, 0] - 1.0).max() < 0.05
    higher = model.simulate(12.0, initial={"z": {"position": 0.9}})
    assert higher.events is not None
    assert higher.events["apex"].q[-1, 1] == pytest.approx(tops.q[-1, 1], abs=1e-3)
