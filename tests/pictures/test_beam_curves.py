"""Geometrically exact beams in pictures: helices between nodes, outlines of sections, what a page holds of them."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm

import eomgen
from eomgen.products.pictures.animation import animation_page
from eomgen.products.pictures.beam_curves import frames_along, outline, pieces_of, stations
from tests.browser.chromium import Browser, chromium
from tests.mechanics.test_cosserat_beams import logarithm
from tests.models.cosserat import beam_scene
from tests.oracles.states import random_unit_quaternions, rotation_of
from tests.pictures.test_animation import data_of


def test_frames_between_nodes_are_on_helices(rng: np.random.Generator) -> None:
    turned, moved = rng.normal(size=(2, 3, 5, 3))
    poses = {}
    for number, (rotation, place) in enumerate(zip(0.8 * turned, moved, strict=True)):
        angle = np.linalg.norm(rotation, axis=1, keepdims=True)
        quaternion = np.concatenate([np.cos(0.5 * angle), np.sin(0.5 * angle) * rotation / angle], axis=1)
        sign = random_unit_quaternions(rng, 5)[:, :1]  # both signs are the same rotation
        poses[f"rope.{number}"] = np.concatenate([np.sign(sign) * quaternion, place], axis=1)
    found, pieces = frames_along(poses, list(poses)), pieces_of(2)
    assert found.shape == (5, 2 * pieces + 1, 7)
    for row in range(5):
        for number in range(2 * pieces):
            element, piece = divmod(number, pieces)
            first, second = (poses[f"rope.{element + end}"][row] for end in (0, 1))
            screw = piece / pieces * logarithm(first, second)
            rotation = np.array([[0, -screw[2], screw[1]], [screw[2], 0, -screw[0]], [-screw[1], screw[0], 0]])
            step = expm(np.block([[rotation, screw[3:, None]], [np.zeros((1, 4))]]))
            R = rotation_of(first[:4])
            np.testing.assert_allclose(found[row, number, 4:], first[4:] + R @ step[:3, 3], atol=1e-12)
            np.testing.assert_allclose(rotation_of(found[row, number, :4]), R @ step[:3, :3], atol=1e-12)
        np.testing.assert_array_equal(found[row, -1], poses["rope.2"][row])


def test_frames_along_a_beam_are_the_deflection_of_its_coordinates(rng: np.random.Generator) -> None:
    """Of five coordinates behind two others of the configuration, by the rotations of the exponential."""
    pose = np.concatenate([random_unit_quaternions(rng, 4), rng.normal(size=(4, 3))], axis=1)
    deflections, rotations = rng.normal(size=(2, 3, 3, 5))
    shortening, pairs, x = rng.normal(size=(3, 2)), [(0, 0), (1, 4)], np.array([0.0, 1.5, 4.0])
    axis = {"x": x.tolist(), "deflections": deflections.tolist(), "rotations": rotations.tolist(), "q_start": 2}
    q = 0.3 * rng.normal(size=(4, 9))
    for shortened in (False, True):
        terms = {"pairs": pairs, "shortening": shortening.tolist()} if shortened else {"pairs": [], "shortening": []}
        frames = stations({**axis, **terms}, pose, q)
        assert frames.shape == (4, 3, 7)
        for row in range(4):
            e, R = q[row, 2:7], rotation_of(pose[row, :4])
            for number in range(3):
                place = np.array([x[number], 0.0, 0.0]) + deflections[number] @ e
                if shortened:
                    place[0] -= shortening[number] @ [e[k] * e[j] for k, j in pairs]
                turn = rotations[number] @ e
                turned = expm(np.array([[0, -turn[2], turn[1]], [turn[2], 0, -turn[0]], [-turn[1], turn[0], 0]]))
                np.testing.assert_allclose(frames[row, number, 4:], pose[row, 4:] + R @ place, atol=1e-13)
                np.testing.assert_allclose(rotation_of(frames[row, number, :4]), R @ turned, atol=1e-13)


@pytest.mark.parametrize(
    ("inertia", "tolerance"), [((3e-3, 1.2e-2), 1e-12), ((1.2e-2, 3e-3), 1e-12), ((7e-3, 7e-3), 0.1)]
)
def test_corners_run_once_round_an_area_of_the_rotary_inertia(inertia: tuple[float, float], tolerance: float) -> None:
    """By the integrals of Green's theorem over the polygon of the corners, for a node of 2 kg."""
    first = np.array(outline(2.0, [0.0, *inertia], 10.0))
    after = np.roll(first, -1, axis=0)
    cross = first[:, 0] * after[:, 1] - after[:, 0] * first[:, 1]
    assert np.all(cross > 0.0)
    for axis, about in ((1, inertia[0]), (0, inertia[1])):
        a, b = first[:, axis], after[:, axis]
        second = np.sum(cross * (a * a + a * b + b * b)) / 12.0
        assert 2.0 * second / (0.5 * np.sum(cross)) == pytest.approx(about, rel=tolerance)
        assert np.sum(cross * (a + b)) == pytest.approx(0.0, abs=1e-12)


def run() -> eomgen.Solution:
    inertia = [0.004 + 0.001, 0.001, 0.004]
    scene = beam_scene(4, {"force": [0.0, "20 * load", 0.0]}, {"rotary_inertia": inertia, "stiffness_damping": 0.01})
    scene["points"] = {"middle": {"body": "rope", "position": [5.0, 0.0, 0.0]}}
    scene["outputs"] = {"middle": {"position": "middle"}}
    return eomgen.build(scene, profile="quick").simulate(0.5, 0.01, error_estimate=False)


@pytest.mark.long
def test_a_page_shows_a_beam_as_one_body(tmp_path: Path) -> None:
    solution = run()
    data = data_of(animation_page(solution))
    (body,), (point,) = data["bodies"], data["points"]
    assert body["name"] == "rope" and data["rods"] == []
    assert point["body"] == 0 and point["carrier"] == [*solution.poses].index("rope.2")
    assert len(body["axis"]) == 4 * pieces_of(4) + 1 and body["axis"][0] == 5
    sides = np.max(body["outline"], axis=0)
    np.testing.assert_allclose(sides, [math.sqrt(3.0 * 0.004), math.sqrt(3.0 * 0.001)], rtol=1e-12)
    if command := chromium():
        page = solution.animate(tmp_path / "rope.html")
        browser = Browser(command)
        plain, marked = (browser.picture(page, place) for place in ("t=0.4", "t=0.4&sections"))
        assert np.count_nonzero(np.any(plain != marked, axis=-1)) > 100
