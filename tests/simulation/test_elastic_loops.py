"""Closed loops with elastic members: multipliers and coordinate partitioning give the same motion, and energy is
kept."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

import eomgen

CRANK, ROD = 0.15, 0.3


def elastic_crank() -> dict[str, Any]:
    """Return a slider-crank whose crank bends from its axle and whose rod bends between its pins, where the loop is
    closed."""
    angle, rate = 0.3, 10.0
    rod_angle = -np.arcsin(CRANK / ROD * np.sin(angle))
    rod_rate = -CRANK * np.cos(angle) * rate / (ROD * np.cos(rod_angle))
    crank = {"modes": 1, "stiffness": 4.0}
    rod = {"shapes": "pinned_pinned", "modes": 2, "stiffness": 2.0}
    hinge = {"type": "revolute", "axis": [0, 0, 1]}
    return {
        "format": 1,
        "name": "elastic_crank",
        "gravity": [0, -9.81, 0],
        "bodies": {"slider": {"mass": 0.1}},
        "beams": {
            "crank": {"length": CRANK, "mass_per_length": 1.5, "bending_y": crank},
            "rod": {"length": ROD, "mass_per_length": 0.5, "bending_y": rod, "stretch": {"modes": 1, "stiffness": 2e3}},
        },
        "joints": {
            "axle": {**hinge, "parent": "base", "child": "crank", "initial": {"position": angle, "velocity": rate}},
            "pin": {
                **hinge,
                "parent": "crank",
                "child": "rod",
                "position": [CRANK, 0, 0],
                "initial": {"position": rod_angle - angle, "velocity": rod_rate - rate},
            },
            "rail": {
                "type": "prismatic",
                "parent": "base",
                "child": "slider",
                "axis": [1, 0, 0],
                "initial": {"position": CRANK * np.cos(angle) + ROD * np.cos(rod_angle)},
            },
        },
        "constraints": {
            "wrist": {
                "type": "point_on_line",
                "first": {"body": "slider", "axis": [0, 0, 1]},
                "second": {"body": "rod", "position": [ROD, 0, 0]},
            }
        },
    }


@cache
def model() -> eomgen.Model:
    return eomgen.build(elastic_crank())


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
