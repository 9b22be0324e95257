"""Roads under tyres and surfaces of contacts in pictures: heights against the formulas, along the path of the wheel and
over time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen.mechanics.describe import describe

#: With the axis of the wheel, the body and place of its hub, the road and further lines of the tyre in braces.
CART = Path(__file__).with_name("cart_on_road.txt").read_text(encoding="utf-8")
WITH_Y = {"axis": "[0, 1, 0]", "carrier": "wheel", "place": "[0, 0, 0]"}


def run(folder: Path, road: str, more: str = "") -> tuple[dict[str, object], np.ndarray, eomgen.Solution]:
    """Return the road of the picture and the centre of the wheel, (nt, 3)."""
    file = folder / "cart.toml"
    file.write_text(CART.format(**WITH_Y, road=road, more=more), encoding="utf-8")
    solution = eomgen.build(file).simulate(0.5, step=5e-3)
    poses, scenery = solution.poses_and_scenery
    (shown,) = scenery["roads"]
    return {**shown, "ground": scenery["ground"]}, poses["wheel"][:, 4:], solution


@pytest.mark.slow
def test_a_road_at_rest_follows_the_path_of_the_wheel(tmp_path: Path) -> None:
    """The strip begins and ends four radii beyond the path; its heights are the heights of the formula."""
    road, center, _ = run(tmp_path, "0.1 * sin(2 * position.hub[0]) * steep + 0.01 * position.hub[1]")
    x, y, z = np.array(road["places"]).T
    np.testing.assert_allclose(z, 0.03 * np.sin(2.0 * x) + 0.01 * y, atol=2e-6)
    np.testing.assert_allclose([x.min(), x.max()], [center[:, 0].min() - 1.2, center[:, 0].max() + 1.2], atol=1e-5)
    assert np.max(np.diff(x)) <= 0.3 / 8 + 1e-5
    assert road["ground"] == [0.0, 0.0, z.min()]


@pytest.mark.slow
def test_a_road_that_an_input_moves_is_drawn_over_time(tmp_path: Path) -> None:
    more = 'road_rate = "lift_rate"'
    road, center, solution = run(tmp_path, "lift + 0.02 * cos(position.hub[0])", more)
    assert road["times"] == solution.t.tolist()
    x = center[:, 0, np.newaxis] + np.array(road["along"])
    expected = 0.02 * np.sin(9.0 * solution.t)[:, np.newaxis] + 0.02 * np.cos(x)
    np.testing.assert_allclose(road["heights"], expected, atol=2e-6)


@pytest.mark.slow
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


# -- surfaces of rolling and sliding contacts --------------------------------------------------------------------------


def on_surface(surface: str, **first: object) -> tuple[dict[str, object], dict[str, np.ndarray], dict[str, object]]:
    """Return the surface of the picture of a sphere of 0.2 m that slides on a surface, poses and the scenery."""
    carried = first.get("body", "base") == "cart"
    bodies = {"ball": {"mass": 1, "inertia": [0.01, 0.01, 0.01]}, "cart": {"mass": 5, "inertia": [1, 1, 1]}}
    cart = {"type": "prismatic", "parent": "base", "child": "cart", "axis": [1, 0, 0], "drive": "2 * t"}
    ball = {"type": "free", "parent": "cart" if carried else "base", "child": "ball"}
    ball["initial"] = {"position": [0.1, 0.0, 0.3], "velocity": [0, 0, 0, 0.5, 0.2, 0]}
    contact = {"type": "sliding", "first": {"body": "base", **first}, "second": {"body": "ball"}, "shape": "sphere"}
    data = {
        "format": 1,
        "name": "bowl",
        "bodies": bodies,
        "joints": {"cart": cart, "ball": ball},
        "constraints": {"bowl": {**contact, "radius": 0.2, "surface": surface}},
    }
    poses, scenery = eomgen.build(data).simulate(1.0, step=5e-3, method="rk4_partitioned").poses_and_scenery
    (shape,) = (shape for shape in scenery["shapes"] if shape["name"] == "bowl" and not shape["whole"])
    return shape, poses, scenery


@pytest.mark.long
@pytest.mark.slow
def test_the_surface_of_a_contact_is_drawn_around_the_path() -> None:
    """Four radii beyond the path, at the heights of the formula, seen from above; the ground touches it from below."""
    shape, poses, scenery = on_surface("0.3 * x**2 + 0.1 * y", axis=[0, 0, 1], position=[0, 0, 0.05])
    x, y, z = np.array(shape["vertices"]).T
    np.testing.assert_allclose(z, 0.05 + 0.3 * x**2 + 0.1 * y, atol=3e-6)
    path = poses["ball"][:, 4:]
    for values, along in ((x, path[:, 0]), (y, path[:, 1])):
        np.testing.assert_allclose([values.min(), values.max()], [along.min() - 0.8, along.max() + 0.8], atol=1e-5)
    corners = np.array(shape["vertices"])[np.array(shape["faces"])]
    assert np.all(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] > 0.0)
    assert scenery["ground"] == [0.0, 0.0, z.min()]


@pytest.mark.long
def test_a_surface_goes_with_its_body_and_ends_at_the_edge_of_its_formula() -> None:
    """A bowl on a cart that has moved by 2 m; beyond the radius of the bowl the formula has no value."""
    shape, _, scenery = on_surface("0.8 - sqrt(0.64 - x**2 - y**2)", body="cart", axis=[0, 0, 1])
    assert shape["body"] == "cart" and "ground" not in scenery
    used = np.array(shape["vertices"])[np.unique(shape["faces"])]
    np.testing.assert_allclose(used[:, 2], 0.8 - np.sqrt(0.64 - used[:, 0] ** 2 - used[:, 1] ** 2), atol=2e-5)
    assert 0.5 < np.abs(used[:, :2]).max() < 0.8
    assert len(shape["faces"]) < 48 * 48
