"""The elastic full car: matrices from first principles, rigid limit, runs against harmonic responses, covariances two
ways."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import simpson

import eomgen
from tests.oracles.elastic_full_car import TYRE, FullCar, full_car, height

FOLDER = Path(__file__).parents[2] / "examples" / "elastic_vehicle"
SUSPENSIONS = ("passive", "skyhook", "LQR")
COHERENCE, SPEED, DELAY = 0.7, 20.0, 3.1 / 20.0
REST = np.sqrt(1.0 - COHERENCE**2)
#: Road under each wheel by the inputs left_front, left_rear, other_front, other_rear.
TRACKS = np.array(
    [[1.0, 0.0, 0.0, 0.0], [COHERENCE, 0.0, REST, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, COHERENCE, 0.0, REST]]
)


@pytest.fixture(scope="module")
def model() -> eomgen.Model:
    return eomgen.build(FOLDER / "full_car.toml", profile="fast")  # for runs of minutes


@pytest.fixture(scope="module")
def script() -> dict[str, Any]:
    return runpy.run_path(str(FOLDER / "compare.py"))


def parameters_of(model: eomgen.Model, script: dict[str, Any], suspension: str) -> dict[str, float]:
    found: dict[str, float] = script["suspensions"](model, script["FULL_CAR"])[suspension]
    return found


def oracle(suspension: str) -> FullCar:
    car = full_car()
    if suspension == "skyhook":
        return car.with_skyhook(3000.0)
    return (
        car if suspension == "passive" else car.regulated(middle=1.0, corner=0.25, travel=1e3, load=1e-6, effort=1e-7)
    )


def responses(car: FullCar, omega: np.ndarray) -> dict[str, np.ndarray]:
    """Return the complex responses (frequencies, 4) of outputs to the four inputs."""
    s = 1j * omega[:, np.newaxis, np.newaxis]
    q = np.linalg.solve(s * s * car.mass + s * car.damping + car.stiffness, car.wheels @ TRACKS)
    rows = {
        "acceleration": s[:, 0] ** 2 * (height(0.0, 0.0) @ q),
        "driver_acceleration": s[:, 0] ** 2 * (height(0.0, 0.35) @ q),
        "bending": q[:, 3],
        "twist": q[:, 5],
    }
    for wheel in range(4):
        rows[f"corner_acceleration[{wheel}]"] = s[:, 0] ** 2 * (car.corners[wheel] @ q)
        rows[f"suspension_travel[{wheel}]"] = car.corners[wheel] @ q - q[:, 7 + wheel]
        rows[f"tyre_load[{wheel}]"] = TYRE * (TRACKS[wheel] - q[:, 7 + wheel])
    return rows


@pytest.mark.long
@pytest.mark.parametrize("suspension", SUSPENSIONS)
def test_linear_model_is_the_one_of_first_principles(
    model: eomgen.Model, script: dict[str, Any], suspension: str
) -> None:
    linear = model.linearize(t=100.0, at="initial", parameters=parameters_of(model, script, suspension))
    # Riccati's equation of first order is less exact
    car, close = oracle(suspension), 1e-7 if suspension == "LQR" else 1e-11
    pairs = (
        (linear.M0, car.mass),
        (linear.C0, car.damping),
        (linear.K0, car.stiffness),
        (linear.E0, car.wheels @ TRACKS),
    )
    for ours, theirs in pairs:
        np.testing.assert_allclose(ours, theirs, atol=close * np.abs(theirs).max())
    if suspension == "passive":
        np.testing.assert_allclose(linear.undamped_frequencies / (2 * np.pi), car.frequencies(), rtol=1e-9)


@pytest.mark.long
def test_runs_are_sums_of_harmonic_responses(model: eomgen.Model, script: dict[str, Any]) -> None:
    """The compiled scene is not linear, but its turns of a degree hardly show."""
    run = model.simulate(16.0, 1e-3, record_every=1, method="rk4", parameters=parameters_of(model, script, "LQR"))
    late = run.t > 12.0
    waves = [np.array(signal.harmonics).T for signal in model.scene.inputs]
    wanted = responses(oracle("LQR"), waves[0][1])
    for name in ("acceleration", "driver_acceleration", "bending", "twist", "corner_acceleration[3]"):
        values = np.zeros(int(late.sum()))
        for track, (amplitude, frequency, phase) in enumerate(waves):
            assert np.array_equal(frequency, waves[0][1])
            values += np.real(
                np.exp(1j * (np.outer(run.t[late], frequency) + phase)) @ (amplitude * wanted[name][:, track])
            )
        found = run.outputs[name.split("[")[0]][late]
        found = found[:, 3] if "[" in name else found
        assert np.abs(found - values).max() < 5e-3 * np.abs(values).max(), name


@pytest.mark.long
def test_covariance_is_the_integral_of_the_spectrum(model: eomgen.Model, script: dict[str, Any]) -> None:
    """Of |H_front + H_rear e^(-i w delay)|^2 over all frequencies and both tracks, matrices and responses being the
    oracle's."""
    car = script["FULL_CAR"]
    omega = np.geomspace(1e-3, 1e5, 80001)
    answers = responses(oracle("LQR"), omega)
    late = np.exp(-1j * omega * DELAY)
    density = 4 * np.pi**2 * 0.01 * 256e-6 * SPEED  # of the road's velocity, one-sided, per Hz
    wanted = []
    for name in car.outputs:
        squares = sum(np.abs((answers[name][:, k] + answers[name][:, k + 1] * late) / omega) ** 2 for k in (0, 2))
        wanted.append(np.sqrt(simpson(squares * density / (2 * np.pi) * omega, x=np.log(omega))))
    found = script["expected"](model, car, parameters_of(model, script, "LQR"))
    np.testing.assert_allclose(found, car.factors * wanted, rtol=1e-4)
