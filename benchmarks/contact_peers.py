"""Ten spheres that bounce on a plane, and a small car that lands on its wheels: time to an error, next to Drake, MuJoCo
and EXUDYN.

    python -m benchmarks.contact_peers [--works balls car] [--target 1e-3] [--rounds 7] [--quick]

Each peer has its own law of contact. Drake's point contact (Hunt and Crossley's force, linear in the penetration, with
friction that rises over a quintic of the slip) and EXUDYN's contact of spheres with triangles (a spring with a damper,
and friction that rises along a line) are formulas in eomgen's scenes: there both programs have the same motion, and the
table has the difference of both limits. MuJoCo's soft contact and Drake's convex one have motions of their own, and
eomgen runs Drake's point contact next to them. Errors are of places at the end, each contestant's against the finest of
its own runs; each takes its fastest method and setting that meet the error, and turns are taken in one process.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray

import eomgen
from benchmarks.measure import figure, machine, pin_to_core, table
from eomgen.integrators.families.register import method_named
from eomgen.lie.numeric import rotation_matrix
from eomgen.simulation.stepping.settings import stepper_library, stepper_settings
from eomgen.simulation.stepping.stepper import Stepper

Array = NDArray[np.float64]
GRAVITY, FRICTION = 9.81, 0.5
#: Drake's loss, s/m; EXUDYN's damper, N s/m.
LOSS, DAMPER = 0.2, 20.0
#: Slip over which friction rises, m/s.
ROLLING = {"balls": 0.05, "car": 0.5}
#: Place at which friction acts, above the deepest point of the sphere, by deflection.
ABOVE = {"drake": 0.5, "exudyn": 1.0}
STIFFNESS = {"balls": 1e5, "car": 2e5}
DURATION = {"balls": 1.5, "car": 1.5}
WORKS, OWN_LAW = ("balls", "car"), "eomgen, EXUDYN's law"
#: Contestants with their packages; eomgen has Drake's law unless another is named.
CONTESTANTS = {
    "eomgen": "eomgen",
    OWN_LAW: "eomgen",
    "Drake": "drake",
    "Drake, CENIC": "drake",
    "MuJoCo": "mujoco",
    "EXUDYN": "exudyn",
}
#: Errors, m, that contestants have to meet.
TARGETS = {"balls": 1e-2, "car": 1e-3}
# -- ten spheres: radius, m, masses, kg, and start, in SI units
RADIUS, MASSES = 0.05, tuple(0.3 + 0.04 * k for k in range(10))
PLACES = tuple((0.5 * k, 0.0, 0.3 + 0.06 * k) for k in range(10))
VELOCITIES = tuple((0.5 - 0.1 * k, 0.3 + 0.05 * k, 0.1 * (k % 3)) for k in range(10))
SPINS = tuple((3.0 * (k % 4), 10.0 - 2.0 * k, 5.0) for k in range(10))
# -- a car: chassis, struts of 0.1 m of travel, wheels that roll as spheres of their radius
CHASSIS, CHASSIS_INERTIA = 400.0, (80.0, 300.0, 350.0)
HUB, WHEEL, WHEEL_RADIUS, WHEEL_INERTIA = 8.0, 12.0, 0.3, (0.3, 0.5, 0.3)
CORNERS = ((1.2, 0.7), (1.2, -0.7), (-1.2, 0.7), (-1.2, -0.7))
SPRING, STRUT_DAMPER, PRELOAD = 20e3, 1500.0, 1000.0
START, SPEED, SIDEWAYS, TURNING = 0.62, 12.0, 1.5, 0.4
#: Points of the chassis whose places are compared.
SEEN = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))


@dataclass(frozen=True)
class Way:
    """A method of a contestant: a run from a setting to places, m, settings from coarse to fine, and the finest."""

    name: str
    run: Callable[[float], Array]
    settings: Sequence[float]


@dataclass(frozen=True)
class Run:
    """One run: places, m, and CPU seconds."""

    way: Way
    setting: float
    places: Array
    seconds: float


# -- eomgen ------------------------------------------------------------------------------------------------------------


def laws(law: str, work: str, radius: float) -> dict[str, Any]:
    """Return the tables of a contact with the law of a peer.

    EXUDYN's spring and damper act as long as the bodies overlap, and pull at the end. Friction acts in the plane, and
    in Drake half way from there to the deepest point of the sphere, at which eomgen's forces act.
    """
    above = f"{ABOVE[law]} * deflection"
    slips = [f"(slip_velocity_{axis} + (velocity_{axis} - slip_velocity_{axis}) * {above} / {radius})" for axis in "xy"]
    slip = f"sqrt({slips[0]}**2 + {slips[1]}**2 + 1e-24)"
    factor = f"{FRICTION} * load / max({slip}, {ROLLING[work]})"
    if law == "exudyn":
        normal = {"type": "formula", "force": f"{STIFFNESS[work]} * deflection - {DAMPER} * rate if gap < 0 else 0"}
    else:
        normal = {"type": "hunt_crossley", "stiffness": STIFFNESS[work], "exponent": 1, "damping": LOSS / 1.5}
        part = f"min({slip} / {ROLLING[work]}, 1)"
        factor += f" * {part}**2 * (10 - 15 * {part} + 6 * {part}**2)"
    x, y = (f"-{factor} * {along}" for along in slips)
    moments = {"moment_x": f"-{above} * ({y})", "moment_y": f"{above} * ({x})"}
    return {"normal": normal, "tangential": {"type": "formula", "force_x": x, "force_y": y, **moments}}


def balls(law: str) -> dict[str, Any]:
    """Return the scene of the spheres."""
    names = [f"ball{k}" for k in range(len(MASSES))]
    bodies, joints, contacts = dict[str, Any](), dict[str, Any](), dict[str, Any]()
    for k, name in enumerate(names):
        bodies[name] = {"mass": MASSES[k], "inertia": [0.4 * MASSES[k] * RADIUS**2] * 3}
        start = {"position": [*PLACES[k]], "velocity": [*SPINS[k], *VELOCITIES[k]]}
        joints[name] = {"type": "free", "parent": "base", "child": name, "initial": start}
        contacts[name] = _contact(name, RADIUS, law, "balls")
    return {
        "format": 1, "name": f"balls_{law}", "gravity": [0, 0, -GRAVITY],
        "bodies": bodies, "joints": joints, "contacts": contacts,
        "simulation": {"step": 1e-3, "duration": DURATION["balls"]},
    }  # fmt: skip  # a scene


def _contact(body: str, radius: float, law: str, work: str) -> dict[str, Any]:
    ground = {"body": "base", "axis": [0, 0, 1], "x_axis": [1, 0, 0]}
    return {"first": ground, "second": {"body": body}, "shape": "sphere", "radius": radius, **laws(law, work, radius)}


def car(law: str) -> dict[str, Any]:
    """Return the scene of the car."""
    start = {"position": [0, 0, START], "velocity": [0, 0, TURNING, SPEED, SIDEWAYS, 0]}
    bodies: dict[str, Any] = {"chassis": {"mass": CHASSIS, "inertia": [*CHASSIS_INERTIA]}}
    joints: dict[str, Any] = {"chassis": {"type": "free", "parent": "base", "child": "chassis", "initial": start}}
    contacts = {}
    for k, (x, y) in enumerate(CORNERS):
        bodies |= {
            f"hub{k}": {"mass": HUB, "inertia": [0.1] * 3},
            f"wheel{k}": {"mass": WHEEL, "inertia": [*WHEEL_INERTIA]},
        }
        joints[f"strut{k}"] = {
            "type": "prismatic", "parent": "chassis", "child": f"hub{k}", "axis": [0, 0, 1], "position": [x, y, -0.3],
            "stiffness": SPRING, "damping": STRUT_DAMPER, "rest": -PRELOAD / SPRING,
        }  # fmt: skip  # a table
        rolling = {"velocity": SPEED / WHEEL_RADIUS}
        joints[f"axle{k}"] = {
            "type": "revolute",
            "parent": f"hub{k}",
            "child": f"wheel{k}",
            "axis": [0, 1, 0],
            "initial": rolling,
        }
        contacts[f"tyre{k}"] = _contact(f"wheel{k}", WHEEL_RADIUS, law, "car")
    return {
        "format": 1, "name": f"car_{law}", "gravity": [0, 0, -GRAVITY],
        "bodies": bodies, "joints": joints, "contacts": contacts,
        "simulation": {"step": 1e-3, "duration": DURATION["car"]},
    }  # fmt: skip  # a scene


@cache
def _model(work: str, law: str) -> Any:
    return eomgen.build({"balls": balls, "car": car}[work](law))


def eomgen_ways(work: str, law: str) -> list[Way]:
    """Return fixed steps and steps by a tolerance, each in the compiled loop without a record."""
    model, duration = _model(work, law), DURATION[work]

    def way(method: str) -> Callable[[float], Array]:
        def run(setting: float) -> Array:
            chosen = method_named(method, tolerance=setting if setting < 1 else None)
            step, steps = (duration, 1) if chosen.chooses_steps else (duration / setting, int(setting))
            library = stepper_library(model, method, chosen)
            settings = stepper_settings(library.layout["method"], step, chosen, {})
            stepper = Stepper(library, settings, model.parameter_array())
            status = stepper.initialize(0.0, model.initial_q, model.initial_v, None)
            record = np.empty((2, stepper.sizes["row"]))
            if status := status or stepper.run(steps, steps, None, record)[0]:
                raise RuntimeError(stepper.status_text(status))
            q = stepper.row[stepper.row_places["q"]]
            if work == "balls":
                return np.array(q).reshape(-1, 7)[:, 4:]
            return np.array(q[4:7] + np.array(SEEN) @ rotation_matrix(q[:4]).T)

        return run

    return [Way("rk4", way("rk4"), _STEPS), Way("rk45", way("rk45"), _TOLERANCES)]


_STEPS = tuple(float(round(200 * 2 ** (k / 2))) for k in range(22))
_ACCURACIES = tuple(10.0 ** (-k / 2) for k in range(2, 19))
_TOLERANCES = tuple(10.0 ** (-k / 2) for k in range(4, 23))
# -- Drake -------------------------------------------------------------------------------------------------------------


def drake_ways(work: str, schemes: Sequence[str] = ("runge_kutta3", "runge_kutta5", "bogacki_shampine3")) -> list[Way]:
    """Return error-controlled methods on the continuous plant."""
    analysis = import_module("pydrake.systems.analysis")
    diagram, context, places = _drake_plant(work, 0.0)
    start = context.Clone()

    def way(scheme: str) -> Callable[[float], Array]:
        def run(accuracy: float) -> Array:
            simulator = analysis.Simulator(diagram, start.Clone())
            settings = {"integration_scheme": scheme, "accuracy": accuracy, "max_step_size": 0.1}
            analysis.ApplySimulatorConfig(analysis.SimulatorConfig(**settings, use_error_control=True), simulator)
            simulator.Initialize()
            simulator.AdvanceTo(DURATION[work])
            return places(simulator.get_context())

        return run

    return [Way(scheme, way(scheme), _ACCURACIES) for scheme in schemes]


def cenic_ways(work: str) -> list[Way]:
    """Return Drake's convex integrator with error control, which has a contact of its own."""
    return drake_ways(work, ("cenic",))


def _drake_plant(work: str, step: float) -> tuple[Any, Any, Callable[[Any], Array]]:
    """Return Drake's diagram, its context at the start, and a function of a context that returns places, m."""
    multibody, trees = import_module("pydrake.multibody.plant"), import_module("pydrake.multibody.tree")
    geometry, maths = import_module("pydrake.geometry"), import_module("pydrake.math")
    builder = import_module("pydrake.systems.framework").DiagramBuilder()
    plant, scene_graph = multibody.AddMultibodyPlantSceneGraph(builder, step)
    plant.mutable_gravity_field().set_gravity_vector([0, 0, -GRAVITY])
    plant.set_contact_model(multibody.ContactModel.kPoint)
    friction = multibody.CoulombFriction(FRICTION, FRICTION)

    def properties() -> Any:
        made = geometry.ProximityProperties()
        geometry.AddContactMaterial(LOSS, 2.0 * STIFFNESS[work], friction, made)
        return made

    def inertia(mass: float, moments: Sequence[float]) -> Any:
        return trees.SpatialInertia(mass, np.zeros(3), trees.UnitInertia(*(moment / mass for moment in moments)))

    def touches(body: Any, radius: float) -> None:
        plant.RegisterCollisionGeometry(
            body, maths.RigidTransform(), geometry.Sphere(radius), body.name(), properties()
        )

    ground = maths.RigidTransform()
    plant.RegisterCollisionGeometry(plant.world_body(), ground, geometry.HalfSpace(), "ground", properties())
    moving, spins = [], []
    if work == "balls":
        for k, mass in enumerate(MASSES):
            body = plant.AddRigidBody(f"ball{k}", inertia(mass, [0.4 * mass * RADIUS**2] * 3))
            touches(body, RADIUS)
            moving.append((body, PLACES[k], SPINS[k], VELOCITIES[k]))
    else:
        chassis = plant.AddRigidBody("chassis", inertia(CHASSIS, CHASSIS_INERTIA))
        moving.append((chassis, (0.0, 0.0, START), (0.0, 0.0, TURNING), (SPEED, SIDEWAYS, 0.0)))
        for k, (x, y) in enumerate(CORNERS):
            hub = plant.AddRigidBody(f"hub{k}", inertia(HUB, [0.1] * 3))
            wheel = plant.AddRigidBody(f"wheel{k}", inertia(WHEEL, WHEEL_INERTIA))
            mount = plant.AddFrame(trees.FixedOffsetFrame(f"mount{k}", chassis, maths.RigidTransform([x, y, -0.3])))
            strut = trees.PrismaticJoint(f"strut{k}", mount, hub.body_frame(), [0, 0, 1], damping=STRUT_DAMPER)
            strut = plant.AddJoint(strut)
            plant.AddForceElement(trees.PrismaticSpring(strut, -PRELOAD / SPRING, SPRING))
            spins.append(
                plant.AddJoint(trees.RevoluteJoint(f"axle{k}", hub.body_frame(), wheel.body_frame(), [0, 1, 0]))
            )
            touches(wheel, WHEEL_RADIUS)
    bodies = [plant.get_body(index) for index in plant.GetBodyIndices(trees.ModelInstanceIndex(1))]
    balls_only = geometry.GeometrySet(
        [plant.GetCollisionGeometriesForBody(body)[0] for body in bodies if plant.GetCollisionGeometriesForBody(body)]
    )
    plant.Finalize()
    plant.set_stiction_tolerance(ROLLING[work])
    scene_graph.collision_filter_manager().Apply(geometry.CollisionFilterDeclaration().ExcludeWithin(balls_only))
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    own = plant.GetMyMutableContextFromRoot(context)
    velocity = import_module("pydrake.multibody.math").SpatialVelocity
    for body, place, spin, speed in moving:
        plant.SetFreeBodyPose(own, body, maths.RigidTransform(np.array(place)))
        plant.SetFreeBodySpatialVelocity(own, body, velocity(np.array(spin), np.array(speed)))
    for axle in spins:
        axle.set_angular_rate(own, SPEED / WHEEL_RADIUS)

    def places(found: Any) -> Array:
        at = plant.GetMyContextFromRoot(found)
        if work == "balls":
            return np.array([plant.EvalBodyPoseInWorld(at, body).translation() for body, *_ in moving])
        return np.array([plant.EvalBodyPoseInWorld(at, moving[0][0]) @ np.array(point) for point in SEEN])

    return diagram, context, places


# -- MuJoCo ------------------------------------------------------------------------------------------------------------


def mujoco_ways(work: str) -> list[Way]:
    """Return MuJoCo's integrators over the step."""
    mujoco = import_module("mujoco")

    def way(integrator: str) -> Callable[[float], Array]:
        @cache
        def made(steps: float) -> tuple[Any, Any]:
            model = mujoco.MjModel.from_xml_string(_mujoco_text(work, integrator, DURATION[work] / steps))
            return model, mujoco.MjData(model)

        def run(steps: float) -> Array:
            model, data = made(steps)
            mujoco.mj_resetData(model, data)
            data.qvel[:] = model.key_qvel[0]
            data.qpos[:] = model.key_qpos[0]
            mujoco.mj_step(model, data, int(steps))
            mujoco.mj_kinematics(model, data)
            return np.array(data.site_xpos)

        return run

    return [Way(name, way(name), _STEPS) for name in ("RK4", "implicitfast", "Euler")]


def _mujoco_text(work: str, integrator: str, step: float) -> str:
    def words(values: Sequence[float]) -> str:
        return " ".join(repr(float(value)) for value in values)

    mass = statistics.mean(MASSES) if work == "balls" else (CHASSIS + 4 * (HUB + WHEEL)) / 4
    soft = f'solref="{-STIFFNESS[work] / mass!r} {-DAMPER / mass!r}" solimp="0.9 0.9 0.001"'
    touch = f'condim="3" friction="{FRICTION} 0 0" {soft}'
    size = RADIUS if work == "balls" else WHEEL_RADIUS
    ball = f'<geom type="sphere" size="{size}" contype="0" conaffinity="1" {touch}/>'
    if work == "balls":
        bodies = "".join(
            f'<body pos="{words(place)}"><freejoint/><inertial pos="0 0 0" mass="{mass_of!r}" diaginertia='
            f'"{words([0.4 * mass_of * RADIUS**2] * 3)}"/>{ball}<site/></body>'
            for place, mass_of in zip(PLACES, MASSES, strict=True)
        )
        q = [part for place in PLACES for part in (*place, 1.0, 0.0, 0.0, 0.0)]
        v = [part for speed, spin in zip(VELOCITIES, SPINS, strict=True) for part in (*speed, *spin)]
    else:
        struts = "".join(
            f'<body pos="{x} {y} -0.3"><joint type="slide" axis="0 0 1" stiffness="{SPRING}" damping="{STRUT_DAMPER}"'
            f' springref="{-PRELOAD / SPRING!r}"/><inertial pos="0 0 0" mass="{HUB}" diaginertia="0.1 0.1 0.1"/>'
            f'<body><joint type="hinge" axis="0 1 0"/><inertial pos="0 0 0" mass="{WHEEL}"'
            f' diaginertia="{words(WHEEL_INERTIA)}"/>{ball}</body></body>'
            for x, y in CORNERS
        )
        seen = "".join(f'<site pos="{words(place)}"/>' for place in SEEN)
        bodies = (
            f'<body pos="0 0 {START}"><freejoint/><inertial pos="0 0 0" mass="{CHASSIS}"'
            f' diaginertia="{words(CHASSIS_INERTIA)}"/>{seen}{struts}</body>'
        )
        q = [0.0, 0.0, START, 1.0, 0.0, 0.0, 0.0, *[0.0] * 8]
        v = [SPEED, SIDEWAYS, 0.0, 0.0, 0.0, TURNING, *[0.0, SPEED / WHEEL_RADIUS] * 4]
    return (
        f'<mujoco><option timestep="{step!r}" integrator="{integrator}" cone="elliptic" gravity="0 0 {-GRAVITY}"/>'
        f'<worldbody><geom type="plane" size="0 0 1" contype="1" conaffinity="0" {touch}/>{bodies}</worldbody>'
        f'<keyframe><key qpos="{words(q)}" qvel="{words(v)}"/></keyframe></mujoco>'
    )


# -- EXUDYN ------------------------------------------------------------------------------------------------------------


def exudyn_ways(work: str) -> list[Way]:
    """Return explicit and implicit methods, by steps and by a tolerance."""
    exudyn = import_module("exudyn")
    exudyn.config.printToConsole = False
    exudyn.config.suppressWarnings = True
    system, places = _exudyn_system(exudyn, work)
    start = system.systemData.GetSystemState()

    def way(solver: str, adaptive: bool) -> Callable[[float], Array]:
        def run(setting: float) -> Array:
            settings = exudyn.SimulationSettings()
            steps = settings.timeIntegration
            steps.endTime, steps.verboseMode, steps.automaticStepSize = DURATION[work], 0, adaptive
            steps.numberOfSteps = 10 if adaptive else int(setting)
            if adaptive:
                steps.relativeTolerance = steps.absoluteTolerance = setting
            if solver == "GeneralizedAlpha":
                steps.generalizedAlpha.spectralRadius, steps.newton.useModifiedNewton = 0.8, True
            settings.solutionSettings.writeSolutionToFile = False
            settings.parallel.numberOfThreads = 1
            settings.linearSolverType = exudyn.LinearSolverType.EXUdense
            system.systemData.SetSystemState(start, configuration=exudyn.ConfigurationType.Initial)
            kind = getattr(exudyn.DynamicSolverType, solver)
            exudyn.SolveDynamic(system, settings, solverType=kind, showHints=False, showCausingItems=False)
            return places()

        return run

    return [
        Way("RK44", way("RK44", False), _STEPS),
        Way("DOPRI5", way("DOPRI5", True), _TOLERANCES[:11]),
        Way("generalized-alpha", way("GeneralizedAlpha", False), _STEPS),
    ]


def _exudyn_system(exudyn: Any, work: str) -> tuple[Any, Callable[[], Array]]:
    utilities, items = import_module("exudyn.utilities"), import_module("exudyn.itemInterface")
    system = exudyn.SystemContainer().AddSystem()
    contact = system.AddGeneralContact()
    contact.frictionProportionalZone = ROLLING[work]
    contact.SetFrictionPairings(FRICTION * np.eye(1))
    contact.SetSearchTreeCellSize([1, 1, 1])
    ground = system.AddObject(items.ObjectGround())
    marker = system.AddMarker(items.MarkerBodyRigid(bodyNumber=ground))
    corners = [[-500.0, -500.0, 0.0], [500.0, -500.0, 0.0], [0.0, 800.0, 0.0]]
    both = {"contactStiffness": 2.0 * STIFFNESS[work], "contactDamping": 0.5 * DAMPER, "frictionMaterialIndex": 0}
    contact.AddTrianglesRigidBodyBased(marker, pointList=corners, triangleList=[[0, 1, 2]], **both)
    if work == "balls":
        numbers = []
        for k, mass in enumerate(MASSES):
            moments = 0.4 * mass * RADIUS**2 * np.eye(3)
            made = system.CreateRigidBody(
                referencePosition=[*PLACES[k]], initialVelocity=[*VELOCITIES[k]], initialAngularVelocity=[*SPINS[k]],
                gravity=[0, 0, -GRAVITY], nodeType=exudyn.NodeType.RotationRotationVector, returnDict=True,
                inertia=utilities.RigidBodyInertia(mass=mass, com=[0, 0, 0], inertiaTensor=moments),
            )  # fmt: skip  # a table
            numbers.append(made["nodeNumber"])
            on_ball = system.AddMarker(items.MarkerNodeRigid(nodeNumber=made["nodeNumber"]))
            contact.AddSphereWithMarker(on_ball, radius=RADIUS, **both)
        contact.sphereSphereContact = False
        system.Assemble()
        position = exudyn.OutputVariableType.Position
        return system, lambda: np.array([system.GetNodeOutput(number, position) for number in numbers])
    kinds, parents, offsets, masses, inertias = list[str](), list[int](), list[Any](), list[float](), list[Any]()

    def link(kind: str, parent: int, place: Sequence[float], mass: float, moments: Sequence[float]) -> int:
        kinds.append(kind)
        parents.append(parent)
        offsets.append([*place])
        masses.append(mass)
        inertias.append(np.diag(moments))
        return len(kinds) - 1

    last = -1
    for kind in ("PrismaticX", "PrismaticY", "PrismaticZ", "RevoluteZ", "RevoluteY"):
        last = link(kind, last, (0.0, 0.0, START if last < 0 else 0.0), 0.0, (0.0, 0.0, 0.0))
    chassis = link("RevoluteX", last, (0.0, 0.0, 0.0), CHASSIS, CHASSIS_INERTIA)
    wheels = []
    for x, y in CORNERS:
        hub = link("PrismaticZ", chassis, (x, y, -0.3), HUB, (0.1, 0.1, 0.1))
        wheels.append(link("RevoluteY", hub, (0.0, 0.0, 0.0), WHEEL, WHEEL_INERTIA))
    count, strut = (
        len(kinds),
        [kind == "PrismaticZ" and parent == chassis for kind, parent in zip(kinds, parents, strict=True)],
    )
    velocities = [0.0] * count
    velocities[0], velocities[1], velocities[3] = SPEED, SIDEWAYS, TURNING
    for wheel in wheels:
        velocities[wheel] = SPEED / WHEEL_RADIUS
    numbers = {"numberOfODE2Coordinates": count, "initialCoordinates_t": velocities}
    node = system.AddNode(
        items.NodeGenericODE2(referenceCoordinates=[0.0] * count, initialCoordinates=[0.0] * count, **numbers)
    )
    tree = system.AddObject(
        items.ObjectKinematicTree(
            nodeNumber=node, jointTypes=[getattr(exudyn.JointType, kind) for kind in kinds], linkParents=parents,
            gravity=[0, 0, -GRAVITY], jointTransformations=exudyn.Matrix3DList([np.eye(3)] * count),
            jointOffsets=exudyn.Vector3DList(offsets), linkInertiasCOM=exudyn.Matrix3DList(inertias),
            linkCOMs=exudyn.Vector3DList([[0.0, 0.0, 0.0]] * count), linkMasses=masses,
            jointPControlVector=[SPRING * is_strut for is_strut in strut],
            jointDControlVector=[STRUT_DAMPER * is_strut for is_strut in strut],
            jointPositionOffsetVector=[-PRELOAD / SPRING * is_strut for is_strut in strut],
            jointVelocityOffsetVector=[0.0] * count,
        )
    )  # fmt: skip  # a table
    for wheel in wheels:
        on_wheel = system.AddMarker(
            items.MarkerKinematicTreeRigid(objectNumber=tree, linkNumber=wheel, localPosition=[0, 0, 0])
        )
        contact.AddSphereWithMarker(on_wheel, radius=WHEEL_RADIUS, **both)
    contact.sphereSphereContact = False
    wanted = {"storeInternal": False, "writeToFile": False, "outputVariableType": exudyn.OutputVariableType.Position}
    sensors = [
        system.AddSensor(
            items.SensorKinematicTree(objectNumber=tree, linkNumber=chassis, localPosition=[*place], **wanted)
        )
        for place in SEEN
    ]
    system.Assemble()
    return system, lambda: np.array([system.GetSensorValues(sensor) for sensor in sensors])


# -- the contest -------------------------------------------------------------------------------------------------------


def ways_of(contestant: str, work: str) -> list[Way]:
    """Return the ways of a contestant of ``CONTESTANTS``."""
    if contestant.startswith("eomgen"):
        return eomgen_ways(work, "exudyn" if "EXUDYN" in contestant else "drake")
    return {"Drake": drake_ways, "Drake, CENIC": cenic_ways, "MuJoCo": mujoco_ways, "EXUDYN": exudyn_ways}[contestant](
        work
    )


def tried(ways: Sequence[Way], limit: float) -> list[Run]:
    """Return the runs of all ways, each from coarse to fine settings until the third or a
    later one takes more than ``limit`` seconds."""
    made = []
    for way in ways:
        for number, setting in enumerate(way.settings, 1):
            began = time.thread_time()
            try:
                places = way.run(setting)
            except Exception as error:  # a peer may raise anything: a coarse step that fails is no run
                print(f"{way.name} {setting:g}: {error}"[:160].replace("\n", " "), file=sys.stderr)
                continue
            seconds = time.thread_time() - began
            made.append(Run(way, setting, places, seconds))
            if seconds > limit and number > 2:
                break
    return made


def finest(runs: Sequence[Run]) -> Run:
    """Return the finest run of the way whose last two runs differ least."""
    by_way: dict[str, list[Run]] = {}
    for run in runs:
        by_way.setdefault(run.way.name, []).append(run)
    pairs = [found[-2:] for found in by_way.values() if len(found) > 1]

    def change(pair: Sequence[Run]) -> float:
        return float(np.nan_to_num(np.abs(pair[1].places - pair[0].places).max(), nan=np.inf))

    return min(pairs, key=change)[1]


def fastest(runs: Sequence[Run], target: float) -> tuple[Run, float]:
    """Return the fastest run whose error against the finest is at most ``target``, m, and its error; the finest itself
    has none that is known."""
    limit = finest(runs)
    errors = [(run, float(np.abs(run.places - limit.places).max())) for run in runs if run is not limit]
    met = [(run, error) for run, error in errors if error <= target]
    if not met:
        raise ValueError(f"no setting reaches {target:g} m")
    return min(met, key=lambda pair: pair[0].seconds)


def main(words: Sequence[str] | None = None) -> int:
    description = (__doc__ or "").partition("\n\n")[0].replace("\n", " ")
    parser = argparse.ArgumentParser(prog="python -m benchmarks.contact_peers", description=description)
    parser.add_argument("--works", nargs="+", choices=WORKS, default=WORKS)
    parser.add_argument("--target", type=float, help="error, m; by default 1e-2 of the balls and 1e-3 of the car")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--limit", type=float, default=1.0, help="seconds of the finest run of a method")
    parser.add_argument("--core", type=int)
    parser.add_argument("--quick", action="store_true", help="short runs of eomgen alone")
    given = parser.parse_args(words)
    contestants = {name: package for name, package in CONTESTANTS.items() if not given.quick or package == "eomgen"}
    for package in dict.fromkeys(contestants.values()):
        if find_spec({"drake": "pydrake"}.get(package, package)) is None:
            print(f"{package} is missing: pip install {package}", file=sys.stderr)
            contestants = {name: of for name, of in contestants.items() if of != package}
    print(machine())
    for work in given.works:
        runs = {name: tried(ways_of(name, work), 1e-3 if given.quick else given.limit) for name in contestants}
        if not given.quick:
            pin_to_core(given.core)
        chosen = {
            name: fastest(found, 10.0 if given.quick else given.target or TARGETS[work]) for name, found in runs.items()
        }
        seconds: dict[str, list[float]] = {name: [] for name in chosen}
        for _ in range(1 if given.quick else given.rounds):
            for name, (run, _) in chosen.items():
                began, count = time.thread_time(), 0
                while not count or time.thread_time() - began < 0.05:
                    run.way.run(run.setting)
                    count += 1
                seconds[name].append((time.thread_time() - began) / count)
        rows = []
        for name, (run, error) in chosen.items():
            own = OWN_LAW if name == "EXUDYN" else "eomgen"
            apart = float(np.abs(finest(runs[name]).places - finest(runs[own]).places).max())
            middle, ours = statistics.median(seconds[name]), statistics.median(seconds[own])
            how = f"{run.way.name}, {run.setting:g}"
            rows.append([name, how, f"{error:.1e}", figure(1e3 * middle), figure(ours / middle), f"{apart:.1e}"])
        header = ["contestant", "way and setting", "error, m", "ms", "eomgen by this", "from eomgen's limit, m"]
        print(f"\n{work}, {DURATION[work]:g} s\n\n{table(header, rows)}", flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
