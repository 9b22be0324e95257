"""A suspension of one wheel, and a steering box with a pitman arm in place of a rack."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import eomgen
from tests.suspension.test_kinematics import SYSTEM, by_distances, curves_of_the_example

_CORNER = """
format = 1
name = "corner"
[include.corner]
file = "{system}/double_wishbone.toml"
prefix = ""
parameters = {{ side = {side} }}
[constraints.tie_rod]
type = "distance"
first = {{ body = "base", position = [-0.16, "{side} * 0.36", 0.205] }}
second = "tie"
"""
#: The pitman arm on the left and the idler arm on the right point to the rear, by 0.15 m.
_STEERING_BOX = """
format = 1
name = "steering_box"
[include]
left = {{ file = "{system}/double_wishbone.toml", parameters = {{ side = 1 }} }}
right = {{ file = "{system}/double_wishbone.toml", parameters = {{ side = -1 }} }}
[bodies]
pitman = {{ mass = 1, inertia = [0.01, 0.01, 0.01] }}
idler = {{ mass = 1, inertia = [0.01, 0.01, 0.01] }}
[joints]
pitman = {{ type = "revolute", parent = "base", child = "pitman", axis = [0, 0, 1], position = [-0.01, 0.36, 0.205] }}
idler = {{ type = "revolute", parent = "base", child = "idler", axis = [0, 0, 1], position = [-0.01, -0.36, 0.205] }}
[points]
pitman = {{ body = "pitman", position = [-0.15, 0, 0] }}
idler = {{ body = "idler", position = [-0.15, 0, 0] }}
[constraints]
drag_link = {{ type = "distance", first = "pitman", second = "idler" }}
left_tie_rod = {{ type = "distance", first = "pitman", second = "left_tie" }}
right_tie_rod = {{ type = "distance", first = "idler", second = "right_tie" }}
"""


def _file(folder: Path, text: str, side: int = 1) -> Path:
    file = folder / "axle.toml"
    file.write_text(text.format(system=SYSTEM.as_posix(), side=side))
    return file


@pytest.mark.slow
@pytest.mark.parametrize("side", [1, -1])
def test_one_wheel_has_the_curves_that_it_has_on_an_axle(tmp_path: Path, side: int) -> None:
    found = eomgen.suspension(_file(tmp_path, _CORNER, side), ["hub"], radius=0.29, rows=9, other_axle=-2.7)
    whole = curves_of_the_example().curves
    assert list(found.curves) == ["travel", "side force", "braking force", "driving force", "aligning moment"]
    name, travel = "left_hub" if side > 0 else "right_hub", found.curves["travel"]
    for column, values in travel.columns.items():
        if column.startswith("hub") and "load" not in column and "rate" not in column:
            of_axle = whole["travel"].columns[column.replace("hub", name, 1)]
            np.testing.assert_allclose(values, of_axle, rtol=1e-9, atol=1e-9, err_msg=column)
    ratio = whole["travel"].columns[f"{name.removesuffix('hub')}spring motion ratio"]
    np.testing.assert_allclose(travel.columns["spring motion ratio"], ratio, rtol=1e-9)
    assert {file.name for file in found.save(tmp_path / "out")} >= {"suspension.png", "suspension.html", "travel.csv"}
    with pytest.raises(eomgen.errors.UsageError, match=r"ranges roll: the range needs hubs; try: hubs=\[\"left_hub"):
        eomgen.suspension(_file(tmp_path, _CORNER), ["hub"], ranges={"roll": 0.05})


@pytest.mark.slow
def test_a_pitman_arm_steers_as_by_distances(tmp_path: Path) -> None:
    hubs = ["left_hub", "right_hub"]
    found = eomgen.suspension(
        _file(tmp_path, _STEERING_BOX), hubs, steering="pitman", radius=0.29, rows=9, other_axle=-2.7
    )
    curves = found.curves["steering"]
    assert (curves.label, curves.unit) == ("angle of the steering joint", "deg")
    assert curves.x[-1] == pytest.approx(np.degrees(0.5))
    for row, angle in enumerate(np.radians(curves.x)):
        inner = [-0.01 - 0.15 * np.cos(angle), 0.36 - 0.15 * np.sin(angle), 0.205]
        for quantity, value in by_distances(0.0, inner).items():
            scale, tolerance = (1e3, 1e-9) if quantity in ("contact y", "centre x") else (1.0, 2e-10)
            assert abs(curves.columns[f"left_hub {quantity}"][row] - scale * value) < tolerance, (quantity, angle)
    by_angle = {name: value for place, name, value, unit in found.characteristics if unit == "deg/deg"}
    near = [by_distances(0.0, [-0.16, 0.36 - 0.15 * turn, 0.205])["toe"] for turn in (1e-5, -1e-5)]
    slope = np.radians(near[1] - near[0]) / 2e-5  # the toe-in of the left wheel is steer to the right
    assert by_angle["left_hub steer by angle of the steering joint"] == pytest.approx(slope, rel=1e-3)
    left, right = (np.ptp(curves.columns[f"{side}_hub steer"][4:]) for side in ("left", "right"))
    difference = 1 / np.tan(np.radians(right)) - 1 / np.tan(np.radians(left))
    assert curves.columns["Ackermann"][-1] == pytest.approx(100 * 2.7 / 1.5258 * difference, rel=1e-3)
    few = eomgen.suspension(
        _file(tmp_path, _STEERING_BOX), hubs, steering="pitman", radius=0.29, rows=5, ranges={"steering": "20 deg"}
    )
    assert few.curves["steering"].x[-1] == pytest.approx(20.0)
