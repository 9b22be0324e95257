"""Numbers that are almost structure: what is computed of a scene does not change by more than they do.

Zeros, ones and coordinate axes make operations cheap, so code asks for them; a number that is beside one of them by
1e-13 to 1e-7 (a CAD export, sin(1.57079633)) must pass neither for it nor for another.
"""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from eomgen.mechanics.derive import derive
from eomgen.mechanics.kinematics.bodies import constant_quaternion
from eomgen.scene.rotations import frame_about, unit_axis
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.scalar import Algebra
from eomgen.symbolic.tape import Tape
from tests.models.urdf import load_urdf
from tests.oracles.almost import ROUNDING, SHIFTS, TERMS, change, computed
from tests.oracles.states import random_states
from tests.oracles.written_scenes import Data

pytestmark = pytest.mark.slow


def pendulum(**joint: Any) -> Data:
    body = {"mass": 1.0, "center_of_mass": [0.3, 0.1, 0.2], "inertia": [0.02, 0.03, 0.04]}
    arm = {"mass": 0.7, "center_of_mass": [0.1, -0.2, 0.05], "inertia": [0.01, 0.012, 0.013]}
    elbow = {"type": "revolute", "parent": "body", "child": "arm", "axis": [0.3, 0.5, 0.7], "position": [0.4, 0.1, 0.0]}
    joints = {"hinge": {"parent": "base", "child": "body", **joint}, "elbow": elbow}
    return {"format": 1, "name": "pendulum", "bodies": {"body": body, "arm": arm}, "joints": joints}


@pytest.mark.parametrize(
    "joint",
    [
        {"type": "revolute", "axis": [3e-9, 0.0, -1.0]},
        {"type": "cylindrical", "axis": [-1.0, 3e-9, 0.0]},
        {"type": "planar", "axis": [0.0, -1.0, 3e-9], "x_axis": [0.6, 0.0, 0.8]},
        {"type": "universal", "axis": [3e-9, -1.0, 0.0], "second_axis": [1.0, 3e-9, 0.0]},
    ],
)
def test_links_have_the_axes_of_bodies_where_joints_are_beside_coordinate_axes(joint: Data) -> None:
    """The matrices of the closed form are in the links' axes."""
    exact = {key: np.round(value).tolist() if key not in {"x_axis", "type"} else value for key, value in joint.items()}
    terms = ("system_jacobian", "link_brackets", "joint_brackets")
    for name, size in change(*(computed(pendulum(**item), 1, terms) for item in (exact, joint))).items():
        assert size <= 100.0 * 3e-9, f"{name} changes by {size:.3g}"


@pytest.mark.parametrize(
    "axis", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 1.0, 0.0), (1.0, 1.0, 1.0), (-1.0, 1.0, -1.0)]
)
def test_the_frame_about_an_axis_is_the_same_for_axes_nearby(
    axis: tuple[float, float, float], rng: np.random.Generator
) -> None:
    frame = frame_about(unit_axis(axis))
    for shift in SHIFTS:
        for sign in itertools.product((-1.0, 0.0, 1.0), repeat=3):
            nearby = frame_about(unit_axis(np.array(axis) + shift * np.array(sign)))
            np.testing.assert_allclose(nearby, frame, rtol=0, atol=4.0 * shift)


def test_quaternions_of_rotations_near_half_a_turn_keep_their_sign(rng: np.random.Generator) -> None:
    algebra = Algebra(Tape())

    def quaternion(turn: Rotation) -> list[float]:
        return constant_quaternion(algebra.matrix(turn.as_matrix().tolist()))

    for axis in ((1, 0, 0), (0, 0, -1), (1, 1, 0), (1, -1, 0), (0, -1, 1), (1, 1, 1), (-0.6, 0.8, 0), (0.2, -0.9, 0.3)):
        half = Rotation.from_rotvec(np.pi * np.array(axis) / np.linalg.norm(axis))
        for shift in (1e-15, 1e-9, 1e-7):
            nearby = half * Rotation.from_rotvec(shift * rng.normal(size=3))
            np.testing.assert_allclose(quaternion(nearby), quaternion(half), rtol=0, atol=10.0 * shift)


ROBOT = """<robot name="r"><link name="base_link"/>
  <link name="a"><inertial><origin xyz="0.1 0 0.2" rpy="0 0 {shift}"/><mass value="1.5"/>
    <inertia ixx="0.02" iyy="0.03" izz="0.04" ixy="{shift}" ixz="0" iyz="0"/></inertial></link>
  <link name="b"><inertial><origin xyz="0 {shift} 0.1"/><mass value="0.8"/>
    <inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="j" type="revolute"><parent link="base_link"/><child link="a"/>
    <origin xyz="0 0 0.3" rpy="{right} 0 0"/><axis xyz="0 {shift} 1"/></joint>
  <joint name="k" type="continuous"><parent link="a"/><child link="b"/>
    <origin xyz="0.3 {shift} 0" rpy="0 {right} {shift}"/><axis xyz="1 0 {shift}"/></joint>
</robot>"""


@pytest.mark.parametrize("shift", SHIFTS)
def test_a_urdf_beside_right_angles_and_coordinate_axes(shift: float) -> None:
    system, moved = (
        derive(load_urdf(ROBOT.format(shift=f"{by:.3e}", right=repr(math.pi / 2 + by))), TERMS[:6])
        for by in (0.0, shift)
    )
    state = random_states(system, 3, np.random.default_rng(1))
    before, after = (
        [evaluate(item.tape, function.refs, state) for function in item.functions.values()] for item in (system, moved)
    )
    for name, first, second in zip(system.functions, before, after, strict=True):
        size = max(1.0, float(np.max(np.abs(first))))
        np.testing.assert_allclose(second, first, rtol=0, atol=100.0 * size * (shift + ROUNDING), err_msg=name)


def blade(start: float, place: float) -> Data:
    """Return a beam whose frame is at its first end, with a body fixed to its second end."""
    bending = {
        "shapes": "finite_elements",
        "elements": 2,
        "modes": 1,
        "stiffness": 20.0,
        "masses": [{"at": place, "mass": 0.2}],
    }
    beam = {"start": start, "length": 0.1, "mass_per_length": 1.0, "polar_inertia": 0.01, "bending_y": bending}
    body = {"mass": 0.2, "inertia": [1e-4, 1e-4, 1e-4]}
    joints = {
        "hub": {"type": "revolute", "parent": "base", "child": "blade", "axis": [0.0, 0.0, 1.0]},
        "end": {"type": "fixed", "parent": "blade", "child": "tip", "position": [place, 0.0, 0.0]},
    }
    return {"format": 1, "name": "rotor", "bodies": {"tip": body}, "beams": {"blade": beam}, "joints": joints}


@pytest.mark.parametrize("shift", [-5e-8, -1e-9, 1e-15, 3e-10, 5e-8])
def test_what_is_a_little_beyond_the_end_of_a_beam_is_at_its_end(shift: float) -> None:
    """The beam's frame a little before or behind its first end; a body, and the mass that modes are found with, at the
    second."""
    before = computed(blade(0.0, 0.1), 1)
    for moved in (blade(0.0, 0.1 + shift), blade(shift, 0.1 + shift)):
        for name, size in change(before, computed(moved, 1)).items():
            scale = max(1.0, float(np.max(np.abs(before[name]))))
            assert size <= 1e4 * abs(shift) * scale + 1e-12 * scale, f"{name} changes by {size:.3g}"
