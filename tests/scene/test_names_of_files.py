"""Legal names stay with their elements in the scene, in any order of the file; others give way."""

from __future__ import annotations

from pathlib import Path

import pytest

import eomgen
from eomgen.base.messages import legal_names

_INERTIA = '<inertial><mass value="{}"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
_MASSES = {"arm-1": 1.0, "arm_1": 2.0}


def urdf(first: str, second: str) -> str:
    links = "".join(f'<link name="{name}">{_INERTIA.format(_MASSES[name])}</link>' for name in (first, second))
    joints = (
        f'<joint name="{child}" type="continuous"><parent link="{parent}"/><child link="{child}"/></joint>'
        for parent, child in (("g", first), (first, second))
    )
    return f'<robot name="r"><link name="g"/>{links}{"".join(joints)}</robot>'


def mjcf(first: str, second: str) -> str:
    inertial = '<inertial pos="0 0 1" mass="{}" diaginertia="1 1 1"/>'
    one, other = (
        f'<body name="{name}"><joint name="{name}" axis="0 1 0"/>{inertial.format(_MASSES[name])}'
        for name in (first, second)
    )
    return f"<mujoco><worldbody>{one}{other}</body></body></worldbody></mujoco>"


def sdf(first: str, second: str) -> str:
    links = "".join(
        f'<link name="{name}l"><inertial><mass>{_MASSES[name]}</mass></inertial></link>' for name in (first, second)
    )
    joints = (
        f'<joint name="{name}" type="revolute"><parent>{parent}</parent><child>{name}l</child>'
        "<axis><xyz>0 0 1</xyz></axis></joint>"
        for parent, name in (("world", first), (f"{first}l", second))
    )
    return f'<sdf version="1.9"><model name="m">{links}{"".join(joints)}</model></sdf>'


@pytest.mark.parametrize("order", [("arm-1", "arm_1"), ("arm_1", "arm-1")])
@pytest.mark.parametrize(("ending", "text"), [(".urdf", urdf), (".xml", mjcf), (".sdf", sdf)])
def test_legal_names_stay(ending: str, text: object, order: tuple[str, str], tmp_path: Path) -> None:
    assert callable(text)
    file = tmp_path / f"a{ending}"
    file.write_text(text(*order), encoding="utf-8")
    scene = eomgen.load(file)
    masses = {body.name: getattr(body.mass, "value", None) for body in scene.bodies}
    carried = {joint.name: masses[joint.child] for joint in scene.joints}
    assert carried == {"arm_1": 2.0, "arm_1_2": 1.0}


def test_names_are_made_legal_after_the_legal_ones() -> None:
    assert legal_names(["a-b", "a_b", "a.b", "a_b_2"]) == {
        "a-b": "a_b_3",
        "a_b": "a_b",
        "a.b": "a_b_4",
        "a_b_2": "a_b_2",
    }


@pytest.mark.parametrize("order", [("arm-1", "arm_1"), ("arm_1", "arm-1")])
def test_compare_names_joints_alike_in_other_readers(order: tuple[str, str], tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    (tmp_path / "a.urdf").write_text(urdf(*order), encoding="utf-8")
    assert eomgen.compare(tmp_path / "a.urdf", reader="mujoco").equal


def test_joined_names_leave_the_names_of_the_file(tmp_path: Path) -> None:
    link = '<link name="{}"><inertial><mass>{}</mass></inertial></link>'
    hand = f'<model name="arm">{link.format("hand", 1)}</model>'
    text = f'<sdf version="1.9"><model name="m">{hand}{link.format("arm__hand", 2)}</model></sdf>'
    (tmp_path / "a.sdf").write_text(text, encoding="utf-8")
    masses = {body.name: getattr(body.mass, "value", None) for body in eomgen.load(tmp_path / "a.sdf").bodies}
    assert masses == {"arm__hand": 2.0, "arm__hand_2": 1.0}
