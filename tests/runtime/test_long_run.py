"""A hundred thousand steps of the slow top and of a four-bar: constraints, energy, quaternions and angular momentum stay."""

from __future__ import annotations

import math
from functools import partial

import pytest

from benchmarks import tops
from benchmarks.long_run import Case, LongRun, four_bar, measured

STEPS = 100_000


def run(case: Case) -> LongRun:
    found = measured(case, STEPS, 0.9)
    assert found.message.startswith(f"reached t = {STEPS * case.step:.9g} s in {STEPS} steps")
    return found


@pytest.mark.parametrize(
    ("formulation", "momentum"), [(tops.SE3, 6.4e-5), (tops.R3XSO3, 4.2e-5)], ids=lambda value: getattr(value, "group", "")
)
def test_the_slow_top_keeps_its_invariants(formulation: tops.Formulation, momentum: float) -> None:
    found = run(Case(formulation.name, partial(formulation.model, tops.SLOW), 1e-3))
    assert found.constraint <= 1e-12
    assert found.quaternion <= 1e-14
    assert found.drop <= 2e-3 * found.energy  # goes to and fro with the nutation
    assert abs(found.trend) * STEPS * 1e-3 <= 1e-4 * found.energy
    assert 1e-6 < found.momentum <= momentum  # not conserved by the method, and not lost


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_a_four_bar_keeps_its_loop_and_loses_energy_by_the_order_only(coordinates: str) -> None:
    rate = 20.0 if coordinates == "absolute" else 0.0
    found = run(Case("four-bar", partial(four_bar, coordinates, rate), 1e-3))
    assert 0.0 < found.constraint <= 1e-12
    assert found.quaternion <= 1e-14
    if rate:
        assert found.drop <= 5e-3 * found.energy
        assert found.trend < 0.0
        assert found.order == pytest.approx(2.0, abs=0.2)
    else:
        assert found.drop <= 1e-3  # J, of some 3 J that move between kinetic and potential energy
    assert math.isnan(found.momentum)  # nothing turns freely about the vertical
