"""Orders of steppers on geometrically exact beams: in closed loops at steps that tolerances choose, and in flight by
methods that know no constraints."""

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
