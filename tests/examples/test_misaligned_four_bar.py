"""The four-bar linkage with a hinge askew against rests of a loop of bars of constant strain."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import eomgen
from tests.oracles.evaluation import Array
from tests.oracles.strained_loops import Bar, Hinge, Loop, Shift

SCENE = Path(__file__).parents[2] / "examples" / "misaligned_four_bar" / "scene.toml"
ARM, SPAN, RATE, ASKEW = 0.12, 0.24, 0.6, np.radians(5.0)
THICK = (733.5, 1131.0, 1131.0, 52.99e6, 16.88e6, 16.88e6)
THIN = (45.84, 70.66, 70.66, 13.25e6, 4.22e6, 4.22e6)
#: Times before, in and after the pass in which all bars lie on the ground, s.
TIMES = np.array([2.5, 3.1, 3.5, 5.0])


def linkage(elements: int) -> Loop:
    """Return the loop, walked from the motor over crank, coupler and rocker to the support and back."""
    q = np.pi / 2.0
    return Loop(
        [
            Hinge([0, 0, 1], before=[0, 0, q]),
            Bar(ARM, elements, THICK),
            Hinge([0, 0, 1], before=[0, 0, -q]),
            Bar(SPAN, elements, THICK),
            Hinge([np.sin(ASKEW), 0, np.cos(ASKEW)]),
            Shift([0, 0, -q], [0, 0, 0]),
            Bar(ARM, elements, THIN),
            Hinge([0, 0, 1], before=[0, 0, q]),
            Shift([0, 0, 0], [-SPAN, 0, 0]),
        ]
    )


def rests(elements: int, angles: Array) -> Array:
    """Return the angles of coupler and rocker, and the motor's torque, for angles that the crank has turned by."""
    loop, turned, found = linkage(elements), 0.0, []
    for angle in angles:
        while turned > angle:  # slowly where all bars lie on the ground, so that the path is followed
            turned = max(turned - (0.02 if -1.7 < turned < -1.49 else 0.1), float(angle))
            torque = loop.turn(turned)
        found.append([loop.angles[1] - np.pi / 2.0, np.pi / 2.0 - loop.angles[3], torque])
    return np.array(found)


@pytest.mark.long
def test_it_rests_as_bars_of_constant_strain_do_on_either_side_of_the_pass() -> None:
    run = eomgen.build(SCENE).simulate(5.0)
    rows = np.rint(TIMES / 1e-3).astype(int)
    crank, coupler, rocker = run.outputs["angles"][rows].T
    angles = -RATE * (TIMES - 0.5)
    np.testing.assert_allclose(crank, np.pi / 2.0 + angles, atol=1e-10)
    coarse, fine = rests(2, angles), rests(4, angles)
    expected = fine + (fine - coarse) / 3.0
    np.testing.assert_allclose(np.stack([coupler, rocker], axis=1), expected[:, :2], atol=3e-4)
    np.testing.assert_allclose(run.outputs["motor"][rows], expected[:, 2], rtol=0.025)
    assert np.abs(expected[2, 1]) > np.abs(expected[2, 0] - 0.01) > 0.5  # the rocker went back
