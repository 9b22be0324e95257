"""Roads under tyres and surfaces of contacts in pictures: heights against the formulas, along the path of the wheel and
over time."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.mechanics.describe import describe
from eomgen.products.pictures.roads import roads_of, surfaces_of
from eomgen.products.pictures.scenery import scenery_at_poses
from eomgen.scene.load import from_data, load_toml

#: With the axis of the wheel, the body and place of its hub, the road and further lines of the tyre in braces.
CART = Path(__file__).with_name("cart_on_road.txt").read_text(encoding="utf-8")
WITH_Y = {"axis": "[0, 1, 0]", "carrier": "wheel", "place": "[0, 0, 0]"}


def wheel_along(path: np.ndarray) -> dict[str, np.ndarray]:
    """Return poses of the wheel with its centre along a path (n, 3)."""
    return {"wheel": np.column_stack([np.ones(len(path)), np.zeros((len(path), 3)), path])}


def roads_along(path: np.ndarray, road: str, more: str = "", **inputs: np.ndarray) -> list[dict[str, Any]]:
    """Return the roads of the picture of a wheel of 0.3 m whose centre takes a path within a second."""
    described = describe(load_toml(CART.format(**WITH_Y, road=road, more=more)))
    t = np.linspace(0.0, 1.0, len(path))
    return roads_of(described.drawing, wheel_along(path), t, described.values({}), lambda: inputs)


def test_a_road_at_rest_is_a_strip_along_the_path() -> None:
    """Around a corner, from four radii before the path to four radii beyond it."""
    along = np.linspace(0.0, 3.0, 301)
    path = np.column_stack([np.minimum(along, 2.0), np.maximum(along - 2.0, 0.0), np.full(301, 0.4)])
    (road,) = roads_along(path, "0.1 * sin(2 * position.hub[0]) * steep + 0.01 * position.hub[1]")
    x, y, z = np.array(road["places"]).T
    np.testing.assert_allclose(z, 0.03 * np.sin(2.0 * x) + 0.01 * y, atol=2e-6)
    np.testing.assert_allclose([x[0], y[0], x[-1], y[-1]], [-1.2, 0.0, 2.0, 2.2], atol=1e-6)
    steps = np.hypot(np.diff(x), np.diff(y))
    assert 0.03 < steps.min() <= steps.max() <= 0.3 / 8 + 1e-6
    assert np.max(np.minimum(np.abs(y), np.abs(x - 2.0))) < 0.3  # corners are cut by less than a radius
    assert (road["name"], road["center"], road["width"]) == ("front", "hub", pytest.approx(0.27))
    (still,) = roads_along(np.tile([0.5, 0.2, 0.4], (5, 1)), "0.1*position.hub[0]")
    x, y, z = np.array(still["places"]).T
    np.testing.assert_allclose([x[0], x[-1]], [0.5 - 1.2, 0.5 + 1.2], atol=1e-6)
    np.testing.assert_allclose([y, z], [np.full(len(x), 0.2), 0.1 * x], atol=1e-6)
    short = np.column_stack([np.linspace(0.0, 0.6, 61), np.zeros(61), np.zeros(61)])
    assert roads_along(short, "0.1*position.hub[0]")[0]["places"][-1][0] == pytest.approx(0.6 + 1.2)
    long = np.column_stack([np.linspace(0.0, 300.0, 3001), np.zeros(3001), np.zeros(3001)])
    assert len(roads_along(long, "0.1*position.hub[0]")[0]["places"]) == pytest.approx(1501, abs=1)


def test_the_ground_touches_a_road_from_below() -> None:
    described = describe(load_toml(CART.format(**WITH_Y, road="0.1 * position.hub[0]", more="")))
    library: Any = SimpleNamespace(layout={"axes": []})
    model: Any = SimpleNamespace(parameters=(), description=described, factors=(), library=library)
    path = np.column_stack([np.linspace(0.0, 2.0, 21), np.zeros(21), np.zeros(21)])
    seen = scenery_at_poses(model, wheel_along(path), np.linspace(0.0, 1.0, 21), np.zeros(0), None)
    assert seen["ground"] == pytest.approx([0.0, 0.0, -0.12])  # four radii before the path


def test_moving_roads_are_drawn_around_the_wheel_and_others_not() -> None:
    path = np.column_stack([np.linspace(0.0, 2.0, 900), np.full(900, 0.1), np.full(900, 0.4)])
    lift = np.linspace(0.0, 0.5, 900)
    (road,) = roads_along(
        path, "lift + 0.02*cos(position.hub[0]) + position.hub[1]", 'road_rate = "lift_rate"', lift=lift
    )
    rows = np.round(np.array(road["times"]) * 899.0).astype(int)
    assert len(rows) == 600 and (rows[0], rows[-1]) == (0, 899)
    np.testing.assert_allclose(road["along"], 0.3 * np.linspace(-2.5, 2.5, 21), atol=1e-6)
    x = path[rows, 0, np.newaxis] + np.array(road["along"])
    np.testing.assert_allclose(road["heights"], lift[rows, np.newaxis] + 0.02 * np.cos(x) + 0.1, atol=2e-6)
    (plate,) = roads_along(path[:5], "track(4 * t - 1)")
    np.testing.assert_allclose(plate["along"], [-0.75, 0.75])
    assert np.shape(plate["heights"]) == (5, 2) and plate["times"] == [0.0, 0.25, 0.5, 0.75, 1.0]
    assert roads_along(path[:5], "steep") == []  # the ground
    assert roads_along(path[:5], "sqrt(position.hub[0] - 9)") == []


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


def surface_scene(surface: str, **first: object) -> dict[str, Any]:
    """Return a sphere of 0.2 m that slides on a surface."""
    carried = first.get("body", "base") == "cart"
    bodies = {"ball": {"mass": 1, "inertia": [0.01, 0.01, 0.01]}, "cart": {"mass": 5, "inertia": [1, 1, 1]}}
    cart = {"type": "prismatic", "parent": "base", "child": "cart", "axis": [1, 0, 0], "drive": "2 * t"}
    ball = {"type": "free", "parent": "cart" if carried else "base", "child": "ball"}
    ball["initial"] = {"position": [0.1, 0.0, 0.3], "velocity": [0, 0, 0, 0.5, 0.2, 0]}
    contact = {"type": "sliding", "first": {"body": "base", **first}, "second": {"body": "ball"}, "shape": "sphere"}
    return {
        "format": 1,
        "name": "bowl",
        "bodies": bodies,
        "joints": {"cart": cart, "ball": ball},
        "constraints": {"bowl": {**contact, "radius": 0.2, "surface": surface}},
    }


def test_surfaces_are_grids_around_the_path_of_the_rider() -> None:
    """In the frame of the body that carries the surface, four radii beyond the path."""
    described = describe(from_data(surface_scene("0.3 * x**2 + 0.1 * y", axis=[0, 0, 1], position=[0, 0, 0.05])))
    path = np.column_stack([np.linspace(0.0, 1.0, 6), np.linspace(0.0, 0.3, 6), np.full(6, 0.4)])
    poses = {"ball": wheel_along(path)["wheel"]}
    (shape,) = surfaces_of(described.drawing, poses, described.values({}))
    x, y, z = np.array(shape["vertices"]).T
    np.testing.assert_allclose(z, 0.05 + 0.3 * x**2 + 0.1 * y, atol=3e-6)
    np.testing.assert_allclose([x.min(), x.max(), y.min(), y.max()], [-0.8, 1.8, -0.8, 1.1], atol=1e-6)
    assert (len(np.unique(x.round(5))), len(np.unique(y.round(5)))) == (49, 37)
    corners = np.array(shape["vertices"])[np.array(shape["faces"])]
    assert len(corners) == 48 * 36 and (shape["whole"], shape["closed"]) == (False, False)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.all(normals[:, 2] > 0.0)
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1)
    assert sides.max() < 0.1  # of neighbours
    bowl = surface_scene("0.8 - sqrt(0.64 - x**2 - y**2)", body="cart", axis=[0, 0, 1])
    described = describe(from_data(bowl))
    half = np.sqrt(0.5)
    poses["cart"] = np.tile([half, 0.0, 0.0, half, 2.0, 0.0, 0.0], (6, 1))  # turned by a quarter about z, and moved
    (shape,) = surfaces_of(described.drawing, poses, described.values({}))
    own = np.column_stack([path[:, 1], -(path[:, 0] - 2.0)])
    vertices = np.array(shape["vertices"])
    np.testing.assert_allclose(vertices[:, :2].min(axis=0), own.min(axis=0) - 0.8, atol=1e-5)
    np.testing.assert_allclose(vertices[:, :2].max(axis=0), own.max(axis=0) + 0.8, atol=1e-5)
    used = vertices[np.unique(shape["faces"])]
    np.testing.assert_allclose(used[:, 2], 0.8 - np.sqrt(0.64 - used[:, 0] ** 2 - used[:, 1] ** 2), atol=2e-5)
    assert shape["body"] == "cart"
