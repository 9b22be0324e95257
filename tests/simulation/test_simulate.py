"""Runs against another solver and against each other, failures that end a run, and what is refused before it starts."""

from __future__ import annotations

import os
import re
import signal
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import eomgen
from eomgen.compiled.functions import Functions
from tests.models.scenes import breaking, flyer, pendulum
from tests.simulation.rails import built, on_rail


def _reference(model: eomgen.Model, end: float) -> np.ndarray:
    start = np.concatenate([model.initial_q, model.initial_v])
    solution = solve_ivp(model.rhs, (0.0, end), start, method="DOP853", rtol=1e-12, atol=1e-13)
    assert solution.success
    return solution.y[:, -1]


@pytest.mark.parametrize("build", [pendulum, flyer])
def test_both_methods_converge_to_the_solution_of_solve_ivp(build: Callable[[], eomgen.Model]) -> None:
    model = build()
    reference = _reference(model, 0.5)
    errors = {}
    for method, steps in (("generalized_alpha", (2e-3, 1e-3)), ("rk4", (1e-2, 5e-3))):
        runs = [model.simulate(0.5, step, method=method) for step in steps]
        errors[method] = [np.linalg.norm(np.concatenate([run.q[-1], run.v[-1]]) - reference) for run in runs]
    slopes = {method: np.log2(pair[0] / pair[1]) for method, pair in errors.items()}
    assert abs(slopes["generalized_alpha"] - 2.0) < 0.1
    assert abs(slopes["rk4"] - 4.0) < 0.3
    assert errors["rk4"][1] < 1e-7


@pytest.mark.parametrize("inputs", [None, {"torque": 0.3}])
def test_inputs_and_the_base_are_evaluated_once_for_each_row(
    inputs: dict[str, float] | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    model, times = pendulum(), {"inputs": 0, "base": 0, "outputs": 0, "energy": 0}
    evaluate = Functions.__call__

    def counted(functions: Functions, name: str, blocks: Mapping[str, np.ndarray]) -> tuple[np.ndarray, ...]:
        if name in times and np.size(blocks["t"]) > 1:
            times[name] += np.size(blocks["t"])
        return evaluate(functions, name, blocks)

    monkeypatch.setattr(Functions, "__call__", counted)
    run = model.simulate(0.5, 1e-3, inputs=inputs, error_estimate=False)
    assert len(run.t) == 501 and run.success and run.outputs and run.energy
    assert times == {"inputs": 0 if inputs else 501, "base": 501, "outputs": 501, "energy": 501}


def test_inputs_by_number_function_and_table_agree() -> None:
    model = pendulum()
    grid = np.arange(501) * 1e-3
    for method, step in (("generalized_alpha", 1e-3), ("rk4", 1e-2)):  # explicit stages lie between the grid points
        as_function = model.simulate(0.5, step, method=method, inputs={"torque": lambda t: 0.2 * np.sin(3 * t)})
        np.testing.assert_allclose(as_function.q, model.simulate(0.5, step, method=method).q, atol=1e-12)
    by_formula = model.simulate(0.5, 1e-3)
    as_table = model.simulate(0.5, 1e-3, inputs={"torque": 0.2 * np.sin(3 * grid)})
    np.testing.assert_allclose(as_table.q, by_formula.q, atol=1e-12)
    constant = model.simulate(0.5, 1e-3, inputs={"torque": 0.3})
    np.testing.assert_allclose(constant.q, model.simulate(0.5, 1e-3, inputs={"torque": np.full(501, 0.3)}).q, rtol=0)
    assert abs(constant.q[-1, 0] - by_formula.q[-1, 0]) > 1e-3
    work = constant.energy["power"] + 0.05 * constant.v[:, 0] ** 2
    np.testing.assert_allclose(work, 0.3 * constant.v[:, 0], atol=1e-12)


def test_progress_and_chunks_do_not_change_the_numbers() -> None:
    seen: list[tuple[int, int]] = []
    run = pendulum().simulate(2.0, 1e-4, progress=lambda done, total: seen.append((done, total)))
    assert seen[-1] == (35000, 35000) and len(seen) > 2  # 10000 and 5000 of them for the error estimate
    assert [done for done, _ in seen] == sorted({done for done, _ in seen})
    halves = pendulum().simulate(1.0, 1e-4)
    np.testing.assert_array_equal(run.q[: len(halves.t)], halves.q)


def test_a_force_that_is_no_number_ends_the_run_and_is_named() -> None:
    run = breaking().simulate()
    assert not run.success and not run.interrupted
    pattern = (
        r"stopped at t = 0\.\d+ s, after \d+ of 1000 steps: a value became infinite or not a number; "
        r"the first block that is not finite is Q \(the generalized force\), component v\.\w+ at t = 0\.5\d* s, "
        r"where in a formula sqrt\(-0\.\d+\) has no value at t = 0\.5\d*; try: another start, or a formula that has .*"
    )
    assert re.fullmatch(pattern, run.message), run.message
    assert 0.498 <= run.t[-1] <= 0.5 and np.all(np.isfinite(run.q)) and np.all(np.isfinite(run.v))


@pytest.mark.slow
def test_a_curve_that_an_internal_state_leaves_is_named() -> None:
    builder = on_rail("lag").curve("map", points=[[-1, 0], [0, 1], [1, 2]])
    message = built(builder.state("clock", "3").state("lag", "map(clock) - lag")).simulate(1.0, 1e-2).message
    said = "the first block that is not finite is zdot (the rates of the internal states), component lag at t = 0.34 s"
    assert f"{said}, where the curve map has points from -1 to 1 and is asked at 1.02; try: points that" in message


MOST = "a whole number from 1 to 2147483647"


REFUSED: dict[str, dict[str, Any]] = {
    "step: step is nan, not a finite number": {"step": np.nan},
    "record_every: a whole number from 1 on is needed, not 0": {"record_every": 0},
    "settings: generalized_alpha has no setting 'rtl'; try: rtol": {"settings": {"rtl": 1e-6}},
    f"settings.max_iterations: max_iterations must be {MOST}, not 1.5; try: 16": {"settings": {"max_iterations": 1.5}},
    "max_halvings must be a whole number from 0 to 30, not 31": {"settings": {"max_halvings": 31}},
    "settings.reuse: reuse must be 0 or 1, not 2; try: 1": {"settings": {"reuse": 2}},
    "parameters: parameter length is inf, not a finite number": {"parameters": {"length": np.inf}},
    "initial hinge: 'speed' is not known here; try: position or velocity": {"initial": {"hinge": {"speed": 0.1}}},
    "(1,) is needed; try: one row of it: q[-1] is the last one": {"initial": {"q": np.zeros((5, 1))}},
    "there is no input 'torq'; try: torque": {"inputs": {"torq": 1.0}},
    "input torque: the shape is (2,), (2001,) is needed": {"inputs": {"torque": [1.0, 2.0]}},
}


@pytest.mark.slow
def test_an_impossible_inertia_is_explained_when_it_ends_a_run() -> None:
    balloon = eomgen.SceneBuilder("balloon").parameter("mass", 1.0, tunable=True)
    balloon.body("first", 1.0, center_of_mass=[0, 0, -0.5], inertia=[0.1, 0.1, 0.1])
    balloon.body("second", "mass", center_of_mass=[0, 0, -0.5], inertia=[0.1, 0.1, 0.1])
    balloon.joint("shoulder", "revolute", "base", "first", axis=[0, 1, 0], initial={"position": [0.5]})
    balloon.joint("elbow", "revolute", "first", "second", axis=[0, 1, 0], position=[0, 0, -1])
    scene = replace(balloon.build(), requirements=())  # which would refuse a mass that a URDF may have
    model = eomgen.build(scene, profile="quick")
    run = model.simulate(10.0, 1e-2, parameters={"mass": -1.1})
    assert not run.success
    assert "the inertia matrix there is not positive definite, its smallest eigenvalue is -" in run.message
    assert run.message.endswith("; try: masses and inertias that bodies can have")


def test_an_input_function_that_fails_ends_the_run_just_before() -> None:
    def torque(t: float) -> float:
        return 1.0 / (1.0 if t < 0.25 else 0.0)

    run = pendulum().simulate(0.5, 1e-3, inputs={"torque": torque})
    assert not run.success
    assert "input torque: the function failed at t = 0.25 s: ZeroDivisionError: float division by zero" in run.message
    assert run.t[-1] == pytest.approx(0.249)


def test_ctrl_c_returns_what_there_is_and_a_second_handler_is_restored() -> None:
    before = signal.getsignal(signal.SIGINT)

    def progress(done: int, total: int) -> None:
        if done > 1000:
            os.kill(os.getpid(), signal.SIGINT)

    run = pendulum().simulate(1e5, 1e-3, record_every=100, progress=progress)
    assert run.interrupted and not run.success
    assert re.fullmatch(r"interrupted at t = [\d.]+ s, after \d+ of 100000000 steps", run.message)
    assert run.stats["steps"] == round(run.t[-1] * 1000) and len(run.t) >= 10 and np.all(np.isfinite(run.q))
    assert signal.getsignal(signal.SIGINT) is before


@pytest.mark.parametrize("text", REFUSED)
def test_what_cannot_run_is_refused_by_name(text: str) -> None:
    with pytest.raises(eomgen.UsageError, match=re.escape(text)):
        pendulum().simulate(**REFUSED[text])


def test_runs_in_several_threads_do_not_disturb_each_other() -> None:
    from concurrent.futures import ThreadPoolExecutor

    model = flyer()
    starts = [{"slide": 0.01 * k} for k in range(6)]
    alone = [model.simulate(0.5, 1e-3, initial=start).q for start in starts]
    with ThreadPoolExecutor(3) as pool:
        together = list(pool.map(lambda start: model.simulate(0.5, 1e-3, initial=start).q, starts))
    for first, second in zip(alone, together, strict=True):
        np.testing.assert_array_equal(first, second)


@pytest.mark.slow_cases("q")
@pytest.mark.parametrize("name", ["q", "v"])
def test_a_joint_with_the_name_of_all_coordinates(name: str) -> None:
    model = built(on_rail("", name))

    def start(value: object) -> list[float]:
        run = model.simulate(0.01, 1e-2, initial={name: value})
        return [float(run.q[0, 0]), float(run.v[0, 0])]

    with pytest.raises(eomgen.UsageError, match=f"initial {name}: {name} may be all of {name} or the joint; try: "):
        start(0.3)
    assert start({"position": 0.3}) == [0.3, 0.0] and start({"velocity": 0.3}) == [0.0, 0.3]
    assert start([0.3]) == ([0.3, 0.0] if name == "q" else [0.0, 0.3])
