"""Poses of bodies by multiplying matrices along the tree as the scene is written, and M, T and V from them by complex
step.

Nothing of eomgen but the scene's data is used: no merging of fixed joints, no turned frames, no grouping, no recursion.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from eomgen.lie.product import Factor
from eomgen.scene.joints.model import Joint
from eomgen.scene.scene import Scene
from eomgen.system.description import BASE
from tests.oracles.evaluation import Array
from tests.oracles.formulas import value_of
from tests.oracles.states import STEP, displaced, rotation_of

Pose = tuple[Array, Array]


def parameter_values(scene: Scene) -> dict[str, float]:
    return {item.name: item.value for item in scene.parameters}


def _turn(axis: Array, q: Array) -> Array:
    """Return the rotation by one angle (..., 1) about a unit axis (Rodrigues)."""
    cross, angle = np.cross(np.eye(3), axis), q[..., np.newaxis]
    turn: Array = np.eye(3) * np.cos(angle) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * np.outer(axis, axis)
    return turn


def _joint_pose(joint: Joint, q: Array, parameters: Mapping[str, float]) -> Pose:
    shape = q.shape[:-1]
    axis = np.array(joint.axis)
    still = np.broadcast_to(np.eye(3), (*shape, 3, 3)), np.zeros((*shape, 3), q.dtype)
    match joint.type:
        case "revolute":
            return _turn(axis, q[..., :1]), still[1]
        case "prismatic":
            return still[0], q * axis
        case "helical":
            return _turn(axis, q), q * value_of(joint.pitch, parameters) * axis
        case "cylindrical":
            return _turn(axis, q[..., :1]), q[..., 1:] * axis
        case "universal":
            return _turn(axis, q[..., :1]) @ _turn(np.array(joint.second_axis), q[..., 1:]), still[1]
        case "planar":
            x = np.array(joint.second_axis)
            return _turn(axis, q[..., :1]), q[..., 1:2] * x + q[..., 2:] * np.cross(axis, x)
        case "spherical":
            return rotation_of(q), still[1]
        case "free":
            return rotation_of(q[..., :4]), q[..., 4:]
        case _:
            return still


def poses(scene: Scene, q: Array, base: Pose | None = None) -> dict[str, Pose]:
    """Return (rotation matrix, position) in the world of every body, batched like q (which may be complex)."""
    parameters = parameter_values(scene)
    shape = q.shape[:-1]
    found = {BASE: base if base is not None else (np.broadcast_to(np.eye(3), (*shape, 3, 3)), np.zeros((*shape, 3)))}
    start = 0
    for joint in scene.joints:
        size = joint.kind.q_size
        turn, shift = _joint_pose(joint, q[..., start : start + size], parameters)
        start += size
        R, p = found[joint.parent]
        here = np.array([value_of(item, parameters) for item in joint.position])
        placed = R @ np.array(joint.orientation)
        found[joint.child] = placed @ turn, p + R @ here + np.einsum("...ij,...j->...i", placed, shift)
    del found[BASE]
    return found


def body_data(scene: Scene) -> list[tuple[str, float, Array, Array]]:
    parameters = parameter_values(scene)
    data = []
    for body in scene.bodies:
        xx, yy, zz, xy, xz, yz = (value_of(item, parameters) for item in body.inertia)
        center = np.array([value_of(item, parameters) for item in body.center_of_mass])
        data.append(
            (body.name, value_of(body.mass, parameters), center, np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
        )
    return data


def _jacobians(scene: Scene, factors: Sequence[Factor], q: Array) -> list[tuple[float, Array, Array, Array]]:
    """Return mass, inertia in the world, and the columns of angular and centre-of-mass velocity, for each body."""
    nv = sum(factor.v_size for factor in factors)
    moved = poses(scene, displaced(factors, q[..., np.newaxis, :], 1j * STEP * np.eye(nv)))
    found = []
    for name, mass, center, inertia in body_data(scene):
        R, p = moved[name]
        spin = (R.imag / STEP) @ np.swapaxes(R.real, -1, -2)
        angular = np.stack([spin[..., 2, 1], spin[..., 0, 2], spin[..., 1, 0]], axis=-1)
        linear = (p + R @ center).imag / STEP
        here = R.real[..., 0, :, :]
        found.append((mass, here @ inertia @ np.swapaxes(here, -1, -2), angular, linear))
    return found


def mass_matrix(scene: Scene, factors: Sequence[Factor], q: Array) -> Array:
    """Return M as the sum of m J^T J + J_w^T I J_w over all bodies, with rotor inertias."""
    M = 0.0
    for mass, inertia, angular, linear in _jacobians(scene, factors, q):
        M = M + mass * linear @ np.swapaxes(linear, -1, -2) + angular @ inertia @ np.swapaxes(angular, -1, -2)
    parameters = parameter_values(scene)
    rotors = {
        joint.name: [value_of(item, parameters) for item in joint.each(joint.rotor_inertia)] for joint in scene.joints
    }
    return M + np.diag([rotor for factor in factors for rotor in rotors[factor.name]])


def weight(scene: Scene, factors: Sequence[Factor], q: Array, gravity: Sequence[float]) -> Array:
    """Return the generalized force of gravity as the sum of J^T m g."""
    return sum(
        (mass * linear @ np.array(gravity) for mass, _, _, linear in _jacobians(scene, factors, q)),
        start=np.zeros(1),
    )


def centers_and_masses(scene: Scene, q: Array, base: Pose | None = None) -> Mapping[str, tuple[float, Array]]:
    """Return mass and centre of mass in the world of every body."""
    placed = poses(scene, q, base)
    return {name: (mass, placed[name][1] + placed[name][0] @ center) for name, mass, center, _ in body_data(scene)}
