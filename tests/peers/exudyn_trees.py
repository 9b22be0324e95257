"""Random trees in EXUDYN: its kinematic tree in minimal coordinates."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np

from eomgen.mechanics.derive import derive
from eomgen.scene.scene import Scene
from eomgen.system.description import BASE
from tests.oracles.evaluation import Array
from tests.oracles.formulas import value_of
from tests.peers.trees import (
    TERMS,
    Differences,
    Values,
    differences,
    first_scene,
    kinds,
    numbers_of,
    states,
    tensor_of,
    without_rotors,
)


def dynamics(seed: int) -> Differences:
    """Compare the mass matrix, the forces at no acceleration, and accelerations."""
    exudyn = import_module("exudyn")

    def fits(scene: Scene) -> bool:
        return kinds(scene) <= {"revolute", "prismatic"} and all(value_of(body.mass, {}) for body in scene.bodies)

    scene = without_rotors(first_scene(seed, fits))
    system = derive(scene, TERMS)
    container, solver = exudyn.SystemContainer(), exudyn.MainSolverStatic()
    mbs = container.AddSystem()
    _add_tree(mbs, scene)
    settings = exudyn.SimulationSettings()
    settings.solutionSettings.writeSolutionToFile = False
    solver.InitializeSolver(mbs, settings)
    state, mass, forces = states(system, seed), [], []
    for q, v in zip(state["q"], state["v"], strict=True):
        mbs.systemData.SetODE2Coordinates(q)
        mbs.systemData.SetODE2Coordinates_t(v)
        solver.ComputeMassMatrix(mbs)
        solver.ComputeODE2RHS(mbs)
        mass.append(np.array(solver.GetSystemMassMatrix()))
        forces.append(-np.array(solver.GetSystemResidual())[: system.nv])
    M, bias = np.array(mass), np.array(forces)
    expected: Values = {
        ("mass matrix", "mass", "M"): M,
        ("forces at no acceleration", "inverse_dynamics", "tau"): bias,
        ("accelerations", "forward_dynamics", "vdot"): np.linalg.solve(M, -bias[..., np.newaxis])[..., 0],
    }
    return differences(system, {**state, "a": np.zeros_like(state["v"])}, expected)


def _add_tree(mbs: Any, scene: Scene) -> None:
    """Add a scene to a system of EXUDYN, with frames of links whose z axes are the axes of the joints."""
    exudyn, items = import_module("exudyn"), import_module("exudyn.itemInterface")

    number_of = {body.name: k for k, body in enumerate(scene.bodies)}
    axes = {BASE: np.eye(3)} | {joint.child: _to_z(np.array(joint.axis)) for joint in scene.joints}
    types = {"revolute": exudyn.JointType.RevoluteZ, "prismatic": exudyn.JointType.PrismaticZ}
    pairs = list(zip(scene.bodies, scene.joints, strict=True))
    turns = [axes[joint.parent].T @ np.array(joint.orientation) @ axes[body.name] for body, joint in pairs]
    tensors = [axes[body.name].T @ tensor_of(body.inertia) @ axes[body.name] for body in scene.bodies]
    offsets = [axes[joint.parent].T @ numbers_of(joint.position) for joint in scene.joints]
    centers = [axes[body.name].T @ numbers_of(body.center_of_mass) for body in scene.bodies]
    zeros = [0.0] * len(pairs)
    start = {"referenceCoordinates": zeros, "initialCoordinates": zeros, "initialCoordinates_t": zeros}
    tree = items.ObjectKinematicTree(
        nodeNumber=mbs.AddNode(items.NodeGenericODE2(numberOfODE2Coordinates=len(pairs), **start)),
        gravity=numbers_of(scene.gravity).tolist(),
        jointTypes=[types[joint.type] for joint in scene.joints],
        linkParents=[number_of.get(joint.parent, -1) for joint in scene.joints],
        jointTransformations=exudyn.Matrix3DList(turns),
        jointOffsets=exudyn.Vector3DList(offsets),
        linkInertiasCOM=exudyn.Matrix3DList(tensors),
        linkCOMs=exudyn.Vector3DList(centers),
        linkMasses=[value_of(body.mass, {}) for body in scene.bodies],
    )
    mbs.AddObject(tree)
    mbs.Assemble()


def _to_z(axis: Array) -> Array:
    """Return a rotation whose third column is a unit vector."""
    across = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    across /= np.linalg.norm(across)
    return np.column_stack([across, np.cross(axis, across), axis])
