"""Axes of a joint's links: a frame in which the joint's own axes are coordinate axes, near the body's if they are."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from eomgen.mechanics.tree.joints import motions_of
from eomgen.scene.joints.model import Joint
from eomgen.scene.rotations import frame_about

#: Turns of the axes: none, rounding of a written axis, and any.
SMALL, SKEW = 3e-7, (0.3, -0.5, 0.8)
AXES = [np.roll(np.array([sense, 0.0, 0.0]), place) for place in range(3) for sense in (1.0, -1.0)]


def directions(joint: Joint) -> Any:
    third = np.cross(joint.axis, joint.second_axis)
    return np.array([joint.axis, joint.second_axis, third])


@pytest.mark.parametrize("kind", ["revolute", "universal", "cylindrical", "planar", "helical"])
@pytest.mark.parametrize("near", ["equal", "beside", "skew"])
@pytest.mark.parametrize("number", range(6))
def test_links_have_the_axes_of_their_joint(kind: Any, near: str, number: int) -> None:
    axis = AXES[number] + {"equal": 0.0, "beside": SMALL, "skew": np.array(SKEW)}[near] * np.roll(
        [0.0, 1.0, -0.6], number
    )
    axis = axis / np.linalg.norm(axis)
    z, x = frame_about(axis).T[2], frame_about(axis).T[0]
    if near == "beside":  # as near to a coordinate axis as the first one is
        x = np.roll(AXES[number], 1) + SMALL * np.roll([1.0, 0.0, 0.4], number)
        x = x - (x @ axis) * axis
        x = x / np.linalg.norm(x)
    joint = Joint("j", kind, "base", "b", tuple(z), second_axis=tuple(x))
    columns, motions = motions_of(joint)
    A = np.array(columns)
    np.testing.assert_allclose(A @ A.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(A) == pytest.approx(1.0)
    own = directions(joint)
    for motion, of_type in zip(motions, joint.kind.chain, strict=True):
        for direction, place in zip(motion.axes, of_type.axes, strict=True):
            np.testing.assert_allclose(A @ direction, own[place], atol=3e-16)
            if motion.kind in ("turn", "screw"):
                assert motion.turn is not None and sorted(map(abs, direction)) == [0.0, 0.0, 1.0]
    if near == "equal":
        assert np.array_equal(A, np.eye(3))
    if near == "beside":
        assert 0.0 < np.max(np.abs(A - np.eye(3))) < 3 * SMALL
    along, _ = motions_of(joint, along_z=True)
    np.testing.assert_allclose(np.array(along)[:, 2], joint.axis, atol=1e-16)
    np.testing.assert_allclose(np.linalg.det(along), 1.0)
