"""Forty differences between descriptions of one machine, planted one by one: each is named first, with its cause."""

from __future__ import annotations

import math
from pathlib import Path
from typing import NamedTuple

import pytest

import eomgen

URDF = """<?xml version="1.0"?>
<robot name="arm">
  <link name="base_link"/>
  <link name="upper">
    <inertial><origin xyz="0.02 0 0.25" rpy="0 0 0"/><mass value="3"/>
      <inertia ixx="0.08" ixy="0.003" ixz="0.001" iyy="0.07" iyz="-0.002" izz="0.03"/></inertial>
  </link>
  <link name="lower">
    <inertial><origin xyz="0 0.01 0.2" rpy="0.3 0.2 0.1"/><mass value="2"/>
      <inertia ixx="0.04" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.014"/></inertial>
  </link>
  <link name="slide">
    <inertial><origin xyz="0 0 0.05"/><mass value="0.5"/>
      <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.002" iyz="0" izz="0.0012"/></inertial>
  </link>
  <joint name="shoulder" type="revolute"><parent link="base_link"/><child link="upper"/>
    <origin xyz="0 0 0.3" rpy="0.1 0 0.2"/><axis xyz="0 1 0"/>
    <limit lower="-1.2" upper="1.5" effort="50" velocity="3"/><dynamics damping="0.7" friction="0.2"/></joint>
  <joint name="elbow" type="continuous"><parent link="upper"/><child link="lower"/>
    <origin xyz="0.05 0 0.5" rpy="0.2 -0.4 0.3"/><axis xyz="0.6 0.8 0"/><dynamics damping="0.3"/></joint>
  <joint name="wrist" type="prismatic"><parent link="lower"/><child link="slide"/>
    <origin xyz="0 0.02 0.4" rpy="0 0.1 0"/><axis xyz="0 0 1"/>
    <limit lower="-0.1" upper="0.2" effort="80" velocity="1"/><dynamics damping="4"/></joint>
</robot>
"""

#: The same arm, as ``mj_saveLastXML`` of MuJoCo 4.0 writes it, with 12 digits in place of 6.
MJCF = """<mujoco model="arm">
  <compiler angle="radian"/>
  <worldbody>
    <body name="upper" pos="0 0 0.3" euler="0.1 0 0">
      <inertial pos="0.02 0 0.25" mass="3" fullinertia="0.08 0.07 0.03 0.003 0.001 -0.002"/>
      <joint name="shoulder" range="-1.2 1.5" damping="0.7" frictionloss="0.2" axis="0 1 0"/>
      <body name="lower" pos="0.05 0 0.5">
        <inertial pos="0 0.01 0.2" mass="2" diaginertia="0.04 0.03 0.014"/>
        <joint name="elbow" damping="0.3" axis="0.6 0.8 0" armature="0.01" stiffness="5" springref="0.2"/>
        <body name="slide" pos="0 0.02 0.4" euler="0 0.1 0">
          <inertial pos="0 0 0.05" mass="0.5" diaginertia="0.001 0.002 0.0012"/>
          <joint name="wrist" type="slide" range="-0.1 0.2" damping="4"/>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""

SCENE = """format = 1
name = "four_bar"
[parameters]
arm = 0.4
[bodies.crank]
mass = 1.0
center_of_mass = [0.1, 0, 0]
inertia = [0.001, 0.002, 0.002]
[bodies.coupler]
mass = 2.0
center_of_mass = [0.2, 0, 0]
inertia = [0.002, 0.04, 0.04]
[bodies.rocker]
mass = 1.5
center_of_mass = [0.15, 0, 0]
inertia = [0.001, 0.01, 0.01]
[joints.drive]
type = "revolute"
parent = "base"
child = "crank"
axis = [0, 1, 0]
damping = 0.1
[joints.pin]
type = "revolute"
parent = "crank"
child = "coupler"
axis = [0, 1, 0]
position = [0.2, 0, 0]
initial.position = -1.2
[joints.support]
type = "revolute"
parent = "base"
child = "rocker"
axis = [0, 1, 0]
position = [0.5, 0, 0]
initial.position = -1.6
[constraints.closure]
type = "revolute"
first = { body = "coupler", position = ["arm", 0, 0], axis = [0, 1, 0] }
second = { body = "rocker", position = [0.3, 0, 0], axis = [0, 1, 0] }
[points.tip]
body = "coupler"
position = [0.2, 0, 0.05]
[points.hook]
body = "base"
position = [0.1, 0, 0.5]
[springs.return]
first = "tip"
second = "hook"
stiffness = 200
damping = 5
length = 0.3
[efforts.motor]
joint = "drive"
effort = "2 * sin(3 * t) - 0.5 * v.drive"
"""

DEGREES = 180.0 / math.pi


class Planted(NamedTuple):
    """One change of a description: text and new text, and the expected answer."""

    old: str
    new: str
    element: str
    quantity: str
    cause: str = ""


OF_URDF = (
    Planted('<mass value="3"/>', '<mass value="3000"/>', "bodies.upper", "mass", "grams against kilograms"),
    Planted('<mass value="2"/>', '<mass value="19.62"/>', "bodies.lower", "mass", "a weight against a mass"),
    Planted('<mass value="0.5"/>', '<mass value="0.51"/>', "bodies.slide", "mass"),
    Planted('xyz="0.02 0 0.25"', 'xyz="0.02 0 -0.25"', "bodies.upper", "center_of_mass", "opposite sign of z"),
    Planted('xyz="0 0.01 0.2"', 'xyz="0.2 0.01 0"', "bodies.lower", "center_of_mass", "in a different order"),
    Planted('xyz="0 0 0.05"', 'xyz="0 0 50"', "bodies.slide", "center_of_mass", "millimetres against metres"),
    Planted('ixy="0.003" ixz="0.001" iyy="0.07" iyz="-0.002"', 'ixy="-0.003" ixz="-0.001" iyy="0.07" iyz="0.002"',
            "bodies.upper", "inertia", "products of inertia with the opposite sign"),
    Planted('ixy="0.003" ixz="0.001" iyy="0.07" iyz="-0.002"', 'ixy="0" ixz="0" iyy="0.07" iyz="0"',
            "bodies.upper", "inertia", "missing products of inertia in the second"),
    Planted('rpy="0.3 0.2 0.1"', 'rpy="0 0 0"', "bodies.lower", "inertia", "inertia given in another frame"),
    Planted('ixx="0.04" ixy="0" ixz="0" iyy="0.03"', 'ixx="0.03" ixy="0" ixz="0" iyy="0.04"',
            "bodies.lower", "inertia", "another frame"),
    Planted('ixx="0.08" ixy="0.003" ixz="0.001" iyy="0.07" iyz="-0.002" izz="0.03"',
            'ixx="0.2675" ixy="0.003" ixz="-0.014" iyy="0.2587" iyz="-0.002" izz="0.0312"',
            "bodies.upper", "inertia", "about the origin of the frame"),
    Planted('ixx="0.001" ixy="0" ixz="0" iyy="0.002" iyz="0" izz="0.0012"',
            'ixx="1000" ixy="0" ixz="0" iyy="2000" iyz="0" izz="1200"', "bodies.slide", "inertia", "square"),
    Planted('<axis xyz="0 1 0"/>', '<axis xyz="0 -1 0"/>', "joints.shoulder", "axis", "opposite axis"),
    Planted('<axis xyz="0 1 0"/>', '<axis xyz="0 0 1"/>', "joints.shoulder", "axis", "in a different order"),
    Planted('<axis xyz="0.6 0.8 0"/>', '<axis xyz="0.8 0.6 0"/>', "joints.elbow", "axis", "different order"),
    Planted('<axis xyz="0 0 1"/>', '<axis xyz="0.09983341664682815 0 0.9950041652780258"/>',
            "joints.wrist", "axis", "axis given in another frame"),
    Planted('xyz="0.05 0 0.5" rpy="0.2 -0.4 0.3"', 'xyz="0.05 0 0.6" rpy="0.2 -0.4 0.3"', "joints.elbow", "position"),
    Planted('xyz="0 0.02 0.4" rpy="0 0.1 0"', 'xyz="0 20 400" rpy="0 0.1 0"', "joints.wrist", "position",
            "millimetres against metres"),
    Planted('rpy="0.1 0 0.2"', 'rpy="5.729577951308232 0 11.459155902616464"', "joints.shoulder", "orientation",
            "degrees against radians"),
    Planted('rpy="0.2 -0.4 0.3"', 'rpy="0 0 0"', "joints.elbow", "orientation", "missing rotation in the second"),
    Planted('rpy="0.2 -0.4 0.3"', 'rpy="-0.2 0.4 -0.3"', "joints.elbow", "orientation", "angles of opposite sign"),
    Planted('damping="0.7"', 'damping="0.0122173"', "joints.shoulder", "damping", "degrees against radians"),
    Planted('<dynamics damping="0.3"/>', "", "joints.elbow", "damping", "missing damping in the second"),
    Planted('friction="0.2"', 'friction="0"', "joints.shoulder", "coulomb", "missing coulomb in the second"),
    Planted('lower="-1.2" upper="1.5"', 'lower="-68.7549" upper="85.9437"', "joints.shoulder", "lower",
            "degrees against radians"),
    Planted('lower="-1.2" upper="1.5"', 'lower="-1.5" upper="1.2"', "joints.shoulder", "lower", "opposite axis"),
    Planted('lower="-0.1" upper="0.2"', 'lower="-0.1" upper="200"', "joints.wrist", "upper", "millimetres"),
    Planted('type="prismatic"', 'type="revolute"', "joints.wrist", "type"),
    Planted('<parent link="upper"/><child link="lower"/>', '<parent link="base_link"/><child link="lower"/>',
            "joints.elbow", "parent"),
)  # fmt: skip  # a table

OF_MJCF = (
    Planted('angle="radian"', 'angle="degree"', "joints.shoulder", "orientation", "degrees against radians"),
    Planted(' armature="0.01"', "", "joints.elbow", "rotor_inertia", "missing rotor inertia in the second"),
    Planted('stiffness="5"', 'stiffness="0.08726646"', "joints.elbow", "stiffness", "degrees against radians"),
    Planted('springref="0.2"', 'springref="0.2" ref="0.2"', "joints.elbow", "orientation"),
    Planted("<worldbody>", '<option gravity="0 0 9.81"/><worldbody>', "gravity", "gravity", "opposite gravity"),
)  # fmt: skip  # a table

OF_SCENE = (
    Planted("arm = 0.4", "arm = 0.41", "constraints.closure", "first position"),
    Planted('type = "revolute"\nfirst', 'type = "cylindrical"\nfirst', "constraints.closure", "type"),
    Planted("stiffness = 200", "stiffness = 0.2", "springs.return", "stiffness", "millimetres against metres"),
    Planted("damping = 5", "damping = 0", "springs.return", "damping", "missing damping in the second"),
    Planted("2 * sin(3 * t)", "2 * sin(3 * t * pi / 180)", "efforts.motor", "effort"),
    Planted("length = 0.3", "length = 0.15", "springs.return", "length", "a diameter against a radius"),
)  # fmt: skip  # a table

DESCRIPTIONS = {".urdf": (URDF, OF_URDF), ".xml": (MJCF, OF_MJCF), ".toml": (SCENE, OF_SCENE)}


def _compared(folder: Path, ending: str, old: str, new: str) -> eomgen.Comparison:
    text = DESCRIPTIONS[ending][0]
    assert text.count(old) == 1, old
    first, second = folder / f"first{ending}", folder / f"second{ending}"
    first.write_text(text)
    second.write_text(text.replace(old, new))
    return eomgen.compare(first, second, states=2)


def _check(folder: Path, ending: str, planted: Planted) -> None:
    comparison = _compared(folder, ending, planted.old, planted.new)
    assert not comparison.equal
    first = comparison.first
    assert first is not None
    assert (first.element, first.quantity) == (planted.element, planted.quantity), str(comparison)
    assert planted.cause in first.cause, str(first)
    assert first.places[1].startswith(f"second{ending}"), first.places


def test_forty_differences_are_planted() -> None:
    """The number that issue 40 asks for."""
    assert sum(len(planted) for _, planted in DESCRIPTIONS.values()) == 40


@pytest.mark.parametrize("planted", [OF_URDF[6], OF_URDF[12], OF_URDF[22]], ids=["products", "axis", "damping"])
def test_a_planted_difference_is_named_first(planted: Planted, tmp_path: Path) -> None:
    """Of a URDF; all others stand in the second tier."""
    _check(tmp_path, ".urdf", planted)


@pytest.mark.slow
@pytest.mark.parametrize("ending", DESCRIPTIONS)
def test_all_planted_differences_are_named_first(ending: str, tmp_path: Path) -> None:
    """With element, quantity, cause and place in the second file."""
    for planted in DESCRIPTIONS[ending][1]:
        _check(tmp_path, ending, planted)
