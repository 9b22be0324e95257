"""Times at which Taylor series end: zeros of what decides a function of time, by hand, and refusals of others."""

from __future__ import annotations

import pytest

import eomgen
from eomgen.codegen.series.functions import breakpoints_in_time


def system_of(formula: str) -> eomgen.System:
    builder = eomgen.SceneBuilder("rail").parameter("level", 0.3, tunable=True)
    builder.curve("table", points=[[0.0, 0.0], [1.0, 2.0], [3.0, -1.0]], interpolation="linear")
    builder.curve("teeth", points=[[0.0, 0.0], [0.2, 2.0], [0.5, 0.0]], interpolation="linear", outside="periodic")
    builder.body("slug", 2.0).joint("slide", "prismatic", "base", "slug", axis=[1, 0, 0])
    return eomgen.derive(builder.effort("push", "slide", formula).build(), terms=["force"])


@pytest.mark.parametrize(
    ("formula", "times"),
    [
        ("sin(t)", []),
        ("abs(2 * t - 3)", [1.5]),
        ("abs(3 - 2 * t) * q.slide", [1.5]),
        ("max(t, 5 - 3 * t)", [1.25]),
        ("min(2 - (t - 1), 1 + 4 * (t + 0.5))", [0.0]),
        ("1 if t < 0.7 else 0", [0.7]),
        ("1 if 3 * (2 * t - 1) - t <= 0 else 0", [0.6]),
        ("sign(-(t - 4))", [4.0]),
        ("table(2 * t + 1)", [-0.5, 0.0, 1.0]),
        ("table(3 - t)", [0.0, 2.0, 3.0]),
        ("abs(t - 2) + abs(4 - 2 * t) + abs(t)", [0.0, 2.0]),
    ],
)
def test_times_are_the_zeros_of_lines(formula: str, times: list[float]) -> None:
    found = breakpoints_in_time(system_of(formula).tape)
    assert [item.time for item in found] == pytest.approx(times, abs=1e-15)
    assert [item.time for item in found] == sorted(item.time for item in found)
    assert {item.period for item in found} <= {0.0} and {item.order for item in found} <= {0}


def test_times_of_periodic_curves_have_the_period_of_their_argument() -> None:
    found = breakpoints_in_time(system_of("teeth(1 - 4 * t)").tape)
    assert {item.period for item in found} == {0.125}
    assert sorted(item.time for item in found) == pytest.approx([0.125, 0.2, 0.25])


@pytest.mark.parametrize(
    ("formula", "decider"),
    [
        ("abs(q.slide)", "abs(), decided by the motion"),
        ("max(v.slide, t)", "max(), decided by the motion"),
        ("abs(t - level)", "abs(), decided by a tunable parameter or a formula that is not linear in time"),
        ("abs(t * t - 2)", "abs(), decided by a tunable parameter or a formula that is not linear in time"),
        ("abs(t / (1 + t))", "abs(), decided by a tunable parameter or a formula that is not linear in time"),
        ("table(q.slide)", "the pieces of curve 'table', decided by the motion"),
    ],
)
def test_other_deciders_are_refused(formula: str, decider: str) -> None:
    with pytest.raises(eomgen.ModelError) as caught:
        breakpoints_in_time(system_of(formula).tape)
    assert caught.value.problems[0].what.endswith(f"here are {decider}")


def test_parameters_alone_decide_nothing_during_a_run() -> None:
    assert breakpoints_in_time(system_of("abs(level - 1) * t").tape) == ()
