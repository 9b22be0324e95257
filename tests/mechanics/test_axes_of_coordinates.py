"""Coordinates of joints with a position and a rotation are in the axes of the joint."""

import math

import numpy as np
import pytest

import eomgen

PLACE = np.array([1.0, 2.0, 3.0])
#: A quarter of a turn about z, from the joint's to the parent's axes.
TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


@pytest.mark.slow_cases("planar-q1-moved1", "free-q0-moved0")
@pytest.mark.parametrize(
    ("kind", "q", "moved"),
    [
        ("free", [1.0, 0.0, 0.0, 0.0, 0.1, 0.2, 0.3], [0.1, 0.2, 0.3]),
        ("planar", [0.0, 0.1, 0.2], [0.1, 0.2, 0.0]),
        ("spherical", [math.cos(0.4), math.sin(0.4), 0.0, 0.0], [0.0, 0.0, 0.0]),
    ],
)
def test_coordinates_are_in_the_axes_of_the_joint(kind: str, q: list[float], moved: list[float]) -> None:
    scene = eomgen.SceneBuilder("one").body("b", 1.0, inertia=[1.0, 1.0, 1.0])
    turned = [{"axis": [0, 0, 1], "angle": "90 deg"}]
    axis = {"axis": [0, 0, 1]} if kind == "planar" else {}
    scene = scene.joint("j", kind, "base", "b", position=PLACE.tolist(), rotation=turned, **axis)
    pose = eomgen.build(scene.build(), profile="quick").pose("b", q)
    np.testing.assert_allclose(pose[4:], PLACE + TURN @ moved, atol=1e-15)
    if kind == "spherical":  # half of a turn of 0.8 about x, after a quarter of a turn about z
        half = math.sqrt(0.5)
        expected = [half * q[0], half * q[1], half * q[1], half * q[0]]
        np.testing.assert_allclose(pose[:4], expected, atol=1e-15)
