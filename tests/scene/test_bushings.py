"""Bushings in scene files: what is read, what it defaults to, and every message."""

from __future__ import annotations

import numpy as np
import pytest

from eomgen.errors import DescriptionError
from eomgen.scene.load import load_toml
from eomgen.scene.scene import Scene

BLOCK = """\
format = 1
name = "block"
bodies.block = { mass = 1, inertia = [0.1, 0.1, 0.1] }
bodies.lid = { mass = 1, inertia = [0.1, 0.1, 0.1] }
joints.block = { type = "free", parent = "base", child = "block" }
joints.lid = { type = "fixed", parent = "block", child = "lid" }
[parameters]
soft = { value = 10, tunable = true }
[points]
hook = { body = "world", position = [0, 0, 1] }
[bushings.mount]
"""
ENDS = 'first = "hook"\nsecond = { body = "block" }\n'
EYE = np.eye(6, dtype=int).tolist()


def read(keys: str, ends: str = ENDS) -> Scene:
    return load_toml(BLOCK + ends + keys, file="block.toml")


def problem(keys: str, ends: str = ENDS) -> str:
    with pytest.raises(DescriptionError) as caught:
        read(keys, ends)
    assert len(caught.value.problems) == 1, str(caught.value)
    return str(caught.value.problems[0]).partition(" (")[2]


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ("", "): the bushing has no stiffness, damping or preload; try: stiffness = [1e5, 1e5, 1e5]"),
        ("stiffness = [1, 2, -3]", ".stiffness[2]): the stiffness is negative: -3; try: 0 or more"),
        (
            'rotational_damping = [0, "-soft", 0]',
            ".rotational_damping[1]): the damping is negative: -10; try: 0 or more",
        ),
        (f"stiffness_matrix = {EYE}\nstiffness = [1, 1, 1]", ".stiffness): stiffness and stiffness_matrix are both"),
        (
            f"stiffness_matrix = {[[1, 2, 0, 0, 0, 0], *EYE[1:]]}",
            ".stiffness_matrix): the matrix is not symmetric: entry [0][1] differs from [1][0]",
        ),
        (
            f"damping_matrix = {[[-1, 0, 0, 0, 0, 0], *EYE[1:]]}",
            ".damping_matrix): the damping is negative in some direction: the smallest eigenvalue is -1",
        ),
        (
            "stiffness = [1, 1, 1]\nrest_rotation = [{ axis = [0, 0, 0], angle = 1 }]",
            ".rest_rotation[0].axis): the axis has no direction; try: an axis such as [0, 0, 1]",
        ),
    ],
)
def test_messages(keys: str, message: str) -> None:
    assert problem(keys).startswith(f"bushings.mount{message}")


@pytest.mark.parametrize(
    ("first", "second", "message"),
    [
        ('"hook"', 'body = "block", axis = [0, 0, 1]', ".second): the angle about the axis matters to a bushing,"),
        ('{ body = "lid" }', 'body = "block"', ".second): both frames are in the same rigid body: lid, block,"),
        ("{ position = [0, 0, 0] }", 'body = "block"', '.first): the frame belongs to no body; try: body = "base", or'),
    ],
)
def test_messages_on_frames(first: str, second: str, message: str) -> None:
    ends = f"first = {first}\nsecond = {{ {second} }}\n"
    assert problem("stiffness = [1, 1, 1]", ends).startswith(f"bushings.mount{message}")
