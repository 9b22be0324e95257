"""Velocities that the equations hold, and forces that are aliased by the steps, are named beyond the stated error.

References: SciPy's LSODA on windows with steep flanks, and eigenvectors of the linear oscillator.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import eomgen
from eomgen.base.arrays import Array
from eomgen.simulation.accuracy import step_path
from eomgen.simulation.accuracy.comparison_runs import comparison_run
from tests.doubts.test_laws_between_steps import DOUBTS
from tests.simulation.rails import built, on_rail

EFFORT = "1 - k*q.x + (F if c - w < v.x < c + w else 0)"
#: Methods of fixed steps: others take up to a million steps for a row at a level that holds the velocity.
METHODS = ("generalized_alpha", "rk4", "rosenbrock", "trapezoidal")


def model(effort: str, *parameters: str, rate: str = "0") -> eomgen.Model:
    builder = on_rail(effort, velocity=1.0).state("s", rate=rate)
    for name in parameters:
        builder.parameter(name, 0.0, tunable=True)
    return built(builder)


WEAK = {"F": -2.01, "c": 1.161, "w": 0.025}


@cache
def windowed() -> eomgen.Model:
    """Return a slider pushed by 1 N, and in a window of its velocity by F more; a state s likewise."""
    return model(EFFORT, "F", "c", "w", "k", "G", rate="1 + (G if c - w < s < c + w else 0)")


@cache
def driven() -> eomgen.Model:
    return model("A*sin(om*t + phase) - k*q.x - d*v.x", "A", "om", "phase", "k", "d")


def names(run: eomgen.Solution) -> set[str]:
    return {finding.name for finding in run.findings}


def through_window(p: Mapping[str, float], t: Array, speed: float) -> Array:
    """Return [q, v] at times, with flanks of the window that are 400 times steeper than it is wide."""
    flank = p["w"] / 200.0

    def rates(_: float, y: Array) -> list[float]:
        inside = 0.5 * (np.tanh((y[1] - p["c"] + p["w"]) / flank) - np.tanh((y[1] - p["c"] - p["w"]) / flank))
        return [y[1], 1.0 - p["k"] * y[0] + p["F"] * inside]

    longest = min(0.01, 0.2 * p["w"])
    solved = solve_ivp(rates, (0.0, t[-1]), [0.0, speed], "LSODA", max_step=longest, rtol=1e-7, atol=1e-9)
    return np.stack([np.interp(t, solved.t, row) for row in solved.y], axis=1)


def oscillation(p: Mapping[str, float], t: Array) -> Array:
    """Return [q, v] of the driven oscillator that begins at q = 0, v = 1."""
    om = p["om"]
    matrix = np.array([[0, 1, 0, 0], [-p["k"], -p["d"], p["A"], 0], [0, 0, 0, om], [0, 0, -om, 0]])
    values, vectors = np.linalg.eig(matrix)
    parts = np.linalg.solve(vectors, np.array([0.0, 1.0, np.sin(p["phase"]), np.cos(p["phase"])]))
    return np.real(vectors @ (parts[:, np.newaxis] * np.exp(np.outer(values, t)))).T[:, :2]


def off(run: eomgen.Solution, true: Array) -> float:
    return float((np.abs(np.hstack([run.q, run.v]) - true).max(axis=0) / np.ptp(true, axis=0)).max())


HELD: dict[str, tuple[dict[str, float], float, dict[str, Any], float]] = {  # parameters, velocity, options, step
    "weak force": (WEAK, 0.5, {"method": "rk45", "tolerance": 1e-3}, 0.1),
    "fixed steps": (WEAK, 0.5, {"method": "generalized_alpha"}, 0.1),
    "strong force": ({"F": -29.06, "c": 0.538, "w": 0.0229}, 0.5, {"method": "rk45", "tolerance": 1e-8}, 0.25),
}


@pytest.mark.slow_cases("strong force")
@pytest.mark.parametrize("case", HELD)
def test_a_velocity_that_the_equations_hold_is_named(case: str) -> None:
    given, speed, options, step = HELD[case]
    p = {**given, "k": 0.0}
    run = windowed().simulate(2.0, step, initial={"v": [speed]}, parameters=p, **options)
    true = through_window(p, run.t, speed)
    assert off(run, true) > 0.5 and true[-1, 1] == pytest.approx(p["c"] - p["w"], rel=1e-3)
    (found,) = (finding for finding in run.findings if finding.name == "unseen_law")
    begin, share = p["c"] - p["w"], 100.0 * (run.v[-1, 0] - true[-1, 1]) / np.ptp(run.v)
    assert f"it holds v.x at {begin:.6g} m/s, beyond which the run goes by" in found.text
    assert found.value == pytest.approx(share / 100.0, rel=0.3) and found.time == pytest.approx(begin - speed, abs=0.02)
    fixed = options == {"method": "generalized_alpha"}
    assert found.hint.startswith("a step of " if fixed else "a method of fixed steps, of ")
    named = float(found.hint.split()[-2])
    followed = windowed().simulate(2.0, named, method="rk4", initial={"v": [speed]}, parameters=p)
    assert followed.v[-1, 0] == pytest.approx(true[-1, 1], rel=0.02)
    assert "unseen_law" not in names(followed)  # it chatters about the level, which is right


def test_a_state_that_its_rate_holds_is_named() -> None:
    run = windowed().simulate(2.0, 0.08, method="generalized_alpha", parameters={"G": -1.5, "c": 1.16, "w": 0.01})
    assert run.z[-1, 0] > 1.9  # it is held at 1.15
    assert "it holds z.s at 1.15, beyond which the run goes by 0." in run.message


def test_a_window_that_slows_but_lets_pass_is_not_said_to_hold() -> None:
    run = windowed().simulate(2.0, 0.1, method="rk4", parameters={"F": -0.5, "c": 1.161, "w": 0.025})
    assert "holds" not in run.message


@pytest.mark.parametrize("step", [0.02, 0.05, 0.1])
def test_an_aliased_force_is_named_or_within_the_stated_error(step: float) -> None:
    p = {"A": 1e-3, "om": 1000.0, "phase": 0.0, "k": 1.0, "d": 0.0}
    run = driven().simulate(5.0, step, method="rk4", parameters=p)
    error = off(run, oscillation(p, run.t))
    for found in run.findings:
        assert found.name == "unseen_law" and 0.5 * error < found.value < 5.0 * error
        assert "the formula A * sin(om * t + phase) acts between the steps" in found.text
        assert found.text.endswith(", which the estimated error leaves out")
    assert run.findings or error < 3.0 * run.error.relative
    resolved = driven().simulate(5.0, 1e-3, method="rk4", parameters={**p, "om": 100.0})
    assert not resolved.findings


@pytest.mark.slow
def test_windows_of_velocity_are_followed_or_named_and_errors_stated() -> None:
    """Places of jumps in their steps are chance, so that one run of many may be understated."""
    random, understated = np.random.default_rng(0), []
    for _ in range(30):
        p = {
            "F": random.choice([-1.0, 1.0]) * 10.0 ** random.uniform(-0.3, 1.5),
            "c": random.uniform(0.2, 1.5),
            "w": 10.0 ** random.uniform(-2.2, -0.7),
            "k": random.choice([0.0, random.uniform(0.0, 1.0)]),
        }
        speed, method = random.choice([0.0, random.uniform(0.0, 1.0)]), str(random.choice(METHODS))
        step = 10.0 ** random.uniform(-2.7, -0.6)
        end = np.floor(2.0 / step) * step
        run = windowed().simulate(end, step, method=method, parameters=p, initial={"v": [speed]})
        if not run.success:  # Newton iterations may fail at the level
            continue
        true = through_window(p, run.t, speed)
        error = off(run, true)
        assert error < 0.1 or names(run) & DOUBTS, (p, speed, method, step, run.message)
        assert error > 0.01 or "unseen_law" not in names(run), (p, speed, method, step, run.message)
        if run.error.available and not names(run):
            errors, sizes = np.abs(np.hstack([run.q, run.v]) - true).max(axis=0), np.ptp(true, axis=0)
            stated = np.array([run.error.q_at.max(), run.error.v_at.max()])
            if np.any((errors > 3.0 * stated) & (errors > 0.005 * sizes)):
                understated.append((p, speed, method, step))
    assert len(understated) <= 1, understated


@pytest.mark.slow
def test_runs_of_thousands_of_steps_to_a_row_are_examined_in_part(monkeypatch: pytest.MonkeyPatch) -> None:
    """An examination repeats a bounded number of steps, and says how much of the run it has seen."""
    repeated: list[int] = []

    def repeat(*given: Any, **options: Any) -> Any:
        piece = comparison_run(*given, **options)
        repeated.append(len(piece.rows))
        return piece

    monkeypatch.setattr(step_path, "comparison_run", repeat)
    monkeypatch.setattr(step_path, "_MOST", 400)
    rubbing = model("2*sin(t) - F*tanh(v.x/0.0001)", "F")
    options = {"method": "rk45", "tolerance": 1e-6, "parameters": {"F": 10.0}}
    run = rubbing.simulate(0.5, 0.05, **options)
    assert run.stats["own_steps"] > 2000
    (found,) = (finding for finding in run.findings if finding.name == "partly_examined")
    assert found.value == pytest.approx(400 / run.stats["own_steps"], rel=0.02)
    assert f"looked for in {100.0 * found.value:.2g} % of the run only: it has thousands of steps" in run.message
    assert 8 <= len(repeated) <= 16 and max(repeated) <= 52
    dense = rubbing.simulate(0.5, 0.0005, **options)
    assert "partly_examined" not in names(dense)


def test_a_force_that_begins_at_zero_is_no_jump() -> None:
    bumper = model("-400*(q.x - 0.1) if q.x > 0.1 else 0")
    run = bumper.simulate(0.4, 0.002, method="generalized_alpha")
    assert "2 times the step" in str(run.error) and run.error.order == pytest.approx(2.0, abs=0.1)


@pytest.mark.slow
def test_no_aliased_force_is_understated_by_more_than_three() -> None:
    random = np.random.default_rng(0)
    methods = ["rk4", "generalized_alpha", "rosenbrock", "tdg1", "rattlie", "trapezoidal"]
    for _ in range(40):
        p = {
            "A": 10.0 ** random.uniform(-5.0, 0.0),
            "om": 10.0 ** random.uniform(0.5, 4.0),
            "phase": random.uniform(0.0, 6.0),
            "k": random.uniform(0.5, 20.0),
            "d": random.choice([0.0, 0.3]),
        }
        method, step = str(random.choice(methods)), 10.0 ** random.uniform(-2.7, -1.0)
        run = driven().simulate(5.0, step, method=method, parameters=p)
        if run.success:
            true = oscillation(p, run.t)
            error = float(np.abs(run.q[:, 0] - true[:, 0]).max() / np.ptp(true[:, 0]))
            stated = run.error.relative if run.error.available else np.inf
            assert error < max(3.0 * stated, 1e-6) or names(run) & DOUBTS, (p, method, step, error, run.message)
            assert "unseen_law" not in names(run) or off(run, true) > 0.5 * stated, (p, method, step, run.message)


def test_initial_values_that_constraints_do_not_keep_are_in_the_message() -> None:
    """Of inertias I and wheels with v = 2 w the projection by kinetic energy turns v = 3 into 3 I / (I + I/4)."""
    builder = eomgen.SceneBuilder("gear", gravity=[0, 0, 0])
    for name in ("x", "y"):
        builder.body(f"wheel_{name}", 1.0, inertia=[0.1, 0.1, 0.1])
        builder.joint(name, "revolute", "base", f"wheel_{name}", axis=[0, 0, 1])
    builder.constraint("mesh", "formula", velocity_equation="v.x - 2 * v.y")
    model = eomgen.build(builder.build(), profile="quick")
    lost, kept = (model.simulate(0.1, 1e-2, initial={"v": v}) for v in ([3.0, 0.0], [3.0, 1.5]))
    assert lost.v[0].tolist() == pytest.approx([2.4, 1.2])
    assert "; corrected onto the constraints: v.x 3 -> 2.4 rad/s" in lost.message
    assert lost.message.endswith("; try: hold = true to keep v.x") and "hold" not in kept.message
    assert kept.v[0].tolist() == pytest.approx([3.0, 1.5])
