"""Beams in pictures: along closed deflection lines, through the model's own points, with all that hangs on them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.products.pictures.animation import animation_page
from eomgen.products.pictures.beam_curves import axes_of, stations
from tests.pictures.test_animation import data_of, stored

LENGTH, DENSITY, STIFFNESS, LOAD = 2.0, 1.5, 800.0, 3.0
EVEN = np.linspace(0.0, LENGTH, 17)


def test_a_cantilever_is_drawn_along_its_deflection_line() -> None:
    """q x^2 (6 L^2 - 4 L x + x^2) / 24 EI + P x^2 (3 L - x) / 6 EI, turned by its derivative; cubic and quartic shapes
    hold both."""
    bending = {"shapes": "polynomial", "modes": 3, "stiffness": STIFFNESS}
    model = eomgen.build(
        {
            "format": 1,
            "name": "cantilever",
            "gravity": [0, 0, -9.81],
            "beams": {
                "beam": {"length": LENGTH, "mass_per_length": DENSITY, "bending_z": bending, "stiffening": False}
            },
            "joints": {"clamp": {"type": "fixed", "parent": "base", "child": "beam"}},
            "forces": {"load": {"body": "beam", "point": [LENGTH, 0, 0], "force": [0, 0, -LOAD]}},
        },
        terms=["mass", "residual", "partials", "poses"],
        profile="quick",
    )
    q = model.equilibrium().q[None]
    (axis,) = axes_of(model)
    (found,) = stations(axis, model.pose("beam", q), q)
    x, weight = EVEN, DENSITY * 9.81
    line = np.polynomial.Polynomial([0, 0, 6 * LENGTH**2 * weight, -4 * LENGTH * weight, weight]) / (24 * STIFFNESS)
    line += np.polynomial.Polynomial([0, 0, 3 * LENGTH * LOAD, -LOAD]) / (6 * STIFFNESS)
    np.testing.assert_allclose(found[:, 4:], np.stack([x, 0 * x, -line(x)], axis=1), atol=1e-11)
    half = 0.5 * line.deriv()(x)  # about y, z towards x
    np.testing.assert_allclose(found[:, :4], np.stack([np.cos(half), 0 * x, np.sin(half), 0 * x], axis=1), atol=1e-11)


#: Beams that deform in every way, with the joint that holds each.
BEAMS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "all kinds": (
        {
            "polar_inertia": 0.01,
            "bending_y": {"modes": 3, "stiffness": 60.0, "initial": {"position": [0.2, 0.02, 0.01]}},
            "bending_z": {"shapes": "polynomial", "modes": 2, "stiffness": 60.0, "initial": {"position": [0.1, -0.05]}},
            "stretch": {"modes": 1, "stiffness": 4e3, "initial": {"position": [0.02]}},
            "torsion": {"modes": 2, "stiffness": 8.0, "initial": {"position": [0.3, 0.1]}},
        },
        {"type": "revolute", "axis": [0, 1, 0], "initial": {"position": 0.4, "velocity": 2.0}},
    ),
    "nodal": (
        {
            "bending_y": {
                "shapes": "finite_elements",
                "elements": 3,
                "coordinates": "nodal",
                "stiffness": 600.0,
                "initial": {"position": [0.01, 0.03, 0.03, 0.06, 0.08, 0.06]},
            },
        },
        {"type": "revolute", "axis": [0, 0, 1], "initial": {"velocity": 1.0}},
    ),
    "about its middle": (
        {
            "start": -0.5 * LENGTH,
            "polar_inertia": 0.01,
            "bending_z": {"shapes": "free_free", "modes": 2, "stiffness": 60.0, "initial": {"position": [0.1, 0.05]}},
        },
        {"type": "free", "initial": {"velocity": [0.3, 1.0, -0.5, 0.1, 0.2, 0.3]}},
    ),
    "pinned": (
        {"stiffening": False, "bending_y": {"shapes": "pinned_pinned", "modes": 2, "stiffness": 60.0}},
        {"type": "revolute", "axis": [0, 0, 1], "initial": {"velocity": 1.0}},
    ),
}


@cache
def moving(kind: str) -> tuple[eomgen.Solution, np.ndarray]:
    """Return a short motion of a beam with points along it, and their places."""
    beam, joint = BEAMS[kind]
    places = EVEN[[0, 3, 8, 13, 16]] + beam.get("start", 0.0)
    points = {f"p{k}": {"body": "beam", "position": [x, 0, 0]} for k, x in enumerate(places.tolist())}
    points["aside"] = {"body": "beam", "position": [0.37, 0.1, -0.2]}
    scene = {
        "format": 1,
        "name": "moving",
        "gravity": [0, 0, -9.81],
        "base": {"position": ["0.1 * sin(3 * t)", 0, 0], "rotation": [{"axis": [0, 0, 1], "angle": "0.5 * t"}]},
        "beams": {"beam": {"length": LENGTH, "mass_per_length": DENSITY, **beam}},
        "joints": {"root": {"parent": "base", "child": "beam", **joint}},
        "points": points,
        "outputs": {name: {"position": name} for name in points},
    }
    model = eomgen.build(scene, terms=["forward_dynamics", "poses", "outputs"], profile="quick")
    return model.simulate(0.02, 1e-3, method="rk4"), places


@pytest.mark.slow
@pytest.mark.long_cases("all kinds")
@pytest.mark.parametrize("kind", BEAMS)
def test_frames_along_a_beam_are_at_the_points_of_the_model(kind: str) -> None:
    run, places = moving(kind)
    (axis,) = run.poses_and_scenery.scenery["axes"]
    assert len(axis["x"]) == 18 and {*places.tolist(), 0.37} <= {*axis["x"]}
    found = stations(axis, run.poses["beam"], run.q)
    for k, x in enumerate(places.tolist()):
        place = found[:, axis["x"].index(x), 4:]
        np.testing.assert_allclose(place, run.outputs[f"p{k}"], atol=1e-12, err_msg=f"at x = {x}")


@pytest.mark.long_cases("all kinds")
@pytest.mark.parametrize("kind", BEAMS)
def test_what_hangs_on_a_beam_goes_with_its_section(kind: str, tmp_path: Path) -> None:
    """The page's own data say where the point beside the axis is; it is turned by slopes and twist."""
    run, _ = moving(kind)
    data = data_of(animation_page(run))
    times, poses = stored(data)
    (point,) = (item for item in data["points"] if item["name"] == "aside")
    w, x, y, z = np.moveaxis(poses[:, point["carrier"], :4].astype(float), -1, 0)
    u = np.stack([x, y, z], axis=-1)
    turned = np.cross(u, np.broadcast_to(point["position"], u.shape))
    beside = np.array(point["position"]) + 2 * w[:, None] * turned + 2 * np.cross(u, turned)
    place = poses[:, point["carrier"], 4:] + beside
    rows = np.searchsorted(run.t, times)
    np.testing.assert_allclose(place, run.outputs["aside"][rows], atol=2e-6)
    (body,) = data["bodies"]
    assert len(body["axis"]) == len({*body["axis"]}) == 18 and body["links"] == []
    again = eomgen.Solution.load(run.save(tmp_path / "run.npz"))
    assert animation_page(again) == animation_page(run)


def test_rows_whose_deflection_is_no_number_are_left_out() -> None:
    run, _ = moving("pinned")
    q = run.q.copy()
    q[15:, -1] = 1e200
    times, poses = stored(data_of(animation_page(replace(run, q=q))))
    np.testing.assert_array_equal(times, run.t[:15])
    assert np.isfinite(poses).all()
