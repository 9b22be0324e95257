"""Sizes of motions and errors from differences of runs, of rows that are given here: closed forms, and both sides of
every limit."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from eomgen.errors import UsageError
from eomgen.lie.product import Factor
from eomgen.results.error_estimate import NONE, OWN
from eomgen.simulation.accuracy import richardson
from eomgen.simulation.accuracy.comparison_runs import MotionDifference
from eomgen.simulation.accuracy.motion_size import MotionSize, differences, motion_size, shares, whole_turns
from eomgen.simulation.accuracy.richardson import Pair, estimate, gain_by, observed_orders

HINGE, SLIDE = Factor("R", "hinge", 0, 1, 0, 1), Factor("R", "slide", 1, 1, 1, 1)


class Names(frozenset[str]):
    """Names of functions with the sizes of their blocks; all may be called by runs."""

    sizes: dict[str, int]

    def for_runs(self, name: str) -> bool:
        return name in self


def model(**values: Any) -> Any:
    """Return a hinge, rad, and a slide, m, with an internal state and a multiplier."""
    given: dict[str, Any] = {
        "nq": 2, "nv": 2, "nz": 1, "nu": 0, "factors": (HINGE, SLIDE), "multipliers": ("rod",), "functions": (),
        "q_names": ("q.hinge", "q.slide"), "q_units": ("rad", "m"), "z_names": ("z.level",), "z_units": ("V",),
        "v_names": ("v.hinge", "v.slide"), "v_units": ("rad/s", "m/s"), "beams": (),
        "library": SimpleNamespace(layout={"outputs": [{"name": "load", "unit": "N"}, {"name": "kept", "unit": "J"}]}),
    }  # fmt: skip  # a table
    given |= values
    given["functions"] = functions = Names(given["functions"])
    functions.sizes = {"q": given["nq"], "v": given["nv"], "z": given["nz"], "lam": len(given["multipliers"])}
    return SimpleNamespace(**given)


def record(q: Any, v: Any, z: Any, multipliers: Any = 0.0) -> Any:
    """Return rows t, q, v, a, multipliers, z with t = 0, 1, 2, ..."""
    q, v, z = (np.asarray(part, float).reshape(len(q), -1) for part in (q, v, z))
    lam = np.broadcast_to(np.reshape(multipliers, (-1, 1)), (len(q), 1))
    return np.hstack([np.arange(float(len(q)))[:, np.newaxis], q, v, np.zeros_like(v), lam, z])


ROWS = record(
    [[0.0, 3.0], [0.5, 3.2], [-0.1, 3.1]], [[0.2, -4.0], [0.1, 1.0], [-0.3, 2.0]], [5.0, 5.5, 5.2], [7.0, -9.0, 1.0]
)


def test_sizes_are_ranges_of_coordinates_and_largest_velocities() -> None:
    load = np.array([2.0, -6.0, 4.0])
    size = motion_size(model(), ROWS, {"load": load})
    assert size.sizes["increment"].tolist() == pytest.approx([0.6, 0.2])
    assert size.sizes["q"].tolist() == pytest.approx([0.6, 0.2])
    assert size.sizes["v"].tolist() == [0.3, 4.0]
    assert size.sizes["z"].tolist() == [0.5] and size.sizes["multipliers"].tolist() == [9.0]
    assert size.sizes["output.load"].tolist() == [10.0]
    assert size.names == ("q.hinge", "q.slide", "z.level") and size.units == ("rad", "m", "V")
    assert size.own == (True, True, True) and size.turns == (False, False, False) and not size.still
    assert size.travel.tolist() == pytest.approx([0.6, 0.2, 0.5])


def test_angles_whose_turns_do_not_matter_are_as_large_as_a_turn() -> None:
    rows = record([[0.0, 0.0], [20.0, 1.0]], [[1.0, 1.0]] * 2, [0.0, 1.0])
    size = motion_size(model(), rows, {}, np.array([True, False]))
    assert size.sizes["increment"].tolist() == pytest.approx([2.0 * math.pi, 1.0])
    assert size.turns == (True, False, False) and size.travel[0] == 20.0


def test_differences_take_quaternions_of_either_sign_for_the_same() -> None:
    ball = Factor("SO3", "ball", 0, 4, 0, 3)
    free = model(nq=4, nv=3, factors=(ball,), multipliers=(), nz=0)
    half = math.cos(0.1), math.sin(0.1)
    first = np.array([[0.0, half[0], half[1], 0.0, 0.0, 1.0, 2.0, 3.0, 0.0, 0.0, 0.0]])
    second = first.copy()
    second[0, 1:5] = -math.cos(0.15), -math.sin(0.15), 0.0, 0.0
    second[0, 5:8] -= [0.5, -0.5, 0.0]
    apart = differences(free, first, second, ({"load": np.array([1.0])}, {"load": np.array([3.5])}))
    assert apart["increment"].tolist() == [pytest.approx([0.1, 0.0, 0.0], abs=1e-15)]
    assert apart["q"].tolist() == [pytest.approx([half[0] - math.cos(0.15), math.sin(0.15) - half[1], 0.0, 0.0])]
    assert apart["v"].tolist() == [[0.5, 0.5, 0.0]] and apart["output.load"].tolist() == [[2.5]]


def test_shares_of_motions_that_rest_in_one_run_alone_are_infinite() -> None:
    size = cast(MotionSize, SimpleNamespace(sizes={"increment": np.array([2.0, math.inf]), "z": np.array([4.0])}))
    apart = {"increment": np.array([[1.0, 0.0], [math.nan, 1e-30]]), "z": np.array([[1.0], [2.0]])}
    assert shares(apart, size).tolist() == [[0.5, 0.0, 0.25], [math.inf, math.inf, 0.5]]
    assert shares(apart, size, ("z",)).tolist() == [[0.25], [0.5]]


@pytest.mark.parametrize(
    ("force", "travel", "turns"),
    [
        (np.sin, 6.3, True),
        (np.sin, 6.28, False),  # less than a turn
        (lambda angle: np.sin(0.5 * angle), 40.0, False),  # two turns matter
        (lambda angle: np.sin(3.0 * angle), 40.0, True),
        (lambda angle: 0.0 * angle + 2.0, 40.0, False),  # a wheel of which no angle matters
        (lambda angle: angle, 40.0, False),
        (lambda angle: np.full_like(angle, np.nan), 40.0, False),
    ],
)
def test_turns_matter_unless_the_equations_have_them_as_period(force: Any, travel: float, turns: bool) -> None:
    made = model(functions=("inverse_dynamics",), inverse_dynamics=lambda q, *_, **__: force(q[:, :1]))
    q = np.stack([np.linspace(0.0, travel, 30), np.linspace(0.0, 40.0, 30)], axis=1)
    rows = record(q, np.ones((30, 2)), np.zeros(30))
    run = cast(Any, SimpleNamespace(model=made))
    assert whole_turns(run, rows, np.zeros(0)).tolist() == [turns, False]  # a slide has no turns


def test_turns_that_cannot_be_looked_at_matter() -> None:
    def fails(*_: object, **__: object) -> object:
        raise UsageError("a function of the caller")

    made = model(functions=("inverse_dynamics",), inverse_dynamics=fails)
    rows = record([[0.0, 0.0], [20.0, 0.0]], np.ones((2, 2)), np.zeros(2))
    assert whole_turns(cast(Any, SimpleNamespace(model=made)), rows, np.zeros(0)).tolist() == [False, False]


# -- Richardson's extrapolation ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("order", [1.0, 2.0, 4.0, 7.0])
def test_gains_take_differences_of_a_power_to_its_error(order: float) -> None:
    """Of x_h = C h^p at h = 1, 2 and 1/2."""
    assert richardson.gain_of(order) * (2.0**order - 1.0) == pytest.approx(1.0)
    assert richardson.gain_of(-order) * (1.0 - 0.5**order) == pytest.approx(1.0)
    assert gain_by(np.array([2.0, 0.5, 3.0]))(order)[:, 0].tolist() == pytest.approx(
        [1.0 / (2.0**order - 1.0), 1.0 / (1.0 - 0.5**order), 1.0 / (3.0**order - 1.0)]
    )


def powers(t: Any, order: float, scale: float = 1e-3, ratio: float = 2.0) -> Any:
    """Return |x_4h - x_2h| and |x_2h - x_h| of errors C(t) h^p, as times and tables."""
    growth = scale * np.asarray(t)[:, np.newaxis]
    return (t, growth * ratio**order), (t, growth)


@pytest.mark.parametrize("ratio", [2.0, 3.0])
@pytest.mark.parametrize("order", [1.0, 2.5, 4.0])
def test_the_order_is_observed_at_the_last_row_below_a_tenth_of_the_motion(order: float, ratio: float) -> None:
    t = np.linspace(0.0, 1.0, 11)
    far, near = powers(t, order, 1e-4, ratio)
    assert observed_orders(far, near, (1e-12,), ratio)[0, 0] == pytest.approx(order)
    bent = far[1].copy()
    bent[8:] = 0.5  # saturated from there on
    assert observed_orders((t, bent), near, (1e-12,), ratio)[0, 0] == pytest.approx(order)
    bent[:] = 0.5
    bent[0] = 0.0
    seen = math.log(0.5 / near[1][1, 0]) / math.log(ratio)  # all too large: the first row that is known
    assert observed_orders((t, bent), near, (1e-12,), ratio)[0, 0] == pytest.approx(seen)


def test_differences_that_are_rounding_show_no_order() -> None:
    t = np.linspace(0.0, 1.0, 11)
    far, near = powers(t, 2.0, 1e-9)
    assert math.isnan(observed_orders(far, near, (1e-9,))[0, 0])  # nothing above the floor in both
    assert observed_orders(far, near, (0.99e-9,))[0, 0] == pytest.approx(2.0)
    assert math.isnan(observed_orders((t[:0], far[1][:0]), near, (1e-12,))[0, 0])
    assert math.isnan(observed_orders(far, (t[:0], near[1][:0]), (1e-12,))[0, 0])
    assert math.isnan(observed_orders((t, np.zeros((11, 1))), near, (1e-12,))[0, 0])
    assert math.isnan(observed_orders((t, np.full((11, 1), np.nan)), near, (1e-12,))[0, 0])


def runs_of(size: MotionSize, rows: Any, outputs: dict[str, Any], made: Any = None) -> Any:
    run = SimpleNamespace(model=made or model(), grid=SimpleNamespace(start=0.0))
    return SimpleNamespace(
        size=size, rounding=1e-12, single=False, own=SimpleNamespace(outputs=outputs), run=run,
        span=SimpleNamespace(rows=rows), step=0.1,
    )  # fmt: skip  # two lines


def apart_of(values: float, outputs: dict[str, Any]) -> MotionDifference:
    t = np.array([1.0, 2.0])
    grows = values * np.array([[0.5], [1.0]])
    kinds = {
        "q": grows * [1.0, 0.1], "increment": grows * [1.0, 0.1], "v": grows * [2.0, 0.2], "z": grows * [1e-3],
        "multipliers": grows * [5.0], **{f"output.{name}": grows * array for name, array in outputs.items()},
    }  # fmt: skip  # two lines
    return cast(MotionDifference, SimpleNamespace(t=t, kinds=kinds))


def test_errors_are_differences_by_the_observed_order_and_relative_to_the_motion() -> None:
    outputs = {"load": np.array([2.0, -6.0, 4.0])}
    size = motion_size(model(), ROWS, outputs)
    near, far = apart_of(3e-4, {"load": [[7.0]]}), apart_of(12e-4, {"load": [[7.0]]})
    pair = Pair(near, lambda order: np.full((2, 1), richardson.gain_of(order)), "runs at 2 and 4 steps", near, far)
    found = estimate(runs_of(size, ROWS, outputs), pair, 2.0)
    assert found.available and found.order == pytest.approx(2.0) and found.declared_order == 2.0
    np.testing.assert_allclose(found.increment_at, [[0.5e-4, 0.5e-5], [1e-4, 1e-5]])
    np.testing.assert_allclose(found.relative_at, [0.5e-4 / 0.6, 1e-4 / 0.6])
    largest = found.largest
    assert largest is not None and (largest.name, largest.unit, largest.time) == ("q.hinge", "rad", 2.0)
    assert (largest.error, largest.share) == (pytest.approx(1e-4), found.relative) and largest.measure == OWN
    velocity = found.largest_velocity
    assert velocity is not None and (velocity.name, velocity.unit, velocity.time) == ("v.hinge", "rad/s", 2.0)
    # the least velocity that counts is the motion over the span of 2 s: 0.3 rad/s, which the largest is, too
    assert (velocity.error, velocity.share) == (pytest.approx(2e-4), pytest.approx(2e-4 / 0.3))
    assert velocity.measure == "the largest velocity in rad/s"
    output = found.largest_output
    assert output is not None and (output.name, output.unit, output.time) == ("output load", "N", 2.0)
    assert (output.error, output.share, output.measure) == (pytest.approx(7e-4), pytest.approx(7e-5), "its range")
    assert found.outputs_at["load"].shape == (2,) and found.method == "runs at 2 and 4 steps"


@pytest.mark.parametrize(("seen", "used"), [(1.5, 1.5), (0.3, 1.0), (3.7, 2.0)])
def test_orders_are_used_from_one_to_the_declared_one(seen: float, used: float) -> None:
    size = motion_size(model(), ROWS, {})
    near, far = apart_of(1e-5, {}), apart_of(1e-5 * 2.0**seen, {})
    pair = Pair(near, lambda order: np.full((2, 1), order), "", near, far)
    found = estimate(runs_of(size, ROWS, {}), pair, 2.0)
    assert found.order == pytest.approx(seen)
    np.testing.assert_allclose(found.increment_at[1], [1e-5 * used, 1e-6 * used])
    alone = estimate(runs_of(size, ROWS, {}), Pair(near, lambda order: np.full((2, 1), order), ""), 3.0)
    assert math.isnan(alone.order)
    np.testing.assert_allclose(alone.increment_at[1], [3e-5, 3e-6])


def test_small_and_missing_motions_are_measured_by_what_is_said() -> None:
    small = record([[0.0, 0.0], [1.0, 1e-4]], [[1.0, 1.0]] * 2, [0.0, 0.0])
    both = model(q_units=("m", "m"), v_units=("m/s", "m/s"))
    size = motion_size(both, small, {})
    apart = apart_of(1e-3, {})
    apart.kinds["increment"] = np.array([[0.0, 0.5e-3], [0.0, 1e-3]])
    pair = Pair(apart, lambda order: np.ones((2, 1)), "")
    found = estimate(runs_of(size, small, {}, both), pair, 2.0).largest
    assert found is not None and (found.name, found.share) == ("z.level", math.inf) and found.measure == NONE
    apart.kinds["z"] = np.zeros((2, 1))
    found = estimate(runs_of(size, small, {}, both), pair, 2.0).largest
    assert found is not None and (found.name, found.share) == ("q.slide", pytest.approx(1.0))
    assert found.measure == "0.001 m, the least that counts as its motion"
    turned = motion_size(
        model(), record([[0.0, 0.0], [20.0, 1.0]], [[1.0, 1.0]] * 2, [0.0, 1.0]), {}, np.array([True, False])
    )
    apart.kinds["increment"] = np.array([[0.0, 0.0], [0.1, 0.0]])
    found = estimate(runs_of(turned, ROWS, {}), pair, 2.0).largest
    assert found is not None and found.measure == "a turn" and found.share == pytest.approx(0.1 / (2.0 * math.pi))
