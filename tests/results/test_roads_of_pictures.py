"""Roads under tyres in pictures: heights against the formulas of the roads, along the path of the wheel and over
time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.mechanics.describe import describe

CART = """format = 1
name = "cart"
[parameters]
steep = {{ value = 0.3, tunable = true }}
[inputs]
lift = {{ formula = "0.02 * sin(9 * t)", unit = "m" }}
lift_rate = {{ formula = "0.18 * cos(9 * t)", unit = "m/s" }}
[curves.track]
points = [[-9, 0], [-4, 0], [0, 0.02], [1, 0.05], [2, 0.02], [6, 0], [9, 0]]
[bodies.cart]
mass = 100
inertia = [1, 1, 1]
[joints.cart]
type = "planar"
parent = "base"
child = "cart"
position = [0, 0.4, 0.5]
axis = [0, 1, 0]
initial = {{ velocity = [0, 2, 0] }}
[bodies.wheel]
mass = 10
inertia = [0.1, 0.2, 0.1]
[joints.spin]
type = "revolute"
parent = "cart"
child = "wheel"
position = [0, 0, -0.2]
axis = {axis}
[points.hub]
body = "{carrier}"
position = {place}
[tyres.front]
center = "hub"
radius = 0.3
stiffness = 2e4
damping = 50
road = "{road}"
{more}
"""
WITH_Y = {"axis": "[0, 1, 0]", "carrier": "wheel", "place": "[0, 0, 0]"}


def run(folder: Path, road: str, more: str = "") -> tuple[dict[str, object], np.ndarray, eomgen.Solution]:
    """Return the road of the picture and the centre of the wheel, (nt, 3)."""
    file = folder / "cart.toml"
    file.write_text(CART.format(**WITH_Y, road=road, more=more), encoding="utf-8")
    solution = eomgen.build(file).simulate(0.5, step=5e-3)
    poses, scenery = solution.poses_and_scenery
    (shown,) = scenery["roads"]
    return {**shown, "ground": scenery["ground"]}, poses["wheel"][:, 4:], solution


def test_a_road_at_rest_follows_the_path_of_the_wheel(tmp_path: Path) -> None:
    """The strip begins and ends four radii beyond the path; its heights are the heights of the formula."""
    road, center, _ = run(tmp_path, "0.1 * sin(2 * position.hub[0]) * steep + 0.01 * position.hub[1]")
    x, y, z = np.array(road["places"]).T
    np.testing.assert_allclose(z, 0.03 * np.sin(2.0 * x) + 0.01 * y, atol=2e-6)
    np.testing.assert_allclose([x.min(), x.max()], [center[:, 0].min() - 1.2, center[:, 0].max() + 1.2], atol=1e-5)
    assert np.max(np.diff(x)) <= 0.3 / 8 + 1e-5
    assert road["ground"] == [0.0, 0.0, z.min()]


def test_a_road_that_an_input_moves_is_drawn_over_time(tmp_path: Path) -> None:
    more = 'road_rate = "lift_rate"'
    road, center, solution = run(tmp_path, "lift + 0.02 * cos(position.hub[0])", more)
    assert road["times"] == solution.t.tolist()
    x = center[:, 0, np.newaxis] + np.array(road["along"])
    expected = 0.02 * np.sin(9.0 * solution.t)[:, np.newaxis] + 0.02 * np.cos(x)
    np.testing.assert_allclose(road["heights"], expected, atol=2e-6)


def test_a_road_of_time_alone_is_a_plate_and_curves_have_values(tmp_path: Path) -> None:
    road, _, solution = run(tmp_path, "track(4 * t - 1)")
    heights = np.array(road["heights"])
    assert heights.shape == (len(solution.t), 2)
    at_one = np.argmin(np.abs(solution.t - 0.5))
    np.testing.assert_allclose(heights[at_one], 0.05, atol=1e-6)  # a point of the curve


@pytest.mark.parametrize(
    ("axis", "carrier", "place", "expected"),
    [
        ("[0, 1, 0]", "wheel", "[0, 0, 0]", [0, 1, 0]),
        ("[1, 0, 0]", "wheel", "[0, 0, 0]", [1, 0, 0]),
        ("[1, 0, 0]", "cart", "[0, 0, -0.2]", [1, 0, 0]),
        ("[1, 0, 0]", "cart", "[0.5, 0, -0.2]", [0, 1, 0]),  # beside the joint
        ("[0, 0, 1]", "wheel", "[0, 0, 0]", [0, 1, 0]),  # a steering joint
    ],
)
def test_a_tyre_without_slip_turns_about_the_joint_of_its_wheel(
    tmp_path: Path, axis: str, carrier: str, place: str, expected: list[int]
) -> None:
    file = tmp_path / "cart.toml"
    file.write_text(CART.format(axis=axis, carrier=carrier, place=place, road="0", more=""), encoding="utf-8")
    (shape,) = describe(eomgen.load(file)).drawing.shapes
    assert (shape.kind, shape.body) == ("wheel", carrier)
    np.testing.assert_array_equal(np.array(shape.axes)[:, 2], expected)
