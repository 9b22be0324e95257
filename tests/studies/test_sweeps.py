"""Studies of speed against accuracy whose runs follow laws: points, ends of ladders, refinements, fronts and slopes."""

from __future__ import annotations

import csv
import json
import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from eomgen.base.figures import new_figure
from eomgen.errors import FileError, ModelError, NumericalError
from eomgen.lie.product import Factor
from eomgen.products.studies import run_commands
from eomgen.products.studies.work_precision import reference as referring
from eomgen.products.studies.work_precision import result as results
from eomgen.products.studies.work_precision import study as studying
from eomgen.products.studies.work_precision.axes import Configuration, candidates, checked_axes, one_of_each
from eomgen.products.studies.work_precision.observation import ErrorSize, errors
from eomgen.products.studies.work_precision.reference import RunReference, reference
from eomgen.products.studies.work_precision.result import DEMANDS, OFF, Point, Tradeoff, short_duration
from eomgen.products.studies.work_precision.running import Grid
from eomgen.products.studies.work_precision.study import PointJournal, _WorkPrecisionStudy
from tests.studies.runs_of_laws import Law, LawRunner, model_of, motion

GRID = Grid(0.01, 64, coarsest=8, recorded=1)
LAWS = {
    "rk4": Law(1e-3, 4, 1e-4), "generalized_alpha": Law(1e-2, 2, 2e-5), "taylor": Law(1.0, 9, 1e-3),
    "rk45": Law(0.5, 5, 1e-4),
}  # fmt: skip  # a table
HALVED = tuple(2**k for k in range(9))


def law_of(configuration: Configuration) -> Law | None:
    return LAWS.get(configuration.method)


def study_of(runner: LawRunner, methods: tuple[str, ...] = ("rk4", "generalized_alpha"), **changes: Any) -> Any:
    defaults = replace(runner.formulations.description.simulation, step=0.01)
    given = {
        "in_coarsest": HALVED, "axes": ("method", "resolution"), "methods": methods, "budget": 1e9, "repeats": 5,
        "progress": None, "announce": None, "absolute": False,
    } | changes  # fmt: skip  # a table
    return _WorkPrecisionStudy(cast(Any, runner), defaults, **given)


def result_of(study: Any, outputs: tuple[str, ...] = ("way",), journal: PointJournal | None = None) -> Tradeoff:
    return cast(Tradeoff, study.result(outputs, "largest", journal or PointJournal(None, "", resume=False), 0.0))


@pytest.fixture(autouse=True)
def exact(monkeypatch: pytest.MonkeyPatch) -> None:
    """The reference is the motion without error, known to 1e-9."""
    held = RunReference(motion(0.0), "laws", "laws again", {"way": ErrorSize(1e-9, 1e-9, 1e-9)})
    monkeypatch.setattr(studying, "reference", lambda *given: held)


def test_points_have_the_errors_and_times_of_their_laws() -> None:
    runner = LawRunner(law_of, GRID)
    found = result_of(study_of(runner))
    own, *others = found.points
    assert (own.configuration, own.value, own.kind) == (Configuration("joint", "rk4"), pytest.approx(0.01), "step")
    for name, law in (("rk4", LAWS["rk4"]), ("generalized_alpha", LAWS["generalized_alpha"])):
        points = [point for point in found.points if point.configuration.method == name]
        steps = {round(0.08 / point.value): point for point in points}
        assert set(steps) == set(HALVED[: len(steps)])
        for number, point in steps.items():
            error = law.size * (8.0 / number) ** law.order
            assert found.error(point) == pytest.approx(max(error, 1e-9), rel=1e-3 if error < 1e-2 else 0.3)
            assert point.seconds == pytest.approx(law.step * 8 * number) and point.least == point.seconds
            assert (point.ended, point.order, point.stats) == ("reached", law.order, {"steps": 8.0 * number})
        last = min(found.error(point) for point in points)
        assert last <= 1e-9 or len(steps) == len(HALVED)  # finer ones would show the reference
    assert found.points[1].configuration.method in ("rk4", "generalized_alpha") and len(others) > 12
    assert found.span == (0.0, 0.64, 64) and found.seconds > 0.0 and found.left_out == {}
    assert found.compiled == runner.compiled and found.machine["python"]
    slopes = {slope.configuration.method: slope for slope in found.slopes}
    for name, slope in slopes.items():
        assert slope.slope == pytest.approx(LAWS[name].order, abs=0.01) and not slope.is_off
        assert slope.declared == LAWS[name].order and 3 <= slope.points <= 4
    assert set(slopes) == {"rk4", "generalized_alpha"}


def test_ladders_run_side_by_side_and_points_near_the_front_are_timed_again() -> None:
    runner = LawRunner(law_of, GRID)
    told: list[tuple[int, int, str]] = []
    found = result_of(study_of(runner, progress=lambda *work: told.append(work)))
    order = [point.configuration.method for point in found.points[1:7]]
    assert order == ["rk4", "generalized_alpha"] * 3
    assert told[-1][0] == len(found.points) + (len(HALVED) > 3) or told[-1][0] >= len(found.points)
    assert all(done <= every for done, every, _ in told)
    for point in found.usable:
        cost = min((one.seconds or 0.0 for one in found.usable if found.error(one) <= found.error(point)), default=0.0)
        if (point.seconds or 0.0) <= 1.5 * cost and found.error(point) <= 0.1:
            assert point.repeats >= 5
    assert {point.repeats for point in found.usable} <= {3, 5, 8}
    again = LawRunner(law_of, GRID)
    once = result_of(study_of(again, repeats=1))
    assert {point.repeats for point in once.usable} == {1}


def test_tolerances_and_methods_that_only_choose_steps() -> None:
    runner = LawRunner(law_of, GRID)
    found = result_of(study_of(runner, ("rk45", "taylor")))
    for name in ("rk45", "taylor"):
        points = [point for point in found.points if point.configuration.method == name and point.kind == "tolerance"]
        values = [point.value for point in points]
        (candidate,) = candidates("joint", model_of(), [name], {})
        assert values == list(candidate.tolerances[: len(values)]) and values == sorted(values, reverse=True)
        for point in points:
            assert found.error(point) == pytest.approx(max(LAWS[name].size * point.value, 1e-9), rel=0.01)
    assert {slope.configuration.method for slope in found.slopes} <= {"rk4"}
    alone = result_of(study_of(LawRunner(law_of, GRID), ("rk45",), axes=("method",)))
    assert [(point.kind, point.value) for point in alone.points[1:]] == [("tolerance", 1e-11)]
    steps = result_of(study_of(LawRunner(law_of, GRID), ("generalized_alpha",), axes=("method",)))
    assert [round(0.08 / point.value) for point in steps.points] == [8, 8]
    default = result_of(study_of(LawRunner(law_of, GRID), (), axes=("resolution",)))
    assert {point.configuration.method for point in default.points} == {"rk4"}


def test_what_the_budget_and_the_limit_leave_out_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = SimpleNamespace(now=0.0)

    def process_time() -> float:
        clock.now += 1.0
        return float(clock.now)

    monkeypatch.setattr(studying.time, "process_time", process_time)
    limited = LawRunner(law_of, GRID, limit=1.5)
    found = result_of(study_of(limited, ("generalized_alpha",)))
    assert found.left_out == {"generalized_alpha rho_inf 0.8, joint, 8 finer": "more than 1.5 s a run"}
    assert all(point.took == 1.0 for point in found.points)
    spent = result_of(study_of(LawRunner(law_of, GRID), ("generalized_alpha",), budget=5.5, repeats=1))
    # of the own point and of three of the ladder 4 s are spent, and 2 s are expected for the next
    assert len(spent.points) == 5 - 1 and spent.left_out == {
        "generalized_alpha rho_inf 0.8, joint, 6 finer": "the budget is spent"
    }


def test_ladders_end_after_four_refusals_in_a_row_and_where_errors_no_longer_fall() -> None:
    refused = LawRunner(lambda one: law_of(one) if one.method == "rk4" else None, GRID)
    found = result_of(study_of(refused))
    points = [point for point in found.points if point.configuration.method == "generalized_alpha"]
    assert [point.ended for point in points] == ["refused"] * 4 and points[0].seconds is None
    assert found.failures == tuple(points)
    flat = LawRunner(lambda one: Law(1e-7, 0, 1e-5) if one.method == "generalized_alpha" else law_of(one), GRID)
    found = result_of(study_of(flat))
    assert len([point for point in found.points if point.configuration.method == "generalized_alpha"]) == 3


def test_builds_that_fail_or_take_too_long_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    failing = LawRunner(lambda one: "no such stepper" if one.method == "generalized_alpha" else law_of(one), GRID)
    assert result_of(study_of(failing)).left_out == {"generalized_alpha rho_inf 0.8, joint": "no such stepper"}
    monkeypatch.setattr(studying, "LEAST_BUILDING", 0.5)
    said: list[str] = []
    long = result_of(study_of(LawRunner(law_of, GRID), budget=0.1, announce=said.append))
    assert long.left_out["generalized_alpha rho_inf 0.8, joint"] == "not built: builds have taken 1 s"
    assert long.not_built == ("generalized_alpha rho_inf 0.8, joint",)
    assert said == ["methods to build, or to take from the cache: 2; then up to 0 s of runs"]


def test_formulations_without_models_or_without_a_reason_are_left_out() -> None:
    scenes = ("joint", "SE3", "R3xSO3", "joint, rigid")
    models = {"SE3": "no absolute beams"}
    runner = LawRunner(law_of, GRID, scenes, ("joint, rigid",), models)
    found = result_of(study_of(runner, ("rk4",)))
    assert {point.configuration.formulation for point in found.points} == {"joint", "joint, rigid"}
    why = "joint coordinates have no constraints; studied with the axis formulation named"
    assert found.left_out == {"SE3": why, "R3xSO3": why}
    asked = result_of(study_of(LawRunner(law_of, GRID, scenes, ("joint, rigid",), models), ("rk4",), absolute=True))
    assert {point.configuration.formulation for point in asked.points} == {"joint", "R3xSO3", "joint, rigid"}
    assert asked.left_out == {"SE3": "no absolute beams"}
    with pytest.raises(ModelError, match="no absolute beams"):
        result_of(study_of(LawRunner(law_of, GRID, ("SE3",), (), models)))
    with pytest.raises(ModelError, match="no method runs on this scene: partitioned needs a system with"):
        result_of(study_of(LawRunner(law_of, GRID), ("rk4_partitioned",)))


def test_the_best_three_are_refined_one_setting_at_a_time() -> None:
    axes = ("method", "resolution", "parameters", "policy", "arithmetic", "profile")

    def law(one: Configuration) -> Law | None:
        sizes = {0.0: 1.0, 0.5: 2.0, 0.8: 4.0, 0.9: 8.0, 1.0: 16.0}
        found = law_of(one)
        return (
            None if found is None else replace(found, size=found.size / sizes.get(one.parameters.get("rho_inf", 0), 1))
        )

    found = result_of(study_of(LawRunner(law, GRID), ("generalized_alpha",), axes=axes))
    plain = Configuration("joint", "generalized_alpha")
    varied = [
        replace(one.configuration, parameters={}) for one in found.points
        if replace(one.configuration, parameters={}, policy="", settings={}) != plain or one.configuration.policy
    ]  # fmt: skip
    policies = ("rtol 1e-08", "rtol 1e-06", "rtol 0.0001", "factors at every step")
    assert {(one.policy, one.real, one.profile) for one in varied if one.method == plain.method} == {
        *((name, "double", plain.profile) for name in policies), ("", "float", plain.profile),
        *(("", "double", profile) for profile in ("reproducible", "quick") if profile != plain.profile),
    }  # fmt: skip
    several = [tuple(one.configuration.parameters.items()) for one in found.points if one.configuration.policy]
    assert len(set(several)) <= 3 and (("rho_inf", 1.0),) in several  # with the smallest errors
    only = result_of(study_of(LawRunner(law, GRID), ("generalized_alpha",), axes=(*axes[:3], "arithmetic")))
    assert {(one.configuration.policy, one.configuration.profile) for one in only.points} == {("", plain.profile)}


def test_a_reference_without_the_quantity_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    held = RunReference(motion(0.0), "laws", "laws again", {"q": ErrorSize(1e-9, 1e-9, 1e-9)})
    monkeypatch.setattr(studying, "reference", lambda *given: held)
    with pytest.raises(NumericalError, match="errors in way is unknown: the two references have no such quantity"):
        result_of(study_of(LawRunner(law_of, GRID)))


def test_points_and_reference_of_a_folder_are_read_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = result_of(study_of(LawRunner(law_of, GRID)), journal=PointJournal(tmp_path, "one", resume=False))
    monkeypatch.setattr(studying, "reference", None)  # it is in the folder
    runner = LawRunner(law_of, GRID)
    again = result_of(study_of(runner), journal=PointJournal(tmp_path, "one", resume=True))
    assert again.points == first.points and again.reference == first.reference and not runner.made
    with pytest.raises(FileError):
        PointJournal(tmp_path, "another", resume=True)
    seen = replace(
        motion(0.25), components=motion(0.0).components._replace(factors=(Factor("R", "slide", 0, 1, 0, 1),)),
        rows=("a", "b"), poses={"rod": np.ones((11, 7))}, twists={"rod": np.ones((11, 6))},
    )  # fmt: skip
    journal = PointJournal(tmp_path / "other", "one", resume=False)
    held = RunReference(seen, "by", "second", {"q": ErrorSize(1.0, 2.0, 3.0)})
    assert journal.reference() is None
    journal.keep_reference(held)
    back = journal.reference()
    assert back is not None and (back.described, back.second, back.uncertainty) == ("by", "second", held.uncertainty)
    assert (back.observation.components, back.observation.rows) == (seen.components, seen.rows)
    assert all(np.array_equal(array, seen.arrays[name]) for name, array in back.observation.arrays.items())


# -- references --------------------------------------------------------------------------------------------------------


@pytest.fixture
def every_motion_moves(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(referring, "possible", lambda name, given, chooses_steps=False: given["tolerance"] >= 1e-13)


@pytest.mark.usefixtures("every_motion_moves")
def test_references_are_two_runs_of_different_families(monkeypatch: pytest.MonkeyPatch) -> None:
    laws = {"taylor": Law(1.0, 9, 1.0), "rk4": Law(1e-4, 4, 1.0), "generalized_alpha": Law(1e-3, 2, 1.0)}
    runner = LawRunner(lambda one: laws.get(one.method), GRID)
    every = candidates("joint", model_of(), list(laws), {})
    said: list[str] = []
    held = reference(cast(Any, runner), every, 1e9, said.append)
    assert said == ["reference: taylor, joint", "reference: rk4, joint"]
    assert held.described == "taylor, joint, tolerance 1e-13" and held.second.startswith("rk4, joint, step ")
    first = [number for one, number, _ in runner.made if one.method == "taylor"]
    assert first[-1] == 1e-13 and len(first) == 2 and first[0] > 1e-13
    steps = [number for one, number, _ in runner.made if one.method == "rk4"]
    assert steps == [2.0**k for k in range(3, 3 + len(steps))]
    apart = 1e-4 * steps[-1] ** -4.0
    assert held.uncertainty["q"].largest == pytest.approx(abs(apart - 1e-13), rel=1e-2, abs=1e-14)
    assert held.bar("q") == held.uncertainty["q"].largest and held.bar("none") == 0.0
    low = reference(cast(Any, runner), [one for one in every if one.row.name != "taylor"], 1e9, said.append)
    assert low.described.startswith("rk4, joint, step ") and low.second.endswith(", extrapolated")
    alone = reference(cast(Any, runner), [one for one in every if one.row.name == "rk4"], 1e9, said.append)
    assert alone.second == "itself at half its accuracy" and alone.to_dict()["by"] == alone.described
    refused = candidates("joint", model_of(), ["rosenbrock"], {})
    with pytest.raises(NumericalError, match="for this scene: rosenbrock on joint: rosenbrock is refused; try:"):
        reference(cast(Any, runner), refused, 1e9, said.append)


@pytest.mark.usefixtures("every_motion_moves")
def test_references_that_differ_by_a_hundredth_are_none() -> None:
    laws = {"taylor": Law(1.5e11, 9, 1.0), "rk4": Law(1e-4, 4, 1.0)}
    runner = LawRunner(lambda one: laws.get(one.method), GRID)
    with pytest.raises(NumericalError, match=r"differ by 1\.48 % of the motion: no error can be computed from them"):
        reference(cast(Any, runner), candidates("joint", model_of(), list(laws), {}), 1e9, lambda _: None)


def test_extrapolated_observations_are_of_higher_order() -> None:
    exact, coarse, fine = (motion(1e-2 * h**2) for h in (0.0, 1.0, 0.5))
    made = referring._extrapolate(fine, coarse, 2)
    assert errors(made, exact)["way"].largest < 1e-14 < errors(fine, exact)["way"].largest


# -- results of hand-made points ---------------------------------------------------------------------------------------


def point(method: str, value: float, error: float, seconds: float | None = None, **more: Any) -> Point:
    sizes = {"q": ErrorSize(error, 0.5 * error, 0.25 * error)}
    given = {"ended": "reached", "said": "", "order": 4} | more
    return Point(Configuration("joint", method), "step", value, error=sizes, seconds=seconds, least=seconds, **given)


def study_by_hand(*points: Point, uncertainty: float = 1e-12) -> Tradeoff:
    known = {"by": "laws", "held against": "laws again", "uncertainty": {"q": {"largest": uncertainty}}}
    machine = {"processor": "abacus", "compiler": "hand"}
    return Tradeoff(
        "law", "q", "largest", (0.0, 2.0, 8), points, known, machine, {"a": 3.0}, {"b": "not built: c"}, 9.0
    )


def test_fronts_verdicts_and_best_points() -> None:
    fast, equal, fine, slow = (
        point("a", 0.1, 1e-2, 1.0), point("b", 0.1, 1e-2, 1.0), point("a", 0.01, 1e-4, 5.0),
        point("b", 0.01, 1e-3, 6.0),
    )  # fmt: skip
    wrong, silent = point("c", 1.0, 0.5, 0.1, said="doubtful"), point("c", 2.0, math.nan, 0.05)
    failed = point("c", 3.0, 1.0, ended="too long", said="more than 1 s")
    untimed = point("a", 0.001, 1e-6)
    beyond = point("b", 1e-3, 1e-13, 7.0), point("b", 1e-4, 1e-14, 8.0)
    found = study_by_hand(fast, equal, fine, slow, wrong, silent, failed, untimed, *beyond)
    assert found.front == (fast, fine, beyond[0])
    verdicts = ["front", "dominated", "front", "dominated", "wrong, said", "wrong, silent", "too long", "dominated",
                "front", "dominated"]  # fmt: skip
    assert [found.verdict(one) for one in found.points] == verdicts
    assert found.wrong == (wrong, silent) and found.silent == (silent,) and found.failures == (failed,)
    assert found.best(1e-2) is fast and found.best(9e-3) is fine and found.best(1e-15) is None
    assert (found.uncertainty, found.error(silent), found.not_built) == (1e-12, math.inf, ("b",))
    assert replace(found, measure="rms").error(fast) == 5e-3
    assert found.usable == tuple(one for one in found.points if one not in (failed, untimed))


@pytest.mark.parametrize(("order", "off"), [(4.0, False), (3.86, False), (3.8, True), (4.2, True)])
def test_slopes_are_fitted_over_the_smallest_steps_that_tell(order: float, off: bool) -> None:
    steps = [0.5**k for k in range(12)]
    points = [point("a", h, 1e-3 * h**order if h < 1.0 else 0.5) for h in steps]
    few = [point("b", h, 1e-3 * h**4) for h in (0.5, 0.25)]
    (slope,) = study_by_hand(*points, *few, uncertainty=1e-13).slopes
    assert slope.slope == pytest.approx(order, rel=1e-9) and slope.points == 4 and slope.is_off is off
    assert OFF == 0.15 and slope.declared == 4
    told = [h for h in steps if 3e-12 < 1e-3 * h**order < 2e-3]
    bent = [point("a", h, 1e-3 * h**order * (1.0 if h <= told[-4] else 7.0)) for h in steps]
    assert study_by_hand(*bent, uncertainty=1e-13).slopes[0].slope == pytest.approx(order, rel=1e-9)


def test_files_have_a_row_for_each_point(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    one = replace(point("a", 0.1, 1e-2, 1.5, said="doubtful"), repeats=3, stats={"steps": 7.0}, took=2.5)
    one = replace(one, configuration=replace(one.configuration, parameters={"rho_inf": 0.5}, policy="frozen"))
    two = replace(point("b", 0.2, math.inf, ended="refused"), error={})
    found = study_by_hand(one, two)
    monkeypatch.setattr(results, "draw", lambda study, path: path)
    data, table, picture = found.save(tmp_path / "new")
    rows = list(csv.DictReader(table.open(encoding="utf-8")))
    assert [(row["method"], row["parameters"], row["policy"], row["value"], row["verdict"]) for row in rows] == [
        ("a", "rho_inf=0.5", "frozen", "0.1", "front"), ("b", "", "", "0.2", "refused"),
    ]  # fmt: skip
    assert [rows[0][name] for name in ("q largest", "q rms", "q final", "seconds", "least_seconds", "steps")] == [
        "0.01", "0.005", "0.0025", "1.5", "1.5", "7.0",
    ]  # fmt: skip
    assert [rows[1][name] for name in ("q largest", "q rms", "q final", "seconds", "steps", "said")] == [""] * 6
    assert (rows[0]["said"], rows[0]["repeats"]) == ("doubtful", "3")
    read = json.loads(data.read_text(encoding="utf-8"))
    assert read["span"] == {"start": 0.0, "end": 2.0, "rows": 8} and read["front"] == [one.label]
    assert [Point.from_dict(each) for each in read["points"]] == [one, two]
    assert read["points"][0]["verdict"] == "front" and picture.name == "tradeoff.png"
    unknown = {**read["points"][0], "errors": {"q": {"largest": None, "rms": 1.0, "final": None}}}
    assert Point.from_dict(unknown).error["q"] == ErrorSize(math.inf, 1.0, math.inf)
    for change in ({"seconds": "x"}, {"repeats": []}, {"errors": {"q": {"largest": "1", "rms": 1.0, "final": 1.0}}}):
        with pytest.raises(TypeError, match="times, counts and errors are numbers"):
            Point.from_dict(read["points"][0] | change)


def test_pictures_have_a_curve_for_each_configuration_and_the_front() -> None:
    own = [point("own", 0.1 / k, 1e-3 / k, 4.0 * k) for k in (2, 1)]
    others = [point(f"m{k}", h, 2e-3 * h * 1.1**k, 1e-3 / h) for k in range(11) for h in (0.1, 0.01)]
    silent = point("own", 1.0, 50.0, 0.5)
    study = study_by_hand(*own, *others, silent, uncertainty=1e-9)
    axis = new_figure((5.0, 4.0)).subplots()
    results._curves(axis, study)
    curves = {line.get_label().partition(" ")[0].rstrip(","): line for line in axis.get_lines()}
    assert (
        set(curves) >= {"m0", "m8", "2"}
        and "m10" not in curves
        and axis.get_lines()[-1].get_label() == "2 other configurations"
    )
    assert curves["m0"].get_xdata().tolist() == pytest.approx([10.0, 100.0])
    assert curves["m0"].get_ydata().tolist() == pytest.approx([2e-4, 2e-5])
    own_line = next(
        line for line in axis.get_lines() if 1e4 > line.get_xdata()[:1].sum() >= 500.0 or "own" in line.get_label()
    )
    assert own_line.get_ydata()[0] == 10.0 and own_line.get_xdata().tolist() == [500.0, 4000.0, 8000.0]
    axis = new_figure((5.0, 4.0)).subplots()
    results._marks(axis, study)
    front, usual, wrong = axis.get_lines()
    assert front.get_xdata().tolist() == pytest.approx([1e3 * (one.seconds or 0.0) for one in study.front])
    assert front.get_ydata().tolist() == [study.error(one) for one in study.front]
    assert (usual.get_xdata().tolist(), usual.get_ydata().tolist()) == ([8000.0], [5e-4])
    assert (wrong.get_xdata().tolist(), wrong.get_ydata().tolist()) == ([500.0], [10.0])
    results._describe(axis, study)
    assert axis.get_ylim() == pytest.approx((1e-9 / 4.0, 25.0))
    assert axis.get_title(loc="left").startswith(
        "law: 2 s, 25 runs, reference known at 9 times\nreference: laws; held against"
    )


@pytest.mark.parametrize(
    ("seconds", "text"), [(1.234, "1.23 s"), (1.0, "1 s"), (0.99, "990 ms"), (1e-3, "1 ms"), (7.894e-6, "7.89 us")]
)
def test_durations_have_three_digits(seconds: float, text: str) -> None:
    assert short_duration(seconds) == text


def test_tables_and_remarks_say_what_was_found(capsys: pytest.CaptureFixture[str]) -> None:
    own, best = point("own", 0.1, 1e-3, 4.0), point("a", 0.1, 1e-5, 2.0)
    others = [point("b", 0.1, 2e-5, 3.0), point("c", 0.1, 0.5, 0.5), point("d", 1.0, 1.0, ended="stopped")]
    slow = [point("e", h, 1e-3 * h**3.5, 9.0) for h in (0.5, 0.25, 0.125)]
    found = study_by_hand(own, best, *others, *slow)
    run_commands._print_tradeoff(found)
    lines = {line.split()[0]: " ".join(line.split()) for line in capsys.readouterr().out.splitlines() if line.strip()}
    assert lines["0.0001"] == "0.0001 a, joint 0.1 s 1.0e-05 2 s b, joint 1.5 x"
    assert lines["1e-08"] == "1e-08 none meets it" and len(DEMANDS) == 4
    assert lines["law:"].startswith("law: largest error of q, 2 s")
    remarks = run_commands._remarks(found)
    assert remarks == [
        "reference: laws, known to 1.0e-12 by laws again",
        "the scene's own, own, joint, step 0.1: error 1.0e-03 in 4 s; a, joint, step 0.1 is 2 x as fast at no more",
        "order as declared within 0.15: 0 of 1 configuration; e, joint 3.50 (declared 4)",
        "wrong by more than 10 %: 1 run, of which 0 said something",
        "did not reach the end: 1 run",
        "left out: 1 configuration, with reasons in tradeoff.json; 1 for want of time: --resume goes on with them",
        "8 runs in 9 s, 3 s of it building; abacus, hand",
    ]
    plain = replace(study_by_hand(own, best), left_out={"b": "refused"})
    assert run_commands._remarks(plain)[2:4] == [
        "order as declared within 0.15: 0 of 0 configurations",
        "left out: 1 configuration, with reasons in tradeoff.json",
    ]  # fmt: skip
    near = study_by_hand(own, point("a", 0.1, 1e-3, 3.8))
    assert run_commands._remarks(near)[1].endswith("error 1.0e-03 in 4 s")
    many = [replace(each, configuration=Configuration("joint", f"m{k}")) for k in range(6) for each in slow]
    told = run_commands._remarks(study_by_hand(*many))[2]
    assert told.count("declared 4") == 4 and told.endswith("; and 2 more, under slopes in tradeoff.json")


def test_axes_and_families() -> None:
    assert checked_axes(()) == ("formulation", "method", "parameters", "resolution", "policy", "arithmetic", "profile")
    assert checked_axes((), ("profile",))[-1] == "arithmetic" and checked_axes(["fidelity"]) == ("fidelity",)
    every = candidates("joint", model_of(), ["rk4", "rk45", "generalized_alpha", "hht"], {})
    assert [one.row.name for one in one_of_each(every)] == ["rk4", "rk45", "generalized_alpha"]
    assert [dict(one.parameters) for one in every[2].configurations()] == [
        {"rho_inf": value} for value in (0.0, 0.5, 0.8, 0.9, 1.0)
    ]
    assert every[2].configuration({"rho_inf": 0.3, "order": 2.0}).parameters == {"rho_inf": 0.3}
