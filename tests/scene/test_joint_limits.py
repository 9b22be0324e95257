"""Stops and dry friction of joints: what is read, what it defaults to, and every message."""

from __future__ import annotations

import pytest

from eomgen.errors import DescriptionError
from eomgen.formula.nodes import Number
from eomgen.scene.load import load_toml
from eomgen.scene.scene import Scene

ARM = """\
format = 1
name = "arm"
bodies.link = { mass = 1, inertia = [0.1, 0.1, 0.1] }
bodies.slider = { mass = 1, inertia = [0.1, 0.1, 0.1] }
bodies.ball = { mass = 1, inertia = [0.1, 0.1, 0.1] }
joints.hinge = { type = "revolute", parent = "base", child = "link", axis = [0, 1, 0] }
joints.rail = { type = "prismatic", parent = "link", child = "slider", axis = [1, 0, 0] }
joints.ball = { type = "spherical", parent = "slider", child = "ball" }
[parameters]
hard = { value = 1e4, tunable = true }
"""


def read(joint: str, **keys: str) -> Scene:
    given = "".join(f"{key} = {value}, " for key, value in keys.items())
    text = ARM.replace(f"joints.{joint} = {{ ", f"joints.{joint} = {{ {given}")
    return load_toml(text, file="arm.toml")


def problem(joint: str, **keys: str) -> str:
    with pytest.raises(DescriptionError) as caught:
        read(joint, **keys)
    assert len(caught.value.problems) == 1, str(caught.value)
    return str(caught.value.problems[0])


def cylinder(keys: str) -> Scene:
    text = ARM.replace('type = "prismatic"', f'type = "cylindrical", {keys}')
    return load_toml(text, file="arm.toml")


def test_joints_of_several_coordinates_have_a_list_for_each_key() -> None:
    limits = (
        'limits = { lower = [-inf, -0.1], upper = [inf, "0.2 * 1"], stiffness = ["hard", 2e4], onset = [0.01, 0.002] }'
    )
    (stop,) = cylinder(limits).joints[1].stops
    assert (stop.index, stop.lower, stop.stiffness, stop.damping) == (1, Number(-0.1), Number(2e4), Number(0.0))
    assert stop.onset == Number(0.002)
    first, second = cylinder("limits = { lower = [-1, -0.1], upper = [1, inf], stiffness = [10, 20] }").joints[1].stops
    assert (first.index, first.onset, first.upper) == (0, Number(1e-3), Number(1))
    assert (second.index, second.onset, second.upper) == (1, Number(1e-4), None)
    (friction,) = cylinder("friction = { coulomb = [0, 3], velocity = [1, 0.01] }").joints[1].friction
    assert (friction.index, friction.coulomb) == (1, Number(3))
    rail = cylinder('limits = { lower = ["-10 deg", "-5 mm"], stiffness = ["1 N m/deg", "2 N/mm"] }').joints[1].stops
    assert [stop.lower for stop in rail] == [Number(pytest.approx(-0.17453292519943295)), Number(-0.005)]


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ("limits = { lower = [-1, -1], stiffness = 1 }", "limits.stiffness): a cylindrical joint needs 2 values"),
        ("limits = { lower = [-inf, -inf], stiffness = [1, 1] }", "limits): limits need lower, upper or both"),
        (
            "friction = { coulomb = [1, 1], velocity = [1, 1], static = [2, 0.5], stribeck = [2, 2] }",
            "friction.static[1]): the static friction 0.5 is below the Coulomb friction 1; try: static above coulomb",
        ),
    ],
)
def test_messages_on_several_coordinates(keys: str, message: str) -> None:
    with pytest.raises(DescriptionError) as caught:
        cylinder(keys)
    assert len(caught.value.problems) == 1, str(caught.value)
    assert str(caught.value.problems[0]).partition(" (joints.rail.")[2].startswith(message)


STOP = "lower = -1, stiffness = 1"
DRY = "coulomb = 1, velocity = 0.01"


def test_absolute_coordinates_take_limits_of_many_turns() -> None:
    text = ARM.replace('name = "arm"\n', 'name = "arm"\ncoordinates = "absolute"\n')
    text = text.replace("joints.hinge = { ", "joints.hinge = { limits = { lower = -30, upper = 40, stiffness = 1 }, ")
    (stop,) = next(joint for joint in load_toml(text, file="arm.toml").joints if joint.name == "hinge").stops
    assert (stop.lower, stop.upper) == (Number(-30.0), Number(40.0))


def test_a_start_beyond_a_limit_is_noted_with_joint_value_limit_and_effort() -> None:
    limits = '{ lower = [-3.07], upper = [-0.07], stiffness = "hard" }'
    found = read("hinge", limits=limits)
    assert found.notes == (
        (
            "joint hinge starts at 0 rad, beyond its upper limit -0.07 rad: the stop pushes back with up to 700 N m; "
            "try an initial position within the limits"
        ),
    )
    assert read("hinge", limits=limits, initial="{ position = -1 }").notes == ()
    assert read("hinge", limits=limits, initial="{ position = -0.07 }").notes == ()
    low = read("hinge", limits=limits, initial="{ position = -4 }").notes
    assert len(low) == 1 and low[0].startswith("joint hinge starts at -4 rad, beyond its lower limit -3.07 rad: ")
    rail = read("rail", limits='{ lower = 0.02, stiffness = "hard / 10" }').notes
    assert len(rail) == 1 and "0 m, beyond its lower limit 0.02 m: the stop pushes back with up to 20 N;" in rail[0]


def test_a_scene_that_starts_at_equilibrium_may_lean_on_its_stops() -> None:
    text = ARM.replace("joints.hinge = { ", 'joints.hinge = { limits = { lower = 0.1, stiffness = "hard" }, ')
    assert len(load_toml(text, file="arm.toml").notes) == 1
    assert load_toml(f'{text}[simulation]\nstart = "equilibrium"\n', file="arm.toml").notes == ()
