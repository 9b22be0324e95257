"""One arm as a scene, URDF, MJCF, SDF and System of SymPy: equal in all pairs, and a difference that one description
has is named first, whichever formats are compared."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
import sympy
from scipy.spatial.transform import Rotation
from sympy.physics import mechanics as me

import eomgen


class Values(NamedTuple):
    """Numbers of the arm; each difference changes one.

    Angles are roll, pitch and yaw, of joints against the parents, and of the lower arm's inertia against its frame.
    """

    mass: float = 2.0
    center: tuple[float, ...] = (0.02, 0.0, 0.25)
    products: tuple[float, ...] = (0.003, 0.001, -0.002)
    inertia: tuple[float, ...] = (0.04, 0.03, 0.014)
    turned: tuple[float, ...] = (0.3, 0.2, 0.1)
    axis: tuple[float, ...] = (0.0, 1.0, 0.0)
    elbow: tuple[float, ...] = (0.6, 0.8, 0.0)
    place: tuple[float, ...] = (0.05, 0.0, 0.5)
    angles: tuple[float, ...] = (0.1, 0.0, 0.2)
    damping: float = 0.3
    coulomb: float = 0.2
    lower: float = -1.2


#: Changed numbers, and the element and quantity that are named; of SymPy's equations, the element and quantity,
#: or none if the equations do not depend on the number.
PLANTED: tuple[tuple[dict[str, Any], tuple[str, str], tuple[str, str]], ...] = (
    ({"mass": 2000.0}, ("bodies.lower", "mass"), ("bodies.lower", "mass")),
    ({"center": (0.02, 0.0, -0.25)}, ("bodies.upper", "center_of_mass"),
     ("", "mass matrix or sum")),
    ({"products": (-0.003, -0.001, 0.002)}, ("bodies.upper", "inertia"), ("", "")),
    ({"turned": (0.0, 0.0, 0.0)}, ("bodies.lower", "inertia"), ("", "mass matrix or sum")),
    ({"inertia": (40.0, 30.0, 14.0)}, ("bodies.lower", "inertia"), ("bodies.lower", "principal moments")),
    ({"axis": (0.0, -1.0, 0.0)}, ("joints.shoulder", "axis"), ("", "mass matrix or sum")),
    ({"elbow": (0.8, 0.6, 0.0)}, ("joints.elbow", "axis"), ("", "mass matrix or sum")),
    ({"place": (50.0, 0.0, 500.0)}, ("joints.elbow", "position"), ("", "mass matrix or sum")),
    ({"angles": (5.729577951308232, 0.0, 11.459155902616464)}, ("joints.shoulder", "orientation"),
     ("", "mass matrix or sum")),
    ({"damping": 0.0}, ("joints.elbow", "damping"), ("v.elbow", "sum")),
    ({"coulomb": 0.0}, ("joints.shoulder", "coulomb"), ("v.shoulder", "sum")),
    ({"lower": -68.7549354}, ("joints.shoulder", "lower"), ("", "")),
)  # fmt: skip  # a table


def listed(values: Any) -> str:
    return " ".join(f"{item:.17g}" for item in values)


def urdf(v: Values) -> str:
    xy, xz, yz = v.products
    a, b, c = v.inertia
    return f"""<robot name="arm"><link name="base_link"/>
<link name="upper"><inertial><origin xyz="{listed(v.center)}"/><mass value="3"/>
  <inertia ixx="0.08" ixy="{xy}" ixz="{xz}" iyy="0.07" iyz="{yz}" izz="0.03"/></inertial></link>
<link name="lower"><inertial><origin xyz="0 0.01 0.2" rpy="{listed(v.turned)}"/><mass value="{v.mass}"/>
  <inertia ixx="{a}" ixy="0" ixz="0" iyy="{b}" iyz="0" izz="{c}"/></inertial></link>
<link name="slide"><inertial><origin xyz="0 0 0.05"/><mass value="0.5"/>
  <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.002" iyz="0" izz="0.0012"/></inertial></link>
<joint name="shoulder" type="revolute"><parent link="base_link"/><child link="upper"/>
  <origin xyz="0 0 0.3" rpy="{listed(v.angles)}"/><axis xyz="{listed(v.axis)}"/>
  <limit lower="{v.lower}" upper="1.5" effort="50" velocity="3"/><dynamics friction="{v.coulomb}"/></joint>
<joint name="elbow" type="continuous"><parent link="upper"/><child link="lower"/>
  <origin xyz="{listed(v.place)}" rpy="0.2 -0.4 0.3"/><axis xyz="{listed(v.elbow)}"/>
  <dynamics damping="{v.damping}"/></joint>
<joint name="wrist" type="prismatic"><parent link="lower"/><child link="slide"/>
  <origin xyz="0 0.02 0.4" rpy="0 0.1 0"/><axis xyz="0 0 1"/>
  <limit lower="-0.1" upper="0.2" effort="80" velocity="1"/><dynamics damping="4"/></joint>
</robot>"""


def mjcf(v: Values) -> str:
    return f"""<mujoco model="arm"><compiler angle="radian" eulerseq="XYZ"/><worldbody>
<body name="upper" pos="0 0 0.3" euler="{listed(v.angles)}">
  <inertial pos="{listed(v.center)}" mass="3" fullinertia="0.08 0.07 0.03 {listed(v.products)}"/>
  <joint name="shoulder" axis="{listed(v.axis)}" range="{v.lower} 1.5" frictionloss="{v.coulomb}"/>
  <body name="lower" pos="{listed(v.place)}" euler="0.2 -0.4 0.3">
    <inertial pos="0 0.01 0.2" euler="{listed(v.turned)}" mass="{v.mass}" diaginertia="{listed(v.inertia)}"/>
    <joint name="elbow" axis="{listed(v.elbow)}" damping="{v.damping}"/>
    <body name="slide" pos="0 0.02 0.4" euler="0 0.1 0">
      <inertial pos="0 0 0.05" mass="0.5" diaginertia="0.001 0.002 0.0012"/>
      <joint name="wrist" type="slide" axis="0 0 1" range="-0.1 0.2" damping="4"/>
    </body></body></body></worldbody></mujoco>"""


def sdf(v: Values) -> str:
    def inertial(pose: str, mass: float, moments: Any, products: Any = (0.0, 0.0, 0.0)) -> str:
        names = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
        entries = "".join(f"<{key}>{x:.17g}</{key}>" for key, x in zip(names, (*moments, *products), strict=True))
        return f"<inertial><pose>{pose}</pose><mass>{mass}</mass><inertia>{entries}</inertia></inertial>"

    def limit(low: float, high: float, effort: float) -> str:
        return f"<limit><lower>{low}</lower><upper>{high}</upper><effort>{effort}</effort></limit>"

    return f"""<sdf version="1.9"><world name="w"><gravity>0 0 -9.81</gravity><model name="arm">
<link name="upper"><pose relative_to="shoulder"/>
  {inertial(f"{listed(v.center)} 0 0 0", 3.0, (0.08, 0.07, 0.03), v.products)}</link>
<link name="lower"><pose relative_to="elbow"/>
  {inertial(f"0 0.01 0.2 {listed(v.turned)}", v.mass, v.inertia)}</link>
<link name="slide"><pose relative_to="wrist"/>
  {inertial("0 0 0.05 0 0 0", 0.5, (0.001, 0.002, 0.0012))}</link>
<joint name="shoulder" type="revolute"><pose relative_to="__model__">0 0 0.3 {listed(v.angles)}</pose>
  <parent>world</parent><child>upper</child><axis><xyz>{listed(v.axis)}</xyz>{limit(v.lower, 1.5, 50.0)}
  <dynamics><friction>{v.coulomb}</friction></dynamics></axis></joint>
<joint name="elbow" type="continuous"><pose relative_to="upper">{listed(v.place)} 0.2 -0.4 0.3</pose>
  <parent>upper</parent><child>lower</child><axis><xyz>{listed(v.elbow)}</xyz>
  <dynamics><damping>{v.damping}</damping></dynamics></axis></joint>
<joint name="wrist" type="prismatic"><pose relative_to="lower">0 0.02 0.4 0 0.1 0</pose>
  <parent>lower</parent><child>slide</child><axis><xyz>0 0 1</xyz>{limit(-0.1, 0.2, 80.0)}
  <dynamics><damping>4</damping></dynamics></axis></joint>
</model></world></sdf>"""


def turn(angles: Any) -> Any:
    """Return the axes (3, 3) of roll, pitch and yaw."""
    return Rotation.from_euler("xyz", angles).as_matrix()


def entries_of_lower(v: Values) -> list[float]:
    """Return xx, yy, zz, xy, xz, yz of the lower arm in the axes of its frame."""
    tensor = turn(v.turned) @ np.diag(v.inertia) @ turn(v.turned).T
    return [float(tensor[i, j]) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]


def scene(v: Values) -> str:
    rows = "[" + ", ".join(f"[{', '.join(f'{x:.17g}' for x in row)}]" for row in turn(v.angles)) + "]"

    def vector(values: Any) -> str:
        return f"[{', '.join(f'{x:.17g}' for x in values)}]"

    return f"""format = 1
name = "arm"
[bodies.upper]
mass = 3
center_of_mass = {vector(v.center)}
inertia = {vector((0.08, 0.07, 0.03, *v.products))}
[bodies.lower]
mass = {v.mass}
center_of_mass = [0, 0.01, 0.2]
inertia = {vector(entries_of_lower(v))}
[bodies.slide]
mass = 0.5
center_of_mass = [0, 0, 0.05]
inertia = [0.001, 0.002, 0.0012]
[joints.shoulder]
type = "revolute"
parent = "base"
child = "upper"
position = [0, 0, 0.3]
orientation = {rows}
axis = {vector(v.axis)}
limits = {{ lower = {v.lower}, upper = 1.5, stiffness = 5000, damping = 50 }}
{f"friction = {{ coulomb = {v.coulomb}, velocity = 0.01 }}" if v.coulomb else ""}
[joints.elbow]
type = "revolute"
parent = "upper"
child = "lower"
position = {vector(v.place)}
orientation = {[[float(f"{x:.17g}") for x in row] for row in turn((0.2, -0.4, 0.3))]}
axis = {vector(v.elbow)}
damping = {v.damping}
[joints.wrist]
type = "prismatic"
parent = "lower"
child = "slide"
position = [0, 0.02, 0.4]
orientation = {[[float(f"{x:.17g}") for x in row] for row in turn((0.0, 0.1, 0.0))]}
axis = [0, 0, 1]
damping = 4
limits = {{ lower = -0.1, upper = 0.2, stiffness = 80000, damping = 800 }}
"""


def along(frame: Any, components: Any) -> Any:
    """Return a vector of SymPy."""
    return sum((x * axis for x, axis in zip(components, frame, strict=True)), me.Vector(0))


@cache
def of_sympy(v: Values) -> Any:
    """Return the arm's equations from a System: each body has its frame at the mass centre."""
    base = me.RigidBody("base_link")
    system = me.System.from_newtonian(base)
    parent, center_of_parent = base, np.zeros(3)
    for name, mass, center, entries, joint, place, angles, axis in (
        ("upper", 3.0, v.center, (0.08, 0.07, 0.03, *v.products), "shoulder", (0, 0, 0.3), v.angles, v.axis),
        ("lower", v.mass, (0, 0.01, 0.2), entries_of_lower(v), "elbow", v.place, (0.2, -0.4, 0.3), v.elbow),
        ("slide", 0.5, (0, 0, 0.05), (0.001, 0.002, 0.0012, 0, 0, 0), "wrist", (0, 0.02, 0.4), (0, 0.1, 0), (0, 0, 1)),
    ):  # fmt: skip  # a table
        xx, yy, zz, xy, xz, yz = entries
        frame, middle = me.ReferenceFrame(name), me.Point(f"{name}_center")
        body = me.RigidBody(name, middle, frame, mass, (me.inertia(frame, xx, yy, zz, xy, yz, xz), middle))
        placed = me.ReferenceFrame(f"{joint}_frame")
        placed.orient_explicit(parent.frame, sympy.Matrix(turn(angles)))
        kind = me.PrismaticJoint if joint == "wrist" else me.PinJoint
        q, u = me.dynamicsymbols(f"{joint} u_{joint}")
        system.add_joints(
            kind(
                joint, parent, body, q, u,
                along(parent.frame, np.array(place) - center_of_parent), along(frame, -np.array(center)),
                parent_interframe=placed, joint_axis=along(placed, axis),
            )
        )  # fmt: skip  # arguments by place
        parent, center_of_parent = body, np.array(center)
    system.apply_uniform_gravity(-9.81 * base.z)
    shoulder, elbow, wrist = system.joints
    dry = v.coulomb * sympy.tanh(shoulder.speeds[0] / 0.01)
    for joint, torque in ((shoulder, dry), (elbow, v.damping * elbow.speeds[0])):
        system.add_actuators(me.TorqueActuator(-torque, joint.joint_axis, joint.child, joint.parent))
    axis = wrist.joint_axis
    system.add_loads((wrist.child.masscenter, -4 * wrist.speeds[0] * axis))
    system.add_loads((wrist.parent.masscenter, 4 * wrist.speeds[0] * axis))
    lever = wrist.child.masscenter.pos_from(wrist.parent.masscenter)
    system.add_loads((wrist.parent.frame, lever.cross(4 * wrist.speeds[0] * axis)))
    return eomgen.from_sympy(system, name="arm")


FORMATS: Mapping[str, Any] = {".toml": scene, ".urdf": urdf, ".xml": mjcf, ".sdf": sdf}


def described(folder: Path, ending: str, name: str, values: Values) -> Any:
    """Return the file, or the equations, of the arm."""
    if ending == "sympy":
        return of_sympy(values)
    path = folder / f"{name}{ending}"
    path.write_text(FORMATS[ending](values), encoding="utf-8")
    return path


def check(folder: Path, pair: tuple[str, str], number: int) -> None:
    """Plant one difference in the second description of a pair of formats."""
    changed, (element, quantity), (element_of_equations, quantity_of_equations) = PLANTED[number]
    first, second = (
        described(folder, ending, name, values)
        for ending, name, values in zip(pair, ("one", "other"), (Values(), Values()._replace(**changed)), strict=True)
    )
    if pair[1] == "sympy" and not quantity_of_equations:
        return
    comparison = eomgen.compare(first, second, states=2)
    difference = comparison.first
    assert difference is not None, (pair, changed)
    if pair[1] == "sympy":
        assert difference.element.startswith(element_of_equations), (pair, str(difference))
        assert difference.quantity in quantity_of_equations, (pair, str(difference))
        return
    assert (difference.element, difference.quantity) == (element, quantity), (pair, str(comparison))
    assert difference.places[1].startswith(f"other{pair[1]}"), (pair, difference.places)


PAIRS = [(one, other) for one in FORMATS for other in (*FORMATS, "sympy")]


@pytest.mark.long
def test_the_arm_is_equal_in_all_pairs_of_formats(tmp_path: Path) -> None:
    """To 1e-12 in the equations at random states, in 20 pairs."""
    for pair in PAIRS:
        first, second = (described(tmp_path, ending, name, Values()) for ending, name in zip(pair, "ab", strict=True))
        comparison = eomgen.compare(first, second, states=2, tolerance=1e-9)
        assert comparison.equal, (pair, str(comparison))
        assert max(comparison.errors.values()) < 1e-12, (pair, comparison.errors)


@pytest.mark.long
def test_forty_differences_are_named_first_across_formats(tmp_path: Path) -> None:
    """Two of each pair; each difference is planted, in SymPy's equations a mass and an axis."""
    for place, pair in enumerate(PAIRS):
        for number in (0, 6) if pair[1] == "sympy" else (place % len(PLANTED), (place + 5) % len(PLANTED)):
            check(tmp_path, pair, number)
