"""The robots: the same URDF file as a scene of eomgen and as a model of Pinocchio, and how their coordinates
correspond."""

from __future__ import annotations

import dataclasses
import importlib.metadata
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.formula.nodes import ZERO, Symbol
from eomgen.scene.forces.forces import Effort
from eomgen.scene.joints.model import Joint
from eomgen.scene.load import load
from eomgen.scene.scene import Scene
from eomgen.system.signals import Input

Array = NDArray[np.float64]

STATES = 64
SNAP = 1e-10


@dataclass(frozen=True)
class Robot:
    """A URDF file of example-robot-data, and how it is used."""

    name: str
    file: str
    root: str
    locked: tuple[str, ...] = ()


ROBOTS = {
    robot.name: robot
    for robot in (
        Robot("panda", "panda_description/urdf/panda.urdf", "fixed", ("panda_finger_joint1", "panda_finger_joint2")),
        Robot("ur5", "ur_description/urdf/ur5_robot.urdf", "fixed"),
        Robot("anymal_b", "anymal_b_simple_description/robots/anymal.urdf", "free"),
        Robot("talos", "talos_data/robots/talos_reduced.urdf", "free"),
    )
}


def urdf(robot: Robot) -> Path:
    """Return the URDF file. Ends the program with the remedy if example-robot-data is not installed."""
    try:
        package = importlib.metadata.distribution("example-robot-data")
    except importlib.metadata.PackageNotFoundError:
        sys.exit("the robots are files of example-robot-data, not installed; try: pip install example-robot-data")
    return Path(str(package.locate_file(f"cmeel.prefix/share/example-robot-data/robots/{robot.file}")))


def scene(robot: Robot) -> Scene:
    """Return the robot as a scene, without the joints' damping, which the peers' algorithms leave out."""
    read = load(urdf(robot), root=robot.root, lock=robot.locked)
    return dataclasses.replace(read, joints=tuple(dataclasses.replace(joint, damping=ZERO) for joint in read.joints))


def driven(undriven: Scene) -> Scene:
    """Return the scene with an input on every velocity component, as forward dynamics of the peers takes them."""
    places = [(joint, index) for joint in undriven.joints for index in range(_sizes(joint)[1])]
    names = [f"effort_{number}" for number in range(len(places))]
    efforts = [
        Effort(name, joint.name, Symbol("input", name), index)
        for name, (joint, index) in zip(names, places, strict=True)
    ]
    return dataclasses.replace(
        undriven,
        inputs=tuple(Input(name) for name in names),
        elements=(*undriven.elements, *efforts),
    )


def shortened(whole: Scene, count: int) -> Scene:
    """Return the first joints of an arm and the bodies they carry."""
    return dataclasses.replace(whole, bodies=whole.bodies[:count], joints=whole.joints[:count], points=())


def _sizes(joint: Joint) -> tuple[int, int]:
    return (7, 6) if joint.type == "free" else (1, 1)


@dataclass(frozen=True)
class PinocchioModel:
    """Pinocchio's reading of the same file, right angles snapped: a model in Python and the text that the programs
    read."""

    model: Any
    text: str
    q_order: NDArray[np.intp]  # q of Pinocchio = q of eomgen [q_order]
    v_order: NDArray[np.intp]
    states: Array  # (STATES, nq + 2 nv) in Pinocchio's order: q, v, and an acceleration or effort

    def states_of_eomgen(self) -> Array:
        """Return the same states in eomgen's order."""
        nq, nv = self.model.nq, self.model.nv
        result = np.empty_like(self.states)
        result[:, self.q_order] = self.states[:, :nq]
        result[:, nq + self.v_order] = self.states[:, nq : nq + nv]
        result[:, nq + nv + self.v_order] = self.states[:, nq + nv :]
        return result


def pinocchio_model(robot: Robot, described: Scene) -> PinocchioModel:
    """Return the peer's model. Raises ImportError when pin is not installed."""
    import pinocchio as pin  # type: ignore[import-untyped]  # noqa: PLC0415  # a peer, which may be missing

    file = str(urdf(robot))
    model = (
        pin.buildModelFromUrdf(file, pin.JointModelFreeFlyer())
        if robot.root == "free"
        else pin.buildModelFromUrdf(file)
    )
    if robot.locked:
        model = pin.buildReducedModel(model, [model.getJointId(name) for name in robot.locked], pin.neutral(model))
    model.gravity.linear = np.array([item.value for item in described.gravity if hasattr(item, "value")])
    lines = []
    for joint in range(1, model.njoints):
        placement = model.jointPlacements[joint]
        model.jointPlacements[joint] = pin.SE3(_snapped(placement.rotation), placement.translation)
        lines.append(_line(model, joint))
    q_order, v_order = _orders(model, described.joints)
    return PinocchioModel(model, "".join(lines), q_order, v_order, _states(model))


def _snapped(rotation: Array) -> Array:
    rounded = np.round(rotation)
    return np.where(np.abs(rotation - rounded) <= SNAP, rounded, rotation)


def _line(model: Any, joint: int) -> str:
    """Return one joint in the format of native/read_model.hpp."""
    kind = model.joints[joint].shortname()
    axis = np.zeros(3)
    if kind.endswith("Unaligned"):
        axis = np.array(model.joints[joint].extract().axis)
    elif kind[-1] in "XYZ":
        axis["XYZ".index(kind[-1])] = 1.0
    name = {"JointModelFreeFlyer": "free", "JointModelP": "prismatic"}.get(kind.rstrip("XYZ"), "revolute")
    placement, body = model.jointPlacements[joint], model.inertias[joint]
    upper = body.inertia[np.triu_indices(3)]
    numbers = [*axis, *placement.rotation.ravel(), *placement.translation, body.mass, *body.lever, *upper]
    return " ".join([str(model.parents[joint]), name, *(repr(float(number)) for number in numbers)]) + "\n"


def _orders(model: Any, joints: Sequence[Joint]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    q_order, v_order = np.empty(model.nq, dtype=np.intp), np.empty(model.nv, dtype=np.intp)
    q_start = v_start = 0
    for joint in joints:
        number = model.getJointId(joint.name)
        if number >= model.njoints:
            raise ValueError(f"Pinocchio has no joint {joint.name}")
        q_size, v_size = _sizes(joint)
        q_places, v_places = ([4, 5, 6, 1, 2, 3, 0], [3, 4, 5, 0, 1, 2]) if joint.type == "free" else ([0], [0])
        q_order[model.idx_qs[number] : model.idx_qs[number] + q_size] = q_start + np.array(q_places)
        v_order[model.idx_vs[number] : model.idx_vs[number] + v_size] = v_start + np.array(v_places)
        q_start, v_start = q_start + q_size, v_start + v_size
    if (q_start, v_start) != (model.nq, model.nv):
        raise ValueError(f"{q_start} coordinates here, {model.nq} in Pinocchio")
    return q_order, v_order


def _states(model: Any) -> Array:
    random = np.random.default_rng(20261120)
    states = random.uniform(-1.0, 1.0, (STATES, model.nq + 2 * model.nv))
    for joint in range(1, model.njoints):
        if model.nqs[joint] == 7:
            quaternion = states[:, model.idx_qs[joint] + 3 : model.idx_qs[joint] + 7]
            quaternion /= np.linalg.norm(quaternion, axis=1, keepdims=True)
    return states


def reference(peer: PinocchioModel) -> dict[str, Array]:
    """Return what Pinocchio's wheel says of every state, row by row."""
    import pinocchio as pin  # noqa: PLC0415  # a peer, which may be missing

    model, data = peer.model, peer.model.createData()
    nq, nv = model.nq, model.nv
    rows: dict[str, list[Array]] = {"inverse_dynamics": [], "mass": [], "forward_dynamics": [], "partials": []}
    for state in peer.states:
        q, v, x = state[:nq].copy(), state[nq : nq + nv].copy(), state[nq + nv :].copy()
        rows["inverse_dynamics"].append(np.array(pin.rnea(model, data, q, v, x)))
        rows["mass"].append(_symmetric(pin.crba(model, data, q)).ravel())
        rows["forward_dynamics"].append(np.array(pin.aba(model, data, q, v, x)))
        K, C, M = pin.computeRNEADerivatives(model, data, q, v, x)
        rows["partials"].append(np.concatenate([K.ravel(), C.ravel(), _symmetric(M).ravel()]))
    return {name: np.array(values) for name, values in rows.items()}


def _symmetric(matrix: Array) -> Array:
    upper = np.triu(matrix)
    return upper + np.triu(upper, 1).T
