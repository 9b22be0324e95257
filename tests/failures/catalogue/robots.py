"""Failure catalogue: URDF."""

from __future__ import annotations

from tests.failures.failure import Failure

#: What most of these robots differ from in one place.
ROBOT = """\
<robot name="r">
  <link name="ground"/>
  <link name="rod"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" \
iyz="0"/></inertial></link>
  <joint name="lift" type="revolute">
    <parent link="ground"/><child link="rod"/><axis xyz="0 1 0"/>
  </joint>
</robot>
"""


def robot(title: str, message: str = "", *changes: tuple[str, str], text: str = ROBOT, options: str = "") -> Failure:
    """Return the entry of a robot with texts in it changed, each at its first place."""
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    told, code = message and f"description error: r.urdf:{message}", 2 if "--lock" in options else 3
    return Failure(title, code, told, command=f"info r.urdf{options}", files={"r.urdf": text})


#: A change to the version that knows quaternions.
NEWER = ('<robot name="r">', '<robot name="r" version="1.1">')
NO_STRICT = "try: no --strict (strict=False), to go on without"


def in_joint(element: str) -> tuple[str, str]:
    """Return the change that puts an element into the joint."""
    return '<axis xyz="0 1 0"/>', f'{element}<axis xyz="0 1 0"/>'


def transmission(reduction: int, joint: str = "lift") -> tuple[str, str]:
    """Return the change that puts a transmission to a joint into the robot."""
    text = f"""\
  <transmission name="t"><type>transmission_interface/SimpleTransmission</type><joint name="{joint}"/>
    <actuator name="motor"><mechanicalReduction>{reduction}</mechanicalReduction></actuator></transmission>
"""
    return "</robot>", f"{text}</robot>"


XACRO = """\
<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:include filename="x.xacro"/>
</robot>"""

FAILURES = [
    robot("XML that is not well formed", text="<robot name='r'><link name='a'></robot>"),
    robot("Another XML", text="<html><body/></html>"),
    robot("A document type, as entity bombs have", text='<!DOCTYPE robot [<!ENTITY a "b">]>\n<robot name="r"/>'),
    robot("A xacro that was not run", text=XACRO),
    robot("A link that there is not", "", ('<child link="rod"/>', '<child link="rdo"/>')),
    robot(
        "A kind of joint that there is not",
        "4 (joints.lift): the joint type 'hinge' is not known; try: one of revolute, prismatic, fixed, planar, "
        "continuous, floating [E1712]",
        ('<joint name="lift" type="revolute">', '<joint name="lift" type="hinge">'),
    ),
    robot("A robot without links", text='<robot name="r"/>'),
    robot("A joint to lock that there is not", options=" --lock lfit"),
    robot(
        "A joint that mimics one that there is not",
        "5 (joints.lift): there is no joint 'lfit' to mimic; try: lift [E1688]",
        in_joint('<mimic joint="lfit"/>'),
    ),
    robot("A mass that is not a number", "", ('<mass value="1"/>', '<mass value="heavy"/>')),
    robot(
        "Two links of one name",
        "3: the link 'ground' is there twice; try: another name [E1702]",
        ('<link name="ground"/>', '<link name="ground"/>\n  <link name="ground"/>'),
    ),
    robot(
        "What would be left out, with --strict",
        f"4: not modelled: limits of position, velocity and effort (1: lift); {NO_STRICT} [W0197]",
        in_joint('<limit lower="-1" upper="1" effort="10" velocity="2"/>'),
        options=" --strict",
    ),
    robot(
        "An attribute that is not known, with --strict",
        f"5: not read: the attribute 'rpz' of <origin> (is rpy meant?) (1: lift); {NO_STRICT} [W0193]",
        in_joint('<origin rpz="0 0 1"/>'),
        options=" --strict",
    ),
    robot(
        "A unit",
        "3: <mass> has the attribute unit, and URDF has SI units and radians only; try: the value in SI units, without"
        " unit [E1703]",
        ('<mass value="1"/>', '<mass value="1" unit="lb"/>'),
    ),
    robot(
        "A version that there is not",
        "1: version '2.0' of URDF is not known; try: a file of version 1.0 to 1.2 [E1700]",
        (NEWER[0], '<robot name="r" version="2.0">'),
    ),
    robot(
        "A quaternion that is no rotation",
        "5 (joints.lift): quat_xyzw: the quaternion has the length 1.41421, and a rotation has 1; try: x, y, z and w of"
        " a unit quaternion [E1728]",
        NEWER,
        in_joint('<origin quat_xyzw="1 0 0 1"/>'),
    ),
    robot(
        "Two orientations in one origin",
        "5 (joints.lift): the origin has rpy and quat_xyzw, and only one of them can say how it is turned; try: one of"
        " them [E1707]",
        NEWER,
        in_joint('<origin rpy="0 0 1" quat_xyzw="0 0 0 1"/>'),
    ),
    robot(
        "A transmission with a reduction of zero",
        "8 (transmissions.t): the mechanical reduction '0' is not a number other than 0; try: efforts of the joint over"
        " efforts of the actuator, e.g. 50 [E1720]",
        transmission(0),
        options=" --transmissions",
    ),
    robot(
        "A transmission to a joint that is not there, with --strict",
        f"7: not modelled: transmissions to joints that are not there (1: lfit), perhaps lift; {NO_STRICT} [W0199]",
        transmission(50, "lfit"),
        options=" --transmissions --strict",
    ),
]
