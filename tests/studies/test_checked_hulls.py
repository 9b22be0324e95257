"""Checks of the closed forms of hulls in water."""

from __future__ import annotations

import math

import pytest

from eomgen.products.studies.verification.check import check
from eomgen.scene.load import from_data
from tests.waves.test_hulls import COLUMN, HULLS, INERTIA, MASS, SEA, _data
from tests.waves.test_water_planes import _scene


@pytest.mark.slow
@pytest.mark.long
def test_all_forms_of_a_platform_with_a_pendulum_agree() -> None:
    """Every closed form, power and derivative, by the checks of a scene."""
    tail = COLUMN | {"body": "arm", "start": [0, 0, -1], "end": [1, 0.3, -4], "drag": 1, "wet": 2, "stations": 1}
    load = {
        "bodies": {
            "buoy": {"mass": MASS, "center_of_mass": [0.2, 0, -3.5], "inertia": INERTIA},
            "arm": {"mass": 300, "center_of_mass": [1, 0, 0], "inertia": {"xx": 10, "yy": 400, "zz": 400}},
        },
        "joints": {
            "moves": {"type": "free", "parent": "base", "child": "buoy"},
            "hinge": {"type": "revolute", "axis": [0, 1, 0], "parent": "buoy", "child": "arm", "position": [0, 0, 5]},
        },
        "hulls": {name: hull | {"waves": "sea"} for name, hull in (HULLS | {"tail": tail}).items()},
    }
    data = _data({"type": "free"}, SEA, {}, coordinates="absolute", simulation={"duration": 1, "step": 0.01}) | load
    report = check(from_data(data), states=2)
    assert report.passed, str(report)


@pytest.mark.slow
@pytest.mark.parametrize("angle", [0.2, math.pi / 2])
def test_all_forms_of_a_wide_buoy_agree(angle: float) -> None:
    """Closed forms, power and derivatives, heeled and lying."""
    joint = {"type": "revolute", "axis": [0, 1, 0], "initial": {"position": angle}}
    body = {"mass": 2e5, "center_of_mass": [0.1, 0, -0.5], "inertia": [1e6, 1e6, 1e6]}
    data = _scene(10.0, -2.0, 2.0, 3, joint, body, added_mass=1, wet=2.0, drag=1.0)
    report = check(from_data(data), states=3)
    assert report.passed, str(report)
