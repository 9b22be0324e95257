"""MuJoCo's and Pinocchio's readings of one file are one machine, with the same equations at random states."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from eomgen.errors import DescriptionError
from eomgen.products.comparison.differences import Pairing, differences
from eomgen.products.comparison.machine import Machine
from eomgen.products.comparison.other_readers import read_mujoco, read_pinocchio
from eomgen.products.comparison.states import errors_of, motions

pytest.importorskip("mujoco")
pytest.importorskip("pinocchio")
ARM = Path(__file__).with_name("arm.urdf").read_text(encoding="utf-8")
#: The arm on a free body, without the frame at rest.
FLYING = ARM.replace(
    '<link name="base_link"/>',
    """<link name="world"/><link name="base_link"><inertial><origin xyz="0.1 0.2 0"/><mass value="4"/>
    <inertia ixx="0.3" ixy="0.01" ixz="0" iyy="0.4" iyz="0.02" izz="0.5"/></inertial></link>
    <joint name="fly" type="floating"><parent link="world"/><child link="base_link"/></joint>""",
)


def both(text: str, folder: Path) -> tuple[Machine, Machine]:
    (folder / "arm.urdf").write_text(text, encoding="utf-8")
    return read_mujoco(folder / "arm.urdf"), read_pinocchio(folder / "arm.urdf")


@pytest.mark.parametrize("text", [ARM, FLYING], ids=["fixed", "free"])
def test_two_programs_read_the_same_machine(text: str, tmp_path: Path) -> None:
    first, second = both(text, tmp_path)
    pairing = Pairing(first, second, 1e-9)
    assert differences(pairing) == []
    assert [link.type for link in first.links][-3:] == ["revolute", "revolute", "prismatic"]
    mine, theirs = motions(pairing, 4, np.random.default_rng(2))
    errors, _ = errors_of(pairing, first.forces(mine), second.forces(theirs))
    assert max(errors.values()) < 1e-12


SPRINGS = """<mujoco><compiler angle="radian"/><worldbody><body name="a" pos="0 0 1">
  <joint name="h" axis="0 0.6 0.8" pos="0.1 0 0" ref="0.3" stiffness="5" springref="0.2" damping="0.4" armature="0.01"/>
  <inertial pos="0.1 0 0.2" mass="2" diaginertia="0.1 0.2 0.25"/>
  <body name="b" pos="0.5 0 0" euler="0.1 0.2 0.3"><joint type="slide" axis="1 0 0" ref="0.4" pos="0 0.3 0"/>
    <inertial pos="0 0.1 0" mass="1" diaginertia="0.02 0.03 0.04"/></body></body></worldbody></mujoco>"""


def test_places_of_mujoco_s_joints_are_at_zero_coordinates(tmp_path: Path) -> None:
    """MuJoCo's own kinematics at qpos = 0, which is off the reference of the file."""
    mujoco = pytest.importorskip("mujoco")
    (tmp_path / "a.xml").write_text(SPRINGS, encoding="utf-8")
    machine = read_mujoco(tmp_path / "a.xml")
    model = mujoco.MjModel.from_xml_string(SPRINGS)
    data = mujoco.MjData(model)
    data.qpos[:] = 0.0
    mujoco.mj_kinematics(model, data)
    frames = [machine.links[0].pose]
    frames.append(frames[0].then(machine.links[1].pose))
    for number, (frame, link) in enumerate(zip(frames, machine.links, strict=True)):
        name = link.body
        place = frame.then(link.bodies[name].place)
        np.testing.assert_allclose(place.origin, data.body(name).xpos, atol=1e-14)
        np.testing.assert_allclose(place.axes, data.body(name).xmat.reshape(3, 3), atol=1e-14)
        np.testing.assert_allclose(frame.axes @ link.axis, data.xaxis[number], atol=1e-14)
    np.testing.assert_allclose(frames[0].origin, data.xanchor[0], atol=1e-14)  # on the axis, where the joint turns
    assert machine.links[0].joint == "h" and machine.links[1].joint == "b_joint0"
    assert machine.links[0].numbers == {"stiffness": 5.0, "damping": 0.4, "rest": 0.2, "rotor_inertia": 0.01}
    assert machine.links[1].numbers["rest"] == 0.0


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (ARM.replace('"prismatic"', '"planar"'), "Pinocchio's JointModelPlanar has coordinates of another kind"),
        ("<robot", "Pinocchio does not read the file"),
    ],
)
def test_files_that_pinocchio_reads_in_another_way_are_refused(text: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(text, encoding="utf-8")
    with pytest.raises(DescriptionError, match=said):
        read_pinocchio(tmp_path / "arm.urdf")
    if text == "<robot":
        with pytest.raises(DescriptionError, match="MuJoCo does not read the file"):
            read_mujoco(tmp_path / "arm.urdf")
