"""The estimated error of a run is near the true one, by closed forms and SciPy's DOP853, and large ones are warned
of."""

from __future__ import annotations

import json
import math
import os
import re
import signal
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import eomgen
from eomgen.base.arrays import Array
from tests.models.scenes import absolute, flyer, pendulum
from tests.simulation.rails import built, on_rail

#: An estimate is good within this factor of the true error.
GOOD = 3.0


@cache
def sled(stiffness: float = 40.0) -> eomgen.Model:
    """Return a mass of 1 kg on a spring, 0.1 m from rest."""
    builder = on_rail("", "rail", stiffness=stiffness, position=[0.1])
    return built(builder.output("pull", formula="-40 * q.rail", unit="N"))


def by_dop853(model: eomgen.Model, run: eomgen.Solution) -> Array:
    """Return [q, v] at the times of a run."""
    start = np.concatenate([run.q[0], run.v[0]])
    solved = solve_ivp(model.rhs, (run.t[0], run.t[-1]), start, "DOP853", run.t, rtol=1e-13, atol=1e-14)
    return np.asarray(solved.y.T)


def good(estimate: Array, true: Array) -> bool:
    """Tell whether estimates are within the factor of true errors."""
    return bool(np.all((true / GOOD <= estimate) & (estimate <= GOOD * true)))


@pytest.mark.parametrize(("method", "step", "order"), [("generalized_alpha", 0.01, 2.0), ("rk4", 0.02, 4.0)])
def test_fixed_steps_on_an_oscillator_of_closed_form(method: str, step: float, order: float) -> None:
    run = sled().simulate(5.0, step, method=method)
    frequency = np.sqrt(40.0)
    position, velocity = 0.1 * np.cos(frequency * run.t), -0.1 * frequency * np.sin(frequency * run.t)
    error = run.error
    assert error.available and error.order == pytest.approx(order, abs=0.15) and error.declared_order == order
    assert good(error.q, np.abs(run.q[:, 0] - position).max())
    assert good(error.v, np.abs(run.v[:, 0] - velocity).max())
    assert good(error.outputs["pull"], 40.0 * np.abs(run.q[:, 0] - position).max())
    assert error.outputs_at["pull"].shape == error.t.shape and error.q_at.shape == (len(error.t), 1)
    at = np.interp(error.t, run.t, np.abs(run.q[:, 0] - position))
    assert good(error.q_at[at > 0.3 * at.max(), 0], at[at > 0.3 * at.max()])
    assert error.relative == pytest.approx(error.q[0] / np.ptp(run.q))
    assert run.message == f"reached t = 5 s in {round(5.0 / step)} steps"


@pytest.mark.parametrize("tolerance", [1e-4, 1e-7, 1e-10])
def test_chosen_steps_on_an_oscillator_of_closed_form(tolerance: float) -> None:
    run = sled().simulate(5.0, 0.05, method="taylor", tolerance=tolerance)
    position = 0.1 * np.cos(np.sqrt(40.0) * run.t)
    assert good(run.error.q, np.abs(run.q[:, 0] - position).max())
    assert np.isnan(run.error.declared_order) and f"a tolerance of {0.1 * tolerance:.2g}" in run.error.method


@pytest.mark.parametrize("method", ["generalized_alpha", "rk4"])
def test_rotations_and_positions_against_dop853(method: str) -> None:
    run = flyer().simulate(2.0, 0.01, method=method)
    known = by_dop853(flyer(), run)
    q, v = known[:, : flyer().nq], known[:, flyer().nq :]
    assert good(run.error.q, np.abs(run.q - q).max(axis=0))
    assert good(run.error.v, np.abs(run.v - v).max(axis=0))
    assert run.error.increment.shape == (10,) and run.error.largest is not None


@pytest.mark.slow
@pytest.mark.parametrize(("method", "step"), [("generalized_alpha", 4e-3), ("rk4_partitioned", 0.01)])
def test_constraints_against_dop853_in_joint_coordinates(method: str, step: float) -> None:
    run = absolute().simulate(1.0, step, method=method)
    known = by_dop853(flyer(), flyer().simulate(1.0, step, method="rk4", error_estimate=False))
    turned = np.abs(run.q[:, :4] - known[:, :4]).max(axis=0)  # the position of the hull is that of its centre of mass
    assert good(run.error.q[:4], turned)
    assert run.error.multipliers.shape == (len(absolute().multipliers),)


def test_a_coarse_run_is_warned_of_and_a_good_one_is_not() -> None:
    coarse = sled().simulate(20.0, 0.025)
    assert coarse.success and coarse.error.largest is not None
    smaller = coarse.error.refinement(0.01) * 0.025
    assert coarse.message == (
        f"reached t = 20 s in 800 steps; the estimated error is {coarse.error.largest}, above 10 % from"
        f" t = {coarse.error.above(0.1):.6g} s on; try: a step smaller than {smaller:.2g} s"
    )
    assert re.search(r"is 0\.0\d+ m of q\.rail at t = \d+\.\d+ s, [12]\d % of its motion, above", coarse.message)
    advised = sled().simulate(20.0, float(coarse.message.split()[-2]))
    assert 0.005 < advised.error.relative < 0.015
    assert sled().simulate(20.0, 0.01).message == "reached t = 20 s in 2000 steps"


@pytest.mark.slow
def test_a_motion_that_is_chaotic_is_never_plain_success() -> None:
    """A double pendulum that turns over: its error grows tenfold about every second and a half."""
    builder = eomgen.SceneBuilder("chaotic")
    for name, parent, place in (("upper", "base", 0.0), ("lower", "upper", -1.0)):
        builder.body(name, 1.0, center_of_mass=[0, 0, -1], inertia=[0, 0, 0])
        at = {"axis": [0, 1, 0], "position": [0, 0, place], "initial": {"position": 2.5}}
        builder.joint(f"of_{name}", "revolute", parent, name, **at)
    run = built(builder).simulate(40.0, 0.01)
    end = run.error.above(0.1)
    assert run.success and run.error.relative > 1.0 and 1.0 < end < 20.0
    assert f" % of a turn, above 10 % from t = {end:.6g} s on" in run.message
    assert run.message.endswith(f"; try: a step much smaller than 0.01 s, or a run to t = {end:.6g} s")
    assert run.error.largest is not None and f"the estimated error is {run.error.largest}" in run.message


def test_a_machine_at_rest_has_no_error() -> None:
    run = sled().simulate(1.0, 0.01, initial={"rail": 0.0})
    assert run.error.relative == 0.0 and run.message == "reached t = 1 s in 100 steps"
    hanging = pendulum().simulate(1.0, 0.01, initial={"hinge": 0.0}, inputs={"torque": 0.0}, parameters={"shake": 0.0})
    assert hanging.error.relative < 1e-3 and hanging.message == "reached t = 1 s in 100 steps"


def test_why_there_is_no_estimate() -> None:
    run = sled().simulate(1.0, 0.01, error_estimate=False)
    assert not run.error.available and str(run.error) == "not known: it was switched off"
    assert run.error.q.shape == (1,) and np.isnan(run.error.relative)
    assert str(sled().simulate(0.0, 0.01).error) == "not known: the run made no step"

    def interrupt(done: int, total: int) -> None:
        os.kill(os.getpid(), signal.SIGINT)

    run = pendulum().simulate(1e5, 1e-3, record_every=100, progress=interrupt)
    assert str(run.error) == "not known: the run was interrupted"


def test_ctrl_c_during_the_estimate_leaves_the_run_as_it_is() -> None:
    def interrupt(done: int, total: int) -> None:
        if done > 200_000:  # and not so few that one call of C makes all runs of the estimate to their ends
            os.kill(os.getpid(), signal.SIGINT)

    run = pendulum().simulate(20.0, 1e-4, record_every=100, progress=interrupt)
    assert run.success and not run.interrupted
    assert str(run.error) == "not known: the runs that it is made from were interrupted"


def test_a_function_of_the_caller_that_fails_when_it_is_asked_again_leaves_the_run_as_it_is() -> None:
    asked: list[float] = []

    def torque(t: float) -> float:
        asked.append(t)
        return 0.1 / float(len(asked) < 3000)

    run = pendulum().simulate(2.0, 1e-3, inputs={"torque": torque}, record_every=100)
    assert run.success and not run.error.available
    assert "input torque: the function failed at t = " in run.error.reason


def test_a_run_that_goes_on_is_estimated_from_its_checkpoint_on(tmp_path: Path) -> None:
    file = tmp_path / "run.ckpt"
    first = pendulum().simulate(0.5, 1e-3, record_every=7, checkpoint=file)
    second = pendulum().resume(file, 1.0)
    assert second.error.available and second.error.t[0] > first.t[-1] and second.error.t[-1] == second.t[-1]
    begins = f"from t = {second.t[1]:.6g} s on, where the state is taken for exact"
    assert second.error.method == f"runs at 2 and 4 times the step {begins}"
    assert begins in str(second.error)
    assert "taken for exact" not in str(first.error)
    assert not first.followed_by(second).error.available
    assert not pendulum().resume(file, 1.0, error_estimate=False).error.available


@pytest.mark.slow
def test_the_measure_of_a_small_motion_is_named_and_outputs_have_their_own() -> None:
    """A joint that hardly moves beside one that does, and an output of the small one's force."""
    builder = on_rail("", "large", stiffness=1e-3, position=1.0, velocity=0.1).body("c", 1.0)
    builder.joint("small", "prismatic", "base", "c", axis=[1, 0, 0], stiffness=1e6, initial={"position": 1e-7})
    run = built(builder.output("pull", formula="1e6 * q.small", unit="N")).simulate(1.0, 1e-4)
    error = run.error
    assert error.largest is not None and error.largest_output is not None
    assert error.largest.name == "q.small" and error.largest.measure == "9.9e-05 m, the least that counts as its motion"
    assert str(error.largest).endswith(" % of 9.9e-05 m, the least that counts as its motion")
    assert error.largest_output.name == "output pull" and error.largest_output.measure == "its range"
    assert error.largest_output.share == pytest.approx(error.outputs["pull"] / np.ptp(run.outputs["pull"]), rel=1e-3)
    assert error.largest_output.share > 100.0 * error.relative
    ordinary = sled().simulate(5.0, 0.01).error
    assert ordinary.largest is not None and ordinary.largest.measure == "its motion"


@pytest.mark.slow
def test_an_output_that_is_rounding_beside_the_forces_is_no_error() -> None:
    """A disc on an axis through its centre that a drive turns: the axis carries its weight, and no moment across it."""
    builder = eomgen.SceneBuilder("turned_disc", gravity=[0, 0, 0]).body("disc", 10, inertia=[0.1, 0.1, 0.2])
    builder.body("arm", 1, center_of_mass=[0.2, 0, 0], inertia=[0.01, 0.01, 0.01])
    builder.joint("axis", "revolute", "base", "disc", axis=[0, 0, 1], drive="3 * sin(2 * t)")
    at = {"axis": [0, 0, 1], "position": [0.3, 0, 0], "damping": 0.2, "initial": {"position": 0.7}}
    builder.joint("arm", "revolute", "disc", "arm", **at).output("force", reaction_force="arm")
    run = built(builder.output("nothing", formula="1e-15 * sin(4000 * q.arm)", unit="N m")).simulate(1.0, 0.002)
    assert np.abs(run["force"]).max() > 1.0 and 0.0 < np.abs(run["nothing"]).max() <= 1e-15
    assert run.error.largest_output is not None and run.error.largest_output.name.startswith("output force")
    assert run.message == "reached t = 1 s in 500 steps"


@pytest.mark.slow
def test_vibrations_of_a_beam_are_told_beside_a_machine_that_moves_fast() -> None:
    """A rod that vibrates along itself, x' = v0 cos(w t) with w = pi/(2 l) sqrt(E A/m'), and a car on a rail."""
    rate, frequency = 5e-3, 0.5 * np.pi * np.sqrt(400.0)
    builder = on_rail("", "rail", velocity=2.0)
    stretch = {"modes": 1, "stiffness": 400.0, "initial": {"velocity": rate}}
    builder.beam("rod", length=1.0, mass_per_length=1.0, stretch=stretch)
    model = built(builder.joint("clamp", "fixed", "base", "rod"))
    for step, doubted in ((1e-3, False), (1e-2, True)):
        run = model.simulate(5.0, step)
        wrong = float(np.abs(run.v[:, 1] - rate * np.cos(frequency * run.t)).max())
        largest = run.error.largest_velocity
        assert largest is not None and largest.name == "v.rod" and largest.measure == "its largest"
        assert good(np.array([largest.error]), np.array([wrong]))
        assert largest.share == pytest.approx(largest.error / rate, rel=1e-2)
        assert (wrong > 0.3 * rate) is doubted is (f"; the estimated error is {largest}" in run.message)
        assert largest.error < 0.01 * run.v[0, 0], "no doubt of the car's velocity"


@pytest.mark.slow
@pytest.mark.parametrize("law", ["position", "state"])
def test_a_motion_that_only_the_comparison_run_sees_is_an_error_without_bound(law: str) -> None:
    """The input acts between the rows, so the run rests; its true way is the impulse by the rest of the time."""
    builder = on_rail("u" if law == "position" else "").input("u")
    model = built(builder if law == "position" else builder.state("w", rate="u"))
    run = model.simulate(2.0, 0.1, method="rk45", inputs={"u": lambda t: 5000.0 if 0.512 < t < 0.522 else 0.0})
    assert not run.q.any() and not run.z.any()
    error = float((run.error.q if law == "position" else run.error.z)[0])
    assert error > 10.0 and run.error.relative == math.inf
    (finding,) = run.findings
    name = "q.x" if law == "position" else "z.w"
    assert finding.name == "discretisation_error" and finding.value == math.inf
    assert f"the estimated error is {error:.2g}" in run.message
    assert f" of {name} at t = " in run.message and " s, which does not move in this run" in run.message
    assert json.dumps(run.error.summary())
