"""States between rows: orders on every group, smoothness across steps, outputs, and what is refused."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.lie import product
from tests.runtime.scenes import absolute, flyer, flyer_scene, pendulum

TIMES = np.linspace(0.013, 0.387, 29)


def free_in_space() -> eomgen.Model:
    """Return the flyer in absolute coordinates on R^3 x SO(3)."""
    scene = flyer_scene()
    groups = {body.name: "R3xSO3" for body in scene.bodies}
    content = scene.content + b"absolute on R3xSO3"
    return eomgen.build(replace(scene, name="in_space", coordinates="absolute", groups=groups, content=content), profile="quick")


def errors_of(model: eomgen.Model, step: float, exact: eomgen.Solution, every: int = 1, **options: object) -> np.ndarray:
    found = model.simulate(0.4, step, record_every=every, **options).at(TIMES)
    known = exact.at(TIMES)
    off = (product.difference(model.factors, known.q, found.q), found.v - known.v, found.a - known.a)
    return np.array([np.abs(x).max() for x in off])


def slopes(steps: list[float], errors: list[np.ndarray]) -> np.ndarray:
    return np.polyfit(np.log(steps), np.log(errors), 1)[0]


@pytest.mark.parametrize("build", [pendulum, flyer], ids=["R", "SE3, SO3 and R"])
def test_explicit_runs_keep_order_four_between_rows(build) -> None:
    model = build()
    exact = model.simulate(0.4, 2e-4, method="rk4")
    steps = [0.02, 0.01, 0.005]
    found = slopes(steps, [errors_of(model, step, exact, method="rk4") for step in steps])
    assert found == pytest.approx(4.0, abs=0.2)


@pytest.mark.parametrize("build", [pendulum, flyer], ids=["R", "SE3, SO3 and R"])
def test_generalized_alpha_keeps_order_two_between_rows(build) -> None:
    model = build()
    exact = model.simulate(0.4, 2e-4, method="rk4")
    steps = [0.004, 0.002, 0.001]
    found = slopes(steps, [errors_of(model, step, exact) for step in steps])
    assert found == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize("build", [absolute, free_in_space], ids=["SE3", "R3xSO3"])
def test_constrained_runs_keep_order_two_and_almost_the_constraints(build) -> None:
    model = build()
    exact = model.simulate(0.4, 2e-4, method="rk4_partitioned")
    steps = [0.004, 0.002, 0.001]
    found = slopes(steps, [errors_of(model, step, exact) for step in steps])
    assert found == pytest.approx(2.0, abs=0.15)
    violations = []
    for step in steps:
        state = model.simulate(0.4, step).at(TIMES)
        violations.append(np.abs(model.evaluate("constraint", state.q, t=state.t)["Phi"]).max())
    assert violations[0] < 1e-6
    assert np.polyfit(np.log(steps), np.log(violations), 1)[0] > 2.5


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


def test_outputs_follow_from_states() -> None:
    model = pendulum()
    run, exact = model.simulate(0.4, 0.01, method="rk4"), model.simulate(0.4, 1e-4, method="rk4")
    state = run.at(TIMES)
    tip = model.outputs(state.q, state.v, state.a, state.t)["tip"]
    known = exact.at(TIMES)
    np.testing.assert_allclose(tip, model.point("link", [0, 0, -1.0], known.q, known.v, known.t).position, atol=3e-8)


def test_a_stored_solution_is_as_dense(tmp_path: Path) -> None:
    run = flyer().simulate(0.05, 0.01)
    again = eomgen.Solution.load(run.save(tmp_path / "solution.npz"))
    assert np.array_equal(again.at([0.017, 0.031]).q, run.at([0.017, 0.031]).q)


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
        pendulum().simulate(0.0, 0.01).at(0.0)
    bare = replace(run, metadata={})
    with pytest.raises(eomgen.UsageError, match="does not say which groups its coordinates are of"):
        bare.at(0.01)
    fast = flyer().simulate(1.0, 1e-3, initial={"ball": {"velocity": [40.0, 0.0, 0.0]}}, record_every=100)
    with pytest.raises(eomgen.UsageError, match=r"at: a body turns by [\d.]+ rad between two rows at t = .* try: a smaller"):
        fast.at(0.05)
    with pytest.raises(eomgen.UsageError, match="interpolation_error: seven rows are needed, not 2"):
        pendulum().simulate(0.01, 0.01).interpolation_error()
