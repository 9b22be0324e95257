"""What Python does around a run: budgets of its calls, and what is evaluated only when it is asked for."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType

import numpy as np
import pytest

import eomgen
from eomgen.compiled.functions import Functions
from eomgen.simulation.stepping.stepper import Stepper

pytestmark = pytest.mark.slow

EXAMPLES = Path(__file__).parents[2] / "examples"
#: Attributes of a solution that are evaluated when they are asked for.
LATER = ("outputs", "energy", "stats", "findings", "message", "success", "metadata", "error")


@pytest.fixture(autouse=True)
def _steady_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Compile constructors of dataclasses at their first instance, as after fifty instances: budgets are of a process
    with many runs. Parts of a run do not become shorter on a busy machine."""
    monkeypatch.setattr("eomgen.base.data._MOST_FILLED", 0)
    monkeypatch.setattr("eomgen.simulation.stepping.chunks.CHUNK_SECONDS", 1e9)


def model_of(name: str, method: str = "rk4") -> eomgen.Model:
    return eomgen.build(EXAMPLES / name / "scene.toml", method=method)


def calls(work: Callable[[], object]) -> int:
    """Return how many Python functions are called, the least of three tries."""
    return min(_calls(work) for _ in range(3))


def _calls(work: Callable[[], object]) -> int:
    count = 0

    def counted(frame: FrameType, event: str, argument: object) -> None:
        nonlocal count
        count += event == "call"

    before = sys.getprofile()
    sys.setprofile(counted)
    try:
        work()
    finally:
        sys.setprofile(before)
    return count


@pytest.mark.parametrize(
    ("name", "method", "budget"),
    [
        ("symmetric_top", "taylor", 110),
        ("symmetric_top", "rk4", 105),
        ("symmetric_top", "generalized_alpha", 105),
        ("robot_arm", "rk4", 110),  # with inputs, as rows
    ],
)
def test_a_run_whose_last_state_is_read_costs_few_calls(name: str, method: str, budget: int) -> None:
    model = model_of(name, method)
    step = 0.1 * model.library.layout["defaults"]["step"]

    def run() -> None:
        assert np.isfinite(model.simulate(10 * step, step).q[-1]).all()

    run()  # what is kept for the next one
    assert calls(run) <= budget


@pytest.mark.parametrize(
    ("name", "method", "success", "message", "with_estimate"),
    [
        ("symmetric_top", "taylor", 301, 653, 1530),
        ("symmetric_top", "rk4", 329, 681, 2595),
        ("robot_arm", "generalized_alpha", 325, 688, 2835),
        ("four_bar", "generalized_alpha", 438, 842, 3350),  # 5 ask for options without an effect
    ],
)
def test_the_judgement_of_a_run_costs_few_calls(
    name: str, method: str, success: int, message: int, with_estimate: int
) -> None:
    model = model_of(name, method)
    step = 0.1 * model.library.layout["defaults"]["step"]
    asked: tuple[tuple[Callable[[], object], int], ...] = (
        (lambda: model.simulate(10 * step, step).success, success),
        (lambda: model.simulate(10 * step, step, error_estimate=False).message, message),
        (lambda: model.simulate(10 * step, step).message, with_estimate),
    )
    for work, budget in asked:
        work()  # what is kept for the next one
        assert calls(work) <= budget


def test_inputs_that_are_numbers_cost_few_calls_and_are_rows_of_them() -> None:
    model = model_of("robot_arm", "generalized_alpha")
    given = {name: 0.1 * k for k, name in enumerate(model.inputs)}
    tables = {name: np.full(11, value) for name, value in given.items()}
    np.testing.assert_array_equal(
        model.simulate(0.01, 1e-3, inputs=given).q, model.simulate(0.01, 1e-3, inputs=tables).q
    )
    assert calls(lambda: model.simulate(0.01, 1e-3, inputs=given)) <= 182


@pytest.mark.parametrize("option", [{"t_start": 0.3}, {"method": "generalized_alpha"}])
def test_other_times_and_methods_cost_as_little_at_the_second_call(option: dict[str, float | str]) -> None:
    model = model_of("symmetric_top", "rk4")
    start = float(option.get("t_start", 0.0))
    model.simulate(start + 0.01, 1e-3, **option)
    assert calls(lambda: model.simulate(start + 0.01, 1e-3, **option)) <= 104
    assert calls(lambda: model.simulate(start + 0.02, 5e-4, **option)) <= 167  # a grid that was not seen before


def test_what_nobody_asks_for_is_not_evaluated(monkeypatch: pytest.MonkeyPatch) -> None:
    model, evaluated, runs = model_of("symmetric_top"), [], []
    evaluate, step = Functions.__call__, Stepper.run

    def called(functions: Functions, name: str, blocks: object) -> object:
        evaluated.append(name)
        return evaluate(functions, name, blocks)  # type: ignore[arg-type]

    def stepped(stepper: Stepper, steps: int, *rest: object) -> object:
        runs.append(steps)
        return step(stepper, steps, *rest)  # type: ignore[arg-type]

    model.simulate(0.05, 1e-3)
    monkeypatch.setattr(Functions, "__call__", called)
    monkeypatch.setattr(Stepper, "run", stepped)
    run = model.simulate(0.05, 1e-3)
    assert sum(runs) == 50 and not evaluated
    assert run.energy["total"].shape == (51,) and evaluated == ["energy"] and sum(runs) == 50
    assert run.success and sum(runs) == 50  # the judgement needs no comparison runs, the message does
    assert "reached t = 0.05 s" in run.message
    assert sum(runs) == 50 + 25 + 13
    before = len(evaluated), len(runs)
    assert run.error.available and run.metadata["energy_balance"] and run.stats["energy_error"] < 1e-6
    assert (len(evaluated), len(runs)) == before  # all of it once
    assert evaluated.count("energy") == 1  # for the balance, and for the size of errors of energies


@pytest.mark.parametrize(
    ("name", "method", "end"),
    [
        ("symmetric_top", "taylor", 0.5),
        ("robot_arm", "rk4", 0.2),
        ("four_bar", "generalized_alpha", 0.2),
        ("quarter_car", "generalized_alpha", 1.0),
        ("bouncing_ball", "rk4", 1.0),
        ("free_spinning_body", "rk4", 0.0305),  # with a last step that is shorter
    ],
)
@pytest.mark.parametrize("every", [1, 7])
def test_what_is_evaluated_later_is_what_is_evaluated_at_once(name: str, method: str, end: float, every: int) -> None:
    model = model_of(name, method)
    later = model.simulate(end, 2e-3, record_every=every)
    at_once = model.simulate(end, 2e-3, record_every=every, progress=lambda done, steps: None)
    assert not set(LATER) & set(vars(later)) or name == "bouncing_ball"
    assert set(LATER) <= set(vars(at_once))
    np.testing.assert_array_equal(later.q, at_once.q)
    assert later.success == at_once.success and later.message == at_once.message
    assert later.findings == at_once.findings
    # the last three depend on the pieces of a run: rounding is related to the forces of a piece
    of_time = ("wall_time", "max_constraint", "max_rounding", "max_impulse_rate")
    known = ({key: value for key, value in run.stats.items() if key not in of_time} for run in (later, at_once))
    assert next(known) == next(known)
    assert max(run.stats.get("max_constraint", 0.0) for run in (later, at_once)) < 1e-13
    assert later.metadata == at_once.metadata
    for group in ("outputs", "energy"):
        mine, other = getattr(later, group), getattr(at_once, group)
        assert list(mine) == list(other)
        for key, values in mine.items():
            np.testing.assert_array_equal(values, other[key])
    np.testing.assert_array_equal(later.error.q, at_once.error.q)
    assert later.error.relative == at_once.error.relative
    assert "_evaluated" not in vars(later)  # what it was evaluated from is not kept


def test_states_that_a_caller_writes_to_are_not_those_that_are_judged() -> None:
    model = model_of("symmetric_top")
    run, other = (model.simulate(0.05, 1e-3) for _ in range(2))
    for name in ("t", "q", "v", "a", "multipliers", "z"):
        getattr(run, name)[:] = 100.0
    for name, values in other.energy.items():
        np.testing.assert_array_equal(run.energy[name], values)
    for name, values in other.outputs.items():
        np.testing.assert_array_equal(run.outputs[name], values)
    assert run.message == other.message and run.error.relative == other.error.relative
