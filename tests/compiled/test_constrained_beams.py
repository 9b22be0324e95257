"""Runs of beams without shear or stretch: digits of the flying spaghetti, orders in time, hidden constraints."""

from __future__ import annotations

import runpy
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import eomgen
from tests.anchors import anchor

spaghetti: Any = SimpleNamespace(
    **runpy.run_path(str(Path(__file__).parents[2] / "examples" / "flying_spaghetti" / "spaghetti.py"))
)
#: Where the end that is thrown is at t = 2.5 s and t = 5 s by elements, of an implementation in NumPy that shares no
#: code with this one: Kirchhoff beam on S^3 x R^3, RATTLie, steps of 2^-10 s (data of Hante, Tumiotto and Arnold 2022).
THROWN_END = {
    4: anchor("flying_spaghetti").reference.reshape(2, 3),
    16: ((3.41719291, 0.19477725, 0.02708423), (19.58065630, 1.57869296, -1.55157278)),
}


@pytest.mark.long
@pytest.mark.parametrize("elements", list(THROWN_END))
def test_the_thrown_end_is_where_another_implementation_has_it(elements: int) -> None:
    model = eomgen.build(spaghetti.scene(elements), method="rattlie", profile="quick")
    run = model.simulate(5.0, 2.0**-10, method="rattlie", record_every=2560, error_estimate=False)
    assert run.success, run.message
    np.testing.assert_allclose(run.poses["noodle"][1:, 4:], THROWN_END[elements], atol=1e-6)
    if elements == 4:
        anchor("flying_spaghetti").check(run.poses["noodle"][1:, 4:])


@pytest.mark.slow
def test_rounding_of_places_stops_no_step_of_rattlie() -> None:
    """Steps that move less than places are rounded to: gaps of 1e-15 m by 6e-5 s are most of what changes."""
    model = eomgen.build(spaghetti.scene(2), method="rattlie", profile="quick")
    for step in (2.0**-13, 2.0**-14):
        run = model.simulate(0.05, step, error_estimate=False)
        assert run.success, run.message
        assert run.stats["newton_iterations"] < 4.0 * run.stats["steps"]


def slopes(errors: Any) -> Any:
    return np.log2(np.asarray(errors)[:-1] / np.asarray(errors)[1:])


@pytest.mark.long
@pytest.mark.parametrize(
    ("model", "methods", "coarsest", "within"),
    [
        ("kirchhoff", ("generalized_alpha", "rattlie"), 9, 0.2),
        ("inextensible", ("generalized_alpha_index3", "rosenbrock"), 8, 0.1),
    ],
)
def test_positions_velocities_and_section_forces_are_of_order_2(
    model: str, methods: tuple[str, ...], coarsest: int, within: float
) -> None:
    """Against a method of order 4, at steps that resolve the stretching (80 rad/s) of models that stretch.

    Multipliers of index 3 oscillate with the step: their order between two steps is 2.08, 2.17, 2.68, 1.19.
    """
    data, fourth = spaghetti.scene(4, model=model), "rk4_partitioned"
    exact = eomgen.build(data, method=fourth, profile="quick").simulate(
        1.0, 2.0**-10, method=fourth, record_every=2**8, error_estimate=False
    )
    for method in methods:
        made, errors = eomgen.build(data, method=method, profile="quick"), []
        for power in (coarsest, coarsest + 1):
            run = made.simulate(1.0, 2.0**-power, method=method, record_every=2 ** (power - 2), error_estimate=False)
            assert run.success, run.message
            assert run.stats["max_constraint"] < 1e-13
            assert run.stats["max_constraint_velocity"] < (1e-5 if method.endswith("index3") else 1e-11)
            pairs = ((run.q, exact.q), (run.v, exact.v), (run.multipliers, exact.multipliers))
            errors.append([np.abs(found[1:] - expected[1:]).max() for found, expected in pairs])
        *motion, forces = slopes(errors)[-1]
        assert motion == pytest.approx([2.0, 2.0], abs=within), method
        assert forces == pytest.approx(2.0, abs=0.3 if method.endswith("index3") else within), method


@pytest.mark.long
def test_free_flight_keeps_what_mechanics_says() -> None:
    """Linear and angular momentum to rounding, energy without drift; its range and the way of the centre of mass by
    order 2, as steps turn nodes and move them at once."""
    made, ranges, gaps = eomgen.build(spaghetti.scene(8), method="rattlie", profile="quick"), [], []
    for power in (9, 10):
        run = made.simulate(9.0, 2.0**-power, method="rattlie", record_every=2 ** (power - 4), error_estimate=False)
        assert run.success, run.message
        free = run.t >= spaghetti.THROWN
        t, nodes = run.t[free], spaghetti.axis_of(run, 8)[free]
        energy = run.energy["kinetic"][free] + run.energy["potential"][free]
        ranges.append(np.ptp(energy))
        assert np.mean(energy) == pytest.approx(874.53, abs=0.01)
        assert np.abs(np.polyfit(t, energy, 1)[0]) < 0.1 * ranges[-1]
        gaps.append(np.abs(spaghetti.centre_of_mass(nodes) - spaghetti.in_free_flight(t)).max())
        momenta = np.einsum("tij,tj->ti", made.centroidal_momentum(run.q[free]), run.v[free])
        np.testing.assert_allclose(momenta[:, 3:], np.tile([50.0, 0.0, 0.0], (len(t), 1)), atol=1e-9)
        about_origin = momenta[:, :3] + np.cross(spaghetti.centre_of_mass(nodes), momenta[:, 3:])
        assert np.max(np.ptp(about_origin, axis=0)) < 1e-8
    assert ranges[1] < 2e-4 and gaps[1] < 5e-5
    assert slopes(ranges) == pytest.approx(2.0, abs=0.1)
    assert slopes(gaps) == pytest.approx(2.0, abs=0.1)
