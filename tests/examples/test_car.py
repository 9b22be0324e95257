"""The car by hard points stands at its design position and on a slope, and turns to the left with its wheel."""

from __future__ import annotations

import math
import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen

SYSTEM = Path(__file__).parents[2] / "examples/car/system"
CORNERS = ("front_left", "front_right", "rear_left", "rear_right")


@pytest.mark.slow
def test_the_car_has_15_degrees_of_freedom() -> None:
    system = eomgen.derive(SYSTEM / "car.toml")
    assert (system.nq, system.nv, len(system.multipliers)) == (36, 31, 16)


@cache
def _car() -> eomgen.Model:
    return eomgen.build(SYSTEM / "car.toml", profile="reproducible")


@cache
def _rest() -> Any:
    return _car().equilibrium()


def _still() -> dict[str, Any]:
    return {"q": _rest().q, "v": np.zeros(_car().nv), "z": np.zeros(_car().nz)}


@pytest.mark.long
def test_the_car_stands_at_the_design_position() -> None:
    car, rest = _car(), _rest()
    place = dict(zip(car.q_names, rest.q, strict=True))
    assert car.nz == 12
    for corner in CORNERS:
        assert abs(place[f"q.{corner}_lower"]) < 1e-3
    assert abs(place["q.chassis[6]"]) < 2e-3
    loads = car.outputs(rest.q, np.zeros(car.nv), np.zeros(car.nv), z=rest.z)["loads"]
    assert loads.sum() == pytest.approx(9.81 * 1474.0)
    assert loads[0] == pytest.approx(loads[1])
    # tyres that stand are springs: frequencies as of the linear model with dampers, damped by a quarter at most
    slow = np.sort(rest.frequencies[rest.frequencies > 1.0])[:5]
    poles = np.linalg.eigvals(car.linearize(at=rest).state_space().A)
    assert slow == pytest.approx(np.sort(np.abs(poles[poles.imag > 1.0]))[:5], rel=0.03)


@pytest.mark.long
def test_a_heavier_car_at_rest_keeps_its_pads_within_their_grip() -> None:
    """It settles, and rolls: the pads of free wheels slide."""
    car = _car()
    rest = car.equilibrium(parameters={"mass": 1450.0})
    pads = [z for name, z in zip(car.z_names, rest.z, strict=True) if name.endswith("pads")]
    assert len(pads) == 4 and np.abs(pads).max() <= 1.0 + 1e-6


@pytest.mark.long
def test_the_braked_car_does_not_creep_on_a_slope_of_20_per_cent() -> None:
    brakes = {"front_brake": 2500.0, "rear_brake": 2500.0}
    slope = {"slope": math.atan(0.2)}
    run = _car().simulate(
        12.0, 1e-3, inputs=brakes, parameters=slope, initial=_still(), record_every=1000, error_estimate=False
    )
    assert run.success, run.message
    assert abs(run.q[-1, 4] - run.q[-3, 4]) / 2.0 < 1e-6  # m/s
    rolling = _car().simulate(1.0, 1e-3, parameters=slope, initial=_still(), record_every=1000, error_estimate=False)
    assert rolling.q[-1, 4] < rolling.q[0, 4] - 0.5


@pytest.mark.long
def test_the_car_turns_to_the_left_and_understeers() -> None:
    start = {"q": _rest().q}
    run = _car().simulate(3.0, 1e-3, inputs={"steering": 0.5}, initial=start, record_every=10, error_estimate=False)
    assert run.success, run.message
    rate, speed = run.v[-1, 2], np.hypot(*run.v[-1, 3:5])
    left, right = run.outputs["loads"][-1, [0, 1]]
    wheels = 0.5 * 0.008 * math.radians(0.4) * 1e3  # 0.4 deg of each wheel by mm of the rack
    assert run.q[-1, 5] > 5.0
    assert 0.1 < rate < 0.9 * wheels * speed / 2.7
    assert right > left + 500.0


@pytest.mark.long
def test_the_car_on_bushings_runs() -> None:
    data = tomllib.loads((SYSTEM / "car.toml").read_text(encoding="utf-8"))
    data["include"]["front"]["file"] = "front_axle_on_bushings.toml"
    for part in data["include"].values():
        part["file"] = str(SYSTEM / part["file"])
    car = eomgen.build(data)
    run = car.simulate(2.0, 1e-3, inputs={"steering": 0.5}, error_estimate=False)
    assert run.success, run.message
    assert 0.1 < run.v[-1, 2] < 0.2
