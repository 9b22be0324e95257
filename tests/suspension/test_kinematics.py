"""Curves of double wishbones: against a solver by distances, written by hand, and against positions from elsewhere."""

from __future__ import annotations

import tomllib
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import ArrayLike

import eomgen
from tests.suspension.by_distances import solve
from tests.suspension.hard_points import PRINTED, positions

SYSTEM = Path(__file__).parents[2] / "examples/car/system"
RADIUS = 0.29


def _values(file: str) -> dict[str, float]:
    return {name: row["value"] for name, row in tomllib.loads((SYSTEM / file).read_text())["parameters"].items()}


@cache
def curves_of_the_example() -> eomgen.SuspensionCurves:
    hubs = ["left_hub", "right_hub"]
    return eomgen.suspension(SYSTEM / "front_axle.toml", hubs, steering="rack", radius=RADIUS, rows=9, other_axle=-2.7)


def by_distances(travel: float, steering: ArrayLike) -> dict[str, float]:
    """Return angles, deg, and places, m, of the left wheel of the example by the inner end of its tie rod, or by the
    travel of the rack, m."""
    numbers = _values("wishbone_parts.toml") | {
        f"rack_{key}": _values("front_axle.toml")[f"rack_{key}"] for key in "xyz"
    }

    def at(name: str) -> np.ndarray:
        return np.array([numbers[f"{name}_{key}"] for key in "xyz"])

    names = ("lower_front", "lower_rear", "lower_ball", "upper_front", "upper_rear", "upper_ball", "tie")
    points = {name: at(name) for name in names}
    shift = np.asarray(steering) - at("rack") if np.ndim(steering) else np.array([0.0, -np.asarray(steering), 0.0])
    points |= {"rack_design": at("rack"), "rack": at("rack") + shift}
    toe, camber = numbers["toe"], numbers["camber"]
    axis = np.array([np.sin(toe) * np.cos(camber), np.cos(toe) * np.cos(camber), -np.sin(camber)])
    design = numbers["center_z"] - RADIUS * np.sqrt(1.0 - axis[2] ** 2)

    def contact(places):
        along = places["axle"] - places["center"]
        return places["center"] - RADIUS * (np.array([0, 0, 1]) - along[2] * along) / np.sqrt(1.0 - along[2] ** 2)

    carried = {"center": at("center"), "axle": at("center") + axis}
    start = None
    for part in (0.25, 0.5, 0.75, 1.0):
        points["rack"] = at("rack") + part * shift
        height = part * travel
        start, places = solve(points, carried, lambda places, z=height: contact(places)[2] - design - z, start)
    along = places["axle"] - places["center"]
    return {
        "toe": np.degrees(np.arctan2(along[0], along[1])),
        "camber": -np.degrees(np.arcsin(along[2])),
        "contact y": contact(places)[1] - contact(carried)[1],
        "centre x": places["center"][0] - numbers["center_x"],
    }


@pytest.mark.slow
@pytest.mark.parametrize("name", ["travel", "steering"])
def test_curves_are_those_of_a_solver_by_distances(name):
    # 1e-9 mm at the radius of the wheel are 2e-10 deg
    curves = curves_of_the_example().curves[name]
    for row, x in enumerate(1e-3 * curves.x):
        expected = by_distances(x, 0.0) if name == "travel" else by_distances(0.0, x)
        for quantity, value in expected.items():
            scale, tolerance = (1e3, 1e-9) if quantity in ("contact y", "centre x") else (1.0, 2e-10)
            found = curves.columns[f"left_hub {quantity}"][row]
            assert abs(found - scale * value) < tolerance, (quantity, x)


@pytest.mark.slow
def test_slopes_are_those_of_close_states():
    h = 1e-6
    near = [by_distances(sign * h, 0.0) for sign in (-1, 1)]
    slopes = {name: (near[1][name] - near[0][name]) / (2 * h) for name in near[0]}
    curves = curves_of_the_example().curves["travel"]
    for name, unit in (("toe", 1e-3), ("camber", 1e-3), ("contact y", 1.0)):
        assert curves.slope(f"left_hub {name}") == pytest.approx(unit * slopes[name], rel=1e-3, abs=1e-5)
    half_track = by_distances(0.0, 0.0)["contact y"] + 0.76 + RADIUS * 0.01
    height = curves.columns["left_hub roll centre height"][4]
    assert height == pytest.approx(1e3 * half_track * slopes["contact y"], rel=1e-3)


def test_positions_are_those_of_a_solver_of_lengths():
    found = positions([row[0] for row in PRINTED])
    for (travel, *places), own in zip(PRINTED, found, strict=True):
        assert np.abs(np.ravel(own) - places).max() < 2e-9, travel


@pytest.mark.slow
def test_angles_of_steering_are_those_of_the_axis_between_the_balls():
    # the wheel rises a little on its pad, so the instantaneous axis is near the axis of the balls
    columns = curves_of_the_example().curves["steering"].columns
    numbers = _values("wishbone_parts.toml")
    x, y, z = (numbers[f"upper_ball_{key}"] - numbers[f"lower_ball_{key}"] for key in "xyz")
    assert columns["left_hub caster"][4] == pytest.approx(np.degrees(np.arctan(-x / z)), abs=0.5)
    assert columns["left_hub kingpin inclination"][4] == pytest.approx(np.degrees(np.arctan(-y / z)), abs=0.5)
    left, right = (columns[f"{side}_hub steer"][-1] - columns[f"{side}_hub steer"][4] for side in ("left", "right"))
    difference = 1 / np.tan(np.radians(right)) - 1 / np.tan(np.radians(left))
    track = 2 * (0.76 + RADIUS * np.sin(0.01))
    assert columns["Ackermann"][-1] == pytest.approx(100 * 2.7 / track * difference, rel=1e-3)
