"""Reference motions of a judge, of methods whose errors are known: c h^order, or c tolerance; nothing is compiled."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from eomgen.errors import ModelError, NumericalError, UsageError
from eomgen.lie.product import Factor
from eomgen.products.studies.tuning import judge as under_test
from eomgen.products.studies.tuning.judge import Condition, Demand, Judge, under, verify
from eomgen.products.studies.work_precision.observation import ErrorSize, Observation
from eomgen.products.studies.work_precision.running import REACHED, ComparedRun
from eomgen.simulation.accuracy.motion_size import RunNames

T = np.linspace(0.0, 1.0, 11)
ROW = 0.1


def motion(error: float) -> Observation:
    """Return a motion of one coordinate from 0 to 1, wrong by a part at its end."""
    q = (T * (1.0 + error * T))[:, None]
    factors = (Factor("R", "slide", 0, 1, 0, 1),)
    names = RunNames(factors, ("q.slide",), ("m",), ("m/s",), (), (), {})
    none = np.zeros((11, 0))
    return Observation(T, q, np.ones((11, 1)), none, none, names, (), {}, {}, {})


def method(name: str, chooses: bool = False, tolerances: tuple[float, ...] = ()) -> Any:
    return SimpleNamespace(
        row=SimpleNamespace(name=name), method=SimpleNamespace(chooses_steps=chooses), tolerances=tolerances,
        formulation="joint", configuration=lambda _: name,
    )  # fmt: skip


class Runner:
    """Runs with the error of each method; the runs that were made are kept."""

    def __init__(self, **errors: Any) -> None:
        self.errors, self.made, self.seconds = errors, [], 0.0
        self.grid = SimpleNamespace(row=ROW)

    def prepare(self, configuration: str) -> None:
        if configuration not in self.errors:
            raise UsageError("no such method", "another")

    def run(self, configuration: str, **given: Any) -> Any:
        number = given.get("per_row", given.get("tolerance"))
        self.made.append((configuration, number))
        self.given = given
        error = self.errors[configuration](number)
        if error is None:
            return ComparedRun("stopped", f"{configuration} stopped")
        return ComparedRun(REACHED, "", motion(error), seconds=self.seconds)


def judge_of(runner: Runner, *candidates: Any, error: float = 1e-4, seconds: float = 1e9) -> Judge:
    return Judge(runner, list(candidates), Demand(error, "q", "largest"), seconds, lambda _: None)  # type: ignore[arg-type]


@pytest.fixture(autouse=True)
def ranks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Methods rank by name and take tolerances from 1e-13 on; all motions move."""
    monkeypatch.setattr(under_test, "possible", lambda name, given: given["tolerance"] >= 1e-13)
    monkeypatch.setattr(under_test, "rank", lambda runner, candidate: candidate.row.name)
    monkeypatch.setattr(under_test, "check_moves", lambda runner, observation: None)


def test_steps_are_halved_until_the_reference_is_known_to_a_twentieth_of_the_demand() -> None:
    runner = Runner(a=lambda n: 0.01 / n**2)
    judge = judge_of(runner, method("a"))
    held = judge.reference()
    # errors of 0.01/4^k differ by 3/4 of the coarser error: 0.0075/4^(k - 1) <= 5e-6 from k = 7 on
    assert runner.made == [("a", 2**k) for k in range(8)]
    assert held.observation.q[-1, 0] == 1.0 + 0.01 / 4**7
    bar = held.bar(judge.demand.quantity)
    assert bar == pytest.approx(0.0075 / 4**6, rel=1e-2) and bar <= 0.05e-4
    assert held.described == f"a, joint, step {ROW / 128:.3g} s" and held.second == "itself at half its accuracy"
    assert judge.reference() is held and len(runner.made) == 8
    assert judge.error(motion(0.01 / 4**7 + 0.5)) == pytest.approx(0.5, rel=1e-3)
    assert judge.error(held.observation) == bar
    other = judge.reference(Condition("2: other", {"initial": {"q": 1.0}}))
    assert runner.made[8:] == [("a", 64), ("a", 128)] and other.observation.q[-1, 0] == held.observation.q[-1, 0]
    assert runner.given["initial"] == {"q": 1.0} and (runner.given["timed"], runner.given["estimated"]) == (
        False,
        False,
    )


def test_tolerances_are_lowered_and_a_method_that_stops_is_left() -> None:
    stops = Runner(a=lambda x: 10.0 * x if x > 1e-9 else None, b=lambda n: None if n < 8 else 1e-7 / n)
    judge = judge_of(stops, method("b"), method("a", chooses=True))
    held = judge.reference()
    assert [name for name, _ in stops.made] == ["a"] * 3 + ["b"] * 5
    assert [number for _, number in stops.made[:3]] == pytest.approx([1e-6, 1e-8, 1e-10])
    assert stops.made[3:] == [("b", 1), ("b", 2), ("b", 4), ("b", 8), ("b", 16)] and held.described.startswith(
        "b, joint"
    )
    first = judge_of(Runner(a=lambda x: 10.0 * x), method("a", chooses=True))
    assert first.reference().described == "a, joint, tolerance 1e-10"


def test_refinement_ends_at_rounding_and_at_the_budget() -> None:
    rounding = Runner(a=lambda n: 0.01 / n + 0.002 * (n == 16))
    held = judge_of(rounding, method("a"), error=4e-3).reference()
    # known to 0.00125 with 8 steps, and 16 steps differ by more than 0.7 of this
    assert rounding.made == [("a", 2**k) for k in range(5)] and held.described == "a, joint, step 0.0125 s"
    slow = Runner(a=lambda n: 0.001 / n)
    slow.seconds = 10.0
    found = judge_of(slow, method("a"), error=1e-2, seconds=15.0)
    with pytest.raises(NumericalError, match="no method gives a reference for this scene: a: two runs, one at half"):
        found.reference()
    assert slow.made == [("a", 1)]


def test_the_better_of_two_methods_is_taken() -> None:
    runner = Runner(a=lambda n: 1e-3 / n if n < 8 else None, b=lambda n: 1e-4 / n if n < 8 else None, c=lambda n: None)
    judge = judge_of(runner, method("b"), method("c"), method("a"), method("missing"), error=1e-3)
    held = judge.reference()
    assert held.described == "b, joint, step 0.05 s"  # the first run that is known to 5e-5
    assert list(dict.fromkeys(name for name, _ in runner.made)) == ["a", "b"]
    assert list(judge.tried) == []
    poor = judge_of(runner, method("c"), method("missing"))
    with pytest.raises(NumericalError, match="no method gives a reference for this scene: c: c stopped; missing: no"):
        poor.reference()
    with pytest.raises(ModelError, match="no method runs on this scene; try: other methods"):
        judge_of(runner).reference()


def test_demands_beyond_the_reference_and_unstable_motions_are_refused() -> None:
    vague = Runner(a=lambda n: 4e-4 * (-0.9) ** np.log2(n))
    with pytest.raises(NumericalError) as raised:
        judge_of(vague, method("a")).reference()
    assert "the best reference, a, joint, step" in str(raised.value)
    assert "only, too little for the demand 0.0001; try: a larger demand, a shorter run, or a" in str(raised.value)
    unstable = {name: lambda n: 0.9 * (-0.9) ** np.log2(n) for name in "abc"}
    runner = Runner(**unstable)
    with pytest.raises(NumericalError, match="of the motion: no error can be computed from them"):
        judge_of(runner, *(method(name) for name in "abc")).reference()
    assert {name for name, _ in runner.made} == {"a", "b"}


def test_verified_runs_start_at_the_reference() -> None:
    runner = Runner(a=lambda n: 0.01 / n**2, fast=lambda n: 0.25, broken=lambda n: None)
    judge, condition = judge_of(runner, method("a")), Condition("1: moved", {"initial": {"q": 3.0}, "later": 2})
    run = verify(judge, {"configuration": "fast", "per_row": 2}, condition)
    assert run is not None and run.error == pytest.approx(0.25, rel=1e-3) and run.what == "1: moved"
    assert (
        run.uncertainty == judge.reference(condition).bar(judge.demand.quantity) > 0.0
        and run.by == judge.reference(condition).described
    )
    start = {name: array.tolist() for name, array in runner.given["initial"].items()}
    assert start == {"q": [0.0], "v": [1.0]} and runner.given["later"] == 2
    failed = verify(judge, {"configuration": "broken", "per_row": 2}, condition)
    assert failed is not None and (failed.error, failed.uncertainty, failed.said) == (np.inf, 0.0, "broken stopped")
    assert verify(judge_of(runner), {"configuration": "fast", "per_row": 2}, condition) is None
    under(judge, {"configuration": "fast", "per_row": 4})
    assert "initial" not in runner.given and runner.made[-1] == ("fast", 4)


@pytest.mark.parametrize("value", [0.5, np.inf, np.nan])
def test_demands_take_their_quantity_and_measure(value: float) -> None:
    sizes = {"q": ErrorSize(value, 2.0, 3.0), "v": ErrorSize(7.0, 8.0, 9.0)}
    assert Demand(1.0, "q", "largest").of(sizes) == (value if value == 0.5 else np.inf)
    assert (Demand(1.0, "q", "rms").of(sizes), Demand(1.0, "v", "final").of(sizes)) == (2.0, 9.0)
    assert Demand(1.0, "tip", "final").of(sizes) == np.inf
