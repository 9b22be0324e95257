"""Rainflow counts: the worked example of ASTM E1049-85, properties of any history, damage in closed form, files."""

from __future__ import annotations

import math
import sys
import warnings
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import eomgen
from eomgen.base.arrays import Array
from eomgen.base.csv_tables import read_table
from eomgen.errors import UsageError


def run_of(values: Array, t: Array | None = None) -> eomgen.Solution:
    """Return a solution with the output ``load``, N, at rows of 1 s by default."""
    n = len(values)
    none = np.zeros((n, 0))
    return eomgen.Solution(
        t=np.arange(float(n)) if t is None else t,
        q=none,
        v=none,
        a=none,
        z=none,
        multipliers=none,
        outputs={"load": np.asarray(values, dtype=float)},
        metadata={"scene": "rig", "units": {"outputs": {"load": "N"}}},
    )


#: Figure 6 of ASTM E1049-85: the peaks and valleys A to I, and (range, mean, count, from, to) of each counted cycle.
_HISTORY = (-2.0, 1.0, -3.0, 5.0, -1.0, 3.0, -4.0, 4.0, -2.0)
_CYCLES = (
    (9.0, 0.5, 0.5, "D", "G"),
    (8.0, 1.0, 0.5, "C", "D"),
    (8.0, 0.0, 0.5, "G", "H"),
    (6.0, 1.0, 0.5, "H", "I"),
    (4.0, -1.0, 0.5, "B", "C"),
    (4.0, 1.0, 1.0, "E", "F"),
    (3.0, -0.5, 0.5, "A", "B"),
)


def test_the_worked_example_of_the_standard() -> None:
    count = run_of(np.array(_HISTORY)).rainflow("load")
    found = zip(count.ranges, count.means, count.counts, count.starts, count.ends, strict=True)
    letters = "ABCDEFGHI"
    assert [(*cycle[:3], letters[int(cycle[3])], letters[int(cycle[4])]) for cycle in found] == list(_CYCLES)
    assert count.unit == "N" and count.duration == 8.0
    edges, counts = count.histogram(9)
    assert edges[-1] == 9.0 and counts.sum() == 4.0 and counts[-1] == 1.5  # 8 to 9: one cycle of 8 and half of 9
    assert repr(count) == "<Rainflow of load: 4 cycles in 8 s; largest range 9 N>"
    assert "range [N]" in count._repr_html_()


@pytest.mark.filterwarnings("ignore:rainflow of load. rows every 1 s")
@settings(max_examples=60, deadline=None)
@given(st.lists(st.integers(-9, 9), min_size=3, max_size=60), st.floats(0.1, 10.0), st.floats(-5.0, 5.0))
def test_any_history(values: list[int], factor: float, offset: float) -> None:
    x = np.array(values, dtype=float)
    count = run_of(x).rainflow("load")
    steps = [b - a for a, b in pairwise(values) if b != a]
    monotone = (1 if steps else 0) + sum(1 for a, b in pairwise(steps) if a * b < 0)
    assert 2.0 * count.counts.sum() == monotone  # each range between reversals is half of one cycle
    assert count.ranges.max(initial=0.0) == np.ptp(x)
    moved = run_of(factor * x + offset).rainflow("load")
    assert moved.equivalent_range(4) == pytest.approx(factor * count.equivalent_range(4), rel=1e-6, abs=1e-9)


def test_damage_of_constant_amplitude_in_closed_form() -> None:
    t = np.arange(0.25, 100.26, 0.01)  # peak to peak: 100 cycles of 1 Hz
    count = run_of(30.0 * np.sin(2.0 * math.pi * t), t - 0.25).rainflow("load")
    assert count.counts.sum() == 100.0 and np.allclose(count.ranges, 60.0)
    assert count.damage(5, 40.0, 1e6) == pytest.approx(100.0 / 1e6 * 1.5**5, rel=1e-9)
    assert count.damage(5, 80.0, 1e6) == pytest.approx(100.0 / 1e6 * 0.75**5, rel=1e-9)
    assert count.damage(5, 80.0, 1e6, slope_below=9) == pytest.approx(100.0 / 1e6 * 0.75**9, rel=1e-9)
    assert count.damage(5, 80.0, 1e6, slope_below=math.inf) == 0.0
    assert count.equivalent_range(5) == pytest.approx(60.0, rel=1e-6)  # as many cycles of 1 Hz as were counted
    assert count.equivalent_range(5, frequency=2.0) == pytest.approx(60.0 * 0.5**0.2, rel=1e-6)
    # damage of the equivalent range in as many cycles is the damage of the count
    same = 100.0 * (count.equivalent_range(5) / 40.0) ** 5 / 1e6
    assert same == pytest.approx(count.damage(5, 40.0, 1e6), rel=1e-6)


def test_a_constant_has_no_cycle() -> None:
    count = run_of(np.full(10, 3.0)).rainflow("load")
    assert len(count.ranges) == 0 and count.damage(3, 1.0) == 0.0 and count.equivalent_range(3) == 0.0
    assert repr(count).endswith("no cycle>") and count.histogram(np.int64(3))[1].sum() == 0.0


def test_files_and_pictures(tmp_path: Path) -> None:
    from matplotlib.figure import Figure

    count = run_of(np.array(_HISTORY)).rainflow("load")
    names, numbers = read_table(count.save(tmp_path / "cycles.csv"))
    assert names == ["range [N]", "mean [N]", "count", "start [s]", "end [s]"]
    assert [tuple(row[:3]) for row in numbers] == [row[:3] for row in _CYCLES]
    axis = Figure().subplots()
    assert count.plot(axis, label="run") == [axis]
    assert axis.get_ylabel() == "range, N" and axis.get_xscale() == "log" and axis.get_title(loc="left")
    with pytest.raises(UsageError, match=r"a rainflow count cannot be saved as \.png; try: \.csv"):
        count.save(tmp_path / "cycles.png")


@pytest.mark.parametrize(
    ("frequency", "distance", "said"),
    [
        (
            6.4,
            0.2,
            "rainflow of load: rows every 0.2 s, 1.8 between two reversals: extreme values lie between the rows, ",
        ),
        (6.4, 0.01, ""),
        (6.4, 0.03, ""),
    ],
)
def test_rows_that_are_too_coarse_for_reversals(frequency: float, distance: float, said: str) -> None:
    t = np.arange(0.0, 8.0, distance)
    run = run_of(np.sin(2.0 * math.pi * frequency * t + 0.3), t)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        run.rainflow("load")
    assert [str(each.message)[: len(said)] for each in caught] == [said] * bool(said)
    assert all(str(each.message).endswith("; try: record_every=1, or a smaller step [W0095]") for each in caught)
    assert all(each.filename == __file__ for each in caught)


def test_refusals(monkeypatch: pytest.MonkeyPatch) -> None:
    run = run_of(np.array(_HISTORY))
    count = run.rainflow("load")
    broken = run_of(np.array([0.0, 1.0, math.nan, 0.0]))
    for call, text in (
        (lambda: run.rainflow("lode"), "rainflow: the solution has no curve 'lode'; try: load"),
        (lambda: run.rainflow("load", start=7.0), "the run has 2 rows from 7 s on, and a cycle needs 3"),
        (
            lambda: run.rainflow("load", start="7 s"),
            "rainflow: start: a time in s is needed, not '7 s'; try: start=5.0",
        ),
        (lambda: run.rainflow(3), "rainflow: the name of one column is needed, not 3; try: solution.rainflow"),
        (lambda: broken.rainflow("load"), "load is not finite at t = 2 s; try: the part of the run before it"),
        (lambda: count.damage(0, 40.0), "slope: 0 is not a positive number"),
        (
            lambda: count.equivalent_range(slope=0.2),
            "slope: 0.2 is below 1, and exponents of Woehler curves are 3 to 15; try: slope=5, the inverse, or",
        ),
        (
            lambda: count.damage(9, 40.0, slope_below=5),
            "slope_below: 5 is smaller than slope 9, and small ranges would damage more than large ones; try: slope=5, "
            "slope_below=9",
        ),
        (lambda: count.damage(5, 40.0, slope_below=-1), "slope_below: -1 is not a positive number"),
        (lambda: count.equivalent_range(5, frequency=0.0), r"frequency: 0\.0 is not a positive number"),
        (lambda: count.histogram(0), "bins: a whole number from 1 on is needed, not 0; try: 1"),
    ):
        with pytest.raises(UsageError, match=text):
            call()
    monkeypatch.setitem(sys.modules, "rainflow", None)
    text = r"counted by the package rainflow, which is not installed; try: pip install 'eomgen\[fatigue\]'"
    with pytest.raises(UsageError, match=text):
        run.rainflow("load")
