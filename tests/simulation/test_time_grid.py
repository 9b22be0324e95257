"""The times of runs: they end where they are told to, time moves on in every step, and waves are slower than steps."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.errors import UsageError
from eomgen.pipeline.model import Model
from eomgen.simulation.stepping.inputs import InputSignals
from eomgen.simulation.stepping.time_grid import time_grid
from tests.models.library import scene
from tests.simulation.rails import built, on_rail


@cache
def pendulum() -> Model:
    """Return a driven pendulum with an input from outside."""
    driven = {"inputs": {"push": {}, "beat": {"formula": "sin(3 * t)"}}, "joints__hinge__initial": {"position": 1.0}}
    effort = {"e": {"joint": "hinge", "effort": "push + beat"}}
    return eomgen.build(scene("pendulum", bodies__rod__inertia=[0.1, 0.1, 0.1], efforts=effort, **driven))


METHODS = ("generalized_alpha", "rk4", "taylor")


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("end", "step", "steps"), [(0.0105, 1e-3, 11), (0.05, 0.1, 1), (0.1, 0.03, 4), (0.3, 0.1, 3)])
def test_a_run_ends_where_it_is_told_to(method: str, end: float, step: float, steps: int) -> None:
    solution = pendulum().simulate(end, step, method=method, inputs={"push": 0.5})
    assert solution.success and solution.stats["steps"] == steps
    assert solution.message.startswith(f"reached t = {end:.9g} s in {steps} steps")
    assert len(solution.t) == steps + 1
    assert solution.t[-1] == end if steps != 3 else solution.t[-1] == pytest.approx(end, abs=1e-16)
    assert np.array_equal(solution.t[:-1], step * np.arange(steps))
    assert pendulum().simulate(end, step, method=method, inputs={"push": 0.5}, record_every=7).t[-1] == solution.t[-1]


@pytest.mark.slow
@pytest.mark.parametrize(("method", "order"), [("generalized_alpha", 2), ("rk4", 4)])
def test_the_shortened_step_keeps_the_order(method: str, order: int) -> None:
    end, errors = 1.0, []
    exact = pendulum().simulate(end, 1e-3, method="taylor", tolerance=1e-14, inputs={"push": 0.5})
    for step in (0.03, 0.015, 0.0075):  # the last step is a third of the others
        solution = pendulum().simulate(end, step, method=method, inputs={"push": 0.5})
        assert solution.t[-1] == end
        errors.append(
            np.abs([solution.q[-1] - exact.q[-1], solution.v[-1] - exact.v[-1], solution.a[-1] - exact.a[-1]]).max()
        )
    assert np.log2(errors[0] / errors[2]) / 2.0 == pytest.approx(order, abs=0.25)


def test_a_checkpoint_of_a_run_with_a_shortened_step_goes_on_with_the_grid(tmp_path: Path) -> None:
    file, model = tmp_path / "run.ckpt", pendulum()
    first = model.simulate(0.0105, 1e-3, inputs={"push": 0.5}, checkpoint=file)
    again = model.resume(file)
    assert again.t.tolist() == [0.01, 0.0105] and np.array_equal(again.q[-1], first.q[-1])
    with pytest.raises(UsageError, match=r"the end 0.0095 s lies before the checkpoint's time 0.01 s"):
        model.resume(file, 0.0095)
    later = model.resume(file, 0.0203)
    whole = model.simulate(0.0203, 1e-3, inputs={"push": 0.5})
    both = first.followed_by(later)
    assert np.array_equal(both.t, whole.t) and np.array_equal(both.q, whole.q) and np.array_equal(both.a, whole.a)


@pytest.mark.parametrize(
    ("start", "step", "apart"), [(1e17, 0.5, "16"), (1e9, 1e-8, "1.19e-07"), (-1e9, 1e-8, "1.19e-07")]
)
def test_a_step_in_which_time_cannot_move_on_is_refused(start: float, step: float, apart: str) -> None:
    with pytest.raises(UsageError) as refused:
        pendulum().simulate(start + 32 * step + 64.0, step, t_start=start, inputs={"push": 0.0})
    latest = max(start, start + 32 * step + 64.0, key=abs)
    said = f"step: at t = {latest:.9g} s neighbouring numbers differ by {apart} s, too much for a step of {step:.3g} s"
    assert said in str(refused.value)
    assert "or times nearer to 0, with formulas of time shifted by as much" in str(refused.value)


def test_steps_that_are_not_refused_have_different_times() -> None:
    for start in (0.0, 1.0, -3.7e3, 1.7e9, 4.5e15):
        step = 16 * np.spacing(abs(start) + 1.0)
        grid = time_grid(start, start + 100.5 * step, step)
        times = np.append(start + step * np.arange(grid.whole + 1), grid.end)
        assert np.all(np.diff(times) > 0.4 * step) and grid.steps == 101


@pytest.mark.parametrize("latest", [1.5, 1e6, -1e6, 1e12])
def test_sixteen_neighbouring_numbers_are_the_shortest_step(latest: float) -> None:
    apart = abs(float(np.spacing(latest)))
    begin, end = sorted((latest, latest - np.sign(latest) * 1e4 * apart))
    assert time_grid(begin, end, 16.0 * apart).steps == 625
    with pytest.raises(UsageError, match="neighbouring numbers differ by"):
        time_grid(begin, end, 15.9 * apart)


def test_a_float_stepper_has_the_time_of_float() -> None:
    with pytest.raises(UsageError, match=r"at t = 10000 s neighbouring numbers differ by 0.000977 s, too much for"):
        time_grid(0.0, 1e4, 1e-3, "float")
    assert time_grid(0.0, 1e4, 1e-3).steps == 10_000_000


def fast_wave(period: float) -> Model:
    return built(on_rail("u").input("u", wave={"shape": "square", "period": period}))


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_waves_much_faster_than_the_step_are_refused_before_the_run(method: str) -> None:
    model = fast_wave(1e-12)
    with pytest.raises(UsageError) as refused:
        model.simulate(1e-3, 1e-3, method=method)
    assert str(refused.value) == (
        "usage error: step: forces jump 2e+09 times within a step of 0.001 s, in waves of 1e-12 s; try: a step of"
        " 5e-09 s or less with a larger record_every, or a longer period of the wave"
    )
    with pytest.raises(UsageError, match=r"there are 2e\+09 such times from 0 s to 0.001 s, in waves of 1e-12 s"):
        model.discontinuity_times(0.0, 1e-3)
    assert len(model.discontinuity_times(0.0, 1e-9)) == 2001


@pytest.mark.slow
def test_a_run_with_very_many_jumps_lists_none_of_them() -> None:
    model = fast_wave(1e-6)
    solution = model.simulate(1.0, 2e-3, method="rk4")
    assert solution.success and solution.v[-1, 0] == pytest.approx(0.5, abs=1e-9)


def test_a_stepper_evaluates_the_inputs_that_are_not_given() -> None:
    """Numbers, functions of t and samples of a caller are handed over; NaN stands for the formulas of the scene."""
    times = np.array([0.0, 0.25, 0.5])
    given = {"number": 3.0, "function": lambda t: t * t, "table": np.array([1.0, 2.0, 4.0])}
    signals = InputSignals(("road", *given), given, lambda at: np.full((len(at), 4), 7.0), 0.25, left_to_stepper=True)
    expected = np.column_stack([np.full(3, np.nan), np.full(3, 3.0), times**2, [1.0, 2.0, 4.0]])
    np.testing.assert_array_equal(signals.table(times), expected)
    np.testing.assert_array_equal(signals.rows(times)[:, 0], 7.0)
