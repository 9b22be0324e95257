"""Pinocchio as an oracle: a model from the same URDF file, and states taken from eomgen's conventions to Pinocchio's.

eomgen: quaternion (w, x, y, z) before position, twists angular first, joints in the scene's order. Pinocchio: position
before quaternion (x, y, z, w), twists linear first, joints sorted by name among siblings, unbounded revolute joints as
(cos, sin).
"""

from __future__ import annotations

import importlib.metadata
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from eomgen.scene.bodies.model import Body
from eomgen.scene.joint_types import JOINTS
from eomgen.scene.joints.model import Joint
from eomgen.scene.scene import Scene
from tests.oracles.evaluation import Array
from tests.oracles.formulas import value_of

#: Where Pinocchio has each component of v that eomgen has, where the orders differ.
_INNER = {"free": (3, 4, 5, 0, 1, 2), "planar": (2, 0, 1)}


def robot_file(path: str) -> Path:
    """Return a file of example-robot-data, given relative to its ``robots`` folder."""
    wanted = f"share/example-robot-data/robots/{path}"
    for file in importlib.metadata.files("example-robot-data") or ():
        if file.as_posix().endswith(wanted):
            return Path(str(file.locate()))
    raise FileNotFoundError(path)


def vector_of(formulas: Sequence[Any]) -> Array:
    return np.array([value_of(item, {}) for item in formulas])


def body_inertia(body: Body) -> Any:
    """Return a body's inertia as Pinocchio's."""
    xx, yy, zz, xy, xz, yz = (value_of(item, {}) for item in body.inertia)
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    found = pin.Inertia.Zero()  # the constructor refuses what no body can have
    found.mass, found.lever, found.inertia = value_of(body.mass, {}), vector_of(body.center_of_mass), tensor
    return found


def _placement(orientation: Sequence[Sequence[float]], position: Sequence[Any]) -> Any:
    return pin.SE3(np.array(orientation), vector_of(position))


@dataclass
class PinocchioOracle:
    """A Pinocchio model with the scene's order of coordinates.

    Attributes
    ----------
    joints : (Pinocchio's joint number, type, first q, first v) in the scene's order
    deviation : largest difference between what Pinocchio read from the file and the scene's snapped numbers
    """

    model: Any
    joints: list[tuple[int, str, int, int]]
    deviation: float

    def __post_init__(self) -> None:
        self.data = self.model.createData()
        order = np.empty(self.model.nv, dtype=int)
        for number, kind, _, v_start in self.joints:
            start = self.model.joints[number].idx_v
            for k, position in enumerate(_INNER.get(kind, range(JOINTS[kind].v_size))):
                order[v_start + k] = start + position
        self.order = order

    def q(self, q: Array) -> Array:
        """Return one configuration as Pinocchio's."""
        found = np.zeros(self.model.nq)
        for number, kind, start, _ in self.joints:
            first = self.model.joints[number].idx_q
            if kind == "free":
                found[first : first + 7] = [*q[start + 4 : start + 7], *q[start + 1 : start + 4], q[start]]
            elif kind == "spherical":
                found[first : first + 4] = [*q[start + 1 : start + 4], q[start]]
            elif kind == "revolute" and self.model.joints[number].nq == 2:
                found[first : first + 2] = np.cos(q[start]), np.sin(q[start])
            else:
                for k, position in enumerate(_INNER.get(kind, range(JOINTS[kind].q_size))):
                    found[first + position] = q[start + k]
        return found

    def v(self, v: Array) -> Array:
        """Return velocities or accelerations as Pinocchio's."""
        found = np.empty(self.model.nv)
        found[self.order] = v
        return found

    def each(self, compute: Callable[..., Array], state: dict[str, Array], *vectors: str) -> Array:
        """Return ``compute(model, data, q, *vectors)`` for all states of a batch, in the scene's order of
        components."""
        results = []
        for k in range(len(state["q"])):
            given = [self.v(state[name][k]) for name in vectors]
            result = np.array(compute(self.model, self.data, self.q(state["q"][k]), *given))
            results.append(result[self.order] if result.ndim == 1 else result[np.ix_(self.order, self.order)])
        return np.array(results)

    def mass(self, state: dict[str, Array]) -> Array:
        def compute(model: Any, data: Any, q: Array) -> Array:
            upper = np.triu(pin.crba(model, data, q))
            return upper + np.triu(upper, 1).T

        return self.each(compute, state)

    def weight(self, state: dict[str, Array]) -> Array:
        """Return the generalized force of gravity."""
        return -self.each(pin.computeGeneralizedGravity, state)

    def coupling(self, state: dict[str, Array]) -> Array:
        """Return the nonlinear effects without gravity."""
        gravity = self.model.gravity.linear.copy()
        self.model.gravity.linear = np.zeros(3)
        effects = self.each(pin.nonLinearEffects, state, "v")
        self.model.gravity.linear = gravity
        return effects

    def inverse_dynamics(self, state: dict[str, Array]) -> Array:
        return self.each(pin.rnea, state, "v", "a")

    def forward_dynamics(self, state: dict[str, Array], tau: Array) -> Array:
        return self.each(pin.aba, {**state, "tau": tau}, "v", "tau")

    def partials(self, state: dict[str, Array]) -> tuple[Array, Array]:
        """Return d rnea / dq (tangent) and d rnea / dv."""
        by_q = self.each(lambda *given: pin.computeRNEADerivatives(*given)[0], state, "v", "a")
        return by_q, self.each(lambda *given: pin.computeRNEADerivatives(*given)[1], state, "v", "a")


def oracle_from_urdf(path: Path, scene: Scene, root: str = "fixed", lock: Sequence[str] = ()) -> PinocchioOracle:
    """Return Pinocchio's model of the file, with placements and inertias replaced by the scene's, which are snapped.

    Both read the file independently; ``deviation`` says how far apart they were, and belongs to a test.
    """
    base = () if root == "fixed" else (pin.JointModelFreeFlyer(),)
    model = pin.buildModelFromUrdf(str(path), *base)
    if lock:
        model = pin.buildReducedModel(model, [model.getJointId(name) for name in lock], pin.neutral(model))
    bodies = {body.name: body for body in scene.bodies}
    joints, deviation, q_start, v_start = [], 0.0, 0, 0
    written_frames = {re.sub(r"[^A-Za-z0-9_]", "_", f.name): f for f in model.frames if f.type == pin.FrameType.BODY}
    written = {re.sub(r"[^A-Za-z0-9_]", "_", name): name for name in model.names}
    for joint in scene.joints:
        name = written.get(joint.name, joint.name) if joint.type != "free" else "root_joint"
        assert joint.type != "fixed" and model.existJointName(name), f"{name} is in one of the models only"
        number = model.getJointId(name)
        joints.append((number, joint.type, q_start, v_start))
        q_start, v_start = q_start + joint.kind.q_size, v_start + joint.kind.v_size
        placement, inertia = _placement(joint.orientation, joint.position), body_inertia(bodies[joint.child])
        deviation = max(deviation, np.abs(placement.homogeneous - model.jointPlacements[number].homogeneous).max())
        deviation = max(deviation, np.abs(inertia.matrix() - model.inertias[number].matrix()).max())
        model.jointPlacements[number], model.inertias[number] = placement, inertia
    for frame in scene.frames:
        if frame.name not in written_frames:
            continue
        found, placement = written_frames[frame.name], _placement(frame.orientation, frame.position)
        deviation = max(deviation, np.abs(placement.homogeneous - found.placement.homogeneous).max())
        found.placement = placement
    assert v_start == model.nv, "the scene has other degrees of freedom than Pinocchio's model"
    model.gravity.linear = np.array([value_of(item, {}) for item in scene.gravity])
    return PinocchioOracle(model, joints, float(deviation))


def _turn(axis: Sequence[float]) -> Any:
    return pin.JointModelRevoluteUnaligned(np.array(axis))


def _travel(axis: Sequence[float]) -> Any:
    return pin.JointModelPrismaticUnaligned(np.array(axis))


def _composite(*models: Any) -> Any:
    joint = pin.JointModelComposite(models[0])
    for model in models[1:]:
        joint.addJoint(model)
    return joint


_MODELS = {
    "revolute": lambda joint: _turn(joint.axis),
    "prismatic": lambda joint: _travel(joint.axis),
    "helical": lambda joint: pin.JointModelHelicalUnaligned(np.array(joint.axis), value_of(joint.pitch, {})),
    "cylindrical": lambda joint: _composite(_turn(joint.axis), _travel(joint.axis)),
    "universal": lambda joint: pin.JointModelUniversal(np.array(joint.axis), np.array(joint.second_axis)),
    "planar": lambda joint: _composite(
        _travel(joint.second_axis), _travel(np.cross(joint.axis, joint.second_axis)), _turn(joint.axis)
    ),
    "spherical": lambda joint: pin.JointModelSpherical(),
    "free": lambda joint: pin.JointModelFreeFlyer(),
}


def oracle_of_tree(scene: Scene, carrier: Any = None) -> PinocchioOracle:
    """Return Pinocchio's model of a scene of numbers, composed joint by joint; fixed joints are left to Pinocchio's
    merging.

    With a ``carrier`` inertia the tree stands on a free-flyer, whose 7 numbers of q and 6 of v come before the scene's.
    """
    model = pin.Model()
    at: dict[str, tuple[int, Any]] = {"base": (0, pin.SE3.Identity())}
    joints: list[tuple[int, str, int, int]] = []
    q_start = v_start = 0
    if carrier is not None:
        number = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "carrier")
        model.appendBodyToJoint(number, carrier, pin.SE3.Identity())
        at["base"] = (number, pin.SE3.Identity())
        joints.append((number, "free", 0, 0))
        q_start, v_start = 7, 6
    starts: dict[str, tuple[int, int]] = {}
    for joint in scene.joints:
        starts[joint.name] = (q_start, v_start)
        q_start, v_start = q_start + joint.kind.q_size, v_start + joint.kind.v_size
    for body, joint in _depth_first(scene):
        parent, offset = at[joint.parent]
        placement = offset * _placement(joint.orientation, joint.position)
        if joint.type == "fixed":
            at[body.name] = (parent, placement)
            if parent:
                model.appendBodyToJoint(parent, body_inertia(body), placement)
            continue
        number = model.addJoint(parent, _MODELS[joint.type](joint), placement, joint.name)
        model.appendBodyToJoint(number, body_inertia(body), pin.SE3.Identity())
        at[body.name] = (number, pin.SE3.Identity())
        joints.append((number, joint.type, *starts[joint.name]))
        armature = model.armature
        for k, formula in enumerate(joint.each(joint.rotor_inertia)):
            armature[model.joints[number].idx_v + _INNER.get(joint.type, range(6))[k]] = value_of(formula, {})
        model.armature = armature
    model.gravity.linear = np.array([value_of(item, {}) for item in scene.gravity])
    return PinocchioOracle(model, joints, 0.0)


def _depth_first(scene: Scene) -> list[tuple[Body, Joint]]:
    """Return bodies and joints with every subtree contiguous, which Pinocchio's crba relies on."""
    carried: dict[str, list[tuple[Body, Joint]]] = {}
    for pair in zip(scene.bodies, scene.joints, strict=True):
        carried.setdefault(pair[1].parent, []).append(pair)
    order, waiting = [], carried.get("base", [])[::-1]
    while waiting:
        order.append(waiting.pop())
        waiting += carried.get(order[-1][0].name, [])[::-1]
    return order
