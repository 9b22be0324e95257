"""A hundred thousand steps of the slow top and of a four-bar: constraints, energy, quaternions and angular momentum
stay."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
import pytest

from benchmarks import tops
from benchmarks.long_run import COUPLER, CRANK, GROUND, ROCKER, Case, LongRun, four_bar, measured

STEPS = 100_000


def run(case: Case) -> LongRun:
    found = measured(case, STEPS, 0.9)
    assert found.message.startswith(f"reached t = {STEPS * case.step:.9g} s in {STEPS} steps")
    return found


@pytest.mark.slow
@pytest.mark.parametrize(
    ("formulation", "trend", "momentum"),
    [(tops.SE3, 1e-5, 6.4e-5), (tops.R3XSO3, 2e-4, 1e-5)],
    ids=lambda value: getattr(value, "group", ""),
)
def test_the_slow_top_keeps_its_invariants(formulation: tops.Formulation, trend: float, momentum: float) -> None:
    found = run(Case(formulation.name, partial(formulation.model, tops.SLOW), 1e-3))
    assert found.constraint <= 1e-12
    assert found.quaternion <= 1e-14
    assert found.drop <= 2e-3 * found.energy  # goes to and fro with the nutation
    assert abs(found.trend) * STEPS * 1e-3 <= trend * found.energy
    assert 1e-6 < found.momentum <= momentum  # not conserved by the method, and not lost


@pytest.mark.slow
@pytest.mark.long_except("joint")
@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_a_four_bar_keeps_its_loop_and_loses_energy_by_the_order_only(coordinates: str) -> None:
    rate = 20.0 if coordinates == "absolute" else 0.0
    found = run(Case("four-bar", partial(four_bar, coordinates, rate), 1e-3))
    assert 0.0 < found.constraint <= 1e-12
    assert found.quaternion <= 1e-14
    if rate:
        assert found.drop <= 1.5e-2 * found.energy
        assert found.trend < 0.0
        assert found.order == pytest.approx(2.0, abs=0.2)
    else:
        assert found.drop <= 1e-3  # J, of some 3 J that move between kinetic and potential energy
    assert math.isnan(found.momentum)  # nothing turns freely about the vertical


@pytest.mark.slow
@pytest.mark.parametrize("method", ["generalized_alpha", "rk4_partitioned"])
def test_a_crank_that_has_turned_eight_thousand_times_keeps_its_loop(method: str) -> None:
    model = four_bar("joint", 20.0)
    turned = model.initial_q + 2.0 * math.pi * np.array([8000.0, -8000.0, 0.0])
    first, late = (
        model.simulate(2.5, 2.5e-4, method=method, rho_inf=0.9, initial={"q": q, "v": model.initial_v})
        for q in (model.initial_q, turned)
    )
    # Corrections end at 32 last places of what the rows add up, four links of 2.6 m in all: 1.847e-14 m at any number
    # of turns and of steps, where the digits of an angle of 5e4 rad would be 7e-12. (They ended at 32 last places of 1
    # m, 7.1e-15, before sizes were looked at.)
    rounding = 32.0 * np.finfo(float).eps * (CRANK + COUPLER + ROCKER + GROUND)
    assert max(run.stats["max_constraint"] for run in (first, late)) <= 1.001 * rounding
    assert late.stats["max_constraint_velocity"] <= 1e-10  # 2 m/s times these digits, and what is left of them in v
    assert late.q[0] == pytest.approx(turned, abs=2e-11)  # brought onto the loop, which these digits miss by 1e-12
    assert np.ptp(late.q[:, 0]) > 20.0  # some turns, and no jump where one is complete
    assert np.abs(np.diff(late.q, axis=0)).max() < 0.03
    assert late.q - turned == pytest.approx(first.q - model.initial_q, abs=2e-9)  # the start, 1e-11 off, is felt
    assert late.v == pytest.approx(first.v, abs=2e-8)
