"""Checks of runs and warnings of equilibria beside their limits: what they name, count and leave out."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from eomgen.compiled.rest.state_warnings import equilibrium_notes
from eomgen.formula.nodes import Number, Symbol
from eomgen.integrators.families.register import method_named
from eomgen.products.doubts import accuracy, remarks, rests
from eomgen.products.doubts.accuracy import linear_range_exceeded
from eomgen.products.doubts.fast_motions import _Law
from eomgen.products.doubts.places import shortest
from eomgen.simulation.accuracy.fastest_rates import FastestRates, Rate
from eomgen.simulation.judgement.finished_run import FACTS
from eomgen.simulation.judgement.register import BY_NAME, CHECKS
from eomgen.simulation.stepping.time_grid import TimeGrid
from eomgen.system.description import Wheel
from tests.rest.test_state_warnings import NO, machine, point, softening

STILL = Rate()
DECAYING = FastestRates(Rate(1e6, 0.05, "v.hinge"), STILL, STILL, STILL)


def test_every_fact_is_needed_by_a_check() -> None:
    assert set(FACTS) == {fact for check in CHECKS for fact in check.needs} | {"events"}


@pytest.mark.parametrize(("method", "other"), [("rattlie", "generalized_alpha, "), ("generalized_alpha", "")])
def test_multipliers_of_rounding_are_told_with_another_method_if_there_is_one(method: str, other: str) -> None:
    for single, precision in ((False, ""), (True, ", or double precision")):
        run = SimpleNamespace(
            run=SimpleNamespace(name=method, method=SimpleNamespace(chooses_steps=False)), single=single,
            longest_part=1e-3, statistics={"max_rounding": 0.3}, settings={"step": 1e-3}, fastest=DECAYING,
        )  # fmt: skip
        check = BY_NAME["multiplier_rounding"].evaluate
        (told,) = check(cast(Any, SimpleNamespace(**vars(run), states=SimpleNamespace(multipliers=np.ones((2, 1))))))
        assert told.text == "up to 30 % of the multipliers is rounding, which grows as 1/step^2"
        assert told.hint == f"{other}a step larger than 0.001 s{precision}"
        none = SimpleNamespace(multipliers=np.zeros(1))
        assert not [*check(cast(Any, SimpleNamespace(**vars(run), states=none)))]


def test_steps_longer_than_their_run_are_told_and_exchanged_ones_written_down() -> None:
    for span, step, told in ((1.0, 1.0, ""), (1.0, 1.1, "longer"), (1.0, 200.0, "simulate(200, 1)"), (0.0, 1.0, "")):
        notes = remarks.exchanged_times(cast(TimeGrid, SimpleNamespace(start=2.0, end=2.0 + span, step=step)))
        assert bool(notes) == bool(told)
        assert not told or (told in notes[0] and ("simulate" in notes[0]) == told.startswith("simulate"))


def test_undefined_outputs_are_counted_from_their_first_row() -> None:
    t = np.array([0.0, 0.5, 1.0])
    one, two = np.array([1.0, np.nan, 2.0]), np.array([[0.0, 0.0], [0.0, 0.0], [np.inf, 1.0]])
    assert remarks.undefined_outputs(t, {"fine": np.zeros(3)}) is None
    found = remarks.undefined_outputs(t, {"two": two, "one": one})
    assert found is not None and found.time == 0.5
    counted = "the outputs two (1 of 3 rows, from t = 1 s), one (1 of 3 rows, from t = 0.5 s) have no value there"
    assert found.text == counted


def test_laws_without_values_and_laws_of_rounding_are_seen() -> None:
    shown = np.array([1.0, -1.0] * 50)
    assert not _Law("f", "N", np.array([shown, shown]), np.full(100, np.nan), shown).unseen
    for off, told in ((0.99e-6, False), (1.1e-6, True)):
        assert _Law("f", "N", np.ones((2, 100)), 1.0 + off * shown, np.ones(100)).unseen == told


def test_few_names_are_listed() -> None:
    names = [f"s{k}" for k in range(6)]
    assert [rests._few(names[:count]) for count in (1, 4, 5, 6)] == [
        "s0", "s0, s1, s2, s3", "s0, s1, s2, s3 and 1 more", "s0, s1, s2, s3 and 2 more",
    ]  # fmt: skip  # two lines


@pytest.mark.parametrize(
    ("start", "end", "u", "sunk"),
    [
        (0.5, 0.41, None, False),
        (0.39, 0.3, None, False),  # was below the road at the start
        (0.6, 0.45, {"lift": 0.1}, True),
        (0.6, 0.45, np.array([0.1]), True),
        (0.5, 0.3, {"lift": -0.2}, False),
    ],
)
def test_tyres_sink_if_their_centre_goes_below_the_road(start: float, end: float, u: Any, sunk: bool) -> None:
    """The road is 0.4 m high under the wheel, 0.5 m at the origin, and moves by an input."""
    road = Number(0.5) + Symbol("input", "lift") + Number(0.1) * Symbol("position", index=0)
    wheels = (Wheel("front", "hub", Number(0.3), road, Number(1e5)),)
    places = {"wheel": [(-1.0, 0.0, start), (-1.0, 0.0, end)]}
    measures, path = machine(places, points=(point("hub", "wheel"),), wheels=wheels)
    notes = equilibrium_notes(measures, path, u)
    assert notes == (["inside out, for their centres are below the road: tyre front"] if sunk else [])


@pytest.mark.parametrize("row", [0, 150, 399])
def test_rows_beyond_the_linear_range_are_found_by_the_largest_deflection(row: int) -> None:
    t, q = np.linspace(0.0, 399.0, 400), np.zeros((400, 3))
    assert linear_range_exceeded(softening(), t, q, NO) == ""
    q[row, 1] = -1.2
    assert linear_range_exceeded(softening(), t, q, NO) == (
        f"at t = {row} s the deflection of beam mast is beyond the range of order = 1: the inertia matrix is not"
        " positive definite; try: order = 2"
    )


def test_the_shortest_lengths_between_rows_are_distances_of_straight_ways() -> None:
    vectors = np.array([[1.0, 0.0, 0.0], [0.5, 0.0, 0.0], [-0.5, 0.0, 0.0], [-0.5, 0.0, 0.0], [0.5, 1.0, 0.0]])
    assert shortest(vectors) == pytest.approx([0.5, 0.0, 0.5, math.sqrt(0.125)])


def test_the_way_through_a_singular_position_names_a_method_that_passes_it() -> None:
    other = "rk4_partitioned, which passes such positions along the velocity"
    found = [accuracy.way_through(method_named(name), 1e-3) for name in ("hht", "rk4_partitioned")]
    assert found == [f"a step smaller than 0.001 s, or {other}", "a step smaller than 0.001 s"]
