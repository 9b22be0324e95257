"""Random trees in Drake: from one URDF that both programs read, and composed joint by joint."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from eomgen.mechanics.derive import derive
from eomgen.scene.joints.model import Joint
from eomgen.scene.load import load
from eomgen.scene.scene import Scene
from eomgen.system.description import BASE
from eomgen.system.system import System
from tests.oracles.evaluation import Array
from tests.oracles.formulas import value_of
from tests.oracles.random_scenes import random_scene
from tests.oracles.states import rotation_of
from tests.peers.trees import TERMS, Differences, Values, differences, numbers_of, states, tensor_of, without_rotors

#: A state as Drake's: positions, the matrix from eomgen's velocities to Drake's, and its rate times the velocities.
Translation = Callable[[Array, Array], tuple[Array, Array, Array]]


def urdf(seed: int) -> Differences:
    """Compare a tree that both read from one URDF; every other one has a free root."""

    text, root = random_urdf(seed), ("fixed", "free")[seed % 2]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "tree.urdf"
        path.write_text(text, encoding="utf-8")
        scene = load(path, root=root)
    plant = import_module("pydrake.multibody.plant").MultibodyPlant(0.0)
    import_module("pydrake.multibody.parsing").Parser(plant).AddModelsFromString(text, "urdf")
    if root == "fixed":
        plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("link0"))
    plant.mutable_gravity_field().set_gravity_vector(numbers_of(scene.gravity))
    plant.Finalize()
    free = [] if root == "fixed" else [plant.get_joint(index) for index in plant.GetJointIndices()][-1:]
    parts = [
        free if joint.type == "free" else [plant.GetJointByName(joint.name)]
        for joint in scene.joints
        if joint.type != "fixed"
    ]
    return _compared(seed, scene, plant, parts)


def joints(seed: int) -> Differences:
    """Compare a tree of any joint types, made by Drake's interface; a cylindrical joint is two joints in turn."""
    scene = without_rotors(random_scene(seed))
    return _compared(seed, scene, *_plant(scene))


def random_urdf(seed: int, links: int = 6) -> str:
    """Return the text of a random tree with revolute, continuous, prismatic and fixed joints with dampers."""
    rng = np.random.default_rng(seed)

    def place(size: float) -> str:
        return f'<origin xyz="{_printed(rng.uniform(-size, size, 3))}" rpy="{_printed(rng.uniform(-3, 3, 3))}"/>'

    parts = []
    for k in range(links + 1):
        places = rng.uniform(-0.4, 0.4, (6, 3))
        tensor = np.sum(places * places) * np.eye(3) - places.T @ places
        entries = [f'i{"xyz"[i]}{"xyz"[j]}="{_printed([tensor[i, j]])}"' for i in range(3) for j in range(i, 3)]
        mass = f'<mass value="{_printed([rng.uniform(0.5, 5.0)])}"/><inertia {" ".join(entries)}/>'
        parts.append(f'<link name="link{k}"><inertial>{place(0.3)}{mass}</inertial></link>')
    for k in range(1, links + 1):
        kind = rng.choice(["revolute", "continuous", "prismatic", "fixed"], p=[0.4, 0.2, 0.3, 0.1])
        axis = rng.normal(size=3)
        ends = f'<parent link="link{rng.integers(k)}"/><child link="link{k}"/>'
        law = f'<axis xyz="{_printed(axis / np.linalg.norm(axis))}"/><dynamics damping="{_printed([rng.uniform()])}"/>'
        limit = '<limit lower="-9" upper="9" effort="9" velocity="9"/>'
        inside = "" if kind == "fixed" else law + limit
        parts.append(f'<joint name="joint{k}" type="{kind}">{place(0.6)}{ends}{inside}</joint>')
    return f'<robot name="tree">{"".join(parts)}</robot>'


def _printed(values: Sequence[float] | Array) -> str:
    return " ".join(repr(float(value)) for value in values)


def _plant(scene: Scene) -> tuple[Any, list[list[Any]]]:
    """Return Drake's plant of a tree, and its joints for each moving joint of the scene."""
    math, tree = import_module("pydrake.math"), import_module("pydrake.multibody.tree")
    plant, parts = import_module("pydrake.multibody.plant").MultibodyPlant(0.0), list[list[Any]]()
    carried = {BASE: plant.world_body()}

    def frame(body: Any, place: Any) -> Any:
        return plant.AddFrame(tree.FixedOffsetFrame(f"frame{plant.num_frames()}", body.body_frame(), place))

    for body, joint in zip(scene.bodies, scene.joints, strict=True):
        mass, inertia = value_of(body.mass, {}), tree.SpatialInertia.Zero()
        if mass:
            xx, yy, zz, xy, xz, yz = tensor_of(body.inertia)[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
            about = tree.RotationalInertia(xx, yy, zz, xy, xz, yz)
            inertia = tree.SpatialInertia.MakeFromCentralInertia(mass, numbers_of(body.center_of_mass), about)
        child = carried[body.name] = plant.AddRigidBody(body.name, inertia)
        parent, aligned = carried[joint.parent], math.RigidTransform(math.RotationMatrix(_aligned(joint)))
        place = math.RigidTransform(math.RotationMatrix(np.array(joint.orientation)), numbers_of(joint.position))
        place = place @ aligned
        new = []
        if joint.type == "cylindrical":
            between = plant.AddRigidBody(f"{body.name}_turned", tree.SpatialInertia.Zero())
            turn = tree.RevoluteJoint(f"{joint.name}_turn", frame(parent, place), between.body_frame(), joint.axis)
            new.append(plant.AddJoint(turn))
            parent, place = between, math.RigidTransform()
        law = {
            "fixed": (tree.WeldJoint, math.RigidTransform()),
            "revolute": (tree.RevoluteJoint, joint.axis),
            "prismatic": (tree.PrismaticJoint, joint.axis),
            "cylindrical": (tree.PrismaticJoint, joint.axis),
            "helical": (tree.ScrewJoint, joint.axis, 2.0 * np.pi * value_of(joint.pitch, {}), 0.0),  # for a turn
            "universal": (tree.UniversalJoint, 0.0),
            "planar": (tree.PlanarJoint, np.zeros(3)),
            "spherical": (tree.BallRpyJoint, 0.0),
            "free": (tree.QuaternionFloatingJoint, 0.0, 0.0),
        }[joint.type]
        new.append(plant.AddJoint(law[0](joint.name, frame(parent, place), frame(child, aligned), *law[1:])))
        if joint.type != "fixed":
            parts.append(new)
    plant.mutable_gravity_field().set_gravity_vector(numbers_of(scene.gravity))
    plant.Finalize()
    return plant, parts


def _aligned(joint: Joint) -> Array:
    """Return the axes that Drake's frames of a joint need: universal joints turn about x and y, planar ones about z."""
    if joint.type not in ("universal", "planar"):
        return np.eye(3)
    first, second = np.array(joint.axis), np.array(joint.second_axis)
    third = np.cross(first, second)
    return np.column_stack([first, second, third] if joint.type == "universal" else [second, third, first])


def _compared(seed: int, scene: Scene, plant: Any, parts: list[list[Any]]) -> Differences:
    """Compare the terms of a scene with a plant, whose joints are given for each moving joint of the scene."""
    moving = [joint for joint in scene.joints if joint.type != "fixed"]

    def translate(q: Array, v: Array) -> tuple[Array, Array, Array]:
        positions, A, rate = np.zeros(plant.num_positions()), np.zeros((len(v), len(v))), np.zeros(len(v))
        q_start = v_start = 0
        for joint, own in zip(moving, parts, strict=True):
            columns = np.arange(v_start, v_start + joint.kind.v_size)
            rows = np.concatenate([part.velocity_start() + np.arange(part.num_velocities()) for part in own])
            places = np.concatenate([part.position_start() + np.arange(part.num_positions()) for part in own])
            values, block, drift = _translated(joint.type, q[q_start : q_start + joint.kind.q_size], v[columns])
            positions[places], A[np.ix_(rows, columns)], rate[rows] = values, block, drift
            q_start, v_start = q_start + joint.kind.q_size, v_start + joint.kind.v_size
        return positions, A, rate

    system = derive(scene, TERMS)
    state = states(system, seed)
    return differences(system, state, _values(plant, system, state, translate))


def _translated(kind: str, q: Array, v: Array) -> tuple[Array, Array, Array]:
    """Return positions, matrix and rate of one joint."""
    still = np.zeros(len(v))
    if kind == "free":  # of eomgen in axes of the body, of Drake in axes of the parent
        R = rotation_of(q[:4])
        return q, np.kron(np.eye(2), R), np.concatenate([np.zeros(3), R @ np.cross(v[:3], v[3:])])
    if kind == "spherical":
        math, R = import_module("pydrake.math"), rotation_of(q)
        return math.RollPitchYaw(math.RotationMatrix(R)).vector(), R, still
    order = [1, 2, 0] if kind == "planar" else list(range(len(v)))
    return q[order], np.eye(len(v))[order], still


def _values(plant: Any, system: System, state: Mapping[str, Array], translate: Translation) -> Values:
    """Return Drake's mass matrix, inverse dynamics and accelerations in the coordinates of a system."""
    context, rows = plant.CreateDefaultContext(), []
    for q, v, a in zip(state["q"], state["v"], state["a"], strict=True):
        positions, A, rate = translate(q, v)
        plant.SetPositions(context, positions)
        plant.SetVelocities(context, A @ v)
        forces = import_module("pydrake.multibody.tree").MultibodyForces(plant)
        plant.CalcForceElementsContribution(context, forces)
        tau = plant.CalcInverseDynamics(context, A @ a + rate, forces)
        derivatives = plant.EvalTimeDerivatives(context).CopyToVector()[plant.num_positions() :]
        rows.append((A.T @ plant.CalcMassMatrix(context) @ A, A.T @ tau, np.linalg.solve(A, derivatives - rate)))
    mass, torques, accelerations = (np.array(part) for part in zip(*rows, strict=True))
    return {
        ("mass matrix", "mass", "M"): mass,
        ("inverse dynamics", "inverse_dynamics", "tau"): torques,
        ("accelerations", "forward_dynamics", "vdot"): accelerations,
    }
