"""Planar joints, mimic joints and limits of a URDF."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

import eomgen
from eomgen.errors import DescriptionError, UsageError
from eomgen.mechanics.derive import derive
from eomgen.products.robots.sources import URDF
from eomgen.scene.load import from_data, load
from eomgen.scene.rotations import about_axis, snapped_rotation
from eomgen.scene.scene import Scene
from tests.models.urdf import load_urdf
from tests.oracles.evaluation import relative_error, tape_evaluator
from tests.oracles.formulas import value_of
from tests.oracles.pinocchio_oracle import robot_file
from tests.oracles.states import random_states
from tests.robots.tables import table

LINK = """<link name="{}"><inertial><mass value="1.5"/><origin xyz="0.1 -0.2 0.3" rpy="0.1 0.2 0.3"/>
  <inertia ixx="0.1" iyy="0.2" izz="0.25" ixy="0.01" ixz="0.02" iyz="-0.01"/></inertial></link>"""
JOINT = """<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>
  <origin xyz="0.3 0.1 -0.2" rpy="0.4 -0.3 0.2"/><axis xyz="{axis}"/>{more}</joint>"""
LIMITED = '<limit lower="-0.5" upper="1.5" effort="20" velocity="3"/>'


def robot(*joints: tuple[str, str, str, str], axis: str = "0 0 1") -> str:
    """Return a URDF of joints (name, type, parent, further elements), each with a link of the name of its joint in
    capitals."""
    links = [LINK.format(name.upper()) for name, *_ in joints]
    lines = [
        JOINT.format(name=name, kind=kind, parent=parent, child=name.upper(), axis=axis, more=more)
        for name, kind, parent, more in joints
    ]
    return f'<robot name="made"><link name="foot"/>{"".join(links)}\n' + "\n".join(lines) + "</robot>"


def pinocchio_model(text: str) -> Any:
    """Return Pinocchio's model; its reader wants limits."""
    return pin.buildModelFromXML(re.sub(r"<axis [^>]*>(?!<limit)", rf"\g<0>{LIMITED}", text))


def refusals(text: str, **options: object) -> list[str]:
    with pytest.raises(DescriptionError) as caught:
        load_urdf(text, **options)  # type: ignore[arg-type]
    return [str(problem) for problem in caught.value.problems]


def mimic(joint: str, more: str = "") -> str:
    return f'<mimic joint="{joint}" {more}/>'


def test_a_planar_joint_is_pinocchios() -> None:
    """Pinocchio counts x, y, cos, sin and body velocities; the rates of ours are theirs turned into the plane."""
    text = robot(
        ("a", "revolute", "foot", '<limit lower="-1" upper="1" effort="1" velocity="1"/>'), ("slab", "planar", "A", "")
    )
    scene = load_urdf(text)
    assert scene.joints[1].type == "planar" and scene.joints[1].second_axis == (1.0, 0.0, 0.0)
    model = pinocchio_model(text)
    data = model.createData()
    system = derive(scene, ["mass", "coupling"])
    evaluate = tape_evaluator(system)
    state = random_states(system, 5, np.random.default_rng(1))
    model.gravity.linear = np.zeros(3)
    for k in range(5):
        (a, angle, x, y), v = state["q"][k], state["v"][k]
        c, s = np.cos(angle), np.sin(angle)
        T = np.array([[1.0, 0, 0, 0], [0, 0, c, s], [0, 0, -s, c], [0, 1.0, 0, 0]])  # pinocchio's velocity from ours
        rate = v[1] * np.array([[0.0, 0, 0, 0], [0, 0, -s, c], [0, 0, -c, -s], [0, 0, 0, 0]])
        q = np.array([a, x, y, c, s])
        M = pin.crba(model, data, q)
        M = np.triu(M) + np.triu(M, 1).T
        expected = T.T @ pin.rnea(model, data, q, T @ v, rate @ v)
        each = {name: values[k] for name, values in state.items()}
        assert relative_error(evaluate("mass", each)["M"], T.T @ M @ T, 2) <= 1e-12
        assert relative_error(evaluate("coupling", each)["h"], expected) <= 1e-12


def test_damping_of_a_planar_joint_is_noted() -> None:
    notes = load_urdf(robot(("slab", "planar", "foot", '<dynamics damping="1"/>'))).notes
    assert "not modelled: damping of a planar joint (1: slab)" in notes


def mimics_of(scene: Scene) -> dict[str, tuple[str, float, float]]:
    return {
        joint.name: (joint.mimic.joint, value_of(joint.mimic.multiplier, {}), value_of(joint.mimic.offset, {}))
        for joint in scene.joints
        if joint.mimic is not None
    }


def test_mimics_of_mimics_and_across_branches() -> None:
    """The first follows a joint of another branch that comes after it, which follows one in its turn."""
    text = robot(
        ("first", "prismatic", "foot", mimic("last", 'multiplier="-0.5"')),
        ("lead", "continuous", "foot", ""),
        ("last", "revolute", "LEAD", mimic("lead", 'multiplier="2" offset="0.3"')),
        ("still", "revolute", "LAST", mimic("lead", 'multiplier="0"')),
    )
    scene = load_urdf(text)
    assert mimics_of(scene) == {"first": ("last", -0.5, 0.0), "last": ("lead", 2.0, 0.3), "still": ("lead", 0.0, 0.0)}
    note = (
        "joints that mimic others are not independent coordinates: first follows last, last follows lead, still follows"
        " lead"
    )
    assert note in scene.notes
    system = derive(scene, ["mass", "inverse_dynamics"])
    assert [factor.name for factor in system.factors] == ["lead"]
    model = pinocchio_model(text)
    data, state = model.createData(), random_states(system, 5, np.random.default_rng(0))
    G = {"first": -1.0, "lead": 1.0, "last": 2.0, "still": 0.0}
    names = [model.names[k] for k in range(1, model.njoints)]
    column = np.array([G[name] for name in names])
    evaluate = tape_evaluator(system)
    for k in range(5):
        q, v, a = (float(state[name][k, 0]) for name in "qva")
        coordinates = {"first": -0.5 * (2.0 * q + 0.3), "lead": q, "last": 2.0 * q + 0.3, "still": 0.0}
        stored = np.concatenate(
            [[np.cos(q), np.sin(q)] if name == "lead" else [coordinates[name]] for name in names]
        )  # a continuous joint
        tau = pin.rnea(model, data, stored, column * v, column * a) @ column
        each = {name: values[k] for name, values in state.items()}
        assert relative_error(evaluate("inverse_dynamics", each)["tau"], np.array([tau])) <= 1e-12


def test_what_mimics_a_held_joint_is_held() -> None:
    text = robot(
        ("lead", "revolute", "foot", ""),
        ("a", "revolute", "LEAD", mimic("lead", 'offset="0.4"')),
        ("b", "prismatic", "A", mimic("a", 'multiplier="2"')),
    )
    held = load_urdf(text, lock=["lead"], root="free")
    assert [joint.name for joint in held.joints] == ["root_joint"]
    assert "joints held because their leaders are held: a, b" in held.notes
    place = next(point for point in held.points if point.name == "B")
    model = pinocchio_model(text)
    data = model.createData()
    pin.framesForwardKinematics(model, data, np.array([0.0, 0.4, 0.8]))
    expected = data.oMf[model.getFrameId("B")].translation
    np.testing.assert_allclose([value_of(item, {}) for item in place.position], expected, atol=1e-14)


@pytest.mark.parametrize(
    ("joints", "message"),
    [
        ([("a", "revolute", "foot", mimic("lead"))], "(joints.a): there is no joint 'lead' to mimic; try: one of a"),
        (
            [("a", "revolute", "foot", mimic("a"))],
            "the joints mimic one another in a circle: a, a; try: one joint that leads",
        ),
        (
            [("a", "revolute", "foot", mimic("b")), ("b", "revolute", "A", mimic("a"))],
            "(joints.a): the joints mimic one another in a circle: a, b, a; try: one joint that leads",
        ),
        (
            [("a", "floating", "foot", ""), ("b", "revolute", "A", mimic("a"))],
            "(joints.b): the floating joint a cannot be mimicked: it has not one coordinate",
        ),
        (
            [("a", "planar", "foot", mimic("b")), ("b", "revolute", "A", "")],
            "(joints.a): the planar joint a cannot mimic another: it has not one coordinate",
        ),
        ([("a", "revolute", "foot", mimic("b", 'multiplier="x"'))], "multiplier: a number is needed here, not 'x'"),
    ],
)
def test_mimics_that_cannot_be(joints: list[tuple[str, str, str, str]], message: str) -> None:
    found = refusals(robot(*joints))
    assert message in found[0], found


@pytest.mark.parametrize("limit", ['effort="3"', 'lower="-1" upper="1"', 'lower="1" upper="1" effort="3"'])
def test_limits_without_a_range_or_an_effort_are_noted(limit: str) -> None:
    scene = load_urdf(robot(("a", "revolute", "foot", f"<limit {limit}/>")), limits=True)
    assert not scene.joints[0].stops
    assert "not modelled: limits of position, velocity and effort (1: a)" in scene.notes


def test_ranges_of_version_1_2_are_open() -> None:
    """Pull request 249 of urdfdom: an end that is not given is infinite, and so is an effort."""
    old = robot(("a", "revolute", "foot", '<limit upper="1.5" effort="20"/>'))
    new = old.replace("<robot ", '<robot version="1.2" ', 1)
    (stop,), (open_stop,) = (load_urdf(text, limits=True).joints[0].stops for text in (old, new))
    assert [value_of(stop.lower, {}), open_stop.lower] == [0.0, None]
    assert [value_of(item.upper, {}) for item in (stop, open_stop)] == [1.5, 1.5]
    scene = load_urdf(new.replace('effort="20"', 'lower="-1"'), limits=True)
    assert not scene.joints[0].stops
    assert "not modelled: limits of position, velocity and effort (1: a)" in scene.notes


def test_dry_friction_is_taken_where_it_is_asked_for() -> None:
    def rubbing(friction: str) -> str:
        return f'<dynamics damping="0.5" friction="{friction}"/>'

    text = robot(
        ("a", "revolute", "foot", rubbing("3")),
        ("b", "prismatic", "A", rubbing("4")),
        ("c", "continuous", "B", rubbing("5")),
        ("d", "floating", "C", rubbing("6")),
        ("e", "revolute", "D", rubbing("-1")),
        ("f", "revolute", "E", rubbing("0")),
    )
    assert all(not joint.friction for joint in load_urdf(text).joints)
    assert "not modelled: dry friction (4: a, b, c, e)" in load_urdf(text).notes
    assert "not modelled: dry friction of floating joints (1: d)" in load_urdf(text).notes
    scene = load_urdf(text, friction=True)
    found = [joint.friction for joint in scene.joints]
    assert [len(entry) for entry in found] == [1, 1, 1, 0, 0, 0]
    numbers = [[value_of(getattr(entry[0], name), {}) for name in ("coulomb", "velocity")] for entry in found[:3]]
    assert numbers == [[3.0, 0.01], [4.0, 0.001], [5.0, 0.01]]
    assert "not modelled: dry friction (1: e)" in scene.notes


@pytest.mark.parametrize(
    "angle", [0.0, 1e-12, 1e-9, 3e-8, 1e-6, 1e-5, 3e-5, 1e-3, 1.0, np.pi / 2 - 1e-5, np.pi / 2 + 5e-12]
)
@pytest.mark.parametrize("axis", [(0.0, 0.0, 1.0), (0.6, 0.0, 0.8), (0.48, 0.6, 0.64)])
def test_snapped_rotations_are_rotations(angle: float, axis: tuple[float, float, float]) -> None:
    """Rounding single entries leaves a turn by 1e-5 skew by 5e-11."""
    R = about_axis(np.array([0.0, 1.0, 0.0]), np.pi / 2) @ about_axis(np.array(axis), angle)
    found = snapped_rotation(R)
    assert np.abs(found @ found.T - np.eye(3)).max() <= 1.1e-14
    assert np.abs(found - R).max() <= 2.1e-10
    if angle < 1e-10:
        assert set(np.abs(found).ravel()) == {0.0, 1.0}


def test_a_nearly_straight_frame_is_no_turn_about_one_axis() -> None:
    """Turned by 1e-9, a frame has a 1 on its diagonal in double precision; M must feel the 1e-9 all the same."""
    text = robot(("a", "revolute", "foot", ""), ("b", "revolute", "A", ""))
    text = text.replace('rpy="0.4 -0.3 0.2"', 'rpy="3e-9 2e-9 0.7"')
    system = derive(load_urdf(text), ["mass"])
    model = pinocchio_model(text)
    q = np.array([0.3, -0.8])
    M = pin.crba(model, model.createData(), q)
    found = tape_evaluator(system)("mass", {"q": q})["M"]
    assert relative_error(found, np.triu(M) + np.triu(M, 1).T, 2) <= 1e-15


def test_actuated_joints_have_inputs_of_their_names() -> None:
    """One for each joint that moves on its own, in the order of v; not for the free root and followers."""
    scene = load(robot_file("panda_description/urdf/panda.urdf"), root="free", actuated=True, lock=["panda_joint3"])
    moving = [joint.name for joint in scene.joints if joint.mimic is None and joint.type in ("revolute", "prismatic")]
    assert [item.name for item in scene.inputs] == moving and len(moving) == 7
    assert [item.unit for item in scene.inputs] == ["N m"] * 6 + ["N"]
    assert "panda_finger_joint2" not in moving and "panda_joint3" not in moving
    assert not load(robot_file("panda_description/urdf/panda.urdf")).inputs


def test_a_joint_that_is_called_like_a_function_has_another_input() -> None:
    text = """<robot name="r"><link name="a"/><link name="b"><inertial><mass value="1"/>
      <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <joint name="sin" type="continuous"><parent link="a"/><child link="b"/></joint></robot>"""
    scene = load_urdf(text, actuated=True)
    assert [item.name for item in scene.inputs] == ["sin_effort"]


UR5 = "ur_description/urdf/ur5_robot.urdf"


def test_inertial_parameters_of_any_link_are_tunable(rng: np.random.Generator) -> None:
    """At the file's values nothing changes; a payload on a massless tool and other inertias are those of Pinocchio."""
    path = robot_file(UR5)
    scene = load(path, tunable=["tool0", "forearm_link"])
    assert len(scene.parameters) == 20 and scene.parameters[0].tunable
    system, plain = derive(scene, ["mass", "inverse_dynamics"]), derive(load(path), ["mass", "inverse_dynamics"])
    evaluate, state = tape_evaluator(system), random_states(system, 3, rng)
    for term, block in (("mass", "M"), ("inverse_dynamics", "tau")):
        expected = tape_evaluator(plain)(term, state)[block]
        assert relative_error(evaluate(term, state)[block], expected) <= 1e-13
    names = [parameter.name for parameter in scene.parameters]
    values = dict(zip(names, (parameter.value for parameter in scene.parameters), strict=True))
    values |= {"tool0_mass": 1.5, "tool0_center_z": 0.07, "tool0_center_x": -0.02, "tool0_inertia_xx": 0.01}
    values |= {"tool0_inertia_yy": 0.012, "tool0_inertia_zz": 0.013, "tool0_inertia_xy": 0.001}
    values |= {"forearm_link_mass": 3.1, "forearm_link_inertia_xz": 0.002}
    state["p"] = np.broadcast_to([values[name] for name in names], (3, 20))
    model = pin.buildModelFromUrdf(str(path))
    wrist, elbow = model.getJointId("wrist_3_joint"), model.getJointId("elbow_joint")
    tool = model.frames[model.getFrameId("tool0")].placement
    tensor = np.array([[0.01, 0.001, 0.0], [0.001, 0.012, 0.0], [0.0, 0.0, 0.013]])
    model.inertias[wrist] += tool.act(pin.Inertia(1.5, np.array([-0.02, 0.0, 0.07]), tensor))
    forearm = model.inertias[elbow]
    off = np.zeros((3, 3))
    off[0, 2] = off[2, 0] = 0.002 - forearm.inertia[0, 2]
    model.inertias[elbow] = pin.Inertia(3.1, forearm.lever, forearm.inertia + off)
    motions = zip(state["q"], state["v"], state["a"], strict=True)
    expected = [pin.rnea(model, model.createData(), *each) for each in motions]
    assert relative_error(evaluate("inverse_dynamics", state)["tau"], np.array(expected)) <= 1e-8  # right angles


def test_what_is_fixed_to_a_tunable_link_is_another_body(rng: np.random.Generator) -> None:
    path = robot_file("panda_description/urdf/panda.urdf")
    scene, plain = load(path, tunable="panda_link7"), load(path)
    assert "panda_link7_others" in [body.name for body in scene.bodies]
    system, expected = derive(scene, ["mass"]), tape_evaluator(derive(plain, ["mass"]))
    state = random_states(system, 3, rng)
    assert relative_error(tape_evaluator(system)("mass", state)["M"], expected("mass", state)["M"], 2) <= 1e-13


def test_links_that_cannot_be_tuned_are_named() -> None:
    with pytest.raises(UsageError, match=r"has no link 'tol0'; try: tool0"):
        load(robot_file(UR5), tunable=["tol0"])
    with pytest.raises(UsageError, match="the link base_link is fixed to the base, so its mass"):
        load(robot_file(UR5), tunable=["base_link"])


FOUR_BAR = Path(__file__).with_name("four_bar.urdf").read_text(encoding="utf-8")


def test_a_loop_joint_is_the_constraint_that_one_would_write(rng: np.random.Generator) -> None:
    scene = load_urdf(FOUR_BAR)
    (pin_of_file,) = scene.constraints
    assert pin_of_file.type == "revolute" and (pin_of_file.first.body, pin_of_file.second.body) == ("coupler", "rocker")
    ends = [[value_of(entry, {}) for entry in frame.position] for frame in (pin_of_file.first, pin_of_file.second)]
    np.testing.assert_allclose(ends, [[0.4, 0.0, 0.0], [0.3, 0.0, 0.0]], atol=1e-15)
    assert not [note for note in scene.notes if "loop" in note]
    data = dict(URDF.read(FOUR_BAR).data)
    frames = [
        {"body": body, "position": [x, 0, 0], "axis": [0, 1, 0]} for body, x in (("coupler", 0.4), ("rocker", 0.3))
    ]
    data["constraints"] = {"pin": {"type": "revolute", "first": frames[0], "second": frames[1]}}
    by_hand = from_data(data, inertias_checked=True)
    terms = ["constraint", "constraint_velocity", "residual"]
    found, expected = derive(scene, terms), derive(by_hand, terms)
    assert found.multipliers == expected.multipliers
    state = random_states(found, 3, rng)
    state["lam"] = rng.normal(size=(3, len(found.multipliers)))
    of_file, of_hand = tape_evaluator(found), tape_evaluator(expected)
    # the frames' other axes may be chosen differently: the rows span the same
    one, two = of_file("constraint", state)["Phi"], of_hand("constraint", state)["Phi"]
    np.testing.assert_allclose(np.linalg.norm(one, axis=1), np.linalg.norm(two, axis=1), atol=1e-12)


#: The same pin as the proposed element: each end has its own axis.
PROPOSED = (
    FOUR_BAR[: FOUR_BAR.index("  <loop_joint")]
    + """  <constraint name="pin" type="revolute">
    <parent link="coupler"/><parent_origin xyz="0.4 0 0" rpy="0 0 0"/><parent_axis xyz="0 1 0"/>
    <child link="tip"/><child_origin xyz="0 0 0" rpy="0 0 0"/><child_axis xyz="1 0 0"/>
  </constraint>
</robot>"""
)


def test_ends_of_constraints_are_turned_by_quaternions() -> None:
    """Origins of version 1.1 have ``quat_xyzw`` everywhere, here a quarter turn about z; it was noted and not read."""
    turned = PROPOSED.replace('parent_origin xyz="0.4 0 0" rpy="0 0 0"', 'parent_origin xyz="0.4 0 0" rpy="0 0 {}"')
    half = "0.7071067811865476"
    by_quaternion = turned.replace('rpy="0 0 {}"', f'quat_xyzw="0 0 {half} {half}"').replace(
        "<robot ", '<robot version="1.1" ', 1
    )
    scenes = [load_urdf(text) for text in (turned.replace("{}", "1.5707963267948966"), by_quaternion)]
    assert not [note for note in scenes[1].notes if "not read" in note]
    first, second = (scene.constraints[0].frames[0].orientation for scene in scenes)
    np.testing.assert_allclose(first, second, atol=1e-15)
    both = by_quaternion.replace("quat_xyzw", 'rpy="0 0 1" quat_xyzw')
    with pytest.raises(DescriptionError, match="the origin has rpy and quat_xyzw, and only one of them can say how"):
        load_urdf(both)


@pytest.mark.slow
def test_a_loop_whose_links_lie_in_one_line_runs_from_elsewhere() -> None:
    """Rows across the plane follow from others and are left out; in the line no motion follows, as the run says."""
    model = eomgen.build(Path(__file__).with_name("flat.urdf"), profile="quick")
    assert sum("follows from the constraints before it and is left out" in note for note in model.notes) == 3
    run = model.simulate(0.1, 1e-3)
    assert not run.success
    assert "the constraints are nearly singular at t = 0 s, where branches of configurations cross" in run.message
    assert "try: a start elsewhere: the constraints do not say there in which branch the motion goes on" in run.message
    run = model.simulate(0.5, 1e-3, initial={"j_a": 0.3, "j_b": -0.3, "j_c": 0.3})
    assert run.success, run.message
    np.testing.assert_allclose(run.q[:, 0], run.q[:, 2], atol=1e-9)
    assert np.abs(model.evaluate("constraint", run.q)["Phi"]).max() <= 1e-12


def test_a_universal_constraint_keeps_its_two_axes_across_each_other(rng: np.random.Generator) -> None:
    free = PROPOSED.replace('type="revolute">', 'type="universal">')
    free = free.replace('child_axis xyz="1 0 0"', 'child_axis xyz="0 0 1"')
    free = free.replace('<axis xyz="0 1 0"/></joint>', '<axis xyz="0 1 0.3"/></joint>', 1)
    system = derive(load_urdf(free), ["constraint"])
    state = random_states(system, 5, rng)
    found = tape_evaluator(system)("constraint", state)["Phi"]
    for q, violation in zip(state["q"], found, strict=True):
        a, b, c = q
        crank = about((0, 1, 0.3), a)
        coupler, rocker = crank @ about((0, 1, 0), b), about((0, 1, 0), c)
        gap = crank @ [0.2, 0, 0] + coupler @ [0.4, 0, 0] - [0.5, 0, 0] - rocker @ [0.3, 0, 0]
        across = float((coupler @ [0.0, 1.0, 0.0]) @ (rocker @ [0.0, 0.0, 1.0]))
        assert np.linalg.norm(violation) == pytest.approx(np.hypot(np.linalg.norm(gap), across), abs=1e-9)


def about(axis: tuple[float, ...], angle: float) -> np.ndarray:
    unit = np.array(axis, dtype=float) / np.linalg.norm(axis)
    return Rotation.from_rotvec(angle * unit).as_matrix()


@pytest.mark.parametrize(
    ("whole", "old", "new", "said"),
    [
        *((FOUR_BAR, *case) for case in table("faults_of_loops")),
        *((PROPOSED, *case) for case in table("faults_of_constraints")),
    ],
)
def test_a_broken_loop_joint_or_constraint_is_named(whole: str, old: str, new: str, said: str) -> None:
    assert old in whole
    with pytest.raises(DescriptionError, match=re.escape(said)):
        load_urdf(whole.replace(old, new))


def test_names_of_numbers_that_look_like_degrees_or_mass() -> None:
    """Also by an open end of version 1.2, which is no range of more than a turn."""
    wide = robot(("a", "revolute", "foot", '<limit lower="-7" upper="1" effort="3"/>'))
    note = f"limits of more than a turn at a: angles of URDF are in radians, and 90 degrees are {np.pi / 2!r}"
    assert note in load_urdf(wide).notes
    for text in (
        wide.replace("-7", "-6"),
        wide.replace('lower="-7" ', "").replace("<robot ", '<robot version="1.2" ', 1),
    ):
        assert not [said for said in load_urdf(text).notes if "more than a turn" in said]
    turned = wide.replace('rpy="0.4 -0.3 0.2"', 'rpy="0.4 -90 0.2"')
    assert any(said.startswith("rpy of more than a turn at a: angles of URDF") for said in load_urdf(turned).notes)
    with pytest.raises(DescriptionError, match=r"the mass -1\.5 is negative"):
        load_urdf(wide.replace('mass value="1.5"', 'mass value="-1.5"'))
    for number, hint in (
        ("1.5kg", "numbers alone: the units of URDF are SI units"),
        ("1,5", "blanks between the numbers: 1 5"),
    ):
        with pytest.raises(DescriptionError, match=hint):
            load_urdf(wide.replace('mass value="1.5"', f'mass value="{number}"'))
