"""States between rows: orders on every group, smoothness across steps, outputs, and what is refused."""

from __future__ import annotations

import pickle
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.lie import product
from eomgen.results.dense_output import Rows, state_at
from tests.models.scenes import absolute, flyer, flyer_scene, pendulum

TIMES = np.linspace(0.013, 0.387, 29)


def free_in_space() -> eomgen.Model:
    """Return the flyer in absolute coordinates on R^3 x SO(3)."""
    scene = flyer_scene()
    groups = {body.name: "R3xSO3" for body in scene.bodies}
    content = scene.content + b"absolute on R3xSO3"
    return eomgen.build(
        replace(scene, name="in_space", coordinates="absolute", groups=groups, content=content), profile="quick"
    )


def errors_of(
    model: eomgen.Model, step: float, exact: eomgen.Solution, every: int = 1, **options: object
) -> np.ndarray:
    found = model.simulate(0.4, step, record_every=every, **options).at(TIMES)
    known = exact.at(TIMES)
    off = (product.difference(model.factors, known.q, found.q), found.v - known.v, found.a - known.a)
    return np.array([np.abs(x).max() for x in off])


def slopes(steps: list[float], errors: list[np.ndarray]) -> np.ndarray:
    return np.polyfit(np.log(steps), np.log(errors), 1)[0]


@pytest.mark.slow
def test_rows_far_apart_cost_the_order_of_their_spacing_and_say_so() -> None:
    model = flyer()
    exact = model.simulate(0.4, 2e-4, method="rk4")
    errors, told = [], []
    for every in (40, 25, 16):
        run = model.simulate(0.4, 1e-3, method="rk4", record_every=every)
        told.append(list(run.interpolation_error().values()))
        errors.append(errors_of(model, 1e-3, exact, every, method="rk4"))
    found = slopes([0.04, 0.025, 0.016], errors)
    assert found == pytest.approx([6.0, 5.0, 4.0], abs=0.6), found  # over so few rows the largest errors scatter
    assert np.all(np.array(told) > np.array(errors))
    assert np.all(np.array(told) < 1000.0 * np.array(errors))


@pytest.mark.slow_cases("rk4")
@pytest.mark.parametrize("method", ["rk4", "generalized_alpha"])
def test_states_are_continuous_across_rows_and_quaternions_of_unit_length(method: str) -> None:
    model = flyer()
    run = model.simulate(0.1, 0.01, method=method)
    inner = run.t[1:-1]
    before, at, after = (run.at(inner + shift) for shift in (-1e-12, 0.0, 1e-12))
    for name, known in (("q", run.q), ("v", run.v), ("a", run.a)):
        for state in (before, at, after):
            np.testing.assert_allclose(getattr(state, name), known[1:-1], atol=1e-9)
    dense = run.at(np.linspace(0.0, 0.1, 201))
    for start in (0, 7):
        np.testing.assert_allclose(np.linalg.norm(dense.q[:, start : start + 4], axis=1), 1.0, atol=4e-16)
    assert dense.q.shape == (201, model.nq) and run.at(0.05).v.shape == (model.nv,)
    assert run.at([[0.01, 0.02], [0.03, 0.04]]).a.shape == (2, 2, model.nv)
    assert np.array_equal(run.at(run.t[-1]).t, run.t[-1])


def lagging() -> eomgen.Model:
    """Return a cart driven by a lagging actuator, with an output of everything that an output may name."""
    builder = eomgen.SceneBuilder("lagging").parameter("gain", 2.0, tunable=True)
    builder.input("push", "sin(9 * t)", unit="N").input("more")
    builder.body("cart", 1.5).joint("rail", "prismatic", "base", "cart", axis=[1, 0, 0], stiffness=40.0)
    builder.state("force", "(gain * push - force) / 0.05", initial=0.7, unit="N").effort(
        "drive", "rail", "force + more"
    )
    builder.output("all", formula="force + 3 * push + gain * q.rail + more * v.rail + t")
    return eomgen.build(builder.build(), profile="quick")


@pytest.mark.slow
@pytest.mark.parametrize("method", ["rk4", "generalized_alpha"])
def test_outputs_between_rows_know_internal_states_inputs_and_parameters_of_the_run(method: str) -> None:
    model, step = lagging(), 2e-3
    table = 0.3 * np.arange(201) * step
    more = {"method": method, "parameters": {"gain": 3.0}, "inputs": {"push": lambda t: np.cos(7.0 * t), "more": table}}
    run = model.simulate(0.4, step, **more)
    at_rows = run.outputs_at(run.t)
    assert list(at_rows) == ["all"]
    np.testing.assert_allclose(at_rows["all"], run.outputs["all"], atol=1e-12)
    coarse = model.simulate(0.4, step, record_every=4, **more)
    np.testing.assert_allclose(coarse.outputs_at(run.t)["all"], run.outputs["all"], atol=1e-4)
    state = run.at(TIMES)
    known = state.z[:, 0] + 3.0 * np.cos(7.0 * TIMES) + 3.0 * state.q[:, 0] + 0.3 * TIMES * state.v[:, 0] + TIMES
    np.testing.assert_allclose(run.outputs_at(TIMES)["all"], known, atol=1e-12)
    assert run.outputs_at(0.05)["all"].shape == () and run.outputs_at([[0.1, 0.2]])["all"].shape == (1, 2)
    assert run.outputs_at([])["all"].shape == (0,)
    assert set(run.interpolation_error()) == {"q", "v", "a", "z"} and 0.0 < run.interpolation_error()["z"] < 1e-4


def test_a_stored_solution_gets_its_model_back_with_the_inputs_that_it_does_not_hold(tmp_path: Path) -> None:
    model, step = lagging(), 2e-3

    def push(t: float) -> float:
        return float(np.cos(7.0 * t))

    given = {"push": push, "more": 0.3 * np.arange(101) * step}
    run = model.simulate(0.2, step, parameters={"gain": 3.0}, inputs=given)
    for stored in (pickle.loads(pickle.dumps(run)), eomgen.Solution.load(run.save(tmp_path / "run.npz"))):
        with pytest.raises(
            eomgen.UsageError,
            match=r"outputs_at: the outputs between rows need the model and the inputs of the run, which a stored"
            r" solution does not hold; try: model\.attach\(solution\), with inputs=\{\.\.\.\}",
        ):
            stored.outputs_at(0.1)
        with pytest.raises(
            eomgen.UsageError,
            match="input push: the run had a function here, which a solution does not hold",
        ):
            model.attach(stored, {"more": given["more"]})
        again = model.attach(stored, given)
        np.testing.assert_array_equal(again.outputs_at(run.t)["all"], run.outputs_at(run.t)["all"])
    held = model.simulate(0.1, step, inputs={"push": 2.0})
    assert model.attach(pickle.loads(pickle.dumps(held))).outputs_at(0.05) == held.outputs_at(0.05)
    with pytest.raises(eomgen.UsageError, match="input push: the run had 2 here; try: leave it out"):
        model.attach(held, {"push": 3.0})
    with pytest.raises(eomgen.UsageError, match="input more: the run followed the scene here; try: leave it out"):
        model.attach(held, {"more": 3.0})
    with pytest.raises(eomgen.ModelError, match="attach: this is a solution of the scene 'lagging', the model is"):
        flyer().attach(held)


def test_what_has_no_state_is_refused() -> None:
    run = pendulum().simulate(0.05, 0.01)
    for t, text in (
        (0.06, "at: t = 0.06 s is outside the solution, 0 s to 0.05 s; try: times within it, or a longer run"),
        ([0.01, -0.001], "at: t = -0.001 s is outside the solution"),
        (np.nan, "t: t is nan, not a finite number"),
        ("soon", "t: "),
    ):
        with pytest.raises(eomgen.UsageError, match=re.escape(text)):
            run.at(t)
    with pytest.raises(eomgen.UsageError, match="at: the solution has 1 row, two are needed"):
        pendulum().simulate(0.0, 0.01).at(0.01)
    bare = replace(run, metadata={})
    with pytest.raises(eomgen.UsageError, match="does not say which groups its coordinates are of"):
        bare.at(0.01)
    apart = replace(run, metadata={**run.metadata, "method": "leaps", "dense_output": "none"})
    with pytest.raises(eomgen.UsageError, match="at: leaps defines no states between its rows; try: record_every = 1"):
        apart.at(0.015)
    fast = flyer().simulate(1.0, 1e-3, initial={"ball": {"velocity": [40.0, 0.0, 0.0]}}, record_every=100)
    with pytest.raises(
        eomgen.UsageError, match=r"at: a body turns by [\d.]+ rad between two rows at t = .* try: a smaller"
    ):
        fast.at(0.05)
    with pytest.raises(eomgen.UsageError, match="interpolation_error: seven rows are needed, not 2"):
        pendulum().simulate(0.01, 0.01).interpolation_error()


def test_two_rows_are_enough_and_one_gives_its_own_time_alone() -> None:
    """The cubic of Hermite through two rows is q = t^3 itself."""
    t = np.array([1.0, 3.0])
    column = t[:, np.newaxis]
    rows = Rows(t, column**3, 3.0 * column**2, 6.0 * column, np.zeros((2, 0)))
    metadata = {"factors": [("R", 0, 1, 0, 1)]}
    found = state_at(rows, metadata, np.array([1.0, 1.5, 2.9, 3.0]))
    assert found.q[:, 0] == pytest.approx(np.array([1.0, 1.5, 2.9, 3.0]) ** 3, rel=1e-14)
    one = Rows(*(array[:1] for array in rows))
    assert state_at(one, metadata, 1.0).q == pytest.approx([1.0])
    with pytest.raises(eomgen.UsageError, match="the solution has 1 row, two are needed; try: a run that made a step"):
        state_at(one, metadata, 1.5)


@pytest.mark.slow_except("R-rk4", "R-generalized_alpha")
@pytest.mark.parametrize("method", ["rk4", "generalized_alpha"])
@pytest.mark.parametrize("build", [pendulum, flyer, absolute, free_in_space], ids=["R", "mixed", "SE3", "R3xSO3"])
def test_runs_keep_their_order_between_rows(build: Any, method: str) -> None:
    model, explicit = build(), method == "rk4"
    if explicit and model.multipliers:
        method = "rk4_partitioned"
    exact = model.simulate(0.4, 2e-4, method="rk4_partitioned" if model.multipliers else "rk4")
    steps = [0.02, 0.01, 0.005] if explicit else [0.004, 0.002, 0.001]
    found = slopes(steps, [errors_of(model, step, exact, method=method) for step in steps])
    assert found == pytest.approx(4.0, abs=0.4) if explicit else found == pytest.approx(2.0, abs=0.15)
