"""Files without inertia for some joints: kinematics, inverse dynamics and comparison work; one message for the rest."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import eomgen

_INERTIA = '<inertial><mass value="{0}"/><inertia ixx="{0}" iyy="{0}" izz="{0}" ixy="0" ixz="0" iyz="0"/></inertial>'


def chain(*masses: float, rest: str = "") -> str:
    """Return links in a row at distances of 0.3 m."""
    links = "".join(
        f'<link name="l{k}">{_INERTIA.format(mass) if mass else ""}</link>' for k, mass in enumerate((0.0, *masses))
    )
    joints = "".join(
        f'<joint name="j{k}" type="continuous"><parent link="l{k - 1}"/><child link="l{k}"/>'
        '<origin xyz="0.3 0 0"/><axis xyz="0 1 0"/></joint>'
        for k in range(1, len(masses) + 1)
    )
    return f'<robot name="r">{links}{joints}{rest}</robot>'


def test_all_light_joints_are_in_one_note(tmp_path: Path) -> None:
    file = tmp_path / "arm.urdf"
    file.write_text(chain(0.0, 0.0, 0.0, 0.0), encoding="utf-8")
    scene = eomgen.load(file)
    (note,) = (note for note in scene.notes if "inertia" in note and "try" in note)
    assert note.startswith("no inertia resists j1 (body l1), j2 (body l2), j3 (body l3), j4 (body l4): no body beyond")
    assert "try: mass or inertia there, lock=['j1', 'j2', 'j3', 'j4']" in note
    model = eomgen.build(scene, terms=["poses"], profile="instant")
    angles = np.array([0.3, -0.2, 0.4, 0.1])
    turned = np.cumsum(np.concatenate([[0.0], angles]))[:4]
    place = 0.3 * np.array([np.sum(np.cos(turned)), 0.0, -np.sum(np.sin(turned))])
    np.testing.assert_allclose(model.pose("l4", angles)[4:], place, atol=1e-14)
    assert eomgen.compare(file, file).equal
    with pytest.raises(eomgen.ModelError, match=re.escape(note.partition("; try")[0])):
        eomgen.build(scene, terms=["forward_dynamics"], profile="instant")


@pytest.mark.slow
def test_inverse_dynamics_needs_no_inertia_of_the_last_links(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(chain(1.0, 0.0, 0.0), encoding="utf-8")
    (tmp_path / "one.urdf").write_text(chain(1.0), encoding="utf-8")
    scene = eomgen.load(tmp_path / "arm.urdf")
    assert any(note.startswith("no inertia resists j2 (body l2), j3 (body l3): ") for note in scene.notes)
    model = eomgen.build(scene, terms=["inverse_dynamics"], profile="instant")
    alone = eomgen.build(eomgen.load(tmp_path / "one.urdf"), terms=["inverse_dynamics"], profile="instant")
    q, v, a = np.array([0.3, 0.1, 0.2]), np.array([0.5, 1.0, 2.0]), np.array([0.1, 0.2, 0.3])
    tau = model.inverse_dynamics(q, v, a)
    np.testing.assert_allclose(tau, [alone.inverse_dynamics(q[:1], v[:1], a[:1])[0], 0.0, 0.0], rtol=1e-14)
    locked = eomgen.load(tmp_path / "arm.urdf", lock=["j2", "j3"])
    assert not any(note.startswith("no inertia resists") for note in locked.notes)
    assert eomgen.build(locked, profile="instant").forward_dynamics([0.3], [0.0]).shape == (1,)


def test_leaders_of_light_joints_are_named(tmp_path: Path) -> None:
    text = chain(1.0, 0.0, 0.0).replace(
        'name="j3" type="continuous">', 'name="j3" type="continuous"><mimic joint="j2"/>'
    )
    (tmp_path / "arm.urdf").write_text(text, encoding="utf-8")
    assert any(
        note.startswith("no inertia resists j2 (body l2): ") for note in eomgen.load(tmp_path / "arm.urdf").notes
    )


_LOOP = (
    '<loop_joint name="loop" type="{}"><link1 link="l1" xyz="{}"/><link2 link="l3"/><axis xyz="0 1 0"/></loop_joint>'
)


@pytest.mark.parametrize(
    ("kind", "place"),
    [
        ("revolute", "0.6 0 0"),
        ("spherical", "0.6 0 0"),
        ("fixed", "0.6 0 0"),
        ("prismatic", "0.6 0.2 0"),
        ("planar", "0.5 0 0.1"),
    ],
)
def test_a_loop_within_one_body_is_left_out_if_it_is_met(kind: str, place: str, tmp_path: Path) -> None:
    file = tmp_path / "loop.urdf"
    file.write_text(chain(1.0, 1.0, 1.0, rest=_LOOP.format(kind, place)), encoding="utf-8")
    scene = eomgen.load(file, lock=["j2", "j3"])
    assert not scene.constraints
    assert "the loop loop is left out: held joints make one body of its ends, which meet" in scene.notes
    file.write_text(chain(1.0, 1.0, 1.0, rest=_LOOP.format(kind, "0.6 0.1 0.1")), encoding="utf-8")
    if kind != "planar":
        with pytest.raises(eomgen.DescriptionError, match=r"held joints make one body of the ends of loop, with a"):
            eomgen.load(file, lock=["j2", "j3"])


def test_a_world_that_joints_name_need_not_be_a_link(tmp_path: Path) -> None:
    text = f'<robot name="r"><link name="pole">{_INERTIA.format(1.0)}</link><joint name="pin" type="continuous">'
    text += '<parent link="world"/><child link="pole"/></joint></robot>'
    (tmp_path / "pole.urdf").write_text(text, encoding="utf-8")
    scene = eomgen.load(tmp_path / "pole.urdf")
    assert [(joint.name, joint.parent) for joint in scene.joints] == [("pin", "base")]
    assert "joints name the link world, which the file lacks: it is a link without mass" in scene.notes


def test_joints_of_drake_are_read(tmp_path: Path) -> None:
    joint = '<drake:joint name="{0}" type="{1}"><parent link="{2}"/><child link="{0}l"/>{3}</drake:joint>'
    rows = (
        ("b", "ball", "g", ""),
        ("u", "universal", "bl", ""),
        ("s", "screw", "ul", '<axis xyz="0 1 0"/><drake:screw_thread_pitch value="0.1"/>'),
        ("p", "planar", "sl", '<axis xyz="0 0 1"/>'),
    )
    links = "".join(f'<link name="{row[0]}l">{_INERTIA.format(1.0)}</link>' for row in rows)
    text = f'<robot name="r"><link name="g"/>{links}{"".join(joint.format(*row) for row in rows)}</robot>'
    (tmp_path / "a.urdf").write_text(text, encoding="utf-8")
    joints = {item.name: item for item in eomgen.load(tmp_path / "a.urdf").joints}
    assert {name: item.type for name, item in joints.items()} == {
        "b": "spherical",
        "u": "universal",
        "s": "helical",
        "p": "planar",
    }
    assert (joints["u"].axis, joints["u"].second_axis) == ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    assert getattr(joints["s"].pitch, "value", None) == pytest.approx(0.1 / (2.0 * np.pi))
