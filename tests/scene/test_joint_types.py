"""Helical, cylindrical, universal and planar joints and joints that follow others, as written, and what is wrong with
them."""

from __future__ import annotations

import numpy as np
import pytest

from eomgen.errors import DescriptionError
from eomgen.formula.nodes import Number, Symbol
from eomgen.scene.joints.model import Joint
from eomgen.scene.load import load_toml
from eomgen.scene.scene import Scene

HEAD = """format = 1
name = "one"
[parameters]
lead = { value = 0.02, tunable = true }
still = 0.0
[bodies.a]
mass = 1.0
inertia = [0.1, 0.2, 0.25]
[bodies.b]
mass = 2.0
inertia = [0.1, 0.2, 0.25]
[joints.first]
parent = "base"
child = "a"
"""
SECOND = """
[joints.second]
type = "prismatic"
parent = "a"
child = "b"
axis = [1, 0, 0]
"""


Z = "axis = [0, 0, 1]\n"
MIMIC = 'mimic = { joint = "second" }\n'


def load(first: str, second: str = SECOND) -> Scene:
    return load_toml(HEAD + first + second)


def joint(text: str) -> Joint:
    return load(text).joints[0]


def problems(first: str, second: str = SECOND) -> list[str]:
    with pytest.raises(DescriptionError) as caught:
        load(first, second)
    return [str(problem) for problem in caught.value.problems]


def test_what_each_type_carries() -> None:
    screw = joint('type = "helical"\naxis = [0, 0, 2]\npitch = "lead"\nstiffness = 3\ninitial = { position = 0.1 }')
    assert (screw.axis, screw.pitch, screw.stiffness) == ((0.0, 0.0, 1.0), Symbol("parameter", "lead"), Number(3.0))
    sleeve = joint('type = "cylindrical"\naxis = [0, 1, 0]\ndamping = [0.1, 20]\ninitial = { velocity = [1, 2] }')
    assert sleeve.damping == (Number(0.1), Number(20.0))
    assert (sleeve.initial_position, sleeve.initial_velocity) == ((0.0, 0.0), (1.0, 2.0))
    assert sleeve.each(sleeve.stiffness) == (Number(0.0), Number(0.0))
    cardan = joint('type = "universal"\naxis = [3, 0, 4]\nsecond_axis = [0, -2, 0]\nrotor_inertia = [0.1, "lead"]')
    assert cardan.second_axis == (0.0, -1.0, 0.0) and len(cardan.each(cardan.rotor_inertia)) == 2
    np.testing.assert_allclose(cardan.axis, (0.6, 0.0, 0.8))
    slab = joint('type = "planar"\naxis = [0, 0, 1]\nx_axis = [3, 4, 5]\nrest = [0.1, 0.2, 0.3]\nstiffness = [1, 2, 3]')
    np.testing.assert_allclose(slab.second_axis, (0.6, 0.8, 0.0))
    assert joint('type = "planar"\naxis = [0, 0, 1]').second_axis == (1.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("kind", "keys", "message"),
    [
        ("helical", Z + 'pitch = "still"', ".pitch): a screw with a pitch of 0 does not travel"),
        (
            "universal",
            Z + "second_axis = [0, 1, 1]",
            ".second_axis): the axes of a universal joint are perpendicular, and these include 45 degrees",
        ),
        ("planar", Z + "x_axis = [0, 0, 3]", ".x_axis): x_axis is parallel to axis; try: a direction across it"),
        ("planar", Z + MIMIC, ".mimic): a planar joint cannot follow another: it has 3 coordinates"),
        ("revolute", Z + 'mimic = { joint = "first" }', ".mimic.joint): the joint first follows itself"),
    ],
)
def test_one_problem(kind: str, keys: str, message: str) -> None:
    (found,) = problems(f'type = "{kind}"\n{keys}')
    assert f"(joints.first{message}" in found


def test_a_circle_is_reported_once() -> None:
    turning = 'type = "revolute"\naxis = [0, 0, 1]\n'
    (found,) = problems(turning + 'mimic = { joint = "second" }', SECOND + 'mimic = { joint = "first" }')
    assert "the joints follow one another in a circle: first, second, first; try: one joint that leads" in found


def test_who_cannot_be_followed() -> None:
    (found,) = problems('type = "cylindrical"\naxis = [0, 0, 1]', SECOND + 'mimic = { joint = "first" }')
    assert "the cylindrical joint first has 2 coordinates, and leaders have one" in found


def test_coordinates_in_formulas_are_counted() -> None:
    effort = '[efforts.motor]\njoint = "first"\nindex = {}\neffort = "{}"\n'
    universal = 'type = "universal"\naxis = [0, 0, 1]\nsecond_axis = [0, 1, 0]'
    assert load(universal, SECOND + effort.format(1, "q.first[1] - v.first[0]")).efforts[0].index == 1
    assert "the universal joint first has no component 2" in problems(universal, SECOND + effort.format(2, "1"))[0]
    [found] = problems(universal, SECOND + effort.format(0, "q.first"))
    assert "q.first has 2 components (column 1); try: q.first[0]" in found


@pytest.mark.parametrize(
    ("spring", "message"),
    [
        ('first = "second"', "twist.first): the joint second is prismatic and has no angle; try: a revolute joint"),
        ('first = "first"\nfirst_index = 1', "twist.first_index): the planar joint first has no angle 1; try: 0"),
    ],
)
def test_springs_between_angles(spring: str, message: str) -> None:
    (found,) = problems(
        'type = "planar"\naxis = [0, 0, 1]', SECOND + f"[torsion_springs.twist]\nstiffness = 1\n{spring}\n"
    )
    assert message in found


AXIS = "axis = [1, 0, 0]\n"
AXES = AXIS + "second_axis = [0, 1, 0]\n"
