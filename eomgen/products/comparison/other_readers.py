"""Readings of descriptions by other programs: MuJoCo and Pinocchio.

MuJoCo gives velocities of free bodies as the velocity of the origin in world axes, then the rotation in body axes;
Pinocchio as the velocity of the origin, then the rotation, both in body axes. Both are turned into twists.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.messages import legal_names
from eomgen.base.products import optional_package
from eomgen.errors import DescriptionError, Problem
from eomgen.lie.numeric import rotation_matrix
from eomgen.products.comparison.machine import (
    AT_ORIGIN,
    Forces,
    Lumps,
    Machine,
    MachineBody,
    MachineLink,
    MachineMotion,
    Placement,
)
from eomgen.scene.inertia import Inertia
from eomgen.scene.rotations import about_axis
from eomgen.system.description import BASE

_Equations = Callable[[MachineMotion], Forces]
#: Types of joints by number in MuJoCo.
_MUJOCO = ("free", "spherical", "prismatic", "revolute")
#: Types of joints by the first letters of their names in Pinocchio.
_PINOCCHIO = {"JointModelR": "revolute", "JointModelP": "prismatic", "JointModelFreeFlyer": "free"}


def _module(name: str, package: str) -> Any:
    """Return an optional package."""
    missing = Problem("--with", f"the package {package} is not installed [E0567]", f"pip install {package}")
    return optional_package(name, missing)


def _machine(path: Path, reader: str, gravity: Array, links: list[MachineLink], forces: _Equations) -> Machine:
    """Return a machine whose constraints and force elements the reader does not give."""
    return Machine(f"{path.name} by {reader}", gravity, tuple(links), None, (), lambda _: path.name, forces, None)


def read_mujoco(path: Path) -> Machine:
    """Return the reading of an MJCF or URDF file by MuJoCo. Raises DescriptionError with MuJoCo's own message."""
    mujoco = _module("mujoco", "mujoco")
    try:
        model = mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        fault = f"MuJoCo does not read the file: {' '.join(str(error).split())} [E0568]"
        raise DescriptionError(Problem(path.name, fault, "a file that MuJoCo compiles")) from None
    lumps, links = Lumps(), []
    written = [model.body(body).name or f"body{body}" for body in range(1, model.nbody)]
    names = [BASE, *legal_names(written).values()]
    joints = legal_names([model.joint(joint).name for joint in range(model.njnt) if model.joint(joint).name])
    for body in range(1, model.nbody):
        parent = names[model.body_parentid[body]]
        rest = Placement(rotation_matrix(np.array(model.body_quat[body])), np.array(model.body_pos[body]))
        first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
        for joint in range(first, first + count):
            name = joints.get(model.joint(joint).name, f"{names[body]}_joint{joint - first}")
            kind = _MUJOCO[int(model.jnt_type[joint])]
            number, pose = lumps.places[parent]
            anchor = np.array(model.jnt_pos[joint]) if kind in ("revolute", "spherical") else np.zeros(3)
            parent = f"{names[body]}/{name}"
            lumps.moved(parent)
            pose = pose.then(_at_zero(model, joint, kind, rest, anchor))
            links.append((joint, name, kind, names[body], number, pose))
            rest = Placement(np.eye(3), -anchor)
        lumps.fixed(names[body], parent, rest)
        turned = rotation_matrix(np.array(model.body_iquat[body]))
        about = turned @ np.diag(model.body_inertia[body]) @ turned.T
        lumps.weigh(names[body], Inertia(float(model.body_mass[body]), np.array(model.body_ipos[body]), about))
    machine_links = []
    for index, (joint, name, kind, carried, number, pose) in enumerate(links):
        axis = np.array(model.jnt_axis[joint]) if kind in ("revolute", "prismatic") else None
        numbers = _mujoco_numbers(model, joint) if axis is not None else {}
        machine_links.append(MachineLink(name, kind, carried, number, pose, axis, None, lumps.bodies[index], numbers))
    forces = partial(_mujoco_forces, mujoco, model, [joint for joint, *_ in links])
    return _machine(path, "MuJoCo", np.array(model.opt.gravity), machine_links, forces)


def _at_zero(model: Any, joint: int, kind: str, rest: Placement, anchor: Array) -> Placement:
    """Return the place of a joint's frame in the parent with the coordinate at zero; MuJoCo gives it (``rest``, with
    the joint at ``anchor`` in the body) at the reference coordinate."""
    axis, reference = np.array(model.jnt_axis[joint]), float(model.qpos0[model.jnt_qposadr[joint]])
    if kind == "revolute":
        return Placement(rest.axes @ about_axis(axis, -reference), rest.point(anchor))
    if kind == "prismatic":
        return Placement(rest.axes, rest.point(-reference * axis))
    return AT_ORIGIN if kind == "free" else Placement(rest.axes, rest.point(anchor))


def _mujoco_numbers(model: Any, joint: int) -> Mapping[str, float | str]:
    rate, stiffness = int(model.jnt_dofadr[joint]), float(model.jnt_stiffness[joint])
    return {
        "stiffness": stiffness,
        "damping": float(model.dof_damping[rate]),
        "rest": float(model.qpos_spring[model.jnt_qposadr[joint]]) if stiffness else 0.0,
        "rotor_inertia": float(model.dof_armature[rate]),
    }


def _mujoco_forces(mujoco: Any, model: Any, joints: Sequence[int], motion: MachineMotion) -> Forces:
    """Return the inertia matrices and total forces of all states by MuJoCo, in the order of the links and in body-fixed
    velocities with the angular part first; bias and applied forces are None."""
    data, masses, totals = mujoco.MjData(model), [], []
    for state in range(len(motion.q[0])):
        transform, drift = np.zeros((model.nv, model.nv)), np.zeros(model.nv)
        start = 0
        for joint, every_q, every_v in zip(joints, motion.q, motion.v, strict=True):
            q, v = every_q[state], every_v[state]
            q_start, rate = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
            if len(v) == 6:
                data.qpos[q_start : q_start + 7] = [*q[4:], *q[:4]]
                axes = rotation_matrix(q[:4])
                transform[rate : rate + 3, start + 3 : start + 6] = axes
                transform[rate + 3 : rate + 6, start : start + 3] = np.eye(3)
                drift[rate : rate + 3] = axes @ np.cross(v[:3], v[3:])
            else:
                data.qpos[q_start : q_start + len(q)] = q
                transform[rate : rate + len(v), start : start + len(v)] = np.eye(len(v))
            start += len(v)
        data.qvel[:] = transform @ np.concatenate([v[state] for v in motion.v])
        mujoco.mj_forward(model, data)
        mass = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, mass)
        masses.append(transform.T @ mass @ transform)
        totals.append(transform.T @ (data.qfrc_bias + mass @ drift - data.qfrc_passive))
    return Forces(np.array(masses), None, None, np.array(totals))


def read_pinocchio(path: Path) -> Machine:
    """Return Pinocchio's reading of a URDF file. Raises DescriptionError, also for planar and mimic joints."""
    pinocchio = _module("pinocchio", "pin")
    try:
        model = pinocchio.buildModelFromUrdf(str(path))
    except (ValueError, RuntimeError) as error:
        fault = f"Pinocchio does not read the file: {' '.join(str(error).split())} [E0569]"
        raise DescriptionError(Problem(path.name, fault, "a URDF file that Pinocchio reads")) from None
    data = model.createData()
    pinocchio.forwardKinematics(model, data, pinocchio.neutral(model), np.zeros(model.nv))
    frames = [frame for frame in model.frames if frame.type == pinocchio.BODY]
    legal = legal_names([frame.name for frame in frames])
    bodies = {frame.parentJoint: legal[frame.name] for frame in reversed(frames)}
    names = legal_names(list(model.names))
    links = []
    for number in range(1, model.njoints):
        kind = _pinocchio_type(model.joints[number].shortname(), model.names[number], path)
        placed, inertia = model.jointPlacements[number], model.inertias[number]
        subspace = np.array(data.joints[number].S).reshape(6, -1)[:, 0]
        axis = {"revolute": subspace[3:], "prismatic": subspace[:3]}.get(kind)
        whole = Inertia(float(inertia.mass), np.array(inertia.lever), np.array(inertia.inertia))
        name = names[model.names[number]]
        body, rate = bodies.get(number, name), int(model.joints[number].idx_v)
        pose = Placement(np.array(placed.rotation), np.array(placed.translation))
        parts: dict[str, MachineBody] = {body: MachineBody(whole, AT_ORIGIN, "")}
        numbers = {} if axis is None else {"rotor_inertia": float(model.armature[rate])}
        parent = int(model.parents[number]) - 1
        links.append(MachineLink(name, kind, body, parent, pose, axis, None, parts, numbers))
    forces = partial(_pinocchio_forces, pinocchio, model)
    return _machine(path, "Pinocchio", np.array(model.gravity.linear), links, forces)


def _pinocchio_type(name: str, joint: str, path: Path) -> str:
    if name == "JointModelPlanar" or "Mimic" in name:
        fault = f"Pinocchio's {name} has coordinates of another kind [E0570]"
        raise DescriptionError(Problem(f"{path.name} ({joint})", fault, "eomgen compare with another description"))
    return next(kind for start, kind in reversed(_PINOCCHIO.items()) if name.startswith(start))


def _pinocchio_forces(pinocchio: Any, model: Any, motion: MachineMotion) -> Forces:
    """Return the inertia matrix and nonlinear effects by Pinocchio, with the viscous damping of the file, in velocities
    with the angular part first."""
    data, joints = model.createData(), model.joints[1:]
    order = np.concatenate([_linear_first(v.shape[1]) + joint.idx_v for v, joint in zip(motion.v, joints, strict=True)])
    masses, totals = [], []
    for state in range(len(motion.q[0])):
        q, v = np.zeros(model.nq), np.zeros(model.nv)
        for joint, every_q in zip(joints, motion.q, strict=True):
            q[joint.idx_q : joint.idx_q + joint.nq] = _numbers(every_q[state], joint.nq)
        v[order] = np.concatenate([item[state] for item in motion.v])
        mass = np.array(pinocchio.crba(model, data, q))
        mass = np.triu(mass) + np.triu(mass, 1).T
        total = np.array(pinocchio.nonLinearEffects(model, data, q, v)) + np.array(model.damping) * v
        masses.append(mass[np.ix_(order, order)])
        totals.append(total[order])
    return Forces(np.array(masses), None, None, np.array(totals))


def _linear_first(size: int) -> NDArray[np.intp]:
    """Return Pinocchio's places of the components of a velocity."""
    return np.array([3, 4, 5, 0, 1, 2]) if size == 6 else np.arange(size)


def _numbers(q: Array, size: int) -> Array:
    """Return Pinocchio's numbers of a coordinate: unbounded angles as cosine and sine, w of quaternions last."""
    if len(q) == 7:
        return np.concatenate([q[4:], q[1:4], q[:1]])
    return np.array([np.cos(q[0]), np.sin(q[0])]) if size == 2 else q


READERS: Mapping[str, Callable[[Path], Machine]] = {"mujoco": read_mujoco, "pinocchio": read_pinocchio}
