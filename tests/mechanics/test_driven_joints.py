"""Drives of joints and lengths over time: efforts against inverse dynamics, in all formulations; what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from eomgen.errors import DescriptionError
from eomgen.formula.motion_faults import jumps
from eomgen.mechanics.derive import derive
from eomgen.mechanics.describe import laws_of
from eomgen.scene.load import load_toml
from tests.oracles.constrained import kkt
from tests.oracles.evaluation import tape_evaluator

TERMS = ["outputs", "energy", "mass", "residual", "constraint", "constraint_velocity", "constraint_jacobian"]
TERMS += ["constraint_bias"]
#: A pendulum whose hinge is driven by 0.4 + 0.3 t + 0.2 t^2.
LAW = '"0.4 + 0.3 * t + 0.2 * t**2"'
ARM = """format = 1
name = "driven"
{top}
bodies.arm = {{ mass = 2.0, center_of_mass = [0.05, 0, -0.6], inertia = [0.2, 0.25, 0.1] }}
{joint}
outputs.effort = {{ formula = "drive_effort.hinge" }}
"""
AXES = "axis = [0, 1, 0], x_axis = [1, 0, 0]"
WAYS = {
    "tree": (
        "",
        f'joints.hinge = {{ type = "revolute", parent = "base", child = "arm", axis = [0, 1, 0], drive = {LAW} }}',
    ),
    "absolute": (
        'coordinates = "absolute"',
        f'joints.hinge = {{ type = "revolute", parent = "base", child = "arm", axis = [0, 1, 0], drive = {LAW} }}',
    ),
    "constraint": (
        "",
        'joints.it = { type = "revolute", parent = "base", child = "arm", axis = [0, 1, 0], '
        'initial = { position = 0.4, velocity = 0.3 } }\n[constraints.hinge]\ntype = "revolute"\n'
        f'first = {{ body = "base", {AXES} }}\nsecond = {{ body = "arm", {AXES} }}\ndrive = {LAW}\n[outputs]\n',
    ),
}


@pytest.mark.parametrize("way", WAYS)
def test_the_effort_is_that_of_inverse_dynamics(way: str) -> None:
    """J qddot + m g (0.6 sin q - 0.05 cos q) of the arm at t = 0, where the state is the law's."""
    top, joint = WAYS[way]
    text = ARM.format(top=top, joint=joint).replace("[outputs]\n\noutputs.", "[outputs]\n")
    scene = load_toml(text)
    rows = (0, 1, 2, 3, 4) if way == "constraint" else ()  # the hinge holds them already
    system = derive(scene, TERMS, rows)
    evaluate = tape_evaluator(system)
    state = {"q": np.array([system.initial_q]), "v": np.array([system.initial_v]), "t": np.zeros((1, 1))}
    assert np.abs(evaluate("constraint", state)["Phi"]).max() <= 1e-15
    assert np.abs(evaluate("constraint_velocity", state)["w"]).max() <= 1e-15
    found = kkt(evaluate, state)
    inertia, q = 0.25 + 2.0 * (0.6**2 + 0.05**2), 0.4
    expected = inertia * 0.4 + 2.0 * 9.81 * (0.6 * np.sin(q) - 0.05 * np.cos(q))
    effort = evaluate("outputs", found)["y"][0, 0]
    assert effort == pytest.approx(expected, rel=1e-12)
    assert evaluate("energy", found)["energy"][0, 3] == pytest.approx(0.3 * effort, rel=1e-12)


def test_each_coordinate_of_a_joint_has_its_drive() -> None:
    scene = load_toml(
        'format = 1\nname = "rod"\nbodies.rod = { mass = 2.0, inertia = [0.2, 0.2, 0.3] }\n'
        'joints.guide = { type = "cylindrical", parent = "base", child = "rod", axis = [0, 0, 1], '
        'drive = ["t**2", "0.1 + 0.5 * t**2"] }\n'
        'outputs.efforts = { formula = ["drive_effort.guide[0]", "drive_effort.guide[1]"] }\n'
    )
    assert scene.joints[0].initial_position == (0.0, 0.1) and scene.joints[0].initial_velocity == (0.0, 0.0)
    assert [(law.quantity, law.unit) for law in laws_of(scene)] == [("driven angle", "rad"), ("driven travel", "m")]
    system = derive(scene, TERMS)
    assert system.multipliers == ("guide: driven angle", "guide: driven travel")
    evaluate = tape_evaluator(system)
    state = {"q": np.array([system.initial_q]), "v": np.array([system.initial_v]), "t": np.zeros((1, 1))}
    assert evaluate("outputs", kkt(evaluate, state))["y"][0] == pytest.approx(
        [0.3 * 2.0, 2.0 * (1.0 + 9.81)], rel=1e-12
    )


def of_a_law(drive: str) -> list[str]:
    scene = load_toml(ARM.format(top="", joint=WAYS["tree"][1].replace(LAW, f'"{drive}"')))
    return [str(problem) for problem in jumps(laws_of(scene), {}, 0.0, 4.0)]


def test_a_law_that_jumps_is_refused() -> None:
    (problem,) = of_a_law("1 if t > 0.5 else 0")
    assert "scene.toml:5 (joints.hinge.drive): the driven angle jumps from 0 to 1 rad at t = 0.5 s" in problem
    assert of_a_law("tanh((t - 0.5) / 0.01)") == []


ROPE = """format = 1
name = "winch"
bodies.load = {{ mass = 3.0, inertia = [0.1, 0.1, 0.1] }}
[joints.guide]
type = "prismatic"
parent = "base"
child = "load"
axis = [0, 0, -1]
initial = {{ position = 1.5, velocity = -0.2 }}
[constraints.rope]
type = "distance"
first = {{ body = "base" }}
second = {{ body = "load" }}
length = {length}
[outputs]
effort = {{ formula = "drive_effort.rope" }}
pull = {{ reaction_force = "rope" }}
"""


def test_a_winch_pulls_by_the_length_of_its_rope() -> None:
    """m (g + 0.6) upwards, in the guide that carries nothing; the effort is minus the tension."""
    scene = load_toml(ROPE.format(length='"1.5 - 0.2 * t - 0.3 * t**2"'))
    (law,) = laws_of(scene)
    assert (law.quantity, law.unit) == ("driven distance", "m")
    evaluate = tape_evaluator(derive(scene, TERMS))
    state = {"q": np.array([[1.5]]), "v": np.array([[-0.2]]), "t": np.zeros((1, 1))}
    assert np.abs(evaluate("constraint_velocity", state)["w"]).max() <= 1e-15
    found = kkt(evaluate, state)
    tension = 3.0 * (9.81 + 0.6)
    assert evaluate("outputs", found)["y"][0] == pytest.approx([-tension, 0.0, 0.0, tension], abs=1e-12)
    assert evaluate("energy", found)["energy"][0, 3] == pytest.approx(0.2 * tension, rel=1e-12)


@pytest.mark.parametrize(
    "text, said",
    [
        (ROPE.format(length='"-1 + t"'), "the length is -1 m at t = 0, which is not positive; try: a length in m"),
        (ROPE.format(length="-1"), "-1 m is not positive; try: a length in m"),
        (ROPE.format(length="1.5"), "drive_effort.rope: rope has no drive"),
    ],
)
def test_what_is_said_of_lengths(text: str, said: str) -> None:
    with pytest.raises(DescriptionError) as caught:
        load_toml(text)
    assert said in str(caught.value)


ONE = 'joints.hinge = { type = "revolute", parent = "base", child = "arm", axis = [0, 1, 0], '


@pytest.mark.parametrize(
    "joint, said",
    [
        (ONE + 'drive = ["t", "t"] }', "a revolute joint needs one value here, not 2"),
        (
            ONE + 'drive = "t", initial = { position = 1 } }',
            "(joints.hinge.initial.position): a driven joint has no initial state of its own; try: no initial: it "
            "starts where its drive is at t = 0",
        ),
        (
            'joints.hinge = { type = "spherical", parent = "base", child = "arm", drive = "t" }',
            "(joints.hinge.drive): a spherical joint has no drive",
        ),
        (
            ONE
            + 'drive = "bend(t)" }\n[curves]\nbend = { points = [[0, 0], [1, 1], [2, 0]], interpolation = "linear" }\n'
            "[outputs]",
            "(joints.hinge.drive): a motion cannot follow bend, which bends at 0; try: interpolation",
        ),
        (ONE + 'drive = "1 / t" }', "(joints.hinge.drive): the motion has no finite value and rate at t = 0"),
        (ONE + 'drive = "q.hinge" }', "q.hinge cannot be used here (column 1); try: time, parameters and curves only"),
    ],
)
def test_what_is_said_of_drives(joint: str, said: str) -> None:
    text = ARM.format(top="", joint=joint).replace("[outputs]\noutputs.", "[outputs]\n")
    with pytest.raises(DescriptionError) as caught:
        load_toml(text)
    assert said in str(caught.value)


def test_an_angle_that_jumps_by_whole_turns_is_the_same_angle() -> None:
    """A law by atan2 in joint coordinates: its equation is within half a turn."""
    law = "atan2(sin(3 * t), cos(3 * t))"
    assert of_a_law(law) == []
    scene = load_toml(ARM.format(top="", joint=WAYS["tree"][1].replace(LAW, f'"{law}"')))
    evaluate = tape_evaluator(derive(scene, TERMS))
    Phi = evaluate("constraint", {"q": np.array([[6.3]]), "v": np.zeros((1, 1)), "t": np.array([[2.1]])})["Phi"]
    assert abs(Phi[0, 0]) <= 1e-14
