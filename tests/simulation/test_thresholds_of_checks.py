"""Both sides of thresholds of the judgement of a run: a number at one says nothing, the next one does."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from eomgen.results.error_estimate import ErrorEstimate, LargestError
from eomgen.simulation.judgement import beams, failures, instability, invariants, stated_errors
from eomgen.simulation.judgement.finished_run import FinishedRun
from eomgen.simulation.judgement.invariants import EnergyBalance, Violation, energy_balance

ESTIMATE = ErrorEstimate(
    available=True, t=np.array([0.0, 0.5, 1.0]), relative_at=np.array([0.0, 0.05, 0.2]), relative=0.2, order=2.0,
    declared_order=2.0, increment_at=np.zeros((1, 1)), z_at=np.zeros((1, 0)),
)  # fmt: skip  # three lines


def largest(share: float, name: str = "q.hinge") -> LargestError:
    return LargestError(name, 0.1, "rad", 0.5, share)


def run_of(**values: Any) -> FinishedRun:
    """Return a run with the given quantities alone."""
    return cast(FinishedRun, SimpleNamespace(**values))


def noticed(**values: Any) -> object:
    return stated_errors.noticed_error(replace(ESTIMATE, **values))


def off_by(violation: float, check: Callable[[FinishedRun], Any]) -> bool:
    run = run_of(violation=Violation(violation, "the constraint pin is off", 0.5), run=METHOD, single=False)
    run = run_of(**vars(run), longest_part=0.01)
    return bool([*check(run)])


METHOD = SimpleNamespace(method=SimpleNamespace(chooses_steps=False), model=SimpleNamespace(nv=1), name="rk4")


def halved(relative: float) -> int:
    return stated_errors._halvings(run_of(statistics={"halvings": 2}, error=replace(ESTIMATE, relative=relative)))


def with_balance(error: float) -> FinishedRun:
    return run_of(balance=EnergyBalance(error), run=METHOD, single=False, longest_part=0.01)


HUNDREDTH = math.nextafter(0.01, 0.0)


#: Thresholds, and what says whether a number beyond is told.
ABOUT: dict[str, tuple[float, Callable[[float], object]]] = {
    "error": (stated_errors.DOUBTFUL_ERROR, lambda x: noticed(relative=x, largest=largest(x))),
    "error of an output": (stated_errors.DOUBTFUL_ERROR, lambda x: noticed(relative=0.0, largest_output=largest(x))),
    "balance": (invariants.REPORTED_ENERGY, lambda x: [*stated_errors._energy_balance(with_balance(x))]),
    "gain": (0.49, lambda x: stated_errors._energy_gained(run_of(balance=EnergyBalance(x, gain=x), conservative=True))),
    "broken constraint": (1e-3, lambda x: off_by(x, failures._broken_constraint)),
    "violated constraint": (1e-3, lambda x: not off_by(x, stated_errors._constraint_violation)),
    "halvings": (HUNDREDTH, lambda x: halved(x) > 0),
}


@pytest.mark.parametrize("kind", ABOUT)
def test_a_number_at_its_threshold_says_nothing_and_the_next_one_does(kind: str) -> None:
    threshold, told = ABOUT[kind]
    assert not told(threshold)
    assert told(math.nextafter(threshold, math.inf) + 1e-15)


def test_the_estimated_error_of_a_run_says_since_when_it_is_large() -> None:
    error = replace(ESTIMATE, largest=largest(0.2))
    run = run_of(error=error, run=run_with_states(), single=False, longest_part=0.01, statistics={}, settings={})
    (found,) = stated_errors._discretisation_error(run)
    assert found.text.endswith(", above 10 % from t = 1 s on") and found.time == 0.5 and found.value == 0.2
    assert found.hint == "a step smaller than 0.0022 s"  # 0.01 sqrt(0.01/0.2)
    (found,) = stated_errors._discretisation_error(run_of(**{**vars(run), "error": replace(error, relative=0.08)}))
    assert "above" not in found.text


def run_with_states(**values: Any) -> SimpleNamespace:
    model = SimpleNamespace(z_names=(), description=SimpleNamespace(states=()), nv=1, **values)
    return SimpleNamespace(method=SimpleNamespace(chooses_steps=False), model=model)


@pytest.mark.parametrize(
    ("share", "order", "hint"),
    [
        (0.01, 2.0, ""),
        (0.0101, 2.0, "a step smaller than 0.01 s"),
        (0.5, 2.0, "a step smaller than 0.0014 s"),
        (0.51, 2.0, "a step much smaller than 0.01 s, or a run to t = 1 s"),
        (0.51, -1.04, "a step of 0.001 s or less (half the step does not help), or a run to t = 1 s"),
    ],
)
def test_the_step_in_a_hint_follows_the_order_up_to_half_the_motion(share: float, order: float, hint: str) -> None:
    error = replace(ESTIMATE, relative=share, largest=largest(share), order=order)
    run = run_of(error=error, run=run_with_states(), single=False, longest_part=0.01, statistics={})
    assert error.largest is not None
    assert stated_errors._refinement(run, error.largest) == hint


@pytest.mark.parametrize(
    ("order", "declared", "told"),
    [(1.98, 2.0, "order 1.98 of 2, "), (0.97, 4.0, "order 0.97 of 4, "), (17.98, 4.0, ""), (-1.04, 2.0, "")],
)
def test_orders_that_are_none_are_not_told(order: float, declared: float, told: str) -> None:
    error = replace(ESTIMATE, order=order, declared_order=declared, method="runs", seconds=1.0)
    assert error.evidence == f"{told}by runs, in 1 s"


@pytest.mark.parametrize(("error", "quanta"), [(5.9, True), (6.0, False), (0.0, False)])
def test_errors_of_few_quanta_are_rounding_of_sampled_states(error: float, quanta: bool) -> None:
    state = SimpleNamespace(name="level", sampling=SimpleNamespace(quantum=0.5))
    model = SimpleNamespace(z_names=("z.level",), description=SimpleNamespace(states=(state,)))
    estimate = replace(ESTIMATE, z_at=np.array([[0.5 * error]]))
    run = run_of(error=estimate, run=SimpleNamespace(model=model))
    assert stated_errors._rounded_states(run) == (["level"] if quanta else [])


def turning(*angles: float) -> Any:
    """Return a model of a beam of two elements, the second of which turns by the angles, rad, row by row."""

    def pose(angle: float) -> list[float]:
        return [math.cos(angle / 2.0), 0.0, 0.0, math.sin(angle / 2.0), 0.0, 0.0, 0.0]

    poses = np.array([[pose(0.0), pose(0.0), pose(angle)] for angle in angles])
    return SimpleNamespace(
        description=SimpleNamespace(exact_beams=(("arm", "arm.1", "arm.2"),)), functions=("poses",),
        bodies=("arm", "arm.1", "arm.2"), evaluate=lambda name, q, **_: {"pose": poses[: len(q)]},
    )  # fmt: skip  # two lines


@pytest.mark.parametrize(
    ("angles", "told"), [((3.0, 3.2), True), ((3.0, 3.1), False), ((1.0, 4.0), False), ((1.8, 3.2), True)]
)
def test_elements_that_pass_half_a_turn_are_told_by_number_and_row(angles: tuple[float, ...], told: bool) -> None:
    model, t = turning(0.5, *angles), np.array([0.0, 0.1, 0.2])
    found = beams.turned_elements(model, t, np.zeros((3, 1)), np.zeros(0))
    assert (found is not None) == told
    if found is not None:
        assert found.time == 0.2 and found.hint == "elements = 4, which turn less each"
        assert found.text.startswith("element 2 of the beam arm turns by more than half a turn at t = 0.2 s")


@pytest.mark.parametrize(
    ("change", "velocity", "rest"),
    [(0.9e-9, 0.9e-12, True), (1.1e-9, 0.9e-12, False), (0.0, 0.9e-9, True), (0.0, 1.1e-9, False)],
)
def test_rest_is_told_from_travel_and_from_changes_between_rows(change: float, velocity: float, rest: bool) -> None:
    model = SimpleNamespace(nq=1, nv=1, nz=0, q_units=("rad",), v_units=("rad/s",))
    rows = np.array([[0.0, 1.0, velocity, 0.0], [1.0, 1.0 + change, velocity, 0.0]])
    assert instability.at_rest(cast(Any, SimpleNamespace(model=model)), rows) == rest


ENERGY = ("kinetic", "potential", "total", "power", "base_power")


def energies(total: list[float], power: float = 0.0) -> dict[str, Any]:
    values = np.array(total)
    zero = np.zeros_like(values)
    return dict(zip(ENERGY, (values, zero, values, zero + power, zero), strict=True))


@pytest.mark.parametrize(("jumps", "known"), [((0.5, 1.5), True), ((0.5, 1.5, 2.5), False)])
def test_work_is_known_if_half_of_the_time_is(jumps: tuple[float, ...], known: bool) -> None:
    """Of five intervals of 1 s those without a jump: three, or two."""
    t = np.arange(6.0)
    balance = energy_balance(t, energies([1.0, 1.0, 1.0, 1.0, 1.0, 1.1]), jumps)
    assert (balance.error is not None) == known
    if known:
        assert balance.error == pytest.approx(0.1 / 1.1)


def test_an_imbalance_of_few_intervals_is_a_pulse_between_rows() -> None:
    t = np.arange(30.0)
    step = np.where(t < 10.0, 1.0, 1.2)
    assert energy_balance(t, energies(step.tolist()), sparse=True).unknown == invariants.APART
    assert energy_balance(t, energies(step.tolist())).error == pytest.approx(0.2 / 1.2)
    drift = 1.0 + 0.2 * t / 29.0
    assert energy_balance(t, energies(drift.tolist()), sparse=True).error == pytest.approx(0.2 / 1.2)
    # one of 20 intervals is not few yet
    assert invariants._is_pulse(np.array([0.0] * 11 + [1.0] * 10)) is False
    assert invariants._is_pulse(np.array([0.0] * 11 + [1.0] * 11)) is True
