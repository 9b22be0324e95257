"""Transmissions of URDFs: efforts of actuators, by virtual work of the documented maps of positions."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from eomgen.errors import DescriptionError
from eomgen.mechanics.derive import derive
from eomgen.scene.load import load
from tests.models.urdf import load_urdf
from tests.oracles.evaluation import relative_error, tape_evaluator
from tests.oracles.pinocchio_oracle import robot_file
from tests.oracles.states import random_states
from tests.robots.tables import table

LINK = """<link name="{}"><inertial><origin xyz="0.1 0.02 -0.2"/><mass value="2"/>
  <inertia ixx="0.1" iyy="0.2" izz="0.25" ixy="0.01" ixz="0.02" iyz="-0.01"/></inertial></link>"""
ARM = f"""<robot name="arm"><link name="foot"/>{"".join(map(LINK.format, "ABCD"))}
  <joint name="a" type="revolute"><parent link="foot"/><child link="A"/><axis xyz="0 1 0"/></joint>
  <joint name="b" type="revolute"><parent link="A"/><child link="B"/><axis xyz="0 1 1"/><origin xyz="0 0 1"/></joint>
  <joint name="c" type="prismatic"><parent link="B"/><child link="C"/><axis xyz="1 0 0"/></joint>
  <joint name="d" type="continuous"><parent link="C"/><child link="D"/><mimic joint="a"/></joint>
  {{}}</robot>"""
SIMPLE = """<transmission name="one"><type>transmission_interface/SimpleTransmission</type>
  <joint name="{joint}"><hardwareInterface>hardware_interface/EffortJointInterface</hardwareInterface>
    <offset>0.3</offset></joint>
  <actuator name="{actuator}"><mechanicalReduction>{reduction}</mechanicalReduction></actuator></transmission>"""
DIFFERENTIAL = """<transmission name="wrist"><type>transmission_interface/DifferentialTransmission</type>
  <actuator name="left"><role>actuator1</role><mechanicalReduction>-30</mechanicalReduction></actuator>
  <actuator name="right"><role>actuator2</role><mechanicalReduction>25</mechanicalReduction></actuator>
  <joint name="b"><role>joint2</role><mechanicalReduction>1.5</mechanicalReduction></joint>
  <joint name="a"><role>joint1</role><mechanicalReduction>-2</mechanicalReduction></joint></transmission>"""
OLD = """<transmission type="pr2_mechanism_model/SimpleTransmission" name="t"><actuator name="m1"/><joint name="c"/>
  <mechanicalReduction>-400</mechanicalReduction></transmission>"""
CONTROL = """<ros2_control name="s" type="system"><hardware><plugin>x</plugin></hardware><transmission name="t">
  <plugin>transmission_interface/SimpleTransmission</plugin><actuator name="m1" role="actuator1"/>
  <joint name="a" role="joint1"><mechanical_reduction>50.0</mechanical_reduction></joint>
  </transmission></ros2_control>"""


def generalized_forces(text: str, inputs: list[float], **options: object) -> np.ndarray:
    """Return Q of an arm at rest in no gravity but its own, less what it is without inputs."""
    system = derive(load_urdf(text, **options), ["force"])
    evaluate, state = tape_evaluator(system), random_states(system, 1, np.random.default_rng(0))
    state["u"] = np.zeros((1, len(inputs)))
    idle = evaluate("force", state)["Q"]
    state["u"] = np.array([inputs])
    return (evaluate("force", state)["Q"] - idle)[0]


@pytest.mark.parametrize(
    ("transmission", "expected"),
    [
        (SIMPLE.format(joint="a", actuator="m1", reduction="50"), [50.0, 0.0, 0.0]),
        (OLD, [0.0, 0.0, -400.0]),
        (CONTROL, [50.0, 0.0, 0.0]),
    ],
    ids=["ros_control", "pr2", "ros2_control"],
)
def test_an_actuator_moves_its_joint_with_the_reduction(transmission: str, expected: list[float]) -> None:
    scene = load_urdf(ARM.format(transmission), transmissions=True)
    assert [item.name for item in scene.inputs] == ["m1"]
    assert scene.inputs[0].unit == ("" if expected[2] else "N m")
    assert "inputs are efforts of actuators with transmissions: m1" in scene.notes
    assert not [note for note in scene.notes if note.startswith(("not read", "not modelled"))]
    np.testing.assert_allclose(generalized_forces(ARM.format(transmission), [1.0], transmissions=True), expected)


def test_differential_by_virtual_work() -> None:
    """Motions: q1 = (a1/n1 + a2/n2) / (2 m1), q2 = (a1/n1 - a2/n2) / (2 m2); power in is power out."""
    n, m = np.array([-30.0, 25.0]), np.array([-2.0, 1.5])
    J = np.array([[1.0, 1.0], [1.0, -1.0]]) / n / (2.0 * m[:, None])
    tau = np.array([0.7, -0.4])
    found = generalized_forces(ARM.format(DIFFERENTIAL), list(tau), transmissions=True)
    np.testing.assert_allclose(J.T @ found[:2], tau, rtol=1e-12)
    assert found[2] == 0.0


def test_joints_without_a_transmission_have_inputs_of_their_own_where_that_is_asked_for() -> None:
    text = ARM.format(DIFFERENTIAL)
    assert [item.name for item in load_urdf(text, transmissions=True).inputs] == ["left", "right"]
    assert [item.name for item in load_urdf(text, transmissions=True, actuated=True).inputs] == ["left", "right", "c"]
    assert [item.name for item in load_urdf(text, actuated=True).inputs] == ["a", "b", "c"]
    assert "not modelled: <transmission> (1: wrist)" in load_urdf(text, actuated=True).notes
    clash = ARM.format(SIMPLE.format(joint="a", actuator="c", reduction="2"))
    scene = load_urdf(clash, transmissions=True, actuated=True)
    assert [item.name for item in scene.inputs] == ["c", "b", "c_effort"]


def test_several_actuators_of_a_joint_add_up_and_names_are_made_legal() -> None:
    text = ARM.format(
        SIMPLE.format(joint="a", actuator="motor-1", reduction="3")
        + SIMPLE.format(joint="a", actuator="sin", reduction="5")
    )
    assert [item.name for item in load_urdf(text, transmissions=True).inputs] == ["motor_1", "sin_2"]
    np.testing.assert_allclose(generalized_forces(text, [2.0, 1.0], transmissions=True), [11.0, 0.0, 0.0])


@pytest.mark.parametrize(
    ("transmission", "options", "note"),
    [
        (
            SIMPLE.format(joint="elbow", actuator="m1", reduction="50"),
            {},
            "not modelled: transmissions to joints that are not there (1: elbow)",
        ),
        (
            SIMPLE.format(joint="a", actuator="m1", reduction="50").replace("Simple", "FourBarLinkage"),
            {},
            "not modelled: transmissions of the type 'FourBarLinkageTransmission' (1: one)",
        ),
        (
            '<transmission name="t"><wheel/></transmission>',
            {},
            "not modelled: transmissions of the type '' (1: t)",
        ),
    ],
)
def test_what_a_transmission_cannot_do_is_noted(transmission: str, options: dict[str, object], note: str) -> None:
    scene = load_urdf(ARM.format(transmission), transmissions=True, **options)
    assert not scene.inputs and note in scene.notes
    with pytest.raises(DescriptionError, match=re.escape(note)):
        load_urdf(ARM.format(transmission), transmissions=True, strict=True)


def test_joints_that_are_held_or_follow_are_not_driven() -> None:
    text = ARM.format("".join(SIMPLE.format(joint=j, actuator=f"m{j}", reduction="50") for j in "bd"))
    scene = load_urdf(text, transmissions=True, lock=["b"])
    assert not scene.inputs
    what = "transmissions have no effect on joints that are held, follow others or have not one coordinate: b, d"
    assert what in scene.notes


@pytest.mark.parametrize(("old", "new", "message"), table("faults_of_transmissions"))
def test_refusals(old: str, new: str, message: str) -> None:
    text = DIFFERENTIAL.replace(old, new, 1)
    with pytest.raises(DescriptionError, match=re.escape(message)):
        load_urdf(ARM.format(text), file="arm.urdf", transmissions=True)


def test_a_robot_with_motors_does_what_inverse_dynamics_asks_for(rng: np.random.Generator) -> None:
    """The wrist of TALOS' arm is a differential: efforts of motors solve T tau_a = tau of inverse dynamics."""
    scene = load(robot_file("talos_data/robots/talos_left_arm.urdf"), transmissions=True)
    system = derive(scene, ["inverse_dynamics", "forward_dynamics", "force"])
    evaluate, state = tape_evaluator(system), random_states(system, 1, rng)
    zero = {**state, "u": np.zeros((1, len(scene.inputs)))}
    idle = evaluate("force", zero)["Q"][0]
    columns = [evaluate("force", {**state, "u": unit[None]})["Q"][0] - idle for unit in np.eye(len(scene.inputs))]
    T = np.column_stack(columns)
    assert T.shape == (7, 7) and np.count_nonzero(np.abs(T) > 1e-9) == 9  # a differential has four entries
    tau = evaluate("inverse_dynamics", zero)["tau"][0]
    found = evaluate("forward_dynamics", {**state, "u": np.linalg.solve(T, tau)[None]})["vdot"]
    assert relative_error(found, state["a"]) <= 1e-10


def test_transmissions_have_the_line_of_their_element(tmp_path: Path) -> None:
    file = tmp_path / "arm.urdf"
    pair = [SIMPLE.format(joint="elbw", actuator=actuator, reduction="2") for actuator in ("motor", "brake")]
    text = ARM.format("\n" + "\n".join(pair))
    file.write_text(text, encoding="utf-8")
    line = 1 + text[: text.index("<transmission")].count("\n")  # of the first
    with pytest.raises(DescriptionError, match=rf":{line}\b.* transmissions to joints that are not there .*1: elbw\)"):
        load(file, actuated=True, transmissions=True, strict=True)
