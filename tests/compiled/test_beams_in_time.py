"""Published motions of geometrically exact beams, against oracles in NumPy and SciPy, and their orders."""

from __future__ import annotations

import runpy
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import eomgen
from tests.models.cosserat import ROLL_UP, beam_scene
from tests.oracles.flying_beam import Beam
from tests.oracles.rolled_strip import MOMENT, Strip

EXAMPLES = Path(__file__).parents[2] / "examples"
spaghetti: Any = SimpleNamespace(**runpy.run_path(str(EXAMPLES / "flying_spaghetti" / "spaghetti.py")))
cantilever: Any = SimpleNamespace(**runpy.run_path(str(EXAMPLES / "right_angle_cantilever" / "cantilever.py")))


def slopes(errors: Any) -> Any:
    return np.log2(np.asarray(errors)[:-1] / np.asarray(errors)[1:])


# -- roll-up -----------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_strip_rolls_up_as_a_planar_model_does() -> None:
    """Its damping is 200, as Cd = 100 of Hante, Tumiotto and Arnold, whose forces are C strain + 2 Cd rate."""
    times = np.array([2.5, 5.0, 7.5, 10.0])
    angle, x, y = Strip(4, 200.0, linear_moments=True).moved(times).T
    expected = np.column_stack([np.cos(0.5 * angle), np.sin(0.5 * angle), x, -y])
    scene = beam_scene(4, {"torque": [0.0, f"{MOMENT!r} * load", 0.0]}, {"damping": dict.fromkeys(ROLL_UP, 200.0)})
    model, errors = eomgen.build(scene, profile="quick"), []
    for power in (6, 7):
        run = model.simulate(10.0, 2.0**-power, rho_inf=0.8, record_every=5 * 2 ** (power - 1), error_estimate=False)
        pose = run.poses["rope.4"][1:]
        np.testing.assert_allclose(pose[:, [1, 3, 5]], 0.0, atol=1e-9)
        errors.append(np.abs(pose[:, [0, 2, 4, 6]] - expected).max())
    assert errors[-1] < 1.2e-4
    assert slopes(errors) == pytest.approx(2.0, abs=0.1)


# -- flying spaghetti --------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_steps_of_the_flying_spaghetti_are_those_of_the_published_scheme() -> None:
    """So is the way of its centre of mass, which on SE(3) is met to order 2 only: steps turn nodes and move them at
    once, along screws. Linear momentum is exact in both."""
    model, step = eomgen.build(spaghetti.scene(4), method="rattlie", profile="quick"), 2.0**-6
    run = model.simulate(6.0, step, method="rattlie", error_estimate=False)
    nodes, beam, found, gaps = spaghetti.axis_of(run, 4), Beam(4), [], []
    for _ in run.t[1:]:
        beam.step(step)
        found.append(beam.place)
        if beam.t >= spaghetti.THROWN:
            gaps.append(beam.centre() - spaghetti.in_free_flight(np.array([beam.t]))[0])
            np.testing.assert_allclose(beam.momentum(), [50.0, 0.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(nodes[1:], found, atol=1e-8)
    free = run.t >= spaghetti.THROWN
    own = spaghetti.centre_of_mass(nodes[free]) - spaghetti.in_free_flight(run.t[free])
    assert np.abs(own).max() > 1e-4
    np.testing.assert_allclose(own, gaps, atol=1e-8)


@pytest.mark.slow
def test_a_centre_of_mass_flies_straight_where_nodes_travel_and_turn_apart() -> None:
    data = spaghetti.scene(4)
    data["beams"]["noodle"]["group"] = "R3xSO3"
    model = eomgen.build(data | {"coordinates": "absolute"}, method="rattlie", profile="quick")
    ranges = []
    for power in (9, 10):
        run = model.simulate(6.5, 2.0**-power, method="rattlie", record_every=2 ** (power - 5), error_estimate=False)
        free = run.t >= spaghetti.THROWN
        centre = spaghetti.centre_of_mass(spaghetti.axis_of(run, 4)[free])
        np.testing.assert_allclose(centre, spaghetti.in_free_flight(run.t[free]), atol=1e-11)
        energy = run.energy["kinetic"][free] + run.energy["potential"][free]
        assert np.mean(energy) == pytest.approx(846.176, abs=2e-3)
        ranges.append(np.ptp(energy))
    assert ranges[1] < 2e-4
    assert slopes(ranges) == pytest.approx(2.0, abs=0.1)


@pytest.mark.long
def test_a_noodle_is_of_order_2_at_steps_that_resolve_it() -> None:
    """Root mean squares over 1/2 s of q, v, and section forces, of a noodle that does not stretch."""
    model = eomgen.build(spaghetti.scene(8, model="inextensible"), method="rattlie", profile="quick")

    def at(power: int) -> list[np.ndarray]:
        run = model.simulate(0.5, 2.0**-power, method="rattlie", record_every=2 ** (power - 6), error_estimate=False)
        assert run.success, run.message
        return [run.q, run.v, run.multipliers]

    runs = [at(7 + number) for number in range(5)]
    exact = [fine + (fine - coarse) / 3.0 for coarse, fine in zip(*runs[-2:], strict=True)]
    found = slopes([[np.sqrt(np.mean((a - b) ** 2)) for a, b in zip(run, exact, strict=True)] for run in runs[:3]])
    np.testing.assert_allclose(found, 2.0, atol=0.1)


# -- right-angle cantilever --------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_the_right_angle_cantilever_takes_long_steps() -> None:
    """0.2 s are 1/30 of a slow swing and 30 periods of stretch; relative and absolute tolerances are ODIN's."""
    model = eomgen.build(cantilever.scene(5), profile="quick")
    fine = model.simulate(10.0, 0.01, record_every=20, rho_inf=0.8, error_estimate=False)
    run, counts = model.start(step=0.2, rho_inf=0.8, settings={"rtol": 1e-5, "atol": 1e-3}), [0]
    for _ in range(75):
        run.step()
        counts.append(run.statistics["newton_iterations"])
    taken = np.diff(counts)
    assert np.max(taken) <= 20 and np.mean(taken) <= 8.0
    for settings in ({}, {"rtol": 1e-5, "atol": 1e-3}):
        coarse = model.simulate(10.0, 0.2, rho_inf=0.8, settings=settings, error_estimate=False)
        assert coarse.success, coarse.message
        for place in ("elbow", "tip"):
            z, expected = coarse.outputs[place][: len(fine.t), 2], fine.outputs[place][:, 2]
            assert np.abs(z - expected).max() < 0.03 * np.abs(expected).max()
