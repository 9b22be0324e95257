"""Cells of ladders whose runs follow laws: references of two methods, verdicts by errors, runs again, and what is left
out; nothing is compiled and no process is started."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

import eomgen
from eomgen.errors import EomgenError
from eomgen.lie.product import Factor
from eomgen.mechanics.derive import derive
from eomgen.products.studies import run_commands
from eomgen.products.studies.ladders import register, study
from eomgen.products.studies.ladders import subject as subjects
from eomgen.products.studies.ladders.register import ALL, DAMPED, EQUATIONS, FEW, ONE, SAME, Ladder, methods_of
from eomgen.products.studies.ladders.result import Cell, Extremes
from eomgen.products.studies.ladders.runs import (
    CRASH,
    RAISED,
    REACHED,
    REFUSED,
    ROWS,
    STOPPED,
    UNFINISHED,
    Request,
    RunConditions,
    RunEnding,
    compile_stepper,
    run_ending,
)
from eomgen.products.studies.ladders.scaling import (
    GRAVITY,
    LENGTH,
    MASS,
    ORIGIN,
    RATIO,
    RATIO_LAST,
    STIFFNESS,
    TIME,
    SceneUnits,
    used_factors,
    with_factors,
)
from eomgen.products.studies.ladders.study import MOST_STEPS, _LadderStudy, reference
from eomgen.products.studies.ladders.subject import FACTORS, OWN, SINGLE, StructuralZeros, Subject
from eomgen.results.finding import NOTE, WARNING
from tests.models.scenes import SWING
from tests.studies.runs_of_laws import model_of

FINE = 0.01


class Swing(SimpleNamespace):
    """A subject of one angle, with methods for references and for ladders by name."""

    def __init__(self, **facts: Any) -> None:
        super().__init__(**{
            "extent": 2.0, "fine": FINE, "name": "swing", "period": 1.0, "seen": [],
            "start": (np.array([0.5]), np.array([1.0])), "scene": SimpleNamespace(digest=b"\x01"),
            "fine_by": {"steps": ["rk4"], "tolerance": ["taylor"], "damping": ["generalized_alpha"]},
            "ladders": {"few": ["rk4", "hht"], "all": ["taylor"], "damped": ["wbz"]}, "cannot": (),
        } | facts)  # fmt: skip  # a table

    def model(self, which: str) -> Any:
        self.seen.append(which)
        simulation = SimpleNamespace(method="own")
        return SimpleNamespace(
            factors=(Factor("R", "pin", 0, 1, 0, 1),), q_units=("rad",), v_units=("rad/s",), z_units=(), nq=1,
            description=SimpleNamespace(simulation=simulation), multipliers=(),
        )  # fmt: skip

    def methods(self, ladders: str = "", fine_by: str = "") -> list[str]:
        return (self.fine_by[fine_by] if fine_by else self.ladders[ladders]).copy()

    def runs(self, method: str) -> bool:
        return method not in self.cannot

    def conditions(self, **changes: Any) -> RunConditions:
        q, v = self.start
        return RunConditions(**{"model": OWN, "step": FINE, "steps": 10 * ROWS, "q": q, "v": v, **changes})


def arrays(request: Request, error: float) -> dict[str, np.ndarray]:
    conditions = request.conditions
    t = conditions.start + np.linspace(0.0, conditions.step * conditions.steps, ROWS + 1)
    at = conditions.q[0] + (np.cos(t - t[0]) - 1.0) * (1.0 + error)
    return {"t": t, "q": at[:, None], "v": -np.sin(t - t[0])[:, None]}


def runs_of(**errors: float | RunEnding) -> Callable[[Request, float], RunEnding]:
    """Return runs whose error is size x step^4, or the tolerance, by method."""

    def ended(request: Request, limit: float) -> RunEnding:
        law = errors[request.method]
        if isinstance(law, RunEnding):
            return law
        error = request.more["tolerance"] if "tolerance" in request.more else law * request.conditions.step**4
        return RunEnding(REACHED, "", arrays(request, error))

    return ended


def test_references_are_of_two_methods_or_steps_that_agree() -> None:
    subject: Any = Swing()
    conditions, asked = subject.conditions(given={"rho_inf": 0.3}), []
    own = runs_of(taylor=0.0, rk4=1.0, generalized_alpha=1.0)

    def noted(request: Request, limit: float) -> RunEnding:
        asked.append((request, limit))
        return own(request, limit)

    held = reference(subject, conditions, noted)
    assert held.by == "taylor, held against rk4 at 1/4 of the step" and held.arrays is not None
    (tight, _), (finer, limit) = asked
    assert (tight.method, tight.more) == ("taylor", {"error_estimate": False, "tolerance": 1e-14})
    assert (tight.conditions.step, tight.conditions.steps) == (pytest.approx(FINE * 10), ROWS)
    assert (finer.method, finer.more, limit) == ("rk4", {"error_estimate": False}, 10.0)
    assert (finer.conditions.step, finer.conditions.steps) == (pytest.approx(FINE / 4.0), 40 * ROWS)
    assert tight.conditions.given == finer.conditions.given == {}
    assert held.uncertainty == pytest.approx((FINE / 4.0) ** 4, rel=1e-3) and held.arrays["q"].shape == (ROWS + 1, 1)
    stopped = RunEnding(STOPPED, "no")
    halved = reference(subject, conditions, runs_of(taylor=stopped, rk4=1.0, generalized_alpha=1.0))
    assert halved.by == "rk4 at 1/4 and 1/8 of the step"
    assert halved.uncertainty == pytest.approx((FINE / 4.0) ** 4 * (1.0 - 2.0**-4), rel=1e-3)
    far = runs_of(taylor=stopped, rk4=1e10, generalized_alpha=0.0)
    damped = reference(subject, conditions, far)
    assert damped.by == "generalized_alpha at 1/16 and 1/8 of the step" and damped.uncertainty == 0.0
    infinite = RunEnding(REACHED, "", arrays(Request(conditions, ""), 0.0), finite=False)
    none = reference(subject, conditions, runs_of(taylor=infinite, rk4=stopped, generalized_alpha=1e16))
    assert none.arrays is None and math.isinf(none.uncertainty)
    parts = none.by.split("; ")
    assert parts[0] == "taylor, held against rk4 at 1/4 of the step: reached"
    assert parts[1] == "rk4 at 1/4 and 1/8 of the step: stopped"
    assert [part.partition(": ")[0] for part in parts[2:]] == [
        "generalized_alpha at 1/16 and 1/8 of the step", "generalized_alpha at 1/256 and 1/128 of the step"
    ]  # fmt: skip
    assert all("difference " in part for part in parts[2:])


def test_references_of_long_runs_have_steps_of_their_own() -> None:
    subject: Any = Swing(fine_by={"steps": ["rk4"], "tolerance": [], "damping": []})
    long = subject.conditions(step=1e-6, steps=1_000_000)  # of 1 s, in which 100 fine steps fit
    ((text, two, one),) = study._pairs(subject, long)
    assert one.conditions.steps == 4 * 5 * ROWS and two.conditions.steps == 2 * one.conditions.steps
    assert text == "rk4 at 1/4 and 1/8 of 0.01 s"
    assert one.conditions.step * one.conditions.steps == pytest.approx(1.0)
    coarse = subject.conditions(step=1.0, steps=ROWS)
    ((_, _, one),) = study._pairs(subject, coarse)
    assert one.conditions.step == pytest.approx(FINE / 4.0)
    other_units = coarse.vary(parameters={"unit_time": 10.0})
    ((_, _, one),) = study._pairs(subject, other_units)
    assert one.conditions.step == pytest.approx(10.0 * FINE / 4.0)
    many = subject.conditions(step=1.0, steps=MOST_STEPS // 8)
    ((_, two, one),) = study._pairs(subject, many)
    assert one.conditions.steps == 2 * MOST_STEPS // 8 and two.conditions.steps == 4 * MOST_STEPS // 8


@pytest.mark.parametrize(("place", "resolved"), [(0.5, True), (1e8, True), (1e10, False)])
def test_runs_that_stand_still_by_rounding_are_no_reference(place: float, resolved: bool) -> None:
    """Steps of 0.0025 s at 1e-3 rad/s change angles by 2.5e-6 rad; doubles at 1e10 are 2e-6 apart."""
    subject: Any = Swing()
    still = {"t": np.linspace(0.0, 2.0, ROWS + 1), "q": np.full((ROWS + 1, 1), 0.5), "v": np.full((ROWS + 1, 1), 1e-3)}
    still["v"][0] = 0.0
    held = reference(subject, subject.conditions(q=np.array([place])), lambda *_: RunEnding(REACHED, "", still))
    assert (held.arrays is not None) is resolved
    assert resolved or held.by.count(": steps change the coordinates by their rounding only") == 4
    scaled = subject.conditions(q=np.array([1e10]), sizes=(np.ones(1), np.full(1, 1e3)))
    assert reference(subject, scaled, lambda *_: RunEnding(REACHED, "", still)).arrays is not None


class Process:
    """Runs requests in this process, as ``RunnerProcess`` does in another."""

    def __init__(self, ended: Callable[[Request, float], RunEnding]) -> None:
        self.ended, self.used, self.compiling, self.closed = ended, False, 0.0, 0
        self.asked: list[tuple[Request, float]] = []

    def execute(self, request: Request, limit: float) -> RunEnding:
        self.asked.append((request, limit))
        return self.ended(request, limit)

    def close(self) -> None:
        self.closed += 1
        self.used = False


def study_of(subject: Any, ended: Callable[[Request, float], RunEnding], limit: float = 7.0) -> Any:
    made = _LadderStudy(subject, limit)
    made.runner = cast(Any, Process(ended))
    return made


def ladder(against: str = "another method", **more: Any) -> Ladder:
    def conditions(subject: Any, value: float) -> RunConditions:
        return cast(RunConditions, subject.conditions(step=value, **more))

    return Ladder("steps", "step, s", (0.01, 0.1), conditions, against=against)


@pytest.mark.parametrize(
    ("size", "said", "verdict"),
    [(99.0, "", "holds"), (101.0, "", "coarse"), (999.0, "", "coarse"), (1001.0, "", "fails"), (1001.0, "!", "warned")],
)
def test_cells_have_the_error_and_verdict_of_their_runs(size: float, said: str, verdict: str) -> None:
    """An error of size x 0.1^4 of the motion, against references that are known to a thousandth of it."""
    own = runs_of(taylor=0.0, rk4=1.0, method=size)
    made = study_of(Swing(), lambda request, limit: replace(own(request, limit), said=said, seconds=0.5))
    cell = made.cell(ladder(), 0.1, "method")
    assert (cell.ladder, cell.value, cell.method, cell.verdict, cell.bound) == ("steps", 0.1, "method", verdict, 0.01)
    assert cell.error == pytest.approx(size * 1e-4, rel=1e-3) and cell.velocity_error == 0.0
    assert (cell.said, cell.seconds) == (said, 0.5) and cell.reference.startswith("taylor, held against rk4")
    first, limit = made.runner.asked[0]
    assert (first.method, first.conditions.step, limit) == ("method", 0.1, 7.0)
    count = len(made.runner.asked)
    made.cell(ladder(), 0.1, "method")
    assert len(made.runner.asked) == count + 1  # the reference is kept
    made.cell(ladder(), 0.01, "method")
    assert len(made.runner.asked) == count + 4


def test_a_fail_in_a_used_process_is_run_again() -> None:
    endings = [RunEnding(CRASH, "killed"), RunEnding(STOPPED, "stopped at t"), RunEnding(RAISED, "no")]
    made = study_of(Swing(), lambda request, limit: endings[len(made.runner.asked) - 1])
    made.runner.used = True
    cell = made.cell(ladder(), 0.1, "method")
    assert (cell.verdict, cell.said, made.runner.closed) == ("stopped", "stopped at t", 1)
    assert (cell.error, cell.velocity_error, cell.reference) == (None, None, "")
    cell = made.cell(ladder(), 0.1, "method")
    assert (cell.verdict, cell.said, made.runner.closed) == ("fails", "no", 1)  # in a new process once


def test_cells_in_other_units_are_held_against_the_scene_as_it_is() -> None:
    """Runs are off by their parameter."""

    def ended(request: Request, limit: float) -> RunEnding:
        return RunEnding(REACHED, "", arrays(request, request.conditions.parameters.get("x", 0.0)))

    def conditions(subject: Any, value: float) -> RunConditions:
        return cast(RunConditions, subject.conditions(model=FACTORS, parameters={"x": value}))

    row, made = Ladder("length", "m", (1.0,), conditions, against=SAME, bound=1e-3), study_of(Swing(), ended)
    cells = [made.cell(row, value, "method") for value in (0.9e-3, 1.1e-3)]
    assert [cell.verdict for cell in cells] == ["holds", "coarse"]
    assert [cell.error for cell in cells] == pytest.approx([0.9e-3, 1.1e-3]) and cells[0].bound == 1e-3
    assert cells[0].reference == "method, the scene as it is"
    _, (request, limit), _ = made.runner.asked
    assert (request.conditions.model, request.conditions.parameters, request.more, limit) == (
        FACTORS, {}, {"error_estimate": False}, 7.0
    )  # fmt: skip
    made.cell(row, 0.0, "other")
    assert len(made.runner.asked) == 5 and set(made.references) == {"same method", "same other"}
    unknown = study_of(Swing(), lambda request, limit: RunEnding(
        STOPPED if request.more else REACHED, "", None if request.more else arrays(request, 0.0)
    )).cell(row, 0.1, "method")  # fmt: skip
    assert (unknown.verdict, unknown.error) == ("unknown", None)


def test_single_precision_has_a_reference_in_double_precision() -> None:
    made = study_of(Swing(), runs_of(taylor=0.0, rk4=1.0, method=1.0))
    cell = made.cell(ladder(model=SINGLE), 0.1, "method")
    assert [request.conditions.model for request, _ in made.runner.asked] == [SINGLE, OWN, OWN]
    assert cell.verdict == "holds" and SINGLE in made.subject.seen


def test_changed_equations_are_judged_by_the_excess_of_the_change() -> None:
    made = study_of(Swing(), runs_of())
    ends = {1e-9: (RunEnding(REACHED, ""), 0.5), 1e-8: (RunEnding(REACHED, "mass changes most"), 2.0),
            1e-7: (RunEnding(REFUSED, "no loop"), 0.0)}  # fmt: skip
    vars(made)["structure"] = SimpleNamespace(verdict_after_change=ends.__getitem__)
    found = [made.cell(ladder(EQUATIONS), value, "own") for value in ends]
    assert [cell.verdict for cell in found] == ["holds", "fails", "refused"]
    assert [cell.error for cell in found] == [0.005, 0.02, None]
    assert [cell.said for cell in found] == ["", "mass changes most", "no loop"]
    assert all(cell.reference == EQUATIONS and not made.runner.asked for cell in found)


def test_plans_have_a_cell_for_each_value_and_method(tmp_path: Path) -> None:
    rows: list[dict[str, Any]] = []
    journal: Any = SimpleNamespace(rows=[], append=rows.append)
    told: list[tuple[int, int, str]] = []
    absent = replace(ladder(), name="absent", applies=lambda subject: "it has none")
    made = study_of(Swing(), runs_of(taylor=0.0, rk4=1.0, hht=1.0, own=1.0))
    entries = [(ladder(), 0.01, ""), (absent, 1.0, ""), (ladder(), 0.02, "hht")]
    cells, left_out = made.run(entries, (), journal, 1e9, lambda *work: told.append(work))
    assert [cell.name for cell in cells] == [
        "steps:0.01:own", "steps:0.01:rk4", "steps:0.01:hht", "steps:0.02:hht"
    ] and left_out == {"absent": "it has none"}  # fmt: skip
    assert told == [
        (0, 4, "steps 0.01 own"),
        (1, 4, "steps 0.01 rk4"),
        (2, 4, "steps 0.01 hht"),
        (3, 4, "steps 0.02 hht"),
    ]
    assert [Cell(**row) for row in rows] == cells
    again = study_of(Swing(), runs_of())
    journal = SimpleNamespace(rows=cells[:3], append=rows.append)
    resumed, left_out = again.run(entries[:1], ("rk4",), journal, 1e9, None)
    assert resumed == [cells[1]] and not again.runner.asked and left_out == {}
    spent = study_of(Swing(), runs_of())
    spent.runner.compiling = -1.0
    none, left_out = spent.run(entries[:1], ("rk4",), SimpleNamespace(rows=[]), 1.0, None)
    assert (none, left_out) == ([], {"steps:0.01:rk4": "the budget is spent"})


@pytest.mark.parametrize(
    ("kind", "wanted", "names"),
    [
        (ONE, ("rk4",), ["own"]), (FEW, (), ["own", "rk4", "hht"]), (ALL, (), ["own", "rk4", "hht", "taylor"]),
        (DAMPED, (), ["wbz"]), (FEW, ("taylor", "none"), ["taylor"]), (ALL, ("none",), ["own", "rk4", "hht", "taylor"]),
    ],
)  # fmt: skip  # a table
def test_methods_of_ladders(kind: str, wanted: tuple[str, ...], names: list[str]) -> None:
    subject: Any = Swing(cannot=("none",))
    assert methods_of(replace(ladder(), methods=kind), subject, wanted) == names


def test_the_verb_runs_ladders_and_says_what_fails(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    subject = Swing(factors=(), used=frozenset(), why_not={}, data=None)
    subject.has = lambda which: False
    subject.why_not = {FACTORS: "a Scene", SINGLE: "no floats"}
    monkeypatch.setattr(study, "Subject", lambda scene, reading: {("swing.toml", 0): subject}[scene, len(reading)])
    ended = runs_of(taylor=0.0, rk4=1.0, hht=1e-30, wbz=1e9)
    monkeypatch.setattr(study, "RunnerProcess", lambda prepare, run: Process(ended))
    found = eomgen.extremes("swing.toml", ladders=["step", "float"], methods=["rk4", "hht"], folder=tmp_path)
    assert found.left_out == {"float": "no floats"} and found.period == 1.0 and found.source == "swing.toml"
    values = register.BY_NAME["step"].values
    assert [(cell.value, cell.method) for cell in found.cells] == [
        (value, method) for value in values for method in ("rk4", "hht")
    ]
    by_law = {cell.value: cell.error for cell in found.cells if cell.method == "rk4"}
    assert by_law[1e-2] == pytest.approx(1e-8, rel=0.01) and by_law[1e-1] == pytest.approx(1e-4, rel=0.01)
    (cell,) = eomgen.extremes("swing.toml", cells=["step:0.5:wbz"]).cells
    assert cell.verdict == "fails" and cell.method == "wbz"
    lines = (tmp_path / "cells.jsonl").read_text(encoding="utf-8").splitlines()
    assert len(lines) == 1 + len(found.cells) and Cell(**json.loads(lines[1])) == found.cells[0]
    again = eomgen.extremes("swing.toml", ladders=["step"], methods=["rk4"], folder=tmp_path, resume=True)
    assert again.cells == tuple(cell for cell in found.cells if cell.method == "rk4")
    both = replace(found, cells=(*found.cells[:2], cell))
    run_commands._print_map(both)
    printed = capsys.readouterr().out
    assert "swing: 3 cells in 0 s" in printed
    table = [line.split() for line in printed.splitlines() if "step by shortest period" in line]
    assert [line[4:] for line in table] == [["rk4", "1"], ["hht", "1"], ["wbz", "1"]]
    run_commands._print_cells(both)
    printed = capsys.readouterr().out
    assert "step:0.5:wbz" in printed and "fails" in printed and "taylor" in printed
    assert both.counts == {"holds": 2, "fails": 1} and both.fails == (cell,)
    table = both.csv().splitlines()
    assert table[0].startswith("ladder,value,method,verdict,error,") and len(table) == 4
    assert table[-1].startswith("step,0.5,wbz,fails,") and table[-1].endswith(
        "eomgen extremes swing.toml --cell step:0.5:wbz"
    )
    data = both.to_dict()
    assert (data["fails"], data["shortest_period"], data["counts"]) == (1, 1.0, both.counts)
    assert data["cells"][2]["command"] == "eomgen extremes swing.toml --cell step:0.5:wbz"


# -- runs --------------------------------------------------------------------------------------------------------------


def solution(**changes: Any) -> Any:
    table = {
        "t": np.linspace(0.0, 1.0, 3), "q": np.full((3, 2), 6.0), "v": np.full((3, 1), 8.0), "z": np.full((3, 1), 2.0),
        "a": np.zeros((3, 1)), "outputs": {"y": np.zeros(3)}, "interrupted": False, "success": True, "message": "m",
        "findings": [],
    } | changes  # fmt: skip  # a table
    return SimpleNamespace(**table)


class Model:
    """A model that returns a run, and keeps the arguments of ``simulate``."""

    def __init__(self, run: Any) -> None:
        self.run = run

    def simulate(self, *end: float, **given: Any) -> Any:
        self.end, self.given = end, given
        if isinstance(self.run, EomgenError):
            raise self.run
        return self.run


CONDITIONS = RunConditions(OWN, 0.25, 3 * ROWS, np.array([1.0, 2.0]), np.array([3.0]))


def test_runs_have_the_arguments_of_their_conditions() -> None:
    model: Any = Model(solution())
    conditions = CONDITIONS.vary(
        z=np.array([4.0]), parameters={"p": 5.0}, start=6.0, given={"rho_inf": 0.5, "tolerance": 1.0}
    )
    ended = run_ending(model, conditions, "rk4", tolerance=1e-9)
    assert model.end == (6.0 + 15.0, 0.25)
    given = model.given
    assert {name: value.tolist() for name, value in given.pop("initial").items()} == {"q": [1, 2], "v": [3], "z": [4]}
    assert given == {"method": "rk4", "parameters": {"p": 5.0}, "t_start": 6.0, "record_every": 3, "rho_inf": 0.5,
                     "tolerance": 1e-9}  # fmt: skip
    assert (ended.how, ended.said, ended.finite) == (REACHED, "", True) and ended.arrays is not None
    assert list(ended.arrays) == ["t", "q", "v", "z"]
    run_ending(model, CONDITIONS.vary(steps=ROWS // 2), "rk4")
    assert (model.given["record_every"], model.given["parameters"], set(model.given["initial"])) == (
        1,
        None,
        {"q", "v"},
    )


def test_states_are_compared_in_the_units_and_at_the_place_of_the_scene() -> None:
    model: Any = Model(solution())
    sizes = np.array([2.0, 3.0]), np.array([4.0])
    scaled = run_ending(model, CONDITIONS.vary(sizes=sizes, shift=np.array([2.0, 0.0])), "rk4").arrays
    assert scaled is not None and list(scaled) == ["t", "q", "v"]
    assert scaled["q"][0].tolist() == [2.0, 2.0] and scaled["v"][0].tolist() == [2.0]
    shifted = run_ending(model, CONDITIONS.vary(shift=np.array([2.0, 0.0])), "rk4").arrays
    assert shifted is not None and shifted["q"][0].tolist() == [4.0, 6.0] and "z" not in shifted


@pytest.mark.parametrize(
    ("run", "how", "said"),
    [
        (EomgenError("no"), REFUSED, "no"),
        (solution(interrupted=True, success=False), UNFINISHED, "m"),
        (solution(success=False), STOPPED, "m"),
    ],
)
def test_runs_that_do_not_reach_the_end(run: Any, how: str, said: str) -> None:
    ended = run_ending(cast(Any, Model(run)), CONDITIONS, "rk4")
    assert (ended.how, ended.arrays, ended.finite) == (how, None, True) and said in ended.said


def test_warnings_are_said_and_notes_are_not() -> None:
    class Finding(SimpleNamespace):
        def __str__(self) -> str:
            return str(self.text)

    findings = [Finding(severity=kind, text=text) for kind, text in ((WARNING, "a"), (NOTE, "b"), (WARNING, "c"))]
    assert run_ending(cast(Any, Model(solution(findings=findings))), CONDITIONS, "rk4").said == "a; c"


@pytest.mark.parametrize("name", ["t", "q", "v", "z", "a", "outputs"])
def test_numbers_that_are_not_finite_are_told(name: str) -> None:
    run = solution()
    (run.outputs["y"] if name == "outputs" else getattr(run, name))[1] = np.nan
    assert not run_ending(cast(Any, Model(run)), CONDITIONS, "rk4").finite


# -- subjects ----------------------------------------------------------------------------------------------------------


def subject_of(data: Any = SWING) -> Subject:
    made = Subject(data, {})
    system = derive(made.scene, ("residual",))
    own = SimpleNamespace(
        name="swing", factors=system.factors, initial_q=np.array(system.initial_q), nv=system.nv, nu=system.nu,
        v_units=("rad/s",) * system.nv, initial_z=np.zeros(0), parameters={}, multipliers=(), description=None,
    )  # fmt: skip
    made._models = {OWN: own}  # type: ignore[dict-item]
    return made


def test_small_changes_of_numbers_change_equations_by_as_little() -> None:
    structure = StructuralZeros(subject_of())
    for amount in (1e-13, 1e-10, 1e-7):
        ended, excess = structure.verdict_after_change(amount)
        assert (ended.how, ended.said) == (REACHED, "") and 0.0 < excess < 0.1
    large = {name: 1e3 * block for name, block in structure.values.items()}
    structure._values_after_change = lambda amount: large  # type: ignore[method-assign]
    ended, excess = structure.verdict_after_change(1e-9)
    assert ended.said.endswith(" changes most") and excess > 1.0
    name = ended.said.split()[0]
    change = 999.0 * np.abs(structure.values[name]).max()
    assert excess == pytest.approx(change / (100.0 * (1e-9 + 1e-13) * structure.condition[name]), rel=1e-9)

    def refused(amount: float) -> Any:
        raise EomgenError("it closes no more")

    structure._values_after_change = refused  # type: ignore[method-assign]
    ended, excess = structure.verdict_after_change(1e-9)
    assert (ended.how, excess) == (REFUSED, 0.0) and "it closes no more" in ended.said


def test_models_of_subjects_are_built_once_and_reasons_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    built: list[tuple[Any, str]] = []

    def build(scene: Any, real: str) -> Any:
        built.append((scene, real))
        if real == "float":
            raise EomgenError("no floats")
        return SimpleNamespace(name=scene.name)

    monkeypatch.setattr(subjects.pipeline, "build", build)
    subject = Subject(SWING, {})
    assert subject.has(FACTORS) and subject.has(FACTORS) and not subject.has(SINGLE) and not subject.has(SINGLE)
    assert subject.why_not == {SINGLE: "no floats"} and [real for _, real in built] == ["double", "float"]
    assert subject.factors == subjects._SETS[0] and subject.name == "swing" and len(built) == 3
    assert subject.used == {LENGTH, MASS, TIME, GRAVITY, RATIO, ORIGIN}
    assert built[0][0] is not subject.scene and built[2][0] is subject.scene
    given = Subject(subject.scene, {})
    assert (
        not given.has(FACTORS) and given.why_not[FACTORS] == "the scene is given as a Scene, whose numbers have no text"
    )
    fixed = subject_of()

    def read(data: Any) -> Any:
        if any(f"{name}" in str(data) for name in (LENGTH, MASS)):
            raise EomgenError("fixed")
        return "scene"

    fixed.read = read  # type: ignore[method-assign]
    assert fixed._with_factors() == ("scene", subjects._SETS[2])
    fixed.read = lambda data: (_ for _ in ()).throw(ValueError("2 kg"))  # type: ignore[method-assign]
    with pytest.raises(EomgenError, match="its numbers cannot be scaled: 2 kg"):
        fixed._with_factors()


def test_factors_multiply_numbers_by_their_units() -> None:
    scene = {
        **SWING, "gravity": [0, 0, -9.81],
        "joints": {"pin": {**SWING["joints"]["pin"], "stiffness": 3.0}},
        "bodies": {"rod": {"mass": 1.0, "inertia": [1.0, 2.0, 3.0]}, "arm": {"mass": 7.0}, "bob": {"mass": 2.0}},
    }  # fmt: skip
    scaled = with_factors(scene, (LENGTH, MASS, TIME, STIFFNESS, GRAVITY, RATIO, RATIO_LAST))
    bodies = scaled["bodies"]
    assert bodies["rod"]["mass"] == f"{RATIO} * (({MASS}) * (1.0))"
    assert bodies["rod"]["inertia"][1] == f"{RATIO} * (({MASS} * {LENGTH}**(2)) * (2.0))"
    assert bodies["bob"]["mass"] == f"{RATIO_LAST} * (({MASS}) * (2.0))"
    assert scaled["gravity"] == [0, 0, f"({LENGTH} * {TIME}**(-2) * {GRAVITY}) * (-9.81)"]
    stiffness = scaled["joints"]["pin"]["stiffness"]
    assert stiffness.endswith(f"* {STIFFNESS}) * (3.0)")
    assert used_factors(scaled, (STIFFNESS, "factor_of_damping")) == {STIFFNESS}
    alone = with_factors({**scene, "bodies": {"rod": {"mass": 1.0}}}, (RATIO, RATIO_LAST))
    assert alone["bodies"]["rod"]["mass"] == f"{RATIO} * (1.0)"
    units = SceneUnits(2.0, 3.0, 5.0)
    sizes = {unit: units.size(unit) for unit in ("m", "kg", "s", "N", "rad", "1", "", "m/s", "kg m^2")}
    assert sizes == {"m": 2, "kg": 3, "s": 5, "N": 0.24, "rad": 1, "1": 1, "": 1, "m/s": 0.4, "kg m^2": 12}


@pytest.mark.parametrize(
    ("name", "facts", "why"),
    [
        ("stiffness", {"used": {STIFFNESS}}, ""),
        ("stiffness", {"used": set()}, "it has no key stiffness with a value"),
        ("gravity", {"used": set()}, "it is without gravity"),
        ("gravity", {"factors": ()}, f"it has numbers that have to be fixed, so no factor {GRAVITY}"),
        ("ratio", {"has": lambda which: False}, "its numbers cannot be scaled: fixed"),
        ("length", {"not_similar": lambda factors: f"not in {factors[0]}"}, f"not in {LENGTH}"),
        ("mass", {"not_similar": lambda factors: ""}, ""),
        ("structure", {"data": None}, "the scene has no text whose numbers could be moved"),
        ("structure", {"data": {}}, ""),
        ("float", {"has": lambda which: which != SINGLE, "why_not": {SINGLE: "no floats"}}, "no floats"),
        ("step", {}, ""),
    ],
)  # fmt: skip
def test_ladders_that_a_scene_has_not(name: str, facts: dict[str, Any], why: str) -> None:
    known = {"has": lambda which: True, "why_not": {FACTORS: "fixed"}, "factors": subjects._SETS[0], "used": set()}
    assert register.BY_NAME[name].applies(cast(Any, SimpleNamespace(**known | facts))) == why


def test_conditions_of_factors_units_and_places() -> None:
    asked: list[Any] = []
    factors = (
        Factor("R", "pin.position", 0, 1, 0, 1),
        Factor("SE3", "free", 1, 7, 1, 6),
        Factor("R", "arm", 8, 1, 7, 1),
    )

    def conditions(**given: Any) -> RunConditions:
        return RunConditions(**{"model": OWN, "step": 1.0, "steps": ROWS, "q": np.ones(9), "v": np.ones(8), **given})

    subject: Any = SimpleNamespace(
        model=lambda which: SimpleNamespace(factors=factors, nq=9), scene=SimpleNamespace(coordinates="absolute"),
        conditions=conditions, in_units=lambda units, given: asked.append(units) or given,
    )  # fmt: skip  # a table
    moved = register.BY_NAME["origin"].conditions(subject, 100.0)
    assert moved.q.tolist() == [101.0, 1, 1, 1, 1, 101.0, 1, 1, 1] and moved.parameters == {ORIGIN: 100.0}
    assert (
        moved.shift is not None
        and moved.shift.tolist() == [100.0, 0, 0, 0, 0, 100.0, 0, 0, 0]
        and moved.model == FACTORS
    )
    subject.scene.coordinates = "joint"
    assert register.BY_NAME["origin"].conditions(subject, 100.0).q.tolist() == [101.0, *[1.0] * 8]
    stiff = register.BY_NAME["stiffness"].conditions(subject, 1e3)
    assert (stiff.model, stiff.parameters) == (FACTORS, {STIFFNESS: 1e3})
    for name, units in (
        ("length", SceneUnits(length=7.0)),
        ("mass", SceneUnits(mass=7.0)),
        ("time", SceneUnits(time=7.0)),
    ):
        register.BY_NAME[name].conditions(subject, 7.0)
        assert asked[-1] == units


def test_methods_of_subjects_are_those_that_can_step_the_scene() -> None:
    subject = Subject.__new__(Subject)
    subject._models = {OWN: model_of()}
    assert set(subject.methods(ladders="few")) == {"rk4", "generalized_alpha"}
    assert subject.methods(fine_by="tolerance") == ["taylor"] and subject.methods(fine_by="damping") == [
        "generalized_alpha"
    ]
    assert subject.runs("rk4") and not subject.runs("auto") and not subject.runs("rk4_partitioned")


def test_rates_of_constrained_scenes_are_those_with_their_reactions() -> None:
    model: Any = SimpleNamespace(
        multipliers=("a",), nz=1, constrained_dynamics=lambda q, v, z, parameters: (q + parameters["x"], None),
        internal_rates=lambda q, v, z, parameters: 2.0 * z,
    )  # fmt: skip
    found = subjects._rates(model, np.array([1.0, 2.0]), np.zeros(2), np.array([4.0]), {"x": 3.0})
    assert found.tolist() == [4.0, 5.0, 8.0]


def test_steppers_are_compiled_unless_they_are_of_the_model(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[str] = []
    model: Any = SimpleNamespace(library=SimpleNamespace(layout={"built_method": "RKMK4"}), stepper=made.append)
    for method in ("rk4", "generalized_alpha", "no such method"):
        compile_stepper(model, method)
    assert made == ["generalized_alpha"]


def test_results_by_ladder(tmp_path: Path) -> None:
    cell = Cell("gravity", 1.0, "rk4", "holds", 1e-9, None, 1e-2, "", "", 0.1)
    other = replace(cell, ladder="step", verdict="fails", error=None)
    found = Extremes("swing", "a.toml", (cell, other))
    assert found.of("gravity") == (cell,) and found.of("step") == (other,) and found.fails == (other,)
    assert cell.name == "gravity:1:rk4" and found.command(cell) == "eomgen extremes a.toml --cell gravity:1:rk4"
