"""Which runs are compared for an estimate, and what it is: runs whose errors are powers of the step, so that each way
gives the error itself, up to the last digits."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from eomgen.results.error_estimate import ErrorEstimate
from eomgen.simulation.accuracy import error_estimation as ways
from eomgen.simulation.accuracy.comparison_runs import MotionDifference, NoEstimateError
from eomgen.simulation.accuracy.fastest_rates import FastestRates
from eomgen.simulation.accuracy.motion_size import motion_size
from tests.simulation.test_sizes_of_motions import model, record

STEP, ERROR = 0.1, 1e-3
T = np.array([0.0, 0.5, 1.0])


class Runs:
    """A run over 1 s whose hinge moves by 1 rad, with the error ERROR t (step/STEP)^order, and runs in other steps."""

    def __init__(self, order: float = 2.0, **values: Any) -> None:
        made = model(multipliers=(), nz=0, z_names=(), z_units=())
        rows = record([[0.0, 0.0], [0.5, 0.0], [1.0, 0.0]], [[1.0, 0.0]] * 3, np.zeros((3, 0)))[
            :, [0, 1, 2, 3, 4, 5, 6]
        ]
        rows[:, 0] = T
        self.order, self.asked = order, cast(list[tuple[float, float | None]], [])
        self.size, self.rounding, self.step, self.end, self.turn = motion_size(made, rows, {}), 1e-13, STEP, 1.0, 0.0
        method = SimpleNamespace(order=order, chooses_steps=False)
        self.run = SimpleNamespace(
            model=made, method=method, grid=SimpleNamespace(start=0.0), settings={"step": STEP, "tolerance": 1e-4},
            driven=None,
        )  # fmt: skip  # two lines
        self.span = SimpleNamespace(rows=rows, parameters=np.zeros(0), steps=1000)
        self.parts = SimpleNamespace(ends=(), start=0.0, end=1.0, count=lambda step: 1.0 / step)
        self.events: Any = None
        self.own = self.motion(1.0)
        self.stops: dict[float, str] = {}
        self.equal: tuple[float, ...] = ()  # multiples that take the same steps as the run
        self.untold: tuple[float, ...] = ()
        vars(self).update(values)

    def motion(self, multiple: float, tolerance: float | None = None, stopped: str = "", rows: int = 3) -> Any:
        error = ERROR * multiple**self.order if tolerance is None else ERROR * tolerance / 1e-4
        return SimpleNamespace(
            rows=np.zeros((rows, 7)), stopped=stopped, error=error, multiple=multiple, events=None, statistics={},
            outputs={},
        )  # fmt: skip  # two lines

    single = False

    def at(self, *, multiple: float = 1.0, tolerance: float | None = None, largest: float = math.inf) -> Any:
        self.asked.append((multiple, tolerance))
        stopped = self.stops.get(multiple, "")
        return self.motion(multiple, tolerance, stopped, 1 if stopped.startswith("at once") else 3)

    def apart(self, one: Any, other: Any) -> MotionDifference:
        off = abs(one.error - other.error) * T[:, np.newaxis]
        kinds = {kind: off * [1.0, 0.0] for kind in ("q", "increment", "v")} | {
            kind: np.zeros((3, 0)) for kind in ("z", "multipliers")
        }
        self.last = other.multiple
        return MotionDifference(T, kinds)

    def ratio(self, multiple: float, t: Any) -> Any:
        return np.full(len(t), multiple)

    def tell(self, finer: float, coarser: float) -> bool:
        return not {finer, coarser} & set(self.untold)

    def same(self, apart: MotionDifference) -> bool:
        return self.last in self.equal

    def same_count(self, other: Any) -> bool:
        return other.multiple in self.equal


@pytest.fixture(autouse=True)
def smooth(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ways, "crosses_jumps", lambda *_: False)


def by_steps(runs: Runs) -> ErrorEstimate:
    return ways._by_steps(cast(Any, runs), FastestRates)


def check(found: ErrorEstimate, runs: Runs, words: str, multiples: Sequence[float]) -> None:
    """The estimate is the error of the run itself, and the runs are these."""
    assert found.relative == pytest.approx(ERROR, rel=1e-9) and found.method == words
    assert [multiple for multiple, _ in runs.asked] == list(multiples)


def reason(runs: Runs, estimate: Callable[[Runs], ErrorEstimate]) -> tuple[str, str]:
    """Return why there is no estimate, and the remedy."""
    with pytest.raises(NoEstimateError) as caught:
        estimate(runs)
    return str(caught.value), caught.value.remedy


def of_steps(steps: int, order: float = 2.0, **values: Any) -> Runs:
    runs = Runs(order, **values)
    runs.span.steps = steps
    return runs


HALF, LONGER = "runs at half and 2 times the step", "runs at 2 and 4 times the step"
QUARTER = "runs at a quarter, half and 2 times the step"


@pytest.mark.parametrize("order", [1.0, 2.0, 4.0])
def test_longer_steps_show_error_and_order(order: float) -> None:
    runs = Runs(order)
    found = by_steps(runs)
    check(found, runs, LONGER, [2.0, 4.0])
    assert found.order == pytest.approx(order) and found.declared_order == order


@pytest.mark.parametrize(
    ("values", "doubtful"),
    [
        ({"span_steps": 15}, True),
        ({"span_steps": 16}, False),
        ({"turn": 3.15}, True),
        ({"end": 1.01}, True),  # the compared rows end early
        ({"method_order": 2.74}, False),
        ({"method_order": 2.76}, True),
    ],
)
def test_doubtful_longer_steps_ask_for_shorter_ones(values: dict[str, float], doubtful: bool) -> None:
    runs = of_steps(int(values.get("span_steps", 1000)))
    runs.turn, runs.end = values.get("turn", 0.0), values.get("end", 1.0)
    runs.run.method.order = values.get("method_order", 2.0)
    quarter = runs.run.method.order > 2.75  # half the step does not show the order either
    assert by_steps(runs).method == (QUARTER if quarter else HALF if doubtful else LONGER)
    assert [multiple for multiple, _ in runs.asked] == [2.0, 4.0, 0.5, 0.25][: 2 + doubtful + quarter]


@pytest.mark.parametrize(("part", "doubtful"), [(-0.41, True), (-0.4, False), (0.4, False), (0.41, True)])
def test_an_order_by_chance_makes_longer_steps_doubtful(part: float, doubtful: bool) -> None:
    """The largest differences have the order, and those in the middle of the run have another one."""
    runs = Runs(2.0)
    apart = runs.apart

    def changed(one: Any, other: Any) -> MotionDifference:
        found = apart(one, other)
        if other.multiple == 4.0:
            found.kinds["increment"][1] += part * found.kinds["increment"][2]
        return found

    runs.apart = changed  # type: ignore[method-assign]
    quarter = runs.run.method.order > 2.75  # half the step does not show the order either
    assert by_steps(runs).method == (QUARTER if quarter else HALF if doubtful else LONGER)


def test_longer_steps_that_do_not_hold_leave_the_shorter_ones() -> None:
    stopped = "stopped at t = 0.7 s"
    for stops, words, asked in (
        ({2.0: stopped}, HALF, [2.0, 0.5]),
        ({4.0: stopped}, HALF, [2.0, 4.0, 0.5]),
        ({4.0: "stopped", 0.5: "stopped"}, LONGER, [2.0, 4.0, 0.5]),
    ):
        runs = Runs(stops=stops)
        check(by_steps(runs), runs, words, asked)
    told, remedy = reason(Runs(stops={2.0: "at once: the energy", 0.5: "at once: the step"}), by_steps)
    assert told == "runs neither at twice nor at half the step hold: at once: the energy"
    assert remedy == "a step smaller than 0.025 s"


def test_runs_of_one_step_are_compared_with_a_quarter_of_it() -> None:
    runs = of_steps(1)
    assert by_steps(runs).method == "a run at 1/4 of the step" and runs.asked == [(0.25, None)]
    # the run at a quarter of the step takes shorter steps by 4, its own are halved
    runs = of_steps(15, equal=(0.25,))
    runs.own.statistics = {"halvings": 3}
    assert by_steps(runs).method == "a run at 1/16 of the step" and runs.asked == [(0.25, None), (0.0625, None)]
    runs = of_steps(15, equal=(0.25, 0.0625))
    runs.own.statistics = {"halvings": 3}
    same = "its steps were halved, and runs at up to 1/16 of the step are the same run"
    assert reason(runs, by_steps)[0] == same
    told, _ = reason(of_steps(1, stops={0.25: "stopped at t = 0.7 s"}), by_steps)
    assert told == "a run at 1/4 of the step does not hold: stopped at t = 0.7 s"


def test_runs_across_jumps_are_compared_with_odd_parts_of_the_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of errors of first order: 1/3 and 1/5 of the step give the error; twice the step, of order 2, a third of it."""
    monkeypatch.setattr(ways, "crosses_jumps", lambda *_: True)
    runs = Runs(1.0)
    runs.run.method.order = 2.0
    found = by_steps(runs)
    check(found, runs, "runs at 1/3 and 1/5 of the step", [2.0, 1.0 / 3.0, 0.2])
    runs = Runs(1.0, stops={0.2: "stopped"})
    runs.run.method.order = 2.0
    assert "1/5" not in by_steps(runs).method


def test_steps_that_end_early_are_compared_with_shorter_ones() -> None:
    runs = Runs(untold=(2.0, 0.5))
    check(by_steps(runs), runs, "a run at 1/4 of the step", [0.25])
    told, _ = reason(Runs(untold=(2.0, 1.0)), by_steps)
    assert told.startswith("its steps end where forces jump or states are sampled; runs in shorter steps that differ")
    told, _ = reason(Runs(untold=(2.0,), stops={0.5: "stopped at t = 0.7 s"}), by_steps)
    assert told == "a run at 1/2 of the step does not hold: stopped at t = 0.7 s"


def by_tolerance(runs: Runs) -> ErrorEstimate:
    return ways._by_tolerance(cast(Any, runs))


@pytest.mark.parametrize(("order", "factor"), [(5.0, 10.0), (2.0, 4.0), (1.0, 2.0)])
def test_a_smaller_tolerance_on_half_the_grid_shows_the_error(order: float, factor: float) -> None:
    runs = Runs(order)
    found = by_tolerance(runs)
    assert runs.asked == [(0.5, pytest.approx(1e-4 / factor))]
    assert found.relative == pytest.approx(ERROR) and math.isnan(found.declared_order)
    assert found.method == f"a run at a tolerance of {1e-4 / factor:.2g} and half the step"


def test_steps_that_end_at_jumps_stay_on_the_grid() -> None:
    runs = Runs(5.0)
    runs.parts.ends = (0.5,)
    found = by_tolerance(runs)
    assert runs.asked == [(1.0, pytest.approx(1e-5))] and found.method == "a run at a tolerance of 1e-05"
    runs = Runs(5.0, events=object())  # events are looked for on the grid
    runs.parts.ends = (0.5,)
    assert by_tolerance(runs).method == "a run at a tolerance of 1e-05 and half the step"


def test_the_same_steps_at_smaller_tolerances_are_told() -> None:
    # too many for a grid whose own steps are shorter than those of the run
    told, remedy = reason(of_steps(2000, 5.0, equal=(0.5,)), by_tolerance)
    assert told == "the steps of runs at other tolerances are the same ones"
    assert remedy == "largest_step = 0.025 in the settings"
    runs = Runs(5.0, equal=(1.0,))
    runs.parts.ends = (0.5,)
    found = by_tolerance(runs)
    # tolerances of 1/10, 1/1e4 and 1/1e8 of it, then a grid whose own steps are shorter than from jump to jump
    assert [tolerance for _, tolerance in runs.asked[:3]] == pytest.approx([1e-5, 1e-8, 1e-12])
    assert runs.asked[3][0] == pytest.approx(0.5 / (512.0 * STEP))
    assert found.method == "a run at a tolerance of 1e-05 and 1/102 of the step"
    told, _ = reason(Runs(5.0, stops={0.5: "stopped at t = 0.7 s", 1.0 / 512.0: "stopped"}), by_tolerance)
    assert told == "runs at other tolerances do not come to the end: stopped at t = 0.7 s"


class Times:
    """Events by name: counts, and times of those that are recorded."""

    def __init__(self, **times: Any) -> None:
        self.counts = {name: value if isinstance(value, int) else len(value) for name, value in times.items()}
        self.times = {name: np.zeros(0) if isinstance(value, int) else np.array(value) for name, value in times.items()}

    def __getitem__(self, name: str) -> Any:
        return SimpleNamespace(t=self.times[name])


@pytest.mark.parametrize(
    ("own", "other", "told"),
    [
        ({"hit": [0.2, 0.5]}, {"hit": [0.2, 0.5]}, ""),
        ({"hit": [0.2, 0.5]}, {"hit": [0.2]}, "the event hit comes 2 times, and 1 times in shorter steps"),
        ({"hit": [0.2]}, {"hit": [0.2, 0.95]}, ""),  # within a step of the end
        ({"hit": [0.2]}, {"hit": [0.2, 0.85]}, "the event hit comes 1 times, and 2 times in shorter steps"),
        ({"hit": [0.2]}, {"hit": [0.3, 0.85]}, ""),  # times differ by half as much as is left
        ({"turns": 5}, {"turns": 6}, ""),
        ({"turns": 5}, {"turns": 7}, "the event turns comes 5 times, and 7 times in shorter steps"),
    ],
)
def test_events_that_another_run_counts_differently(own: Any, other: Any, told: str) -> None:
    runs = Runs()
    runs.own.events = Times(**own)
    compared = SimpleNamespace(events=Times(**other))
    assert ways._passed_over(cast(Any, runs), cast(Any, compared)) == told
    runs.span.rows[0, 0] = 0.1  # a run that goes on has events from before
    assert ways._passed_over(cast(Any, runs), cast(Any, compared)) == ""


def test_the_largest_of_differences_is_taken_row_by_row() -> None:
    first = MotionDifference(np.array([0.0, 1.0, 3.0]), {"q": np.array([[1.0], [4.0], [9.0]])})
    last = MotionDifference(np.array([0.0, 1.0, 2.0]), {"q": np.array([[2.0], [2.0], [2.0]])})
    found = ways._largest_of([(first, 0.5), (last, 2.0)])
    assert found.t.tolist() == [0.0, 1.0, 2.0] and found.kinds["q"].tolist() == [[4.0], [4.0], [4.0]]
    found = ways._largest_of([(first, 2.0), (last, 1.0)])
    assert found.kinds["q"].tolist() == [[2.0], [8.0], [2.0]]


@pytest.mark.parametrize(("share", "doubtful"), [(0.99, False), (1.01, True)])
def test_large_differences_in_parts_of_the_motion_are_doubtful(share: float, doubtful: bool) -> None:
    runs = Runs()
    runs.motion = lambda multiple, *_, **__: SimpleNamespace(  # type: ignore[method-assign]
        rows=np.zeros((3, 7)), stopped="", error=share * 0.1 / 3.0 * multiple**2, multiple=multiple,
        events=None, statistics={}, outputs={},
    )  # fmt: skip  # two lines
    runs.own = runs.motion(1.0)
    by_steps(runs)
    assert ((0.5, None) in runs.asked) == doubtful
