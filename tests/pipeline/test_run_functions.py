"""Models that are built for runs alone: fewer functions, the same bits and messages, and nothing that a run misses."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.cli import main
from eomgen.compiled.equations import has_residual_partials, residual_partials
from eomgen.pipeline.documents import load
from eomgen.pipeline.pipeline import build_in, derive
from tests.models.library import scene

NAMES = "robot_arm active_quarter_car four_bar pi_servo bouncing_ball pendulum_on_shaking_base elastic_slider_crank"
ARM, QUARTER, FOUR_BAR, SERVO, BALL, SHAKEN, SLIDER = (f"examples/{name}/scene.toml" for name in NAMES.split())


def of_run(data: Any, method: str | None = None, start: str = "initial") -> eomgen.Model:
    return build_in(None, data, None, method, "quick", start=start)


@pytest.mark.slow
def test_functions_that_runs_do_not_call_are_left_out() -> None:
    explicit, implicit = of_run(ARM, "rk4"), of_run(ARM)
    assert explicit.terms == ("mass", "force", "forward_dynamics", "poses", "outputs", "energy")
    assert set(implicit.terms) == {*explicit.terms, "residual", "partials"}
    left_out = set(eomgen.build(ARM, profile="quick").terms) - set(implicit.terms)
    assert left_out == {"coupling", "inverse_dynamics", "twists"}


#: Additions and multiplications in all functions of a model, and in those that its runs call. They may only fall.
BUDGETS = {
    (ARM, "rk4"): (7281, 2345),
    (ARM, "generalized_alpha"): (7281, 6021),
    (FOUR_BAR, "generalized_alpha"): (1225, 939),
    (SERVO, "rk4"): (138, 71),
}


@pytest.mark.slow_except("examples/pi_servo/scene.toml-rk4")
@pytest.mark.parametrize(("path", "method"), BUDGETS)
def test_operations_in_the_functions_of_a_run(path: str, method: str) -> None:
    system, model = derive(load(path)), of_run(path, method)
    found = tuple(
        sum(system.counts[name].flops for name in names) for names in (system.functions, model.functions.names)
    )
    assert found == BUDGETS[path, method]


@pytest.mark.slow_cases("examples/pi_servo/scene.toml")
@pytest.mark.parametrize("path", [SERVO, *(pytest.param(path, marks=pytest.mark.slow) for path in (FOUR_BAR, SLIDER))])
def test_partials_of_runs_come_from_nonzeros_alone_if_steps_take_these(path: str) -> None:
    data = load(path)
    whole, short = eomgen.build(data, ["partials"], profile="quick"), of_run(data, "generalized_alpha")
    assert "iteration" in short.functions
    assert "partials" not in short.functions
    assert has_residual_partials(short)
    random = np.random.default_rng(2)
    for _ in range(3):
        q, v, a = whole.initial_q, random.normal(size=whole.nv), random.normal(size=whole.nv)
        given = {"z": random.normal(size=whole.nz)} if whole.nz else {}
        if whole.multipliers:
            given["multipliers"] = random.normal(size=len(whole.multipliers))
        known = whole.partials(q, v, a, 0.3, **given)
        for matrix, other in zip(known, residual_partials(short, q, v, a, 0.3, **given), strict=True):
            np.testing.assert_allclose(other, matrix, rtol=1e-12, atol=1e-12 * max(1.0, np.abs(matrix).max()))


@pytest.mark.slow_except("examples/pi_servo/scene.toml-rk4-50")
@pytest.mark.parametrize(
    ("path", "method", "steps"),
    [
        (ARM, "rk4", 50),
        (ARM, "generalized_alpha", 50),
        (SHAKEN, "rk45", 50),
        (FOUR_BAR, "generalized_alpha", 50),
        (FOUR_BAR, "rk4_partitioned", 50),
        (SERVO, "generalized_alpha", 50),
        (SERVO, "rk4", 50),
        (BALL, "taylor", 400),
    ],
)
def test_a_run_is_the_same_to_the_bit_and_says_the_same(path: str, method: str, steps: int) -> None:
    data = load(path)
    whole, short = eomgen.build(data, method=method, profile="quick"), of_run(data, method)
    assert set(short.terms) < set(whole.terms)
    end = steps * data.simulation.step
    one, other = (model.simulate(end, method=method) for model in (whole, short))
    assert other.message == one.message
    assert other.metadata == one.metadata
    for name, column in one.columns().items():
        np.testing.assert_array_equal(other.columns()[name], column, err_msg=name)
    timed = ("seconds", "cost")
    found, known = ({k: v for k, v in run.error.summary().items() if k not in timed} for run in (other, one))
    assert found == known
    for body, poses in one.poses.items():
        np.testing.assert_array_equal(other.poses[body], poses)


@pytest.mark.slow
def test_a_run_from_equilibrium_has_what_finds_it() -> None:
    whole = eomgen.build(QUARTER, profile="quick").simulate(0.05, start="equilibrium")
    short = of_run(QUARTER, start="equilibrium").simulate(0.05, start="equilibrium")
    assert short.message == whole.message
    np.testing.assert_array_equal(short.q, whole.q)


@pytest.mark.slow
def test_damping_too_fast_for_an_explicit_step_is_found_without_partials() -> None:
    data = scene("oscillator", joints__slide__damping=3000.0)
    whole, short = eomgen.build(data, method="rk4", profile="quick"), of_run(data, "rk4")
    assert "partials" in whole.functions
    assert "partials" not in short.functions
    said = "damping or friction of slide decays at up to 3e+03 1/s at t = 0 s, too fast for an explicit method"
    for model in (whole, short):
        assert said in model.simulate(1e-3, 1e-3).message
        assert "too fast" not in model.simulate(1e-3, 1e-5).message


@pytest.mark.slow
def test_solutions_and_checkpoints_belong_to_the_scene_and_not_to_the_functions_that_were_built(tmp_path: Path) -> None:
    whole, short, file = eomgen.build(ARM, profile="quick"), of_run(ARM), tmp_path / "run.ckpt"
    one = whole.simulate(0.06, error_estimate=False)
    first = short.simulate(0.03, checkpoint=file, error_estimate=False)
    rest = whole.resume(file, 0.06, error_estimate=False)
    assert np.array_equal(first.followed_by(rest).q, one.q)
    stored = eomgen.Solution.load(first.save(tmp_path / "first.npz"))
    again = whole.attach(stored)
    assert sorted(again.outputs_at(0.015)) == sorted(first.outputs)
    first = whole.simulate(0.03, method="rk4", checkpoint=file, error_estimate=False)
    of_others = of_run(ARM, "rk4").resume(file, 0.06, error_estimate=False)
    assert np.array_equal(first.followed_by(of_others).q, whole.simulate(0.06, method="rk4", error_estimate=False).q)


def test_the_verb_builds_what_the_run_calls(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[tuple[str, ...]] = []
    simulate = eomgen.Model.simulate

    def watched(model: eomgen.Model, *given: Any, **options: Any) -> eomgen.Solution:
        made.append(model.terms)
        return simulate(model, *given, **options)

    monkeypatch.setattr(eomgen.Model, "simulate", watched)
    words = [SERVO, "--out", str(tmp_path), "--no-plots", "--t-end", "0.01", "--no-error-estimate"]
    assert main(["simulate", *words, "--method", "rk4"]) == 0
    (terms,) = made
    assert "coupling" not in terms
    assert "partials" not in terms
