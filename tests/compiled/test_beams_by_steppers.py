"""Orders of steppers on geometrically exact beams: in closed loops at steps that vary, which callers or tolerances
choose, and in flight by methods that know no constraints."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

import eomgen
from tests.compiled.spaghetti import flown, slopes, spaghetti
from tests.models.flexible_four_bar import flexible_four_bar

pytestmark = pytest.mark.slow

Array = NDArray[np.float64]


@cache
def four_bar_over_time(model: str) -> Callable[[Any], list[Array]]:
    """Return q, v and multipliers of the four-bar up to 1 s as functions of time, by a method of order 4."""
    made = eomgen.build(flexible_four_bar(model), method="rk4_partitioned", profile="quick")
    run = made.simulate(1.05, 2.0**-10, method="rk4_partitioned", error_estimate=False)
    assert run.success, run.message
    assert np.abs(run.q - run.q[0]).max() > 1.0
    rows = [CubicSpline(run.t, block) for block in (run.q, run.v, run.multipliers)]
    return lambda t: [row(t) for row in rows]


def at_random_steps(made: eomgen.Model, method: str, largest: float, seed: int, exact: Any) -> tuple[float, Array]:
    """Return the root mean square over 1 s of the step, and the largest errors of q, v and multipliers; steps are in
    [largest/4, largest], each 1/2 to 3/2 of the last."""
    rng, run = np.random.default_rng(seed), made.start(step=largest, method=method)
    step, taken, worst = 0.5 * largest, [], np.zeros(3)
    while sum(taken) < 1.0:
        step = float(np.clip(step * rng.uniform(0.5, 1.5), 0.25 * largest, largest))
        taken.append(step)
        run.advance(sum(taken))
        found = (run.q, run.v, run.multipliers)
        worst = np.maximum(worst, [np.abs(a - b).max() for a, b in zip(found, exact(run.t), strict=True)])
    return float(np.sqrt(np.sum(np.power(taken, 3)) / np.sum(taken))), worst


@pytest.mark.long
def test_order_2_through_a_loop_at_steps_that_vary() -> None:
    """Errors of single grids of steps are half their mean apart, so slopes need eight of them."""
    exact, method = four_bar_over_time("kirchhoff"), "rattlie"
    made, sizes, errors = eomgen.build(flexible_four_bar("kirchhoff"), method=method, profile="quick"), [], []
    for power in (7, 8, 9, 10):
        runs = [at_random_steps(made, method, 2.0**-power, seed, exact) for seed in range(8)]
        sizes.append(np.mean([size for size, _ in runs]))
        errors.append(np.mean([found for _, found in runs], axis=0))
    orders = [np.polyfit(np.log(sizes), np.log(column), 1)[0] for column in np.transpose(errors)]
    assert orders == pytest.approx([2.0, 2.0, 2.0], abs=0.15)


@pytest.mark.slow
def test_order_2_through_a_loop_at_steps_by_tolerances() -> None:
    exact, method = four_bar_over_time("cosserat"), "generalized_alpha_adaptive"
    made, taken, errors = eomgen.build(flexible_four_bar("cosserat"), method=method, profile="quick"), [], []
    for tolerance in (1e-4, 1e-5):
        run = made.simulate(1.0, 2.0**-5, method=method, tolerance=tolerance, error_estimate=False)
        assert run.success, run.message
        taken.append(run.stats["own_steps"])
        found = zip((run.q, run.v, run.multipliers), exact(run.t), strict=True)
        errors.append([np.abs(a - b)[1:].max() for a, b in found])
    orders = np.diff(np.log(errors), axis=0) / -np.diff(np.log(taken))[:, None]
    assert orders[-1] == pytest.approx([2.0, 2.0, 2.0], abs=0.1)


@pytest.mark.slow
@pytest.mark.parametrize(("method", "order", "finer"), [("lsrt2", 2, 9), ("tdg2", 5, 8)])
def test_beams_that_shear_and_stretch_fly_by_methods_of_higher_order(method: str, order: int, finer: int) -> None:
    """All against rk4 over 1 s; at 2^-6 s, h omega of the fastest stretch is 1.25."""
    data, errors = spaghetti.scene(4, model="cosserat"), []
    exact = flown(eomgen.build(data, method="rk4", profile="quick"), 1.0, 11, 3, method="rk4")
    made = eomgen.build(data, method=method, profile="quick")
    for power in (finer - 1, finer):
        run = flown(made, 1.0, power, 3, method=method)
        errors.append([np.abs(run.q - exact.q).max(), np.abs(run.v - exact.v).max()])
    (orders,) = slopes(errors)
    assert np.min(orders) > order - 0.3 and np.max(orders) < order + 0.8
