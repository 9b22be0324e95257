"""Random trees of rigid bodies in Pinocchio, MuJoCo, Drake and EXUDYN: equations at random states."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from eomgen.mechanics.derive import derive
from eomgen.scene.forces.springs import Spring, TorsionSpring
from eomgen.scene.joints.model import Joint
from eomgen.scene.load import load
from eomgen.scene.scene import Scene
from eomgen.system.description import BASE, Point
from eomgen.system.system import System
from tests.models.elements import elements_with
from tests.oracles.evaluation import Array, relative_error, tape_evaluator
from tests.oracles.formulas import number, value_of, vector
from tests.oracles.random_scenes import NUMBERS, random_scene
from tests.oracles.states import random_states, random_unit_quaternions, rotation_of

STATES = 5
Differences = dict[str, float]


def first_scene(seed: int, fits: Callable[[Scene], bool]) -> Scene:
    """Return the first random tree that fits, of trees that belong to this seed alone."""
    return next(scene for scene in map(random_scene, range(1000 * seed, 1000 * seed + 1000)) if fits(scene))


def kinds(scene: Scene) -> set[str]:
    """Return the types of the joints of a scene."""
    return {joint.type for joint in scene.joints}


def without_rotors(scene: Scene) -> Scene:
    """Return the scene with joints whose rotors have no inertia."""

    def bare(joint: Joint) -> Joint:
        zeros = tuple(number(0.0) for _ in joint.each(joint.rotor_inertia))
        return replace(joint, rotor_inertia=zeros if isinstance(joint.rotor_inertia, tuple) else number(0.0))

    return replace(scene, joints=tuple(bare(joint) for joint in scene.joints))


def compared(
    system: System, state: Mapping[str, Array], expected: Mapping[tuple[str, str, str], Array]
) -> Differences:
    """Return the largest relative differences, of the norms at each state, by quantity.

    Parameters
    ----------
    expected : values of the peer by quantity, function of the system and its output
    """
    evaluate = tape_evaluator(system)
    return {
        name: relative_error(evaluate(function, state)[block], values, values.ndim - 1)
        for (name, function, block), values in expected.items()
    }


# -- Pinocchio ---------------------------------------------------------------------------------------------------------


#: Joints whose motion subspace changes with their coordinates: universal ones, and composites that turn after moving.
VARYING = {"universal", "planar"}


def pinocchio_trees(seed: int) -> Differences:
    """Compare terms, inverse and forward dynamics of a tree of any joint types."""
    from tests.oracles.pinocchio_oracle import oracle_of_tree

    scene = random_scene(seed)
    system = derive(scene, ["mass", "coupling", "force", "inverse_dynamics", "forward_dynamics"])
    oracle, state = oracle_of_tree(scene), random_states(system, STATES, np.random.default_rng(seed))
    return compared(
        system,
        state,
        {
            ("mass matrix", "mass", "M"): oracle.mass(state),
            ("velocity terms", "coupling", "h"): oracle.coupling(state),
            ("gravity", "force", "Q"): oracle.weight(state),
            ("inverse dynamics", "inverse_dynamics", "tau"): oracle.inverse_dynamics(state),
            ("accelerations", "forward_dynamics", "vdot"): oracle.forward_dynamics(state, np.zeros_like(state["v"])),
        },
    )


def pinocchio_partials(seed: int, *, varying: bool = False) -> Differences:
    """Compare partials of inverse dynamics; with ``varying`` of trees with joints whose motion subspace varies."""
    from tests.oracles.pinocchio_oracle import oracle_of_tree

    scene = first_scene(seed, lambda scene: bool(kinds(scene) & VARYING) == varying)
    system = derive(scene, ["partials"])
    oracle, state = oracle_of_tree(scene), random_states(system, STATES, np.random.default_rng(seed))
    by_q, by_v = oracle.partials(state)
    expected = {("partials by q", "partials", "K"): by_q, ("partials by v", "partials", "C"): by_v}
    if varying:
        expected[("differences of inverse dynamics by v", "partials", "C")] = np.stack(
            [
                (oracle.inverse_dynamics({**state, "v": state["v"] + d}) - oracle.inverse_dynamics({**state, "v": state["v"] - d}))
                / 2.0
                for d in np.eye(system.nv)
            ],
            axis=-1,
        )
    return compared(system, state, expected)


def pinocchio_varying(seed: int) -> Differences:
    """Compare partials of trees with universal and planar joints, and with differences of Pinocchio's own function."""
    return pinocchio_partials(seed, varying=True)


# -- MuJoCo ------------------------------------------------------------------------------------------------------------


def with_springs(scene: Scene, seed: int) -> Scene:
    """Return the scene with linear springs and dampers on joints, between joints, and between points.

    Free joints start at the origin, as MuJoCo has them.
    """
    rng = np.random.default_rng(seed)

    def value(low: float, high: float) -> Any:
        return number(float(rng.uniform(low, high)))

    identity = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    joints = tuple(
        replace(joint, position=vector((0.0, 0.0, 0.0)), orientation=identity)
        if joint.type == "free"
        else replace(joint, stiffness=value(1, 9), damping=value(0.1, 2), rest=value(-1, 1))
        if joint.type in NUMBERS and rng.uniform() < 0.6
        else joint
        for joint in scene.joints
    )
    bodies = [body.name for body in scene.bodies]
    points = (
        Point("ground", BASE, vector((1.5, -2.0, 2.5))),
        Point("tip", bodies[-1], vector(rng.uniform(-0.5, 0.5, 3).tolist())),
        Point("middle", bodies[0], vector(rng.uniform(-0.5, 0.5, 3).tolist())),
    )
    springs = [Spring("stay", "ground", "tip", value(5, 40), value(0.2, 2), value(0.5, 2))]
    if bodies[0] != bodies[-1]:
        springs.append(Spring("brace", "tip", "middle", value(5, 40), value(0.2, 2), value(0.5, 2)))
    turning = [joint.name for joint in scene.joints if joint.type == "revolute"]
    second = turning[-1] if len(turning) > 1 else ""
    torsion = [TorsionSpring("couple", first, second, value(1, 9), value(0.1, 1), value(0, 1)) for first in turning[:1]]
    return replace(
        scene, joints=joints, points=points, elements=elements_with(scene, springs=springs, torsion_springs=torsion)
    )


def mujoco_trees(seed: int) -> Differences:
    """Compare inverse and forward dynamics of a tree with springs, dampers and rotors."""
    from tests.oracles.mujoco_oracle import KINDS, Engine

    def is_of_mujoco(scene: Scene) -> bool:
        free_above = all(joint.parent == BASE for joint in scene.joints if joint.type == "free")
        return kinds(scene) <= {*KINDS, "fixed"} and free_above and all(value_of(it.mass, {}) for it in scene.bodies)

    scene = with_springs(first_scene(seed, is_of_mujoco), seed)
    system = derive(scene, ["inverse_dynamics", "forward_dynamics"])
    engine, state = Engine.of(scene, system), random_states(system, STATES, np.random.default_rng(seed))
    each = list(zip(state["q"], state["v"], state["a"], strict=True))
    return compared(
        system,
        state,
        {
            ("inverse dynamics", "inverse_dynamics", "tau"): np.array([engine.inverse(*one) for one in each]),
            ("accelerations", "forward_dynamics", "vdot"): np.array([engine.forward(q, v) for q, v, _ in each]),
        },
    )


# -- Drake -------------------------------------------------------------------------------------------------------------


def _numbers(values: Sequence[float]) -> str:
    return " ".join(repr(float(value)) for value in values)


def random_urdf(seed: int, links: int = 6) -> str:
    """Return the text of a random tree with revolute, continuous, prismatic and fixed joints, some of them damped."""
    rng = np.random.default_rng(seed)
    text = ""
    for k in range(links + 1):
        masses, places = rng.uniform(0.1, 0.8, 6), rng.uniform(-0.4, 0.4, (6, 3))
        center = masses @ places / masses.sum()
        r = places - center
        tensor = np.einsum("k,ki,ki->", masses, r, r) * np.eye(3) - np.einsum("k,ki,kj->ij", masses, r, r)
        entries = " ".join(f'i{"xyz"[i]}{"xyz"[j]}="{tensor[i, j]!r}"' for i in range(3) for j in range(i, 3))
        text += (
            f'<link name="link{k}"><inertial><origin xyz="{_numbers(center)}" rpy="{_numbers(rng.uniform(-3, 3, 3))}"/>'
            f'<mass value="{masses.sum()!r}"/><inertia {entries}/></inertial></link>'
        ).replace("np.float64(", "").replace(")", "")
    for k in range(1, links + 1):
        kind = rng.choice(["revolute", "continuous", "prismatic", "fixed"], p=[0.4, 0.2, 0.3, 0.1])
        axis = rng.normal(size=3)
        place = f'xyz="{_numbers(rng.uniform(-0.6, 0.6, 3))}" rpy="{_numbers(rng.uniform(-3, 3, 3))}"'
        law = f'<dynamics damping="{rng.uniform(0, 1)!r}"/><limit lower="-9" upper="9" effort="9" velocity="9"/>'
        text += (
            f'<joint name="joint{k}" type="{kind}"><origin {place}/><parent link="link{rng.integers(k)}"/>'
            f'<child link="link{k}"/>'
        )
        text += "</joint>" if kind == "fixed" else f'<axis xyz="{_numbers(axis / np.linalg.norm(axis))}"/>{law}</joint>'
    return f'<robot name="tree">{text}</robot>'


#: What a state of eomgen is in a peer: configuration, and the matrix from velocities to velocities with its rate times v.
Translation = Callable[[Array, Array], tuple[Array, Array, Array]]


def drake_values(plant: Any, system: System, state: Mapping[str, Array], translate: Translation) -> dict[Any, Array]:
    """Return Drake's mass matrix, inverse dynamics and accelerations in the coordinates of a system."""
    from pydrake.multibody.tree import MultibodyForces

    context, rows = plant.CreateDefaultContext(), []
    for q, v, a in zip(state["q"], state["v"], state["a"], strict=True):
        positions, A, rate = translate(q, v)
        plant.SetPositions(context, positions)
        plant.SetVelocities(context, A @ v)
        forces = MultibodyForces(plant)
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


TERMS = ["mass", "inverse_dynamics", "forward_dynamics"]


def free_rates(q: Array, v: Array) -> tuple[Array, Array]:
    """Return the matrix from velocities in body axes to velocities in axes of the parent, and its rate times v."""
    R = rotation_of(q[:4])
    A = np.kron(np.eye(2), R)
    return A, np.concatenate([np.zeros(3), R @ np.cross(v[:3], v[3:])])


def drake_urdf(seed: int) -> Differences:
    """Compare a tree that both read from one URDF; every other one has a free root."""
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant

    text, root = random_urdf(seed), ("fixed", "free")[seed % 2]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "tree.urdf"
        path.write_text(text, encoding="utf-8")
        scene = load(path, root=root)
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModelsFromString(text, "urdf")
    if root == "fixed":
        plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("link0"))
    plant.mutable_gravity_field().set_gravity_vector([value_of(item, {}) for item in scene.gravity])
    plant.Finalize()
    system = derive(scene, TERMS)

    def translate(q: Array, v: Array) -> tuple[Array, Array, Array]:
        positions, A, rate = np.zeros(plant.num_positions()), np.zeros((len(v), len(v))), np.zeros(len(v))
        for factor in system.factors:
            own_q, own_v = slice(factor.q_start, factor.q_start + factor.q_size), factor.v_start
            if factor.group == "SE3":
                positions[:7] = q[own_q]
                A[:6, own_v : own_v + 6], rate[:6] = free_rates(q[own_q], v[own_v : own_v + 6])
                continue
            joint = plant.GetJointByName(factor.name)
            positions[joint.position_start()] = q[factor.q_start]
            A[joint.velocity_start(), own_v] = 1.0
        return positions, A, rate

    state = random_states(system, STATES, np.random.default_rng(seed))
    return compared(system, state, drake_values(plant, system, state, translate))


def drake_joints(seed: int) -> Differences:
    """Compare a tree of any joint types, composed by Drake's interface; cylindrical joints are two joints in turn."""
    scene = without_rotors(random_scene(seed))
    system = derive(scene, TERMS)
    plant, translate = drake_plant(scene)
    state = random_states(system, STATES, np.random.default_rng(seed))
    return compared(system, state, drake_values(plant, system, state, translate))


def drake_plant(scene: Scene) -> tuple[Any, Translation]:
    """Return Drake's plant of a tree, and the translation of states."""
    from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
    from pydrake.multibody import tree
    from pydrake.multibody.plant import MultibodyPlant

    plant = MultibodyPlant(0.0)
    carried = {BASE: plant.world_body()}
    made: list[tuple[Joint, Any]] = []
    for body, joint in zip(scene.bodies, scene.joints, strict=True):
        mass, (xx, yy, zz, xy, xz, yz) = value_of(body.mass, {}), (value_of(item, {}) for item in body.inertia)
        about = tree.RotationalInertia(xx, yy, zz, xy, xz, yz)
        center = np.array([value_of(item, {}) for item in body.center_of_mass])
        inertia = tree.SpatialInertia.Zero()
        if mass:
            inertia = tree.SpatialInertia.MakeFromCentralInertia(mass, center, about)
        child = plant.AddRigidBody(body.name, inertia)
        carried[body.name] = child
        parent = carried[joint.parent]
        place = RigidTransform(RotationMatrix(np.array(joint.orientation)), [value_of(x, {}) for x in joint.position])
        axis, name = np.array(joint.axis), joint.name
        aligned = RigidTransform()
        if joint.type in ("universal", "planar"):
            columns = [axis, joint.second_axis, np.cross(axis, joint.second_axis)]
            if joint.type == "planar":
                columns = [*columns[1:], axis]
            aligned = RigidTransform(RotationMatrix(np.column_stack(columns)))
        if joint.type == "cylindrical":
            between = plant.AddRigidBody(f"{body.name}_between", tree.SpatialInertia.Zero())
            turn = plant.AddJoint(tree.RevoluteJoint(f"{name}_turn", _frame(plant, parent, place), between.body_frame(), axis))
            travel = plant.AddJoint(tree.PrismaticJoint(name, between.body_frame(), child.body_frame(), axis))
            made.append((joint, (turn, travel)))
            continue
        frames = _frame(plant, parent, place @ aligned), _frame(plant, child, aligned)
        new = {
            "fixed": lambda f: tree.WeldJoint(name, *f, RigidTransform()),
            "revolute": lambda f: tree.RevoluteJoint(name, *f, axis),
            "prismatic": lambda f: tree.PrismaticJoint(name, *f, axis),
            "helical": lambda f: tree.ScrewJoint(name, *f, axis, 2.0 * np.pi * value_of(joint.pitch, {}), 0.0),
            "universal": lambda f: tree.UniversalJoint(name, *f, 0.0),
            "planar": lambda f: tree.PlanarJoint(name, *f, np.zeros(3)),
            "spherical": lambda f: tree.BallRpyJoint(name, *f, 0.0),
            "free": lambda f: tree.QuaternionFloatingJoint(name, *f, 0.0, 0.0),
        }[joint.type]
        made.append((joint, (plant.AddJoint(new(frames)),)))
    plant.mutable_gravity_field().set_gravity_vector([value_of(item, {}) for item in scene.gravity])
    plant.Finalize()

    def translate(q: Array, v: Array) -> tuple[Array, Array, Array]:
        positions, A, rate, q_start, v_start = np.zeros(plant.num_positions()), np.zeros((len(v), len(v))), np.zeros(len(v)), 0, 0
        for joint, parts in made:
            own_q, own_v = q[q_start : q_start + joint.kind.q_size], v[v_start : v_start + joint.kind.v_size]
            q_start, v_start = q_start + joint.kind.q_size, v_start + joint.kind.v_size
            if joint.type == "fixed":
                continue
            columns = np.arange(v_start - joint.kind.v_size, v_start)
            rows = np.concatenate([part.velocity_start() + np.arange(part.num_velocities()) for part in parts])
            places = np.concatenate([part.position_start() + np.arange(part.num_positions()) for part in parts])
            block, drift, values = np.eye(len(own_v)), np.zeros(len(own_v)), own_q
            if joint.type == "free":
                block, drift = free_rates(own_q, own_v)
            elif joint.type == "spherical":
                block, values = rotation_of(own_q), RollPitchYaw(RotationMatrix(rotation_of(own_q))).vector()
            elif joint.type == "planar":
                block = block[[1, 2, 0]]
                values = own_q[[1, 2, 0]]
            elif joint.type == "helical":
                block = np.eye(1)
            A[np.ix_(rows, columns)], rate[rows], positions[places] = block, drift, values
        return positions, A, rate

    return plant, translate


def _frame(plant: Any, body: Any, place: Any) -> Any:
    from pydrake.multibody.tree import FixedOffsetFrame

    return plant.AddFrame(FixedOffsetFrame(f"frame{plant.num_frames()}", body.body_frame(), place))


# -- EXUDYN ------------------------------------------------------------------------------------------------------------


def exudyn_trees(seed: int) -> Differences:
    """Compare the mass matrix and the forces at rest of accelerations of a kinematic tree."""
    import exudyn
    from exudyn import itemInterface as items

    scene = without_rotors(first_scene(seed, lambda scene: kinds(scene) <= {"revolute", "prismatic"}))
    system = derive(scene, TERMS)
    number_of = {BASE: -1} | {body.name: k for k, body in enumerate(scene.bodies)}
    axes = [_to_z(np.array(joint.axis)) for joint in scene.joints]
    tree: dict[str, list[Any]] = {"jointTypes": [], "linkParents": [], "jointTransformations": [], "jointOffsets": []}
    links: dict[str, list[Any]] = {"linkInertiasCOM": [], "linkCOMs": [], "linkMasses": []}
    for body, joint, own in zip(scene.bodies, scene.joints, axes, strict=True):
        parent = number_of[joint.parent]
        before = np.eye(3) if parent < 0 else axes[parent]
        kind = {"revolute": exudyn.JointType.RevoluteZ, "prismatic": exudyn.JointType.PrismaticZ}[joint.type]
        position, orientation = np.array([value_of(x, {}) for x in joint.position]), np.array(joint.orientation)
        xx, yy, zz, xy, xz, yz = (value_of(item, {}) for item in body.inertia)
        tensor, center = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]), [value_of(x, {}) for x in body.center_of_mass]
        for group, values in (
            (tree, (kind, parent, before.T @ orientation @ own, before.T @ position)),
            (links, (own.T @ tensor @ own, own.T @ center, value_of(body.mass, {}))),
        ):
            for part, value in zip(group.values(), values, strict=True):
                part.append(value)
    for group, matrices in ((tree, {"jointTransformations"}), (links, {"linkInertiasCOM"})):
        for name, values in group.items():
            if name in matrices:
                group[name] = exudyn.Matrix3DList(values)
            elif name in ("jointOffsets", "linkCOMs"):
                group[name] = exudyn.Vector3DList(values)
    container = exudyn.SystemContainer()
    mbs = container.AddSystem()
    zeros = [0.0] * system.nv
    node = mbs.AddNode(
        items.NodeGenericODE2(referenceCoordinates=zeros, initialCoordinates=zeros, initialCoordinates_t=zeros, numberOfODE2Coordinates=system.nv)
    )
    gravity = [value_of(item, {}) for item in scene.gravity]
    mbs.AddObject(items.ObjectKinematicTree(nodeNumber=node, gravity=gravity, **tree, **links))
    mbs.Assemble()
    solver, settings = exudyn.MainSolverStatic(), exudyn.SimulationSettings()
    settings.solutionSettings.writeSolutionToFile = False
    solver.InitializeSolver(mbs, settings)
    state = random_states(system, STATES, np.random.default_rng(seed))
    mass, forces = [], []
    for q, v in zip(state["q"], state["v"], strict=True):
        mbs.systemData.SetODE2Coordinates(q)
        mbs.systemData.SetODE2Coordinates_t(v)
        solver.ComputeMassMatrix(mbs)
        solver.ComputeODE2RHS(mbs)
        mass.append(np.array(solver.GetSystemMassMatrix()))
        forces.append(-np.array(solver.GetSystemResidual())[: system.nv])
    still = {**state, "a": np.zeros_like(state["v"])}
    M, bias = np.array(mass), np.array(forces)
    return compared(
        system,
        still,
        {
            ("mass matrix", "mass", "M"): M,
            ("forces at no acceleration", "inverse_dynamics", "tau"): bias,
            ("accelerations", "forward_dynamics", "vdot"): np.linalg.solve(M, -bias[..., np.newaxis])[..., 0],
        },
    )


def _to_z(axis: Array) -> Array:
    """Return a rotation whose third column is a unit vector."""
    across = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    across /= np.linalg.norm(across)
    return np.column_stack([across, np.cross(axis, across), axis])
