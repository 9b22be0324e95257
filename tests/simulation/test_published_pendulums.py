"""Pendulums and sliders on single joints against runs of another program.

Places of the centre of mass and angular accelerations are printed with 7 digits by MSC Adams, in the reference data of
Project Chrono's tests of joints (BSD-3-Clause). It is known to some 1e-5 m for the revolute joint, 4e-4
for the spherical and the universal ones, which in the plane are the same pendulum: the first three cases have one
motion, and differ among each other by this much.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest

import eomgen

Row = tuple[float, float, float]


class Published(NamedTuple):
    """Joint of a rod of 1 kg, its moments of inertia and centre of mass, printed results and their scatter."""

    joint: dict[str, Any]
    inertia: Row
    center: Row
    at_1_s: Row
    at_5_s: Row
    alpha_at_5_s: Row
    scatter: float
    more: dict[str, Any]


ALONG_X, ALONG_Y = (0.04, 0.1, 0.1), (0.1, 0.04, 0.1)
ROPE = {"rod": {"type": "distance", "first": {"body": "base"}, "second": "center", "length": 2.0}}
CASES = {
    "revolute": Published(
        {"type": "revolute", "axis": [0, 1, 0]},
        ALONG_X,
        (2.0, 0.0, 0.0),
        (-0.892381, 0.0, -1.78988),
        (-1.99968, 0.0, -0.0355587),
        (0.0, -4.78297, 0.0),
        1e-5,
        {},
    ),
    "cylindrical": Published(
        {"type": "cylindrical", "axis": [0, 1, 0]},
        ALONG_X,
        (2.0, 0.0, 0.0),
        (-0.892381, 0.0, -1.78988),
        (-1.99968, 0.0, -0.0355587),
        (0.0, -4.78297, 0.0),
        1e-5,
        {},
    ),
    "spherical": Published(
        {"type": "spherical"},
        ALONG_X,
        (2.0, 0.0, 0.0),
        (-0.892369, 0.0, -1.78988),
        (-1.99967, 0.0, -0.0361929),
        (0.0, -4.78295, 0.0),
        7e-4,
        {},
    ),
    "universal": Published(
        {"type": "universal", "axis": [1, 0, 0], "second_axis": [0, 0, 1]},
        ALONG_Y,
        (0.0, 2.0, 0.0),
        (0.0, -0.892369, -1.78988),
        (0.0, -1.99967, -0.0361929),
        (4.78295, 0.0, 0.0),
        7e-4,
        {},
    ),
    "prismatic": Published(
        {"type": "prismatic", "axis": [0, 1, 1], "position": [3, 2, 3]},
        ALONG_X,
        (0.0, 0.0, 0.0),
        (3.0, -0.451662, 0.548338),
        (3.0, -59.2916, -58.2916),
        (0.0, 0.0, 0.0),
        5e-5,
        {},
    ),
    "distance": Published(
        {"type": "free", "initial": {"position": [0, 2, 0]}},
        ALONG_X,
        (0.0, 0.0, 0.0),
        (0.0, -0.956545, -1.756423),
        (0.0, -1.999998, -0.002779575),
        (0.0, 0.0, 0.0),
        1e-6,
        {"constraints": ROPE},
    ),
}


@pytest.mark.slow_cases("revolute", "cylindrical", "universal", "prismatic")
@pytest.mark.slow_cases("distance")
@pytest.mark.parametrize("name", CASES)
def test_a_rod_on_one_joint_is_where_another_program_has_it(name: str) -> None:
    case = CASES[name]
    words = {"place": "position.center", "alpha": "angular_acceleration.rod"}
    scene = {
        "format": 1,
        "name": name,
        "gravity": [0, 0, -9.80665],
        "bodies": {"rod": {"mass": 1.0, "inertia": case.inertia, "center_of_mass": case.center}},
        "joints": {"joint": {"parent": "base", "child": "rod", **case.joint}},
        "points": {"center": {"body": "rod", "position": case.center}},
        "outputs": {key: {"formula": [f"{word}[{k}]" for k in range(3)]} for key, word in words.items()},
        **case.more,
    }
    method = "rk4_partitioned" if case.more else "rk4"
    run = eomgen.build(scene, profile="quick").simulate(5.0, 1e-3, method=method, record_every=1000)
    assert run.success
    np.testing.assert_allclose(run.outputs["place"][[1, 5]], [case.at_1_s, case.at_5_s], atol=case.scatter)
    np.testing.assert_allclose(run.outputs["alpha"][5], case.alpha_at_5_s, atol=5.0 * case.scatter)
