"""Rosenbrock steps on loops: orders with jumps, impacts and rolling; a step by the formula in dense NumPy, and what its
parts are worth; the bound of the drift; what ends a run."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

import eomgen
from tests.integrators.constrained_models import rolling_disc
from tests.oracles.placed_loops import four_bar, parallelogram, windows
from tests.simulation.test_singular_positions import error as error_of_windows

Array = NDArray[np.float64]
METHODS = ("rosenbrock", "lsrt2")
GAMMA = {"rosenbrock": 0.5, "lsrt2": 1.0 - np.sqrt(0.5)}


def slopes(errors: list[float]) -> Array:
    return np.asarray(np.log2(np.array(errors[:-1]) / errors[1:]))


def five_bars(scene: str, **laws: str) -> eomgen.SceneBuilder:
    """Return a loop of five bars, of which some joints follow laws of time."""
    builder = eomgen.SceneBuilder(scene)
    for name in ("crank", "left", "right", "rocker"):
        builder.body(name, 1.0, center_of_mass=[0.15, 0, 0], inertia=[1e-3, 0.01, 0.01])
    for name, parent, child, place, angle in (
        ("drive", "base", "crank", 0.0, 1.6),
        ("left_pin", "crank", "left", 0.3, -1.1),
        ("support", "base", "rocker", 0.4, 1.4),
        ("right_pin", "rocker", "right", 0.3, 1.2),
    ):
        free = {"initial": {"position": angle}, "damping": 0.02}
        law = {"drive": laws[name]} if name in laws else free
        builder.joint(name, "revolute", parent, child, axis=[0, -1, 0], position=[place, 0, 0], **law)
    ends = [{"body": name, "position": [0.3, 0, 0]} for name in ("left", "right")]
    return builder.constraint("tip", "spherical", ends[0], ends[1])


def struck_bars() -> eomgen.Scene:
    """Return one with an input, an effort that jumps within a step, and a crank that strikes a wall."""
    builder = five_bars("struck_bars").input("pull", "3 * sin(9 * t)").effort("pulled", "support", "pull")
    builder.effort("switched", "drive", "2 * sign(t - 0.1037)")
    return builder.event("wall", "q.drive - 1.75", direction="rising", action="impact", restitution=0.5).build()


#: Scenes and durations; orders of loops of other kinds are measured in test_orders.py, for all methods.
SCENES: dict[str, tuple[Callable[[], eomgen.Scene | str], float]] = {
    "four_bar": (lambda: "examples/four_bar/scene.toml", 0.25),
    "slider_crank": (lambda: "examples/slider_crank_planar/scene.toml", 0.01),
    "jump_and_impact": (struck_bars, 0.4),
    "rolling_disc": (rolling_disc, 0.5),
}


@cache
def model(name: str) -> eomgen.Model:
    return eomgen.build(SCENES[name][0](), profile="quick")


@cache
def reference(name: str) -> eomgen.Solution:
    end = SCENES[name][1]
    return model(name).simulate(end, end / 4000, method="rk4_partitioned", record_every=4000, error_estimate=False)


@pytest.mark.slow
@pytest.mark.long_cases("jump_and_impact-lsrt2")
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", SCENES)
def test_order_in_positions_velocities_and_multipliers(name: str, method: str) -> None:
    """Against coordinate partitioning of order 4, on every group; multipliers are those of the accelerations."""
    exact, end = reference(name), SCENES[name][1]
    errors: dict[str, list[float]] = {}
    for count in (200, 400, 800):
        last = model(name).simulate(end, end / count, method=method, error_estimate=False)
        assert last.success, last.message
        for part in ("q", "v", "z", "multipliers"):
            if len(getattr(exact, part)[-1]):
                errors.setdefault(part, []).append(
                    float(np.abs(getattr(last, part)[-1] - getattr(exact, part)[-1]).max())
                )
        assert last.stats["max_constraint"] <= 1e-10
    for part, found in errors.items():
        assert slopes(found)[-1] == pytest.approx(2.0, abs=0.1), part


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_what_two_corrections_leave_falls_by_the_ninth_power_of_the_step(method: str) -> None:
    """From steps whose corrections do not reach rounding to those whose do."""
    left = []
    for step in (4e-3, 2e-3):
        end = model("four_bar").simulate(1.0, step, method=method, error_estimate=False)
        assert end.success, end.message
        left.append((end.stats["max_constraint"], end.stats["max_constraint_velocity"]))
    orders = np.log2(np.array(left[0]) / left[1])
    assert orders == pytest.approx([9.0, 9.0], abs=1.0)
    fine = model("four_bar").simulate(1.0, 5e-4, method=method, error_estimate=False)
    assert fine.stats["max_constraint"] < 1e-15 and fine.stats["max_constraint_velocity"] < 5e-14


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_steps_too_long_for_two_corrections_end_the_run(method: str) -> None:
    end = model("slider_crank").simulate(0.1, 2e-3, method=method, error_estimate=False)
    assert not end.success
    assert "the corrections of a step, a fixed number, did not bring it onto the constraints" in end.message
    assert "try: a step smaller than 0.002 s" in end.message
    loose = model("four_bar").simulate(0.1, 4e-3, method=method, error_estimate=False)
    with pytest.raises(eomgen.UsageError, match=r"settings\.drift: drift is 0, and has to be above it; try: 1e-06"):
        model("four_bar").simulate(0.1, 4e-3, method=method, settings={"drift": 0.0})
    strict = model("four_bar").simulate(0.1, 4e-3, method=method, error_estimate=False, settings={"drift": 1e-14})
    assert loose.success and not strict.success


def stepped(made: eomgen.Model, method: str, step: float, count: int) -> tuple[Array, Array]:
    """Return (q, v) and |Phi| behind steps on numbers that just add up, from the model's functions in dense NumPy."""
    nv, h, gain = made.nv, step, GAMMA[method] * step

    def rows(q: Array) -> Array:
        return np.asarray(made.evaluate("constraint_jacobian", q)["B"])

    def forces(q: Array, v: Array, lam: Array) -> Array:
        return np.asarray(-made.evaluate("residual", q, v, np.zeros(nv), multipliers=lam)["r"])

    def solved(S: Array, left: Array, below: Array, force: Array, rates: Array) -> tuple[Array, Array]:
        bordered = np.block([[S, left.T], [below, np.zeros((len(below), len(below)))]])
        found = np.linalg.solve(bordered, np.concatenate([force, rates]))
        return found[:nv], found[nv:]

    q, v = made.initial_q.copy(), made.initial_v.copy()
    bias = made.evaluate("constraint_bias", q, v)["g"]
    zero = np.zeros(len(bias))
    a, lam = solved(made.mass(q), rows(q), rows(q), forces(q, v, zero), -bias)
    for _ in range(count):
        K, C, M = made.partials(q, v, a, multipliers=lam)
        S, B, ahead = M + gain * C + gain * gain * K, rows(q), rows(q + h * v + h * h / 2 * a)
        k, change = solved(S, B, ahead, forces(q, v, lam) - gain * K @ v, -ahead @ v / h)
        lam = lam + change
        along = v + gain * k
        if method == "lsrt2":
            middle, speed = q + h / 2 * along, v + h / 2 * k
            force = forces(middle, speed, lam) - made.mass(middle) @ k - gain * K @ ((h / 2 - gain) * k)
            more, change = solved(S, B, ahead, force, zero)
            k, lam, along = k + more, lam + change, speed + gain * more
        q, v, a = q + h * along, v + h * k, k
        for _ in range(2):
            q = q + solved(S, B, ahead, np.zeros(nv), -made.evaluate("constraint", q)["Phi"])[0]
        for _ in range(2):
            v = v + solved(S, B, ahead, np.zeros(nv), -made.evaluate("constraint_velocity", q, v)["w"])[0]
    return np.concatenate([q, v]), np.abs(made.evaluate("constraint", q)["Phi"])


@pytest.mark.slow
@pytest.mark.long_cases("lsrt2")
@pytest.mark.parametrize("method", METHODS)
def test_a_step_is_that_of_the_formula(method: str) -> None:
    made, end = model("four_bar"), SCENES["four_bar"][1]
    ours = made.simulate(end, end / 100, method=method, error_estimate=False)
    same, left = stepped(made, method, end / 100, 100)
    np.testing.assert_allclose(np.concatenate([ours.q[-1], ours.v[-1]]), same, rtol=0, atol=1e-8)
    assert left.max() < 1e-10


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_two_windows_pass_where_their_bars_lie_on_one_line(method: str) -> None:
    """Ten times in 10 s, along the motion of the closed form in which they stay parallel."""
    made = eomgen.build(windows(2), profile="quick")
    errors = []
    for step in (5e-3, 2.5e-3):
        end = made.simulate(10.0, step, method=method, error_estimate=False)
        assert end.success and end.stats["max_constraint"] < 1e-14
        errors.append(error_of_windows(end))
    assert errors[1] < 0.35 * errors[0] < 0.02


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_a_parallelogram_ends_where_its_branches_cross(method: str) -> None:
    """The direction that its rows hold turns round within the step, and with it the sign of the determinant of its
    matrix; where the run goes on all the same, it does so on its branch, and its energy is kept by the step's
    square."""
    made = eomgen.build(parallelogram("revolute") | {"outputs": {"energy": {"energy": "total"}}}, profile="quick")
    end = made.simulate(0.1, 1e-3, method=method)
    assert not end.success and end.t[-1] == pytest.approx(0.061)
    assert "or the constraints are singular within the step" in end.message
    assert "the constraints are nearly singular at t = 0.0615 s, where branches of configurations cross" in end.message
    assert "try: rk4_partitioned, which passes such positions along the velocity" in end.message
    drift = []
    for step in (2e-3, 1e-3):
        run = made.simulate(1.0, step, method=method, error_estimate=False, settings={"stop_at_growth": 0})
        assert run.success and run.stats["unfollowed_growth"] == 12
        assert np.abs(np.sin(run.q[:, 0]) - np.sin(run.q[:, 2])).max() < 1e-11
        drift.append(float(np.ptp(run.outputs["energy"])))
    assert drift[1] < 0.3 * drift[0]


@pytest.mark.long_cases("rosenbrock")
@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_a_loop_that_its_drive_moves_alone_is_exact_to_rounding(method: str) -> None:
    """As many rows as velocities: nothing is left to integrate."""
    data = four_bar("revolute")
    del data["joints"]["drive"]["initial"]
    data["joints"]["drive"]["drive"] = "0.5 + 30 * t"
    made = eomgen.build(data, profile="quick")
    assert len(made.multipliers) == made.nv
    exact = made.simulate(0.2, 1e-4, method="rk4_partitioned", record_every=2000, error_estimate=False)
    end = made.simulate(0.2, 1e-3, method=method, error_estimate=False)
    for part, bound in (("q", 1e-13), ("v", 1e-12), ("multipliers", 1e-10)):
        assert np.abs(getattr(end, part)[-1] - getattr(exact, part)[-1]).max() < bound, part
