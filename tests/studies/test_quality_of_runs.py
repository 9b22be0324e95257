"""One measure of a run's quality: every verb that runs a scene has the same error of an internal state, and the same
finding on steps that do not resolve friction."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import fmpy  # type: ignore[import-untyped]
import pytest

import eomgen
from eomgen.products.pages import live
from eomgen.products.reliability.vibration import random_vibration
from eomgen.products.studies.ladders.study import extremes
from eomgen.products.studies.savings import savings
from eomgen.products.studies.tuning.result import Tuned
from eomgen.products.studies.work_precision.formulations import formulations
from eomgen.products.studies.work_precision.running import Runner, tuning_grid
from eomgen.simulation.judgement.register import CHECKS

METHOD, STEP, END = "generalized_alpha", 0.05, 4.0


def oscillator() -> Any:
    """Return a slider that moves slowly and smoothly, beside internal states on a limit cycle with fast turns."""
    builder = eomgen.SceneBuilder("oscillator", gravity=[0, 0, 0]).body("cart", 1.0)
    builder.joint("rail", "prismatic", "base", "cart", axis=[1, 0, 0], initial={"velocity": 0.1})
    builder.state("a", "1 + a**2 * b - 4 * a", initial=1.5).state("b", "3 * a - a**2 * b", initial=3.0)
    builder.parameter("push", 0.1, tunable=True).effort("pull", "rail", "-push * q.rail")
    return builder.simulation(method=METHOD, step=STEP, duration=END).build()


def by_simulate() -> float:
    run = eomgen.build(oscillator(), profile="quick").simulate()
    assert run.error.worst is not None and run.error.worst.name.startswith("z.")
    return run.error.worst.share


def by_ensemble() -> float:
    model = eomgen.build(oscillator(), profile="quick")
    result = model.simulate_many(END, STEP, table={"push": [0.1, 0.11]}, columns=["q.rail"], points=2)
    assert result.error.worst is not None and result.error.worst[1].name.startswith("z.")
    return result.error.relative


def by_live() -> float:
    run = eomgen.build(oscillator(), profile="quick").simulate()
    words = live._error(run)
    assert run.error.worst is not None and f"of {run.error.worst.name} " in words
    return run.error.worst.share


def by_tradeoff() -> float:
    study = eomgen.tradeoff(oscillator(), methods=[METHOD], steps=[STEP], axes=["method"], budget=20.0)
    return max(study.error(point) for point in study.points if point.value == pytest.approx(STEP))


VERBS: dict[str, Callable[[], float]] = {"ensemble": by_ensemble, "live": by_live, "tradeoff": by_tradeoff}


@pytest.mark.parametrize("verb", VERBS)
def test_the_error_of_an_internal_state_is_the_same_by_every_verb(verb: str) -> None:
    expected = by_simulate()
    assert expected > 1e-3  # the slider's error is below 1e-5
    assert VERBS[verb]() == pytest.approx(expected, rel=1.0)


def test_a_demand_that_is_met_is_met_by_the_estimate_of_the_run() -> None:
    demand = 1e-3
    tuned = eomgen.tune(oscillator(), error=demand, methods=[METHOD], axes=["method"], budget=20.0)
    assert isinstance(tuned, Tuned)
    run = eomgen.build(oscillator(), profile="quick").simulate(END, tuned.value, method=METHOD)
    assert tuned.met and tuned.error <= demand
    assert run.error.relative < 1.5 * demand
    assert tuned.said == ""


def stuck(duration: float = 1.0, *, gusts: bool = False) -> Any:
    """Return a cart that a spring pulls over dry friction, whose width no step resolves, and random gusts."""
    builder = eomgen.SceneBuilder("stuck", gravity=[0, 0, 0]).body("cart", 1.0)
    friction = {"coulomb": 3.0, "static": 5.0, "stribeck": 2e-7, "velocity": 1e-8}
    builder.joint("rail", "prismatic", "base", "cart", axis=[1, 0, 0], friction=friction)
    builder.parameter("pull", 400.0, tunable=True).effort("spring", "rail", "pull * (0.1 * t - q.rail)")
    if gusts:
        builder.random("gust", type="exponential", standard_deviation=1, correlation_time=1, unit="N", modes=3)
        builder.effort("gusts", "rail", "gust")
        builder.output("place", formula="q.rail")
    return builder.simulation(method="rk4", step=1e-3, duration=duration).build()


def told_by_simulate() -> str:
    return eomgen.build(stuck(), profile="quick").simulate().message


def told_by_ensemble() -> str:
    model = eomgen.build(stuck(), profile="quick")
    return "; ".join(model.simulate_many(table={"pull": [400.0, 410.0]}, columns=["q.rail"], points=2).notes)


def told_by_live() -> str:
    model = eomgen.build(stuck(), profile="quick")
    return live._note(model, model.simulate())


def told_by_work_precision() -> str:
    runner = Runner(formulations(stuck(), {}, others=False), tuning_grid(1.0, 1e-3, 1e-3))
    run = runner.run(runner.own_configuration(), 1, estimated=False, timed=False)
    assert run.ended == "reached" and run.observation is not None and run.reference is None
    return run.unresolved


def told_by_savings() -> str:
    return savings(stuck(0.2), only=["a run"], rounds=1, profile="quick").doubt


def told_by_file() -> str:
    run = eomgen.build(stuck(), profile="quick").simulate()
    return str(pickle.loads(pickle.dumps(run)).message)


def told_by_extremes() -> str:
    (cell,) = extremes(stuck(0.2), cells=["step:1:rk4"]).cells
    return cell.said


def told_by_random() -> str:
    model = eomgen.build(stuck(0.2, gusts=True), profile="quick")
    return random_vibration(model, "place", samples=20, points=False).message


def told_by_log_of_fmu() -> str:
    messages: list[str] = []
    with TemporaryDirectory() as folder:
        file = eomgen.fmu(stuck(0.2), Path(folder) / "stuck.fmu", types="cs", profile="quick")
        options = {"debug_logging": True, "logger": lambda *words: messages.append(words[-1].decode())}
        fmpy.simulate_fmu(str(file), stop_time=0.01, output_interval=0.01, **options)
    return "; ".join(messages)


TOLD: dict[str, Callable[[], str]] = {
    "simulate": told_by_simulate,
    "ensemble": told_by_ensemble,
    "live": told_by_live,
    "tradeoff": told_by_work_precision,
    "savings": told_by_savings,
    "extremes": told_by_extremes,
    "random": told_by_random,
    "log of an FMU": told_by_log_of_fmu,
    "file": told_by_file,
}


@pytest.mark.parametrize("verb", TOLD)
def test_friction_that_steps_do_not_resolve_is_told_by_every_verb(verb: str) -> None:
    assert "too fast for an explicit method" in TOLD[verb]()


def test_no_demand_is_met_by_steps_that_do_not_resolve_friction() -> None:
    with pytest.raises(eomgen.NumericalError, match=r"no error can be computed from them|nothing meets"):
        eomgen.tune(stuck(), error=1e-2, methods=["rk4"], axes=["method"], budget=10.0)


def test_faults_that_comparisons_share_are_marked() -> None:
    alike = {check.name for check in CHECKS if check.alike}
    assert alike == {
        *("unresolved_motion", "fast_law", "unseen_law", "unresolved_damping", "unresolved_states", "passed_growth"),
    }
