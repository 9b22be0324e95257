"""A suspension of one wheel, a steering box with a pitman arm in place of a rack, and a solid axle."""

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
#: Links of a solid axle: ends on the body and on the axle, at the design position.
_LINKS = {
    "left": ([0.5, 0.5, 0.24], [0.0, 0.5, 0.2]),
    "right": ([0.5, -0.5, 0.24], [0.0, -0.5, 0.2]),
    "upper": ([0.4, 0.1, 0.43], [0.0, 0.1, 0.45]),
    "panhard": ([-0.12, -0.5, 0.27], [-0.12, 0.5, 0.25]),
}


def _solid_axle() -> str:
    """Return a scene: an axle on two lower and one upper link, a Panhard rod and two springs."""
    links = "\n".join(
        f'{name} = {{ type = "distance", first = {{ body = "base", position = {first} }}, second = "{name}" }}'
        for name, (first, _) in _LINKS.items()
    )
    ends = "\n".join(f'{name} = {{ body = "axle", position = {second} }}' for name, (_, second) in _LINKS.items())
    seats = "\n".join(
        f'{side}_foot = {{ body = "axle", position = [0, {y}, 0.35] }}\n'
        f'{side}_top = {{ body = "base", position = [0, {y}, 0.65] }}'
        for side, y in (("left", 0.5), ("right", -0.5))
    )
    return f"""
format = 1
name = "solid_axle"
[bodies]
axle = {{ mass = 60, center_of_mass = [0, 0, 0.3], inertia = [15, 1, 15] }}
left_hub = {{ mass = 5, inertia = [0.02, 0.03, 0.02] }}
right_hub = {{ mass = 5, inertia = [0.02, 0.03, 0.02] }}
[joints]
axle = {{ type = "free", parent = "base", child = "axle" }}
left_hub = {{ type = "fixed", parent = "axle", child = "left_hub", position = [0, 0.75, 0.3] }}
right_hub = {{ type = "fixed", parent = "axle", child = "right_hub", position = [0, -0.75, 0.3] }}
[points]
{ends}
{seats}
[constraints]
{links}
[springs]
left = {{ first = "left_foot", second = "left_top", stiffness = 25000, length = 0.42 }}
right = {{ first = "right_foot", second = "right_top", stiffness = 25000, length = 0.42 }}
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
            # the roll centre of a wheel alone is by a spline through 9 rows
            tolerance = 0.1 if "roll centre" in column else 1e-9
            np.testing.assert_allclose(values, of_axle, rtol=1e-9, atol=tolerance, err_msg=column)
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


@pytest.mark.slow
def test_the_roll_centre_of_a_solid_axle_is_that_of_its_links(tmp_path: Path) -> None:
    """Velocity and angular velocity of the axle by the directions of its links and the rates of both pads."""
    file = tmp_path / "axle.toml"
    file.write_text(_solid_axle())
    found = eomgen.suspension(file, ["left_hub", "right_hub"], radius=0.3, rows=9)
    contacts = {"left_hub": np.array([0.0, 0.75, 0.0]), "right_hub": np.array([0.0, -0.75, 0.0])}
    rows = [np.subtract(*ends) for ends in _LINKS.values()]
    rows = [
        np.concatenate([along, np.cross(ends[1], along)]) for along, ends in zip(rows, _LINKS.values(), strict=True)
    ]
    rows += [[0.0, 0.0, 1.0, place[1], -place[0], 0.0] for place in contacts.values()]
    motion = np.linalg.solve(rows, [0.0, 0.0, 0.0, 0.0, 1.0, -1.0])
    height = 0.75 * (motion[:3] + np.cross(motion[3:], contacts["left_hub"]))[1]
    assert 0.25 < height < 0.29  # near the middle of the Panhard rod
    travel, roll = (found.curves[name].columns for name in ("travel", "roll"))
    for hub in contacts:
        assert travel[f"{hub} roll centre height"][4] == pytest.approx(1e3 * height, rel=1e-5)
        assert roll[f"{hub} roll centre height"][4] == pytest.approx(1e3 * height, rel=1e-3)
    # the axle moves to the side as a whole with its Panhard rod, and ideal joints yield nothing
    values = {(place, name): value for place, name, value, _ in found.characteristics}
    left, right = (values["travel", f"{hub} contact y by travel"] for hub in contacts)
    assert left == pytest.approx(-right) == pytest.approx(0.0212, abs=1e-3)
    assert values["braking force", "left_hub toe by force backward"] == 0.0


@pytest.mark.parametrize(("turned", "axis"), [("[1, 0, 0]", "[0.0, 0.0, 1.0]"), ("[0, 0, 1]", "[-1.0, 0.0, 0.0]")])
def test_a_hub_whose_y_is_not_the_axis_of_the_wheel_is_refused(tmp_path: Path, turned: str, axis: str) -> None:
    rotation = f'position = [0, 0.75, 0.3], rotation = [{{ axis = {turned}, angle = "90 deg" }}]'
    file = tmp_path / "axle.toml"
    file.write_text(_solid_axle().replace("position = [0, 0.75, 0.3]", rotation))
    with pytest.raises(eomgen.errors.UsageError) as caught:
        eomgen.suspension(file, ["left_hub", "right_hub"])
    message = f"hubs left_hub: y of this hub is the axis of the wheel, and is {axis}, not to the left; try: rotation of"
    assert message in str(caught.value)
