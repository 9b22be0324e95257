"""The tables of ``benchmarks.default_method``, from runs that are written by hand."""

from __future__ import annotations

import math

import pytest

from benchmarks import default_method
from benchmarks.default_method import Point
from eomgen.products.studies.work_precision.running import REACHED, REFUSED, STOPPED


def run(scene: str, candidate: str, error: float, seconds: float, *, given: bool = False) -> Point:
    return Point(scene, candidate, 0.01, given, candidate, REACHED, error, seconds)


def no_run(scene: str, candidate: str) -> Point:
    return Point(scene, candidate, math.nan, True, candidate, REFUSED, math.inf, math.inf, "needs a system")


POINTS = [
    run("tree", "generalized_alpha", 1e-2, 1.0, given=True),
    run("tree", "generalized_alpha", 5e-4, 4.0),
    run("tree", "rk4", 2e-4, 2.0, given=True),
    run("tree", "rk4", 1e-7, 3.0),
    no_run("tree", "rk4_partitioned"),
    run("loop", "generalized_alpha", 1e-4, 6.0, given=True),
    no_run("loop", "rk4"),
    run("loop", "rk4_partitioned", 1e-9, 2.0, given=True),
    Point("loop", "rk4_partitioned", 0.1, False, "rk4_partitioned", STOPPED, math.inf, math.inf),
]


def cells(text: str, candidate: str) -> list[str]:
    found = [line for line in text.splitlines() if line.startswith(f"| {candidate} ")]
    assert len(found) == 1
    return [cell.strip() for cell in found[0].split("|")[2:-1]]


def test_costs_are_the_cheapest_that_meet_a_demand() -> None:
    assert default_method.costs(POINTS, 1e-3) == {
        "tree": {"generalized_alpha": 4.0, "rk4": 2.0},
        "loop": {"generalized_alpha": 6.0, "rk4_partitioned": 2.0},
    }
    assert default_method.costs(POINTS, 1e-6) == {"tree": {"rk4": 3.0}, "loop": {"rk4_partitioned": 2.0}}


def test_a_rule_takes_the_runs_of_its_method_for_each_scene() -> None:
    ruled = [p for p in default_method.with_rules(POINTS) if p.candidate == "rk4, or rk4_partitioned"]
    assert sorted((p.scene, p.by) for p in ruled if p.ended == REACHED) == [
        ("loop", "rk4_partitioned"),
        ("tree", "rk4"),
        ("tree", "rk4"),
    ]
    assert not any(default_method.refused(p) for p in ruled)


def test_tables_tell_demands_ratios_and_refusals() -> None:
    text = default_method.demanded(POINTS)
    assert cells(text, "generalized_alpha") == ["0", "2 of 2", "2.5", "2.9", "3", "0 of 2", "", "", ""]
    assert cells(text, "rk4") == ["1", "1 of 2", "1", "1", "1", "1 of 2", "1", "1", "1"]
    text = default_method.as_given(POINTS)
    assert cells(text, "generalized_alpha") == ["2 of 2", "1", "0", "0", "5.0e-03", "1", "1"]
    assert cells(text, "rk4") == ["1 of 2", "1", "0", "0", "2.0e-04", "2", "2"]


def test_every_scene_of_the_examples_takes_part() -> None:
    found = default_method.scenes()
    assert len(found) >= 30 and "sea_arm/links" not in found
    assert found["heavy_top/se3"].name == "se3.toml" and found["four_bar"].name == "scene.toml"
    assert set(default_method.ENDS) <= {path.parent.name for path in found.values()}


def test_the_medians_of_the_given_runs_are_over_those_that_ended() -> None:
    assert float(cells(default_method.as_given(POINTS), "rk4_partitioned")[5]) == pytest.approx(2.0 / 6.0, rel=5e-3)
