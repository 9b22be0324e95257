"""Inverse dynamics in formulas, against Pinocchio; computed torque, written in a scene, as a linear law of errors."""

from __future__ import annotations

import re

import numpy as np
import pinocchio as pin
import pytest

from eomgen.errors import DescriptionError, ModelError
from eomgen.mechanics.derive import derive
from eomgen.scene.load import data_of, from_data
from tests.models import library
from tests.oracles.evaluation import relative_error, tape_evaluator
from tests.oracles.pinocchio_oracle import oracle_from_urdf, robot_file
from tests.oracles.states import random_states

UR5 = robot_file("ur_description/urdf/ur5_robot.urdf")
JOINTS = [
    "shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint",
]  # fmt: skip  # a table


def ur5(**sections: object) -> dict[str, object]:
    """Return the UR5 as nested data, with more sections."""
    data = data_of(UR5)
    for name, entries in sections.items():
        data[name] = {**data.get(name, {}), **entries} if isinstance(entries, dict) else entries
    return data


def test_gravity_and_tau_are_pinocchios(rng: np.random.Generator) -> None:
    """At the state itself, and at reference positions, velocities and accelerations in place of its own."""
    references = {
        "feedforward": {
            "position": {joint: f"sin({k + 1} * t)" for k, joint in enumerate(JOINTS)},
            "velocity": {joint: f"{k + 1} * cos({k + 1} * t)" for k, joint in enumerate(JOINTS)},
            "acceleration": {joint: f"-{(k + 1) ** 2} * sin({k + 1} * t)" for k, joint in enumerate(JOINTS)},
        },
        "here": {"acceleration": {"elbow_joint": "2 - 3 * v.elbow_joint"}},
    }
    outputs = {
        "weight": {"formula": [f"gravity.{joint}" for joint in JOINTS]},
        "ahead": {"formula": [f"tau.{joint}(feedforward)" for joint in JOINTS]},
        "held": {"formula": [f"tau.{joint}(here)" for joint in JOINTS]},
    }
    scene = from_data(ur5(references=references, outputs=outputs), inertias_checked=True)
    system = derive(scene, ["outputs"])
    state = random_states(system, 4, rng)
    found = tape_evaluator(system)("outputs", state)["y"]
    oracle = oracle_from_urdf(UR5, scene)
    model, data = oracle.model, oracle.data
    expected = []
    for k in range(4):
        q, v, t = state["q"][k], state["v"][k], float(state["t"][k, 0])
        n = np.arange(1, 7)
        ahead = pin.rnea(model, data, np.sin(n * t), n * np.cos(n * t), -(n**2) * np.sin(n * t)).copy()
        a = np.zeros(6)
        a[2] = 2 - 3 * v[2]
        expected.append([*pin.computeGeneralizedGravity(model, data, q), *ahead, *pin.rnea(model, data, q, v, a)])
    assert relative_error(found, np.array(expected)) <= 1e-12


def test_computed_torque_is_a_scene(rng: np.random.Generator) -> None:
    """Errors of all joints obey e'' = -20 e' - 100 e exactly, whatever the robot does otherwise."""
    law = {
        joint: f"-sin(t) + 20 * (cos(t) - v.{joint}) + 100 * (sin(t) - q.{joint})" for joint in JOINTS
    }  # the reference is sin(t) in every joint
    efforts = {f"at_{joint}": {"joint": joint, "effort": f"tau.{joint}(servo)"} for joint in JOINTS}
    scene = from_data(ur5(references={"servo": {"acceleration": law}}, efforts=efforts), inertias_checked=True)
    system = derive(scene, ["forward_dynamics", "partials"])
    state = random_states(system, 4, rng)
    evaluate = tape_evaluator(system)
    q, v, t = state["q"], state["v"], state["t"]
    expected = -np.sin(t) + 20 * (np.cos(t) - v) + 100 * (np.sin(t) - q)
    assert relative_error(evaluate("forward_dynamics", state)["vdot"], expected) <= 1e-10
    partials = evaluate("partials", {**state, "a": expected})
    M = partials["M"]
    assert relative_error(partials["C"], 20 * M, 2) <= 1e-10  # tau - M a has no velocity in it but the law's
    assert relative_error(partials["K"], 100 * M, 2) <= 1e-9


MISTAKES = {
    "tau.elbow_joint": "tau.elbow_joint needs a reference motion (column 1); try: tau.elbow_joint(servo), and",
    "tau.elbow_joint(t + 1)": "tau.elbow_joint() takes the name of one reference (column 1)",
    "tau.elbow_joint(sevo)": "there is no reference 'sevo' (column 17); try: servo",
    "tau.elbw_joint(servo)": "tau.elbw_joint: there is no joint 'elbw_joint' (column 1); try: elbow_joint",
    "gravity.elbow_joint[1]": "gravity.elbow_joint has no component 1 (column 1); try: gravity.elbow_joint",
}


@pytest.mark.parametrize("formula", MISTAKES)
def test_what_is_said_of_mistakes(formula: str) -> None:
    efforts = {"motor": {"joint": "elbow_joint", "effort": formula}}
    data = ur5(references={"servo": {"acceleration": {"elbow_joint": 1.0}}}, efforts=efforts)
    with pytest.raises(DescriptionError, match=re.escape(MISTAKES[formula])):
        from_data(data, inertias_checked=True)


def test_where_inverse_dynamics_has_no_place() -> None:
    state = {"lag": {"rate": "tau.elbow_joint(servo)"}}
    data = ur5(references={"servo": {"velocity": {"elbw": 1.0}}}, states=state)
    with pytest.raises(DescriptionError) as caught:
        from_data(data, inertias_checked=True)
    assert "tau.elbow_joint cannot be used here" in str(caught.value)
    assert "(references.servo.velocity.elbw): there is no joint 'elbw'; try:" in str(caught.value)
    efforts = {"motor": {"joint": "elbow_joint", "effort": "gravity.elbow_joint"}}
    scene = from_data(ur5(efforts=efforts), inertias_checked=True, coordinates="absolute")
    with pytest.raises(ModelError, match=r"gravity\.elbow_joint exists in joint coordinates, and this scene has"):
        derive(scene)
    led = {"joints__elbow__mimic": {"joint": "shoulder"}, "joints__elbow__initial": None}
    scene = from_data(library.scene("arm", outputs={"load": {"formula": "gravity.elbow"}}, efforts={}, **led))
    with pytest.raises(ModelError, match=r"gravity\.elbow: the joint elbow follows another and has no equation of its"):
        derive(scene, ["outputs"])
