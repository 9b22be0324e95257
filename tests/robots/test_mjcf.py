"""MJCF: M and all forces as MuJoCo has them at random states, exact constraints, and a word on everything left out."""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path

import mujoco
import numpy as np
import pytest

import eomgen
from eomgen.pipeline.pipeline import derive
from eomgen.scene.load import load
from tests.oracles.evaluation import tape_evaluator
from tests.oracles.mjcf_oracle import Imported

TOLERANCE = 1e-12


def arm(
    *,
    first: str = "",
    second: str = 'axis="0 1 0"',
    body: str = "",
    beside: str = "",
    free: str = '<freejoint name="free"/>',
    rest: str = "",
    option: str = "",
) -> str:
    """Return two links on hinges ``a`` and ``b``, with an anchor beside the origin, and a free ball ``f``."""
    return f"""<mujoco model="arm">
  {option}
  <worldbody>
    <body name="upper" pos="0 0 1" euler="10 20 30">
      <joint name="a" axis="0 1 0.2" {first}/>
      <geom type="capsule" fromto="0 0 0 0.5 0 0" size="0.05"/>
      {beside}<body name="lower" pos="0.5 0 0" {body}>
        <joint name="b" pos="0.01 0 0.02" {second}/>
        <geom type="box" size="0.1 0.02 0.03" pos="0.1 0 0"/>
        <body name="tip" pos="0.3 0 0" quat="1 1 0 0"><geom size="0.04" pos="0 0.01 0"/>
          <site name="s" pos="0 0.1 0" euler="10 20 30"/></body>
      </body>
    </body>
    <body name="f" pos="1 1 1" quat="0.6 0 0.8 0">{free}<geom size="0.1" pos="0.01 0.02 0"/>
      <site name="c" pos="0.2 0 0.1"/></body>
  </worldbody>
  {rest}
</mujoco>"""


def actuators(text: str) -> str:
    return f"<actuator>{text}</actuator>"


HERE = Path(__file__).parent
SENSORS = (HERE / "sensors.txt").read_text(encoding="utf-8")
#: Additions to the arm: forces of all kinds.
ADDITIONS = tomllib.loads((HERE / "forces_of_mjcf.toml").read_text(encoding="utf-8"))
CASES = {name: arm(**additions) for name, additions in ADDITIONS.items()}
_PATH = ADDITIONS["spatial tendon"]["rest"].partition("<actuator>")[0].replace("\n", "")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "model.xml"


#: Cases whose forces ``test_mjcf_parts`` compares without a derivation.
_LONGER = (
    *("site against site", "sites on one chain", "slider and crank", "ellipsoids in a medium", "servos of balls"),
    *("motors", "servos", "activations", "unclamped", "ball motor", "limited sum", "medium", "pid", "dcmotor"),
)


@pytest.mark.long_except_every(3)
@pytest.mark.long_cases("muscle", "site against site")
@pytest.mark.slow_except(*(name for name in CASES if name not in _LONGER))
@pytest.mark.parametrize("name", CASES)
def test_mass_and_forces_are_mujoco_s(name: str, file: Path) -> None:
    file.write_text(CASES[name], encoding="utf-8")
    mass, forces = Imported.of(file).errors()
    assert mass < TOLERANCE
    assert forces < TOLERANCE


MOCAP = """<mujoco><option><flag contact="disable"/></option><worldbody>
  <body name="target" mocap="true" pos="0.3 0.1 1" euler="10 20 30"><geom size="0.1"/><site name="eye" pos="0.1 0 0"/>
    <body pos="0 0 0.2"><joint name="p" axis="1 0 0"/><geom size="0.1" pos="0 0.1 0"/></body></body>
  <body name="arm" pos="0 0 2"><joint name="a" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0.5 0 0" size="0.05"/>
    <site name="s" pos="0.5 0 0"/></body></worldbody>
  <tendon><spatial stiffness="30"><site site="eye"/><site site="s"/></spatial></tendon>
  <keyframe><key name="up" mpos="0.4 0 1.5" mquat="0.6 0 0.8 0"/></keyframe></mujoco>"""


def test_motions_from_outside_move_mocap_bodies(file: Path) -> None:
    file.write_text(MOCAP, encoding="utf-8")
    assert any("mocap=True moves it" in note for note in load(file).notes)
    scene = load(file, mocap=True, keyframe="up")
    assert not any("not modelled" in note for note in scene.notes)
    system = derive(scene, ["mass", "residual", "constraint"])
    q = np.array([0.4, 0.0, 1.5, 0.0, 0.0, 0.0, 0.7, -0.4])
    v = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.3, -1.1])
    model = mujoco.MjModel.from_xml_string(MOCAP)
    data = mujoco.MjData(model)
    for turn, quaternion in ((0.0, [1, 0, 0, 0]), (0.5, [np.cos(0.25), 0, np.sin(0.25), 0])):
        q[4] = turn
        data.mocap_pos[0], data.mocap_quat[0], data.qpos[:], data.qvel[:] = q[:3], quaternion, q[6:], v[6:]
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        M = np.zeros((2, 2))
        mujoco.mj_fullM(model, data, M)
        given = {"q": q, "v": v, "a": np.zeros(8), "lam": np.zeros(6), "t": np.zeros(1)}
        own, r = (tape_evaluator(system)(term, given)[key] for term, key in (("mass", "M"), ("residual", "r")))
        np.testing.assert_allclose(own.reshape(8, 8)[6:, 6:], M, rtol=1e-12)
        np.testing.assert_allclose(r.ravel()[6:8], data.qfrc_bias - data.qfrc_passive, rtol=1e-12, atol=1e-12)
    # the keyframe's pose is where the drives begin
    values = np.array([symbol.value for symbol in system.parameters])
    q[3:6] = np.pi, np.pi - 2.0 * np.arctan2(0.8, 0.6), np.pi
    Phi = tape_evaluator(system)("constraint", {**given, "q": q, "p": values})["Phi"].ravel()
    np.testing.assert_allclose(Phi, 0.0, atol=1e-12)


def test_sensors_are_outputs_with_mujoco_s_values(file: Path) -> None:
    acts = '<motor name="m" tendon="r" gear="2"/><position name="n" joint="a" kp="3"/>'
    body = '><site name="p" pos="0.1 0.1 0.05"/><geom name="o" size="0.06"/><site name="away" pos="0 0 0.3"/'
    body += '><site name="s_x"/'
    file.write_text(arm(body=body, rest=_PATH + actuators(acts) + SENSORS), encoding="utf-8")
    imported = Imported.of(file, terms=("outputs",))
    sensors = imported.sensors()
    assert len(sensors) == 21
    for name, (values, theirs) in sensors.items():
        np.testing.assert_allclose(values, theirs, rtol=1e-12, atol=1e-12, err_msg=name)
    assert any(note.startswith("not modelled: sensors (2: absent, late)") for note in imported.scene.notes)


def test_a_path_through_a_ring_is_mujoco_s_to_its_tolerance(file: Path) -> None:
    # MuJoCo ends the search for the point of contact at 1e-6 rad; the lengths of its path are exact to second order.
    ring = CASES["spatial tendon"].replace('name="away" pos="0 0 0.3"', 'name="away" pos="0 0 0.001"')
    file.write_text(ring, encoding="utf-8")
    imported = Imported.of(file)
    assert any(wrap.inside for tendon in imported.scene.tendons for wrap in tendon.wraps)
    mass, forces = imported.errors()
    assert mass < TOLERANCE
    assert forces < 1e-6


@pytest.mark.parametrize(
    "equality",
    [
        '<connect body1="rod" body2="rocker" anchor="0.5 0 0"/>',
        '<connect site1="end" site2="top"/>',
        '<weld body1="rod" body2="rocker" anchor="0 0 0.3"/>',
        '<weld site1="end" site2="top"/>',
        '<joint joint1="a" joint2="c" polycoef="0.1 2 0.3 0 0.1"/>',
        '<joint joint1="c" polycoef="0.2 0 0 0 0"/>',
    ],
)
def test_equalities_allow_the_same_velocities(equality: str, file: Path) -> None:
    file.write_text((HERE / "loop.txt").read_text(encoding="utf-8").format(equality), encoding="utf-8")
    imported = Imported.of(file, terms=("constraint", "constraint_jacobian"))
    rows, violation = imported.constraints(np.array([0.0, 0.0, np.radians(10.0)]))
    mujoco.mj_fwdPosition(imported.model, imported.data)
    theirs = imported.data.efc_J.reshape(-1, imported.model.nv)
    assert np.linalg.matrix_rank(rows, 1e-9) == np.linalg.matrix_rank(theirs, 1e-9) > 0
    assert np.linalg.matrix_rank(np.vstack([rows, theirs]), 1e-9) == np.linalg.matrix_rank(rows, 1e-9)
    np.testing.assert_allclose(np.linalg.norm(violation), np.linalg.norm(imported.data.efc_pos), atol=1e-12)


@pytest.mark.long
def test_a_loop_stays_closed_for_many_steps() -> None:
    """A leg like Cassie's: a rod on a ball joint closes the loop of thigh, shin and tarsus."""
    model = eomgen.build(HERE / "leg.xml", method="generalized_alpha")
    run = model.simulate(100.0, 1e-3, method="generalized_alpha", record_every=97, error_estimate=False)
    assert run.success and run.stats["steps"] == 100_000
    given = {"q": run.q, "parameters": None, "t": run.t, "base": None}
    assert np.max(np.abs(model.evaluator.call("constraint", **given)[0])) < 1e-12
    assert np.all(np.ptp(run.q[:, :4], axis=0) > 0.05)  # the leg swings all the time


def test_names_frames_and_notes(file: Path) -> None:
    file.write_text(
        arm(
            first='range="-90 90" frictionloss="0.2"',
            rest='<keyframe><key name="bent" qpos="0.5 -1 1 2 3 1 0 0 0" qvel="1 2 3 4 5 0 0 0"/></keyframe>',
        ).replace('name="tip"', 'name="tip-1"'),
        encoding="utf-8",
    )
    scene = load(file)
    assert [body.name for body in scene.bodies] == ["upper", "lower_b", "lower", "f"]
    assert [joint.name for joint in scene.joints] == ["a", "b", "lower_fixed", "free"]
    assert [frame.name for frame in scene.frames] == ["tip_1", "s", "c"]
    assert scene.notes == (
        "the start is the configuration of the file; keyframe=... is one of bent",
        "body 'tip-1' of the file is called tip_1",
        "links merged into the bodies that carry them, as frames: tip_1",
        "not modelled: contact (4 geoms)",
        "not modelled: dry friction (1: a)",
        "not modelled: limits of position (1: a)",
    )
    assert scene.joints[0].initial_position == (0.0,)
    bent = load(file, keyframe="bent", limits=True, friction=True)
    assert [note for note in bent.notes if "not modelled" in note] == ["not modelled: contact (4 geoms)"]
    assert bent.joints[0].initial_position == (0.5,)
    assert bent.joints[3].initial_position == (1.0, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0)
    assert bent.joints[3].initial_velocity == (0.0, 0.0, 0.0, 3.0, 4.0, 5.0)
    assert bent.joints[0].stops
    with pytest.raises(eomgen.UsageError, match=r"model\.xml has no keyframe 'bend'; try: bent"):
        load(file, keyframe="bend")
    with pytest.raises(
        eomgen.DescriptionError, match=r"model\.xml:6: not modelled: contact \(4 geoms\); try: no --strict"
    ):
        load(file, strict=True)


def test_the_outermost_element_decides(file: Path) -> None:
    file.write_text("<?xml version='1.0'?>\n<!-- a > b -->\n" + arm(), encoding="utf-8")
    assert load(file).name == "arm"
    file.write_text('<!-- <mujoco> -->\n<robot name="r"><link name="a"/></robot>', encoding="utf-8")
    with pytest.raises(eomgen.DescriptionError, match="no joint can move"):
        load(file)


def test_included_files_and_meshes_are_looked_for_beside_the_file(tmp_path: Path) -> None:
    (tmp_path / "part.xml").write_text(
        '<mujoco>\n<worldbody>\n<body name="p"><joint name="j" type="ball" stiffness="1 2"/><geom size="1"/></body>'
        "</worldbody></mujoco>",
        encoding="utf-8",
    )
    (tmp_path / "whole.xml").write_text('<mujoco><include file="part.xml"/></mujoco>', encoding="utf-8")
    with pytest.raises(eomgen.DescriptionError, match=r"part\.xml:3 \(joints\.j\): a ball joint with stiffness"):
        load(tmp_path / "whole.xml")


def test_pictures_show_the_geoms_that_mujoco_shows() -> None:
    scene = load(HERE / "geoms.xml")
    shapes = {shape.kind: shape for shape in scene.shapes if shape.body == "a"}
    sizes = {kind: [size.value for size in shape.sizes] for kind, shape in shapes.items()}
    np.testing.assert_allclose(sizes["capsule"], [0.05, 0.5])
    np.testing.assert_allclose(sizes["box"], [0.2, 0.08, 0.12])
    np.testing.assert_allclose(sizes["cylinder"], [0.06, 0.2])
    np.testing.assert_allclose(sizes["ellipsoid"], [0.05, 0.1, 0.2])
    assert sizes["sphere"] == [0.05] and [part.value for part in shapes["sphere"].position] == [1.0, 2.0, 3.0]
    assert shapes["capsule"].color == "#ff0000" and shapes["ellipsoid"].color == "#0000ff"
    # MuJoCo moves the frame of a mesh to its axes of inertia; here the file is at its own place
    np.testing.assert_allclose([part.value for part in shapes["mesh"].position], [0.0, 0.0, -0.5], atol=1e-9)
    np.testing.assert_allclose(np.array(shapes["mesh"].axes)[2, 2], np.cos(np.radians(10.0)), atol=1e-9)
    assert sizes["mesh"] == [0.5, 0.5, 2.0]
    (ground,) = [shape for shape in scene.shapes if shape.body == "base"]
    assert ground.kind == "box" and ground.opacity == 0.6
    assert ground.sizes[0].value < 20.0  # a plane without end ends near the machine


def test_tendons_of_an_included_file_keep_their_lengths(tmp_path: Path) -> None:
    (tmp_path / "arm.xml").write_text(CASES["muscle"], encoding="utf-8")
    text = 'format = 1\nname = "two"\n[include.left]\nfile = "arm.xml"\n[outputs]\nlength = { formula = "LENGTH" }\n'
    (tmp_path / "scene.toml").write_text(text.replace("LENGTH", "left_length_of_r"), encoding="utf-8")
    scene = load(tmp_path / "scene.toml")
    assert [tendon.name for tendon in scene.tendons] == ["left_r_branch_1", "left_r_branch_2", "left_r_branch_3"]
    alone = load(tmp_path / "arm.xml")
    for tendon, own in zip(scene.tendons, alone.tendons, strict=True):
        assert tendon.points == tuple(f"left_{point}" for point in own.points)
        assert [wrap.side for wrap in tendon.wraps] == [wrap.side and f"left_{wrap.side}" for wrap in own.wraps]
        assert [wrap.frame.body for wrap in tendon.wraps] == [f"left_{wrap.frame.body}" for wrap in own.wraps]


def test_without_mujoco_the_remedy_is_the_extra(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file.write_text(arm(), encoding="utf-8")
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(eomgen.UsageError, match=r"mujoco is not installed; try: pip install 'eomgen\[mujoco\]'"):
        load(file)
