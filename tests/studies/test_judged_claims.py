"""Verdicts on closed forms of formulas that bend, jump, leave their domain or are wrong, on the tape: remarked where
they do, neither silently passed nor called wrong."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

import eomgen
from eomgen.base.figures import new_figure
from eomgen.errors import UsageError
from eomgen.products.studies.verification import check as checking
from eomgen.products.studies.verification import report as reporting
from eomgen.products.studies.verification.claims.claim import Array, Claim, Space
from eomgen.products.studies.verification.claims.partials import FIRST, partial_claims
from eomgen.products.studies.verification.differences import LADDER, NonSmoothOperations, Remarks
from eomgen.products.studies.verification.report import CheckReport, Disagreement, FormReport, _panels
from eomgen.products.studies.verification.states import CheckedStates
from eomgen.symbolic.external import Call
from eomgen.symbolic.operations import Op
from tests.studies.claims_of_scenes import space_of


@cache
def swing(effort: str) -> Space:
    """Return the space of a pendulum with a formula in its joint."""
    builder = eomgen.SceneBuilder("swing").body("bob", 2.0, center_of_mass=[0, 0, -0.5], inertia=[0.1, 0.1, 0.1])
    builder.joint("pin", "revolute", "base", "bob", axis=[0, 1, 0])
    builder.curve("bend", points=[[-1, 0], [0.1, 0], [1, 1]], interpolation="linear", outside="hold")
    return space_of(builder.effort("push", "pin", effort).build(), ("residual", "partials"))


def judged(
    effort: str,
    places: list[tuple[float, float]],
    form: str = "K",
    change: Callable[[Array], Array] = lambda value: value,
) -> FormReport:
    """Return the report on the partials of a formula at (q, v) of states."""
    space = swing(effort)
    claim = next(claim for claim in partial_claims(space) if claim.name == f"partials.{form}")
    own = claim.value
    q, v = (np.array([[place[k]] for place in places]) for k in (0, 1))
    blocks = {"q": q, "v": v, "a": np.ones_like(q), "t": np.zeros_like(q)}
    states = CheckedStates(blocks, tuple(f"state {k}" for k in range(len(places))), ())
    wrong = replace(claim, value=lambda engine, state: change(np.array(own(engine, state))))
    rng = np.random.default_rng(3)
    return checking.judge_claim(wrong, space.engine, space.engine, space.system, states, rng)


def test_smooth_formulas_agree_with_all_their_numbers() -> None:
    found = judged("sin(3 * q.pin)", [(0.1, 0.0), (0.7, 1.0)])
    assert (found.name, found.verdict, found.worst, found.remarks) == ("partials.K", "agrees", None, ())
    assert found.complex_step is not None and found.complex_step < 1e-14
    assert found.agreement is not None and 0.0 < found.agreement < 1e-9 and len(found.errors) == len(LADDER)
    assert found.agreement == min(found.errors) and found.step == LADDER[int(np.argmin(found.errors))]
    assert found.slope == pytest.approx(2.0, abs=0.02)  # of central differences
    q = np.array([0.1, 0.7])
    h = LADDER[2]
    exact = 2.0 * 9.81 * 0.5 * np.cos(q) - 3.0 * np.cos(3.0 * q)
    step = (2.0 * 9.81 * 0.5 * np.cos(q) * np.sin(h) - np.cos(3.0 * q) * np.sin(3.0 * h)) / h
    sizes = np.maximum(np.abs(exact), 1e-3 * np.abs(exact).max())
    assert found.errors[2] == pytest.approx(np.max(np.abs(step - exact) / sizes), rel=1e-6)
    assert found.second is None and found.second_name == ""


@pytest.mark.parametrize(
    ("effort", "form", "places", "remarks"),
    [
        ("-3 * abs(q.pin)", "K", [(0.0, 0.0), (0.5, 0.0)], ["not smooth at state 0 (abs in effort push)"]),
        ("-100 * max(0, q.pin)", "K", [(0.0, 0.0)], ["not smooth at state 0 (max in effort push)"]),
        ("-3 * sign(v.pin)", "C", [(0.0, 0.0)], ["not smooth at state 0 (sign in effort push)"]),
        ("sqrt(q.pin)", "K", [(0.0, 0.0), (1.0, 0.0)], ["unbounded derivative at state 0 (sqrt in effort push)"]),
        ("sqrt(q.pin ** 2)", "K", [(0.0, 0.0)], ["unbounded derivative at state 0 (sqrt in effort push)"]),
        (
            "2 if q.pin > 0.3 else 1",
            "K",
            [(0.3, 0.0)],
            ["not smooth at state 0 (comparison in effort push, select in effort push)"],
        ),
        ("bend(q.pin)", "K", [(0.1, 0.0)], ["not smooth at state 0 (curve bend in effort push)"]),
        ("-3 * abs(v.pin) * v.pin", "C", [(0.0, 0.0)], []),
        ("-1e9 * q.pin", "K", [(0.0, 0.0), (0.3, 0.0)], []),
        ("sin(3000 * q.pin)", "K", [(0.0, 0.0)], []),
        ("-100 * max(0, q.pin)", "K", [(1e-7, 0.0)], []),
        ("-100 * max(0, q.pin)", "K", [(1e-15, 0.0)], ["not smooth at state 0 (max in effort push)"]),
        ("log(q.pin)", "K", [(-1.0, 0.0), (1.0, 0.0)], ["not a number at state 0"]),
    ],
)
def test_what_is_not_smooth_is_remarked_and_agrees(
    effort: str, form: str, places: list[tuple[float, float]], remarks: list[str]
) -> None:
    found = judged(effort, places, form)
    assert (found.verdict, found.worst) == ("agrees", None)
    assert list(found.remarks) == remarks


def test_where_nothing_is_a_number_there_is_no_state() -> None:
    found = judged("log(q.pin - 100)", [(0.0, 0.0), (1.0, 0.0)])
    assert (found.verdict, found.remarks, found.errors) == ("no state", ("not a number at state 0, state 1",), ())


@pytest.mark.parametrize(
    ("change", "by"),
    [
        (lambda value: value * (1.0 + 1e-6), "finite differences"),
        (lambda value: value * (1.0 + 1e-9), "complex step"),
        (lambda value: -value, "finite differences"),
        (lambda value: np.where(np.arange(2)[:, None, None] == 1, np.nan, value), "any other way a finite number"),
    ],
)
def test_wrong_numbers_fail_by_what_tells_them(change: Callable[[Array], Array], by: str) -> None:
    found = judged("sin(3 * q.pin)", [(0.1, 0.0), (0.7, 1.0)], change=change)
    assert found.verdict == "FAILS" and found.worst is not None and found.worst.by == by
    assert found.worst.entry == "v.pin along v.pin" and found.worst.state in ("state 0", "state 1")
    assert not abs(found.worst.value - found.worst.expected) <= found.worst.bar


@pytest.mark.parametrize(("error", "verdict"), [(-20.0, "FAILS"), (0.0, "agrees"), (50.0, "agrees"), (120.0, "FAILS")])
def test_at_a_kink_the_closed_form_lies_between_the_sides(error: float, verdict: str) -> None:
    """Slopes of the sides differ by 100."""
    found = judged(
        "-100 * max(0, q.pin)", [(0.0, 0.0)], change=lambda value: np.full_like(value, 2.0 * 9.81 * 0.5 + error)
    )
    assert found.verdict == verdict
    assert verdict == "agrees" or (found.worst is not None and found.worst.by == "complex step")


def test_second_derivations_are_compared_as_well() -> None:
    space = swing("sin(3 * q.pin)")
    zero = np.zeros((2, 1))
    blocks = {"q": zero + 0.3, "v": zero, "a": zero, "t": zero}
    states = CheckedStates(blocks, ("a", "b"), ())

    def judge(second: float) -> FormReport:
        from eomgen.products.studies.verification.claims.claim import Second

        value = np.array([[[2.0]], [[3.0]]])
        claim = Claim(
            "form", "as other", lambda *_: value, second=Second("other", lambda *_: value * second), rows=("x",)
        )
        given = claim, space.engine, space.engine, space.system, states, np.random.default_rng(0)
        return checking.judge_claim(*given)

    fine, off, unknown = judge(1.0), judge(1.0 + 1e-9), judge(math.nan)
    assert (fine.verdict, fine.second, fine.second_name, fine.agreement) == ("agrees", 0.0, "other", None)
    assert off.verdict == "FAILS" and off.second == pytest.approx(1e-9, rel=1e-5) and off.worst is not None
    assert (off.worst.state, off.worst.by, off.worst.value) == ("a", "other", 2.0)
    assert unknown.verdict == "FAILS" and str(unknown.worst) == "x: not a number by other, at a"


def test_operations_say_which_branch_they_take() -> None:
    space = swing(
        "abs(q.pin) + min(q.pin, v.pin) + (1 if q.pin < 2 else 3) + sqrt(v.pin) + log(q.pin + 4) + q.pin / v.pin"
    )
    operations = NonSmoothOperations(space.system, ("residual",))

    def at(q: float, v: float) -> dict[str, Array]:
        return {"q": np.array([q]), "v": np.array([v]), "a": np.zeros(1), "t": np.zeros(1)}

    assert operations.decisions([at(1.0, 1.5), at(1.2, 1.4)]) == []
    assert operations.decisions([at(1.0, 1.5), at(-1.0, 1.5)]) == ["abs in effort push"]
    assert operations.decisions([at(1.0, 1.5), at(1.0, 0.5)]) == ["min in effort push"]
    assert set(operations.decisions([at(1.0, 3.0), at(2.5, 3.0)])) == {
        "comparison in effort push",
        "select in effort push",
    }
    assert operations.edges(at(1.0, 1.0)) == [("not smooth", "min in effort push")]
    assert operations.edges(at(0.0, 1.0)) == [("not smooth", "abs in effort push")]
    assert set(operations.singular(at(1.0, 0.0))) == {"sqrt in effort push", "division in effort push"}
    assert operations.singular(at(-4.0, 1.0)) == ["log in effort push"]
    assert ("unbounded derivative", "sqrt in effort push") in operations.edges(at(1.0, 0.0))
    assert set(operations.kinks_and_jumps()) == {
        f"{name} in effort push" for name in ("abs", "min", "comparison", "select")
    }
    assert operations.step_of_laws() == 0.0
    for name, inside, edge in (("asin", 0.5, 1.0), ("asin", 0.5, -1.0), ("acos", 0.0, 1.0)):
        alone = NonSmoothOperations(swing(f"{name}(q.pin)").system, ("residual",))
        assert alone.singular(at(inside, 0.0)) == [] and alone.singular(at(edge, 0.0)) == [f"{name} in effort push"]
    both = NonSmoothOperations(swing("atan2(q.pin, v.pin)").system, ("residual",))
    assert both.singular(at(0.0, 1.0)) == [] == both.singular(at(1.0, 0.0))
    assert both.singular(at(0.0, 0.0)) == ["atan2 in effort push"]


@pytest.mark.parametrize(
    ("slopes", "parameters", "columns", "order"),
    [((), (), 1, 2), (("a",), (), 1, 1), (("a",), ("p",), 2, 3), ((), (), 3, 4)],
)
def test_laws_by_differences_are_known_to_the_step_of_their_order(
    slopes: tuple[str, ...], parameters: tuple[str, ...], columns: int, order: int
) -> None:
    call = Call.__new__(Call)
    function = SimpleNamespace(code=SimpleNamespace(slopes=slopes), parameters=parameters)
    for name, value in (("function", function), ("columns", tuple(range(columns)))):
        object.__setattr__(call, name, value)
    tape = SimpleNamespace(maps=[call, None], a=[0, 1, 0], op=[Op.MAP, Op.MAP, Op.ADD], live=lambda refs: [0, 1, 2])
    system: Any = SimpleNamespace(tape=tape, functions={"f": SimpleNamespace(refs=())})
    step = NonSmoothOperations(system, ("f",)).step_of_laws()
    assert step == pytest.approx(np.finfo(float).eps ** (1.0 / (order + 2.0)))


def test_remarks_name_states_and_formulas_once() -> None:
    remarks = Remarks()
    for state in ("a", "b", "a"):
        remarks.add(state, "not smooth", "abs in x")
    for k in range(6):
        remarks.add("a", "unbounded derivative", f"sqrt in {k}")
    remarks.add("b", "differences have no digits")
    assert remarks.texts == (
        "not smooth at a, b (abs in x)",
        "unbounded derivative at a (sqrt in 0, sqrt in 1, sqrt in 2, sqrt in 3 and 2 more)",
        "differences have no digits at b",
    )


# -- the terms of a check ----------------------------------------------------------------------------------------------


def test_costly_terms_are_built_on_request_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = cast(eomgen.Scene, swing("sin(3 * q.pin)").scene)
    every = checking._terms(scene, ())
    assert every == [term.name for term in checking._CHECKED] and "rates_3" not in every
    monkeypatch.setattr(checking, "CLOSED", 0)
    few = checking._terms(scene, ())
    assert "mass" in few and "rates" in few and set(every) - set(few) >= {
        "rates_closed", "coriolis", "adjoints", "outputs_derivatives", "frame_poses_hessian"
    }  # fmt: skip
    of_name = checking._terms(scene, ["outputs_hessian"])
    assert {"outputs_derivatives", "outputs_hessian"} <= set(of_name) and "residual_hessian" not in of_name
    assert "regressor" not in of_name and "mass" in of_name
    second = checking._terms(scene, ["second"])
    assert {*FIRST, "second_partials"} <= set(second) and "regressor" not in second
    assert "rates" in checking._terms(scene, ["base_rates"]) and "rates" not in checking._terms(scene, ["partials"])
    monkeypatch.setattr(checking, "LARGE", 0)
    large = checking._terms(scene, ["rates_closed", "outputs_hessian"])
    assert "residual" in large and not {"mass", "rates_closed", "outputs_hessian", "partials"} & set(large)


def test_closed_forms_are_chosen_by_the_beginnings_of_their_names() -> None:
    claims = [Claim(name, "", lambda *_: np.zeros(1)) for name in ("mass.M", "mass.M, definite", "partials.K")]
    assert checking._chosen(claims, ()) == claims and checking._chosen(claims, ["part"]) == claims[2:]
    assert checking._chosen(claims, ["partials", "mass.M,"]) == claims[1:]
    with pytest.raises(UsageError, match="no closed form of this scene is called 'partals'; try: partials"):
        checking._chosen(claims, ["partals"])


# -- reports -----------------------------------------------------------------------------------------------------------


def report_of(*forms: FormReport, **more: Any) -> CheckReport:
    return CheckReport("scene", ("a", "b"), 3, forms, **more)


def test_reports_are_written_with_their_errors_by_step(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[Any] = []
    monkeypatch.setattr(reporting, "draw", lambda *given: drawn.append(given) or given[-1])
    errors = tuple(1e-3 * step**2 + 1e-16 / step for step in LADDER.tolist())
    fine = FormReport("mass.M", "d", "separated", "agrees", 1e-9, 1e-4, 2.0, 1e-15, errors=errors, remarks=("kink",))
    worst = Disagreement("a", "row", 1.0, 2.0, "complex step", 1e-3)
    wrong = FormReport("partials.K", "d", "partials", "FAILS", errors=tuple(2.0 * x for x in errors), worst=worst)
    second = FormReport("tau", "as", "separated", "agrees", second=1e-15, second_name="sum", remarks=("kink", "jump"))
    report = report_of(fine, wrong, second)
    assert report.failures == (wrong,) and not report.passed
    assert report.remarks == ("kink: mass.M, tau", "jump: tau")
    assert report.summary == "1 of 3 closed forms not shown to agree"
    data, table, picture = report.write(tmp_path)
    rows = list(csv.reader(table.read_text(encoding="utf-8").splitlines()))
    assert rows[0] == ["step", "mass.M", "partials.K"] and len(rows) == 1 + len(LADDER)
    assert [list(map(float, row)) for row in rows[1:]] == [
        [step, x, 2.0 * x] for step, x in zip(LADDER.tolist(), errors, strict=True)
    ]
    read = json.loads(data.read_text(encoding="utf-8"))
    assert read["ladder"] == LADDER.tolist() and read["passed"] is False and read["forms"][1]["worst"]["bar"] == 1e-3
    title = "scene: closed forms against central differences at 2 states; failed: partials.K"
    assert drawn == [([fine, wrong], title, picture)] and picture.name == "check.png"
    assert report_of(second).write(tmp_path / "new")[-1].name == "check.csv"
    assert str(worst) == "row: 1, but 2 by complex step (known to 0.001), at a"
    assert str(replace(worst, entry="", explained="")) == "1, but 2 by complex step (known to 0.001), at a"
    assert str(replace(worst, explained="why")) == "why"


def test_curves_of_a_panel_are_errors_over_steps() -> None:
    errors = tuple(np.geomspace(1e-3, 1e-20, len(LADDER)).tolist())
    forms = [
        FormReport("mass.M", "", "f", "agrees", complex_step=1e-15, errors=errors),
        FormReport("tau", "", "f", "FAILS", errors=errors),
    ]
    axis = new_figure((4.0, 3.0)).subplots()
    reporting._panel(axis, "f", forms)
    first, dotted, second, slope = axis.get_lines()
    assert (
        first.get_ydata().tolist() == [max(x, 1e-17) for x in errors] and first.get_xdata().tolist() == LADDER.tolist()
    )
    assert (first.get_label(), second.get_label()) == ("mass.M", "tau (FAILS)")
    assert set(dotted.get_ydata()) == {1e-15} and second.get_linewidth() > first.get_linewidth()
    x, y = (np.log10(values) for values in (slope.get_xdata(), slope.get_ydata()))
    assert (y[1] - y[0]) / (x[1] - x[0]) == pytest.approx(2.0)


@pytest.mark.parametrize(("counts", "sizes"), [([7], [7]), ([8], [4, 4]), ([15, 2], [5, 5, 5, 2]), ([1, 1], [1, 1])])
def test_panels_have_seven_curves_at_most(counts: list[int], sizes: list[int]) -> None:
    forms = [FormReport(f"{k}", "", f"family {n}", "agrees") for n, count in enumerate(counts) for k in range(count)]
    panels = _panels(forms)
    assert [len(members) for _, members in panels] == sizes
    assert [form for _, members in panels for form in members] == forms
    assert all({form.family for form in members} == {family} for family, members in panels)
