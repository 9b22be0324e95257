"""One measure of a run's quality: studies have the errors and the findings of runs."""

from __future__ import annotations

from collections.abc import Callable

import pytest

import eomgen
from eomgen.products.studies.ladders.study import extremes
from eomgen.products.studies.savings import savings
from eomgen.products.studies.work_precision.formulations import formulations
from eomgen.products.studies.work_precision.running import Runner, tuning_grid
from tests.models.doubtful_scenes import END, METHOD, STEP, UNRESOLVED, oscillator, share_of_state, stuck


@pytest.mark.slow
def test_the_error_of_an_internal_state_is_that_of_a_run() -> None:
    study = eomgen.tradeoff(oscillator(), methods=[METHOD], steps=[STEP], axes=["method"], budget=20.0)
    found = max(study.error(point) for point in study.points if point.value == pytest.approx(STEP))
    assert found == pytest.approx(share_of_state(), rel=1.0)


@pytest.mark.slow
def test_a_demand_that_is_met_is_met_by_the_estimate_of_the_run() -> None:
    demand = 1e-3
    tuned = eomgen.tune(oscillator(), error=demand, methods=[METHOD], axes=["method"], budget=20.0)
    run = eomgen.build(oscillator(), profile="instant").simulate(END, tuned.value, method=METHOD)
    assert tuned.met and tuned.error <= demand
    assert run.error.relative < 1.5 * demand
    assert tuned.said == ""


def told_by_work_precision() -> str:
    runner = Runner(formulations(stuck(), {}, others=False), tuning_grid(1.0, 1e-3, 1e-3))
    run = runner.run(runner.own_configuration(), 1, estimated=False, timed=False)
    assert run.ended == "reached" and run.observation is not None and run.reference is None
    return run.unresolved


def told_by_savings() -> str:
    return savings(stuck(0.2), only=["a run"], rounds=1, profile="instant").doubt


def told_by_extremes() -> str:
    (cell,) = extremes(stuck(0.2), cells=["step:1:rk4"]).cells
    return cell.said


TOLD: dict[str, Callable[[], str]] = {
    "tradeoff": told_by_work_precision,
    "savings": told_by_savings,
    "extremes": told_by_extremes,
}


@pytest.mark.slow
@pytest.mark.parametrize("verb", TOLD)
def test_friction_that_steps_do_not_resolve_is_told_by_every_study(verb: str) -> None:
    assert UNRESOLVED in TOLD[verb]()


@pytest.mark.long
def test_no_demand_is_met_by_steps_that_do_not_resolve_friction() -> None:
    with pytest.raises(eomgen.NumericalError, match=r"no error can be computed from them|no configuration meets"):
        eomgen.tune(stuck(), error=1e-2, methods=["rk4"], axes=["method"], budget=10.0)
