"""Warnings of runs: turns, outputs, small coordinates, water, quanta, kept energies, motions that run away."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.simulation.judgement import stated_errors
from eomgen.simulation.judgement.stated_errors import noticed_error
from tests.models.library import scene
from tests.simulation.rails import built, on_rail

EXAMPLES = Path(__file__).parents[2] / "examples"


def rotor(eccentricity: float, inertia: float = 0.02) -> eomgen.Model:
    """Return a disc about a horizontal axle, with a point on its rim."""
    builder = eomgen.SceneBuilder("rotor", gravity=[0, 0, -9.81])
    builder.parameter("eccentricity", eccentricity, tunable=True)
    builder.body("disc", 2.0, center_of_mass=["eccentricity", 0, 0], inertia=[0.01, inertia, inertia])
    builder.joint("axle", "revolute", "base", "disc", axis=[0, 1, 0], initial={"velocity": 60.0})
    builder.point("rim", "disc", [0.5, 0, 0]).output("rim", position="rim", unit="m")
    builder.effort("motor", "axle", "2.0*sin(3*t)")
    return eomgen.build(builder.simulation(step=0.05, duration=20.0).build(), profile="quick")


@pytest.fixture(scope="module")
def disc() -> eomgen.Model:
    return rotor(0.0)


@pytest.mark.slow
def test_an_angle_in_sines_alone_is_measured_by_a_turn(disc: eomgen.Model) -> None:
    case = {"parameters": {"eccentricity": 0.01}, "initial": {"axle": {"velocity": 10.0}}}
    run = disc.simulate(20.0, 0.05, **case)
    exact = disc.simulate(20.0, 0.05, method="taylor", tolerance=1e-12, **case)
    off = np.abs(run.q - exact.q).max()
    assert 0.07 * 2.0 * np.pi < off < 0.01 * np.ptp(run.q)
    assert run.error.largest is not None and run.error.largest.measure == "a turn"
    assert run.error.relative == pytest.approx(off / (2.0 * np.pi), rel=1.0)
    [finding] = [one for one in run.findings if one.name == "discretisation_error"]
    assert f"the estimated error is {run.error.largest}" in finding.text and finding.text in run.message


@pytest.mark.slow
def test_an_angle_that_changes_no_force_is_measured_by_its_travel(disc: eomgen.Model) -> None:
    run = disc.simulate(20.0, 0.05)
    assert run.error.largest is not None and run.error.largest.measure == "its motion"


@pytest.mark.slow
def test_an_output_that_is_wrong_is_warned_of(disc: eomgen.Model) -> None:
    """The point goes round at the angle of a symmetric disc, whose own error is a small part of its travel."""
    run = disc.simulate(20.0, 0.1)
    exact = disc.simulate(20.0, 0.1, method="taylor", tolerance=1e-12)
    wrong = np.abs(run.outputs["rim"] - exact.outputs["rim"]).max() / np.ptp(exact.outputs["rim"][:, 0])
    assert run.error.relative < 0.01 < stated_errors.DOUBTFUL_ERROR < wrong
    assert run.error.largest_output is not None
    assert f"; the estimated error is {run.error.largest_output}; try: a step much smaller than 0.1 s" in run.message
    assert noticed_error(run.error) is run.error.largest_output


@pytest.mark.slow_except("absolute")
@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_a_body_in_water_makes_no_claim_of_momentum(coordinates: str) -> None:
    builder = eomgen.SceneBuilder("buoy", gravity=[0, 0, 0], coordinates=coordinates)
    builder.body("buoy", 1000.0, center_of_mass=[0, 0, 0], inertia=[500, 500, 200])
    start = {"position": [0, 0, -30], "velocity": [0.3, 0.2, 0.1, 1.0, 0.5, 0.0]}
    builder.joint("root", "free", "base", "buoy", initial=start)
    hull = {"start": [0, 0, -2], "end": [0, 0, 2], "diameter": 1.0, "drag": 0, "axial_drag": 0, "added_mass": 1.0}
    builder.hull("hull", "buoy", **hull)
    model = eomgen.build(builder.simulation(step=0.01, duration=10.0).build(), profile="quick")
    run = model.simulate(10.0, 0.01, error_estimate=False)
    assert run.message == "reached t = 10 s in 1000 steps" and run.findings == ()


@pytest.mark.slow_cases("1e-06-0.05-True", "0.01-0.001-False")
@pytest.mark.parametrize(
    ("travel", "step", "named"), [(1e-6, 0.014, True), (1e-3, 0.002, False), (1e-6, 0.05, True), (1e-2, 0.001, False)]
)
def test_a_small_coordinate_is_named_if_its_error_hides_it(travel: float, step: float, named: bool) -> None:
    """Of its own motion, beside a vehicle that travels 100 m."""
    builder = on_rail("", velocity=50.0).body("device", 1.0)
    device = {"stiffness": 400.0, "initial": {"position": travel}}
    run = built(builder.joint("y", "prismatic", "base", "device", axis=[0, 1, 0], **device)).simulate(2.0, step)
    off = np.abs(run.q[:, 1] - travel * np.cos(20.0 * run.t)).max() / (2.0 * travel)
    assert (off > 0.1) == named
    assert ("q.y is not resolved: its motion of " in run.message) == named
    assert ("unresolved_coordinate" in [finding.name for finding in run.findings]) == named


SERVO = {
    "states": {
        "measured": {"sample": "1 ms", "formula": "q.hinge", "quantum": "2*pi/4096"},
        "before": {"sample": "1 ms", "formula": "measured"},
        "asked": {"sample": "1 ms", "formula": "60*(0.5*sin(2*t) - measured) - 5*(measured - before)/1e-3"},
        "torque": {"rate": "(asked - torque)/0.002"},
    },
    "efforts": {"motor": {"joint": "hinge", "effort": "torque"}},
    "bodies__rod": {"mass": 2.0, "center_of_mass": [0, 0, -0.2], "inertia": [0.03, 0.03, 0.01]},
    "joints__hinge__initial": {"position": 0.3},
    "outputs": None,
}


@pytest.mark.slow
def test_the_error_of_a_quantum_is_not_cured_by_a_smaller_step(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stated_errors, "DOUBTFUL_ERROR", 1e-4)
    model = eomgen.build(scene("pendulum", **SERVO), profile="quick")
    run = model.simulate(4.0, 5e-4)
    finer = model.simulate(4.0, 2.5e-4)
    quantum = 2.0 * np.pi / 4096.0
    assert quantum < run.error.z[0] < 5.0 * quantum and quantum < finer.error.z[0] < 5.0 * quantum
    [finding] = [one for one in run.findings if one.name == "discretisation_error"]
    assert finding.hint.startswith("none, if the hardware has the quantum of measured: compared runs differ by quanta")
    smooth = eomgen.build(scene("pendulum", **SERVO, states__measured__quantum=None), profile="quick")
    assert not any("quantum" in one.hint for one in smooth.simulate(4.0, 5e-4).findings)


def test_a_kept_energy_has_no_error_of_its_range() -> None:
    model = eomgen.build(EXAMPLES / "four_bar" / "scene.toml")
    run = model.simulate(0.2)
    assert "energy" in run.outputs and np.ptp(run.outputs["energy"]) < 1e-3 * run.energy["kinetic"].max()
    largest = run.error.largest_output
    assert largest is not None and largest.share < 0.07 and "output energy" not in run.message


def arm(gain: float, rate: float) -> eomgen.Model:
    builder = eomgen.SceneBuilder("controlled_arm", gravity=[0, 0, -9.81])
    builder.body("upper", 2.0, center_of_mass=[0, 0, -0.2], inertia=[0.03, 0.03, 0.01])
    builder.body("lower", 1.0, center_of_mass=[0, 0, -0.2], inertia=[0.01, 0.01, 0.005])
    builder.joint("shoulder", "revolute", "base", "upper", axis=[0, 1, 0], initial={"position": 0.1})
    builder.joint("elbow", "revolute", "upper", "lower", position=[0, 0, -0.4], axis=[0, 1, 0])
    for joint in ("shoulder", "elbow"):
        builder.effort(f"{joint}_motor", joint, f"{gain}*(0.5-q.{joint})-{rate}*v.{joint}")
    return eomgen.build(builder.simulation(step=1e-3, duration=5.0).build(), profile="quick")


@pytest.mark.slow
@pytest.mark.parametrize("method", ["generalized_alpha", "rk4"])
def test_a_gain_of_the_wrong_sign_is_not_taken_for_a_fast_start(method: str) -> None:
    run = arm(-200.0, 20.0).simulate(10.0, 1e-2, method=method)
    assert not run.success
    assert "try: other signs or sizes of gains, damping and stiffnesses" in run.message
    assert "smaller initial angles" not in run.message and run.findings[0].name == "stopped"
