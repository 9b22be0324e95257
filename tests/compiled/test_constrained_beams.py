"""Runs of beams without shear or stretch: digits of the flying spaghetti, orders in time, hidden constraints."""

from __future__ import annotations

import runpy
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import eomgen
from tests.models.cache import shared_cache

__all__ = ["shared_cache"]

spaghetti: Any = SimpleNamespace(
    **runpy.run_path(str(Path(__file__).parents[2] / "examples" / "flying_spaghetti" / "spaghetti.py"))
)
#: Where the end that is thrown is at t = 2.5 s and t = 5 s by elements, of an implementation in NumPy that shares no
#: code with this one: Kirchhoff beam on S^3 x R^3, RATTLie, steps of 2^-10 s (data of Hante, Tumiotto and Arnold 2022).
THROWN_END = {
    4: ((3.55778181, 0.14453902, 0.14393421), (19.68905208, 2.61983381, -2.32524228)),
    8: ((3.44348092, 0.18402970, 0.05276752), (19.63434192, 1.78533503, -1.70756265)),
    16: ((3.41719291, 0.19477725, 0.02708423), (19.58065630, 1.57869296, -1.55157278)),
    32: ((3.41086502, 0.19758223, 0.02046807), (19.56466560, 1.52752843, -1.51284367)),
}


@pytest.mark.parametrize("elements", list(THROWN_END))
def test_the_thrown_end_is_where_another_implementation_has_it(elements: int) -> None:
    model = eomgen.build(spaghetti.scene(elements), method="rattlie", profile="quick")
    run = model.simulate(5.0, 2.0**-10, method="rattlie", record_every=2560, error_estimate=False)
    assert run.success, run.message
    np.testing.assert_allclose(run.poses["noodle"][1:, 4:], THROWN_END[elements], atol=1e-6)


def test_rounding_of_places_stops_no_step_of_rattlie() -> None:
    """Steps that move less than places are rounded to: gaps of 1e-15 m by 6e-5 s are most of what changes."""
    model = eomgen.build(spaghetti.scene(2), method="rattlie", profile="quick")
    for step in (2.0**-13, 2.0**-14):
        run = model.simulate(0.05, step, error_estimate=False)
        assert run.success, run.message
        assert run.stats["newton_iterations"] < 4.0 * run.stats["steps"]


def slopes(errors: Any) -> Any:
    return np.log2(np.asarray(errors)[:-1] / np.asarray(errors)[1:])


@pytest.mark.parametrize("model", ["kirchhoff", "inextensible"])
def test_positions_velocities_and_section_forces_are_of_order_2(model: str) -> None:
    """Until t = 1 s, at steps that resolve stretch (160 rad/s), against a method of order 4."""
    data = spaghetti.scene(8, model=model)
    exact = eomgen.build(data, method="rk4_partitioned", profile="quick").simulate(
        1.0, 2.0**-11, method="rk4_partitioned", record_every=2**9, error_estimate=False
    )
    for method in ("generalized_alpha", "generalized_alpha_index3", "rattlie", "rosenbrock"):
        made, errors = eomgen.build(data, method=method, profile="quick"), []
        for power in (9, 10, 11):
            run = made.simulate(1.0, 2.0**-power, method=method, record_every=2 ** (power - 2), error_estimate=False)
            assert run.success, run.message
            assert run.stats["max_constraint"] < 1e-13
            if method != "generalized_alpha_index3":
                assert run.stats["max_constraint_velocity"] < 1e-11
            pairs = ((run.q, exact.q), (run.v, exact.v), (run.multipliers, exact.multipliers))
            errors.append([np.abs(found[1:] - expected[1:]).max() for found, expected in pairs])
        assert slopes(errors)[-1] == pytest.approx([2.0, 2.0, 2.0], abs=0.1), method


def test_free_flight_keeps_what_mechanics_says() -> None:
    made, ranges = eomgen.build(spaghetti.scene(8), method="rattlie", profile="quick"), []
    for power in (9, 10):
        run = made.simulate(9.0, 2.0**-power, method="rattlie", record_every=2 ** (power - 4), error_estimate=False)
        assert run.success, run.message
        free = run.t >= spaghetti.THROWN
        t, nodes = run.t[free], spaghetti.axis_of(run, 8)[free]
        energy = run.energy["kinetic"][free] + run.energy["potential"][free]
        momentum = run.momentum["angular"][free] if hasattr(run, "momentum") else None
        ranges.append(np.ptp(energy))
        assert np.abs(np.polyfit(t, energy, 1)[0]) < 0.1 * ranges[-1]
        centre = np.abs(spaghetti.centre_of_mass(nodes) - spaghetti.in_free_flight(t)).max()
        print(power, energy.mean(), ranges[-1], centre, momentum)
    assert ranges[1] < 2e-4
    assert slopes(ranges) == pytest.approx(2.0, abs=0.1)
