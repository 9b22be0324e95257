"""Every row of the register of checks: named, documented, skipped without its facts, and worded in the message."""

from __future__ import annotations

import json
import pickle
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

import eomgen
from eomgen.base.limits import Limit
from eomgen.compiled.rest.state_warnings import LargestBending
from eomgen.errors import Problem, UsageError
from eomgen.results.error_estimate import ErrorEstimate, LargestError
from eomgen.results.finding import FAILURE, NOTE, Finding
from eomgen.results.solution import Solution
from eomgen.simulation.judgement import beams
from eomgen.simulation.judgement.finished_run import ANY_FAILURE, FACTS, Check, FinishedRun
from eomgen.simulation.judgement.instability import Growth
from eomgen.simulation.judgement.invariants import EnergyBalance, Violation
from eomgen.simulation.judgement.register import BY_NAME, CHECKS, OWN, Verdict, message_of
from tests.docs.parts import whole
from tests.models.scenes import pendulum

LARGE = ErrorEstimate(
    available=True, t=np.array([0.5]), relative_at=np.array([0.2]), relative=0.2, order=2.0, declared_order=2.0,
    largest=LargestError("q.hinge", 0.1, "rad", 0.5, 0.2), increment_at=np.zeros((1, 1)), z_at=np.zeros((1, 0)),
)  # fmt: skip  # two lines
Change = Callable[[FinishedRun, pytest.MonkeyPatch], None]


def finished(monkeypatch: pytest.MonkeyPatch, *changes: Change, model: eomgen.Model | None = None) -> FinishedRun:
    """Return a run of a model, of the pendulum by default, in which quantities are replaced."""
    kept: list[FinishedRun] = []
    original = FinishedRun.__init__

    def init(self: FinishedRun, *args: Any, **options: Any) -> None:
        original(self, *args, **options)
        kept.append(self)

    with monkeypatch.context() as patch:
        patch.setattr(FinishedRun, "__init__", init)
        (model or pendulum()).simulate(0.1, 1e-3, error_estimate=False)
    [run] = kept
    for change in changes:
        change(run, monkeypatch)
    return run


def having(**values: Any) -> Change:
    return lambda run, patch: vars(run).update(values)


def returning(module: Any, name: str, value: Any) -> Change:
    return lambda run, patch: patch.setattr(module, name, lambda *_: value)


def method_with(**attributes: Any) -> Change:
    """Replace attributes of the run's method."""
    return lambda run, patch: [patch.setattr(type(run.run.method), *item) for item in attributes.items()] and None


def statistics(**values: float) -> Change:
    def change(run: FinishedRun, patch: pytest.MonkeyPatch) -> None:
        vars(run)["statistics"] = {**run.statistics, **values}

    return change


def stopped(run: FinishedRun, patch: pytest.MonkeyPatch) -> None:
    failure = UsageError(Problem("input motor", "it has no value", "another one"))
    run.trajectory = replace(run.trajectory, failure=failure)


def begun(**values: Any) -> Change:
    def change(run: FinishedRun, patch: pytest.MonkeyPatch) -> None:
        assert run.beginning is not None
        run.beginning = run.beginning._replace(**values)

    return change


def bounded(run: FinishedRun, patch: pytest.MonkeyPatch) -> None:
    run.run = replace(run.run, bounded_for="it is found", settings={**run.run.settings, "largest_step": 2.0})


FOUND = Finding(text="it is found", hint="another one", value=2.0, time=0.05)
#: For every check of the core: how to make it find something.
WITNESSES: dict[str, tuple[Change, ...]] = {
    "stopped": (stopped,),
    "checkpoint": (having(checkpoint="no checkpoint was written"),),
    "unstable": (having(growth=Growth("v.hinge", "rad/s", 0.0, 0.1, 1.0, 1e9, 1e-4, 1.0)),),
    "infinite_energy": (having(balance=EnergyBalance(None, infinite=0.05)),),
    "broken_constraint": (having(violation=Violation(0.1, "the constraint pin is off", 0.05)),),
    "halved_steps": (statistics(halvings=3),),
    "discretisation_error": (having(error=LARGE),),
    "energy_balance": (having(balance=EnergyBalance(0.7, gain=0.7)),),
    "constraint_violation": (having(violation=Violation(1e-5, "the constraint pin is off", 0.05)),),
    "large_deflection": (having(bending=LargestBending("boom", 0.05, 2.0)),),
    "turned_element": (returning(beams, "turned_elements", FOUND),),
    "unknown_error": (having(error=ErrorEstimate(reason="it is unknown", remedy="another one")),),
    "chosen_method": (begun(choice="rk4 was chosen"),),
}


@pytest.mark.parametrize("check", OWN, ids=lambda check: check.name)
def test_every_check_is_named_documented_and_worded(check: Check, monkeypatch: pytest.MonkeyPatch) -> None:
    assert_reported(check, finished(monkeypatch, *WITNESSES[check.name]), monkeypatch)


def assert_reported(check: Check, run: FinishedRun, monkeypatch: pytest.MonkeyPatch) -> None:
    """A check that finds something in a run is named, documented and worded, and needs its facts."""
    assert BY_NAME[check.name] is check  # names are unique
    earlier = [row.name for row in CHECKS[: CHECKS.index(check)]]
    assert {*check.unless, *check.after} <= {*earlier, ANY_FAILURE}
    assert set(check.needs) <= FACTS.keys()
    documented = whole("python")
    assert f"| `{check.name}` | {check.severity}" in documented
    monkeypatch.setattr(FinishedRun, "has", lambda self, facts: True)
    verdict = Verdict(run)
    found = verdict.of(check.name)
    assert found and all(finding.name == check.name and finding.severity == check.severity for finding in found)
    assert all(finding.text and "; try: " not in finding.text for finding in found)
    assert [finding for finding in verdict.findings if finding.name == check.name] == list(found)
    assert (found[0].text in verdict.message) == check.said
    assert verdict.success == all(finding.severity != FAILURE for finding in verdict.findings)
    back = [Finding.from_data(json.loads(json.dumps(finding.to_dict()))) for finding in verdict.findings]
    assert repr(back) == repr(list(verdict.findings))  # NaN included
    for fact in check.needs:  # without one of them it is not even evaluated
        monkeypatch.setattr(FinishedRun, "has", lambda self, facts, fact=fact: fact not in facts)
        silent = replace(check, evaluate=lambda run: pytest.fail("evaluated without its facts"))
        monkeypatch.setitem(cast("Any", BY_NAME), check.name, silent)
        assert Verdict(run).of(check.name) == ()


def test_success_pays_for_no_error_estimate_and_states_for_no_judgement(monkeypatch: pytest.MonkeyPatch) -> None:
    evaluated: list[str] = []
    original = Verdict.of

    def of(self: Verdict, name: str) -> tuple[Finding, ...]:
        evaluated.append(name)
        return original(self, name)

    monkeypatch.setattr(Verdict, "of", of)
    run = pendulum().simulate(0.1, 1e-3)
    assert run.q.shape == (101, 1) and not evaluated
    assert run.success and set(evaluated) == {check.name for check in CHECKS if check.severity == FAILURE}
    assert "error" not in vars(run) and run.findings == ()


def test_findings_are_kept_by_files_copies_and_other_processes(tmp_path: Path) -> None:
    run = pendulum().simulate(10.0, 0.25, parameters={"shake": 0.0})
    assert [finding.name for finding in run.findings][:1] == ["discretisation_error"]
    assert str(run.findings[-1]) in run.message and run.findings[0].text in run.message
    loaded = Solution.load(run.save(tmp_path / "run.npz"))
    for other in (loaded, pickle.loads(pickle.dumps(run)), replace(run, model=None)):
        assert repr(other.findings) == repr(run.findings) and other.message == run.message


def test_findings_that_continue_one_another_have_one_hint() -> None:
    found = [
        Finding("halved_steps", text="the step was halved once", hint="one"),
        Finding("discretisation_error", text="an error is large", hint="two"),
        Finding("chosen_method", NOTE, text="rk4 was chosen"),
        Finding("turned_element", FAILURE, text="an element turns", hint="three"),
        Finding("unknown_error", text="its error is unknown"),
    ]
    assert message_of("reached the end", found) == (
        "reached the end; the step was halved once, and an error is large; try: two; rk4 was chosen, but an element"
        " turns; try: three; its error is unknown"
    )
    assert message_of("", found[2:]) == "rk4 was chosen; an element turns; try: three; its error is unknown"


def test_limits_are_numbers_with_unit_meaning_and_source() -> None:
    limits = [limit for check in CHECKS for limit in check.limits]
    assert limits and all(limit.unit and limit.meaning and limit.source for limit in limits)
    copy = pickle.loads(pickle.dumps(limits[0]))
    assert copy == limits[0] == float(limits[0]) and copy.source == limits[0].source and isinstance(copy, Limit)
