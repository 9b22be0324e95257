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


def robot(*changes: tuple[str, str]) -> str:
    """Return the robot with texts in it changed, each at its first place."""
    text = ROBOT
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    return text


#: A change to the version that knows quaternions.
NEWER = ('<robot name="r">', '<robot name="r" version="1.1">')


def in_joint(element: str) -> tuple[str, str]:
    """Return the change that puts an element into the joint."""
    return '<axis xyz="0 1 0"/>', f'{element}<axis xyz="0 1 0"/>'


TRANSMISSION = """\
  <transmission name="t"><type>transmission_interface/SimpleTransmission</type><joint name="lift"/>
    <actuator name="motor"><mechanicalReduction>{}</mechanicalReduction></actuator></transmission>
"""

FAILURES = [
    Failure(
        "XML that is not well formed",
        3,
        command="info r.urdf",
        files={"r.urdf": "<robot name='r'><link name='a'></robot>"},
    ),
    Failure("Another XML", 3, command="info r.urdf", files={"r.urdf": "<html><body/></html>"}),
    Failure(
        "A document type, as entity bombs have",
        3,
        command="info r.urdf",
        files={"r.urdf": '<!DOCTYPE robot [<!ENTITY a "b">]>\n<robot name="r"/>'},
    ),
    Failure(
        "A xacro that was not run",
        3,
        command="info r.urdf",
        files={
            "r.urdf": (
                '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">\n'
                '  <xacro:include filename="x.xacro"/>\n'
                "</robot>"
            )
        },
    ),
    Failure(
        "A link that there is not",
        3,
        command="info r.urdf",
        files={"r.urdf": robot(('<child link="rod"/>', '<child link="rdo"/>'))},
    ),
    Failure(
        "A kind of joint that there is not",
        3,
        "description error: r.urdf:4 (joints.lift): the joint type 'hinge' is not known; try: one of revolute, "
        "prismatic, fixed, planar, continuous, floating [E1712]",
        command="info r.urdf",
        files={"r.urdf": robot(('<joint name="lift" type="revolute">', '<joint name="lift" type="hinge">'))},
    ),
    Failure("A robot without links", 3, command="info r.urdf", files={"r.urdf": '<robot name="r"/>'}),
    Failure("A joint to lock that there is not", 2, command="info r.urdf --lock lfit", files={"r.urdf": ROBOT}),
    Failure(
        "A joint that mimics one that there is not",
        3,
        "description error: r.urdf:5 (joints.lift): there is no joint 'lfit' to mimic; try: lift [E1688]",
        command="info r.urdf",
        files={"r.urdf": robot(in_joint('<mimic joint="lfit"/>'))},
    ),
    Failure(
        "A mass that is not a number",
        3,
        command="info r.urdf",
        files={"r.urdf": robot(('<mass value="1"/>', '<mass value="heavy"/>'))},
    ),
    Failure(
        "Two links of one name",
        3,
        "description error: r.urdf:3: the link 'ground' is there twice; try: another name [E1702]",
        command="info r.urdf",
        files={"r.urdf": robot(('<link name="ground"/>', '<link name="ground"/>\n  <link name="ground"/>'))},
    ),
    Failure(
        "What would be left out, with --strict",
        3,
        "description error: r.urdf:4: not modelled: limits of position, velocity and effort (1: lift); try: no --strict"
        " (strict=False), to go on without [W0197]",
        command="info r.urdf --strict",
        files={"r.urdf": robot(in_joint('<limit lower="-1" upper="1" effort="10" velocity="2"/>'))},
    ),
    Failure(
        "An attribute that is not known, with --strict",
        3,
        "description error: r.urdf:5: not read: the attribute 'rpz' of <origin> (is rpy meant?) (1: lift); try: no"
        " --strict (strict=False), to go on without [W0193]",
        command="info r.urdf --strict",
        files={"r.urdf": robot(in_joint('<origin rpz="0 0 1"/>'))},
    ),
    Failure(
        "A unit",
        3,
        "description error: r.urdf:3: <mass> has the attribute unit, and URDF has SI units and radians only; try: the"
        " value in SI units, without unit [E1703]",
        command="info r.urdf",
        files={"r.urdf": robot(('<mass value="1"/>', '<mass value="1" unit="lb"/>'))},
    ),
    Failure(
        "A version that there is not",
        3,
        "description error: r.urdf:1: version '2.0' of URDF is not known; try: a file of version 1.0 to 1.2 [E1700]",
        command="info r.urdf",
        files={"r.urdf": robot(('<robot name="r">', '<robot name="r" version="2.0">'))},
    ),
    Failure(
        "A quaternion that is no rotation",
        3,
        "description error: r.urdf:5 (joints.lift): quat_xyzw: the quaternion has the length 1.41421, and a rotation"
        " has 1; try: x, y, z and w of a unit quaternion [E1728]",
        command="info r.urdf",
        files={"r.urdf": robot(NEWER, in_joint('<origin quat_xyzw="1 0 0 1"/>'))},
    ),
    Failure(
        "Two orientations in one origin",
        3,
        "description error: r.urdf:5 (joints.lift): the origin has rpy and quat_xyzw, and only one of them can say how"
        " it is turned; try: one of them [E1707]",
        command="info r.urdf",
        files={"r.urdf": robot(NEWER, in_joint('<origin rpy="0 0 1" quat_xyzw="0 0 0 1"/>'))},
    ),
    Failure(
        "A transmission with a reduction of zero",
        3,
        "description error: r.urdf:8 (transmissions.t): the mechanical reduction '0' is not a number other than 0; try:"
        " efforts of the joint over efforts of the actuator, e.g. 50 [E1720]",
        command="info r.urdf --transmissions",
        files={"r.urdf": robot(("</robot>", TRANSMISSION.format(0) + "</robot>"))},
    ),
    Failure(
        "A transmission to a joint that is not there, with --strict",
        3,
        "description error: r.urdf:7: not modelled: transmissions to joints that are not there (1: lfit), perhaps lift;"
        " try: no --strict (strict=False), to go on without [W0199]",
        command="info r.urdf --transmissions --strict",
        files={"r.urdf": robot(("</robot>", TRANSMISSION.format(50).replace("lift", "lfit") + "</robot>"))},
    ),
]
