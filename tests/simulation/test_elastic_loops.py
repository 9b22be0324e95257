"""Closed loops with elastic members: multipliers and coordinate partitioning give the same motion, and energy is
kept."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import eomgen

CRANK, ROD = 0.15, 0.3


@cache
def model() -> eomgen.Model:
    """Return a slider-crank whose crank bends from its axle and whose rod bends between its pins, where the loop is
    closed."""
    angle, rate, z = 0.3, 10.0, [0, 0, 1]
    rod_angle = -np.arcsin(CRANK / ROD * np.sin(angle))
    rod_rate = -CRANK * np.cos(angle) * rate / (ROD * np.cos(rod_angle))
    builder = eomgen.SceneBuilder("elastic_crank", gravity=[0, -9.81, 0]).body("slider", 0.1)
    builder.beam("crank", length=CRANK, mass_per_length=1.5, bending_y={"modes": 1, "stiffness": 4.0})
    bending = {"shapes": "pinned_pinned", "modes": 2, "stiffness": 2.0}
    stretch = {"modes": 1, "stiffness": 2e3}
    builder.beam("rod", length=ROD, mass_per_length=0.5, bending_y=bending, stretch=stretch)
    start = {"position": angle, "velocity": rate}
    builder.joint("axle", "revolute", "base", "crank", axis=z, initial=start)
    start = {"position": rod_angle - angle, "velocity": rod_rate - rate}
    builder.joint("pin", "revolute", "crank", "rod", axis=z, position=[CRANK, 0, 0], initial=start)
    start = {"position": CRANK * np.cos(angle) + ROD * np.cos(rod_angle)}
    builder.joint("rail", "prismatic", "base", "slider", axis=[1, 0, 0], initial=start)
    end = {"body": "rod", "position": [ROD, 0, 0]}
    builder.constraint("wrist", "point_on_line", {"body": "slider", "axis": z}, end)
    return eomgen.build(builder.build())


@pytest.mark.slow
def test_partitioning_and_multipliers_agree_on_elastic_members() -> None:
    """What generalized-alpha is off by along the motion, in every coordinate, falls with the square of the step."""
    partitioned = model().simulate(0.1, 2.5e-5, method="rk4_partitioned").q[::4]
    off = []
    for step, every in ((2.5e-5, 4), (1.25e-5, 8)):
        q = model().simulate(0.1, step, method="generalized_alpha").q[::every]
        off.append(np.sqrt(np.mean((q - partitioned) ** 2, axis=0)))
    np.testing.assert_allclose(off[0] / off[1], 4.0, rtol=0.1)
    assert np.all(off[1] <= 2e-3 * np.ptp(partitioned, axis=0))
    assert np.ptp(partitioned[:, 1]) > 4e-5, "the crank hardly bends"


@pytest.mark.slow
def test_the_loop_stays_closed_and_energy_is_kept() -> None:
    run = model().simulate(0.1, 5e-5, method="rk4_partitioned")
    total = np.asarray(run.energy["kinetic"]) + np.asarray(run.energy["potential"])
    assert np.ptp(total) <= 1e-8 * np.max(run.energy["kinetic"])
    assert run.stats["max_constraint"] <= 1e-12
    assert np.abs(model().evaluate("constraint", run.q[::200])["Phi"]).max() <= 1e-12
