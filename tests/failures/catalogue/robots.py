"""Failure catalogue: URDF."""

from __future__ import annotations

from tests.failures.failure import Failure

FAILURES = [
    Failure(
        "XML that is not well formed", 3,
        "description error: r.urdf:1: this is not XML: mismatched tag (column 34)",
        command="info r.urdf",
        files={"r.urdf": "<robot name='r'><link name='a'></robot>"},
    ),
    Failure(
        "Another XML", 3,
        "description error: r.urdf:1: the outermost element is 'html', not 'robot'; try: a URDF file",
        command="info r.urdf",
        files={"r.urdf": "<html><body/></html>"},
    ),
    Failure(
        "A document type, as entity bombs have", 3,
        "description error: r.urdf:1: document types and entities are refused; try: the file without <!DOCTYPE>",
        command="info r.urdf",
        files={"r.urdf": (
            '<!DOCTYPE robot [<!ENTITY a "b">]>\n'
            '<robot name="r"/>'
        )},
    ),
    Failure(
        "A xacro that was not run", 3,
        "description error: r.urdf:1: the file holds xacro macros; try: xacro first, to make a URDF of it",
        command="info r.urdf",
        files={"r.urdf": (
            '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">\n'
            '  <xacro:include filename="x.xacro"/>\n'
            "</robot>"
        )},
    ),
    Failure(
        "A link that there is not", 3,
        "description error: r.urdf:5 (joints.lift): there is no link 'rdo'; try: rod",
        command="info r.urdf",
        files={"r.urdf": (
            '<robot name="r">\n'
            '  <link name="ground"/>\n'
            '  <link name="rod"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" '
            'iyz="0"/></inertial></link>\n'
            '  <joint name="lift" type="revolute">\n'
            '    <parent link="ground"/><child link="rdo"/><axis xyz="0 1 0"/>\n'
            "  </joint>\n"
            "</robot>\n"
        )},
    ),
    Failure(
        "An axis without a direction", 3,
        "description error: r.urdf:4 (joints.lift.axis): the axis has no direction; try: an axis such as [0, 0, 1]",
        command="info r.urdf",
        files={"r.urdf": (
            '<robot name="r">\n'
            '  <link name="ground"/>\n'
            '  <link name="rod"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" '
            'iyz="0"/></inertial></link>\n'
            '  <joint name="lift" type="revolute">\n'
            '    <parent link="ground"/><child link="rod"/><axis xyz="0 0 0"/>\n'
            "  </joint>\n"
            "</robot>\n"
        )},
    ),
    Failure(
        "A kind of joint that there is not", 3,
        (
            "description error: r.urdf:4 (joints.lift): the joint type 'hinge' is not known; try: one of revolute, "
            "continuous, prismatic, fixed, floating, planar"
        ),
        command="info r.urdf",
        files={"r.urdf": (
            '<robot name="r">\n'
            '  <link name="ground"/>\n'
            '  <link name="rod"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" '
            'iyz="0"/></inertial></link>\n'
            '  <joint name="lift" type="hinge">\n'
            '    <parent link="ground"/><child link="rod"/><axis xyz="0 1 0"/>\n'
            "  </joint>\n"
            "</robot>\n"
        )},
    ),
    Failure(
        "A robot without links", 3,
        "description error: r.urdf:1: the robot has no link; try: xacro first, if the file was meant for it",
        command="info r.urdf",
        files={"r.urdf": '<robot name="r"/>'},
    ),
    Failure(
        "A joint to lock that there is not", 2,
        "usage error: r.urdf has no joint 'lfit' to lock; try: lift",
        command="info r.urdf --lock lfit",
        files={"r.urdf": (
            '<robot name="r">\n'
            '  <link name="ground"/>\n'
            '  <link name="rod"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" '
            'iyz="0"/></inertial></link>\n'
            '  <joint name="lift" type="revolute">\n'
            '    <parent link="ground"/><child link="rod"/><axis xyz="0 1 0"/>\n'
            "  </joint>\n"
            "</robot>\n"
        )},
    ),
    Failure(
        "A joint that mimics one that there is not", 3,
        "description error: r.urdf:5 (joints.lift): there is no joint 'lfit' to mimic; try: lift",
        command="info r.urdf",
        files={"r.urdf": (
            '<robot name="r">\n'
            '  <link name="ground"/>\n'
            '  <link name="rod"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" '
            'iyz="0"/></inertial></link>\n'
            '  <joint name="lift" type="revolute">\n'
            '    <parent link="ground"/><child link="rod"/><mimic joint="lfit"/><axis xyz="0 1 0"/>\n'
            "  </joint>\n"
            "</robot>\n"
        )},
    ),
    Failure(
        "A mass that is no number", 3,
        "description error: r.urdf:3 (links.rod): value: a number is needed here, not 'heavy'",
        command="info r.urdf",
        files={"r.urdf": (
            '<robot name="r">\n'
            '  <link name="ground"/>\n'
            '  <link name="rod"><inertial><mass value="heavy"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" '
            'iyz="0"/></inertial></link>\n'
            '  <joint name="lift" type="revolute">\n'
            '    <parent link="ground"/><child link="rod"/><axis xyz="0 1 0"/>\n'
            "  </joint>\n"
            "</robot>\n"
        )},
    ),
    Failure(
        "Two links of one name", 3,
        "description error: r.urdf:3: the link 'ground' is there twice; try: another name",
        command="info r.urdf",
        files={"r.urdf": (
            '<robot name="r">\n'
            '  <link name="ground"/>\n'
            '  <link name="ground"/>\n'
            '  <link name="rod"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" '
            'iyz="0"/></inertial></link>\n'
            '  <joint name="lift" type="revolute">\n'
            '    <parent link="ground"/><child link="rod"/><axis xyz="0 1 0"/>\n'
            "  </joint>\n"
            "</robot>\n"
        )},
    ),
    Failure(
        "What would be left out, with --strict", 3,
        (
            "description error: r.urdf:1: not modelled: limits of position, velocity and effort (1: lift); try: no --strict "
            "(strict=False), to go on without"
        ),
        command="info r.urdf --strict",
        files={"r.urdf": (
            '<robot name="r">\n'
            '  <link name="ground"/>\n'
            '  <link name="rod"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" '
            'iyz="0"/></inertial></link>\n'
            '  <joint name="lift" type="revolute">\n'
            '    <parent link="ground"/><child link="rod"/><limit lower="-1" upper="1" effort="10" velocity="2"/><axis '
            'xyz="0 1 0"/>\n'
            "  </joint>\n"
            "</robot>\n"
        )},
    ),
    Failure(
        "An attribute that is not known, with --strict", 3,
        (
            "description error: r.urdf:5: not read: the attribute 'rpz' of <origin> (is rpy meant?) (1: lift); try: no --strict "
            "(strict=False), to go on without"
        ),
        command="info r.urdf --strict",
        files={"r.urdf": (
            '<robot name="r">\n'
            '  <link name="ground"/>\n'
            '  <link name="rod"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" '
            'iyz="0"/></inertial></link>\n'
            '  <joint name="lift" type="revolute">\n'
            '    <parent link="ground"/><child link="rod"/><origin rpz="0 0 1"/><axis xyz="0 1 0"/>\n'
            "  </joint>\n"
            "</robot>\n"
        )},
    ),
    Failure(
        "A unit", 3,
        (
            "description error: r.urdf:3: <mass> has the attribute unit, and URDF has SI units and radians only; try: the value "
            "in SI units, without unit"
        ),
        command="info r.urdf",
        files={"r.urdf": (
            '<robot name="r">\n'
            '  <link name="ground"/>\n'
            '  <link name="rod"><inertial><mass value="1" unit="lb"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" '
            'iyz="0"/></inertial></link>\n'
            '  <joint name="lift" type="revolute">\n'
            '    <parent link="ground"/><child link="rod"/><axis xyz="0 1 0"/>\n'
            "  </joint>\n"
            "</robot>\n"
        )},
    ),
    Failure(
        "A version that there is not", 3,
        (
            "description error: r.urdf:1: version '2.0' of URDF is not known; try: a file of version 1.0 to 1.2"
        ),
        command="info r.urdf",
        files={"r.urdf": (
            '<robot name="r" version="2.0">\n'
            '  <link name="ground"/>\n'
            '  <link name="rod"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" '
            'iyz="0"/></inertial></link>\n'
            '  <joint name="lift" type="revolute">\n'
            '    <parent link="ground"/><child link="rod"/><axis xyz="0 1 0"/>\n'
            "  </joint>\n"
            "</robot>\n"
        )},
    ),
    Failure(
        "A quaternion that is no rotation", 3,
        (
            "description error: r.urdf:5 (joints.lift): quat_xyzw: '1 0 0 1' has the length 1.41421, and a rotation has 1; try: "
            "x, y, z and w of a unit quaternion"
        ),
        command="info r.urdf",
        files={"r.urdf": (
            '<robot name="r" version="1.1">\n'
            '  <link name="ground"/>\n'
            '  <link name="rod"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" '
            'iyz="0"/></inertial></link>\n'
            '  <joint name="lift" type="revolute">\n'
            '    <parent link="ground"/><child link="rod"/><origin quat_xyzw="1 0 0 1"/><axis xyz="0 1 0"/>\n'
            "  </joint>\n"
            "</robot>\n"
        )},
    ),
    Failure(
        "Two orientations in one origin", 3,
        (
            "description error: r.urdf:5 (joints.lift): the origin has rpy and quat_xyzw, and only one of them can say how it is "
            "turned; try: one of them"
        ),
        command="info r.urdf",
        files={"r.urdf": (
            '<robot name="r" version="1.1">\n'
            '  <link name="ground"/>\n'
            '  <link name="rod"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" '
            'iyz="0"/></inertial></link>\n'
            '  <joint name="lift" type="revolute">\n'
            '    <parent link="ground"/><child link="rod"/><origin rpy="0 0 1" quat_xyzw="0 0 0 1"/><axis xyz="0 1 0"/>\n'
            "  </joint>\n"
            "</robot>\n"
        )},
    ),
]  # fmt: skip
