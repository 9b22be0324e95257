"""Checks of the closed forms of hulls in water."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

import eomgen
from eomgen.scene.load import from_data
from eomgen.studies import check
from tests.waves.test_hulls import COLUMN, INERTIA, MASS, _data
from tests.waves.test_water_planes import _scene

HULLS = {
    "leg": COLUMN
    | {"start": [1, 0.5, -5], "end": [1.5, 0.2, 3], "drag": 1.1, "axial_drag": 80, "wet": 4, "stations": 2},
    "pontoon": COLUMN
    | {"start": [-3, 0.5, -5], "end": [3, 0.2, -4.5], "drag": 0.9, "stations": 1, "axial_added_mass": 0},
}
SEA = {"spectrum": {"type": "jonswap", "height": 1, "period": 7}, "components": 2, "depth": 40}


def platform() -> eomgen.Scene:
    """Return a platform in waves with a pendulum."""
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
    data = _data({"type": "free"}, SEA, {}, coordinates="absolute", simulation={"duration": 1, "step": 0.01})
    return from_data(data | load)


def buoy(angle: float) -> eomgen.Scene:
    joint = {"type": "revolute", "axis": [0, 1, 0], "initial": {"position": angle}}
    body = {"mass": 2e5, "center_of_mass": [0.1, 0, -0.5], "inertia": [1e6, 1e6, 1e6]}
    return from_data(_scene(10.0, -2.0, 2.0, 3, joint, body, added_mass=1, wet=2.0, drag=1.0))


@pytest.mark.slow
@pytest.mark.long_cases("platform")
@pytest.mark.parametrize(
    ("scene", "states"),
    [(platform, 2), (lambda: buoy(0.2), 3), (lambda: buoy(math.pi / 2), 3)],
    ids=["platform", "heeled buoy", "lying buoy"],
)
def test_closed_forms_of_hulls_agree(scene: Callable[[], eomgen.Scene], states: int) -> None:
    report = check(scene(), profile="instant", states=states)
    assert report.passed, [(form.name, str(form.worst)) for form in report.failures]
