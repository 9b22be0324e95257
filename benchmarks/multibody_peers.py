"""The fast top and chains of rods in EXUDYN and MuJoCo: each function returns CPU seconds of a run and the error at its
end.

Traps of EXUDYN: its generalized-alpha does not converge on the top with the default tolerances of Newton's iteration at
common steps; bodies that the solver starts from must be set back before each run; sparse factors need their solver
chosen by name.
"""

from __future__ import annotations

import importlib.util
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.chains import INERTIA, LENGTH, MASS, tip_at_the_end
from benchmarks.tops import ARM, CENTER_AT_1, FAST, GRAVITY
from benchmarks.tops import INERTIA as INERTIA_OF_TOP
from benchmarks.tops import MASS as MASS_OF_TOP

Array = NDArray[np.float64]


def missing(package: str) -> str | None:
    """Return how to install a package that is not there."""
    return None if importlib.util.find_spec(package) else f"{package} is missing: pip install {package}"


class NotConvergedError(Exception):
    """A peer gave a run up."""


# -- EXUDYN ------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class ExudynMethod:
    """A solver with its settings: ``options`` are paths below ``timeIntegration``."""

    name: str
    node: str
    solver: str
    options: Mapping[str, Any] = field(default_factory=dict)


def _tolerance(value: float) -> dict[str, Any]:
    return {"newton.relativeTolerance": value, "newton.absoluteTolerance": value}


def _generalized_alpha(radius: float, tolerance: float | None = None) -> dict[str, Any]:
    return {"generalizedAlpha.spectralRadius": radius, **(_tolerance(tolerance) if tolerance else {})}


_INDEX2 = {"generalizedAlpha.useNewmark": True, "generalizedAlpha.useIndex2Constraints": True}
_LIE, _PARAMETERS, _ALPHA = "RotationRotationVector", "RotationEulerParameters", "GeneralizedAlpha"
#: Implicit solvers for the top with its ball joint.
TOP_METHODS = (
    *(
        ExudynMethod(
            f"gen-alpha {radius}, Lie, tolerance {tolerance:g}", _LIE, _ALPHA, _generalized_alpha(radius, tolerance)
        )
        for radius, tolerance in ((0.9, 1e-5), (0.8, 1e-5), (0.8, 3e-5), (0.6, 1e-5), (0.6, 1e-6))
    ),
    ExudynMethod("Newmark index 2, Lie", _LIE, _ALPHA, _INDEX2),
    ExudynMethod("trapezoidal index 2, Lie", _LIE, "TrapezoidalIndex2"),
    ExudynMethod("trapezoidal index 2, Lie, tolerance 1e-05", _LIE, "TrapezoidalIndex2", _tolerance(1e-5)),
    ExudynMethod("gen-alpha 0.9, Euler parameters", _PARAMETERS, _ALPHA, _generalized_alpha(0.9)),
    ExudynMethod(
        "gen-alpha 0.9, Euler parameters, tolerance 1e-05", _PARAMETERS, _ALPHA, _generalized_alpha(0.9, 1e-5)
    ),
    ExudynMethod("trapezoidal index 2, Euler parameters", _PARAMETERS, "TrapezoidalIndex2"),
)
#: Solvers for chains, in joint coordinates (a kinematic tree).
CHAIN_METHODS = (
    ExudynMethod("gen-alpha 0.8", "", _ALPHA, _generalized_alpha(0.8, 1e-5)),
    ExudynMethod("trapezoidal index 2", "", "TrapezoidalIndex2"),
    ExudynMethod("RK44", "", "RK44"),
)


def exudyn_top(method: ExudynMethod, steps: int, repeats: int) -> tuple[float, float]:
    """Return CPU seconds of 1 s of the fast top on its ball joint, and the error of its center in m."""
    exudyn, utilities = import_module("exudyn"), import_module("exudyn.utilities")
    system = exudyn.SystemContainer().AddSystem()
    spin = np.array(FAST)
    top = system.CreateRigidBody(
        referencePosition=ARM,
        initialVelocity=np.cross(spin, ARM),
        initialAngularVelocity=spin,
        gravity=[0, 0, -GRAVITY],
        inertia=utilities.RigidBodyInertia(mass=MASS_OF_TOP, com=[0, 0, 0], inertiaTensor=np.diag(INERTIA_OF_TOP)),
        nodeType=getattr(exudyn.NodeType, method.node),
        returnDict=True,
    )
    pair = [system.CreateGround(), top["bodyNumber"]]
    system.CreateSphericalJoint(itemNumbers=pair, position=[0, 0, 0], useGlobalFrame=True, show=False)
    system.Assemble()

    def center() -> Array:
        position = exudyn.OutputVariableType.Position
        return np.array(system.GetObjectOutputBody(top["bodyNumber"], position, localPosition=[0, 0, 0]))

    seconds, found = _exudyn_run(exudyn, system, method, 1.0, steps, repeats, center)
    return seconds, float(np.linalg.norm(found - CENTER_AT_1))


def exudyn_chain(method: ExudynMethod, links: int, duration: float, steps: int, repeats: int) -> tuple[float, float]:
    """Return CPU seconds of a chain of hinges as a kinematic tree, and the error of its tip in m."""
    exudyn, items = import_module("exudyn"), import_module("exudyn.itemInterface")
    system = exudyn.SystemContainer().AddSystem()
    turn = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])  # columns: z of the first link along -y of the world
    zeros = [0.0] * links
    coordinates = system.AddNode(
        items.NodeGenericODE2(
            referenceCoordinates=zeros,
            initialCoordinates=zeros,
            initialCoordinates_t=zeros,
            numberOfODE2Coordinates=links,
        )
    )
    inertia = np.diag(INERTIA[[0, 2, 1]])
    tree = system.AddObject(
        items.ObjectKinematicTree(
            nodeNumber=coordinates,
            jointTypes=[exudyn.JointType.RevoluteZ] * links,
            linkParents=list(range(-1, links - 1)),
            gravity=[0, 0, -GRAVITY],
            jointTransformations=exudyn.Matrix3DList([turn, *[np.eye(3)] * (links - 1)]),
            jointOffsets=exudyn.Vector3DList([[0, 0, 0], *[[LENGTH, 0, 0]] * (links - 1)]),
            linkInertiasCOM=exudyn.Matrix3DList([inertia] * links),
            linkCOMs=exudyn.Vector3DList([[LENGTH / 2, 0, 0]] * links),
            linkMasses=[MASS] * links,
        )
    )
    sensor = system.AddSensor(
        items.SensorKinematicTree(
            objectNumber=tree,
            linkNumber=links - 1,
            localPosition=[LENGTH, 0, 0],
            storeInternal=False,
            writeToFile=False,
            outputVariableType=exudyn.OutputVariableType.Position,
        )
    )
    system.Assemble()

    def tip() -> Array:
        return np.array(system.GetSensorValues(sensor))

    seconds, found = _exudyn_run(exudyn, system, method, duration, steps, repeats, tip)
    return seconds, float(np.linalg.norm(found - tip_at_the_end(links)))


def _exudyn_run(
    exudyn: Any,
    system: Any,
    method: ExudynMethod,
    duration: float,
    steps: int,
    repeats: int,
    result: Callable[[], Array],
) -> tuple[float, Array]:
    exudyn.config.suppressWarnings = True
    settings = exudyn.SimulationSettings()
    run = settings.timeIntegration
    run.numberOfSteps, run.endTime, run.verboseMode, run.automaticStepSize = steps, duration, 0, False
    run.newton.useModifiedNewton = True
    for path, value in method.options.items():
        place, _, name = path.rpartition(".")
        setattr(getattr(run, place) if place else run, name, value)
    settings.solution.file.write = False
    settings.parallel.numberOfThreads = 1
    settings.linearSolver.solverType = exudyn.LinearSolverType.EXUdense
    start = system.systemData.GetSystemState()

    def go() -> None:
        system.systemData.SetSystemState(start, configuration=exudyn.ConfigurationType.Initial)
        try:
            solver = getattr(exudyn.DynamicSolverType, method.solver)
            exudyn.SolveDynamic(system, settings, solverType=solver, showHints=False, showCausingItems=False)
        except Exception as error:  # EXUDYN's classes of errors differ between its versions
            raise NotConvergedError(str(error).strip().splitlines()[0]) from None

    exudyn.SetWriteToConsole(False)
    try:
        seconds = _median_seconds(go, repeats)
    finally:
        exudyn.SetWriteToConsole(True)
    return seconds, result()


# -- MuJoCo ------------------------------------------------------------------------------------------------------------


def mujoco_chain(integrator: str, links: int, duration: float, steps: int, repeats: int) -> tuple[float, float]:
    """Return CPU seconds of a chain of hinges, and the error of its tip in m."""
    mujoco = import_module("mujoco")

    inertia = " ".join(map(repr, INERTIA.tolist()))
    one = f'<joint type="hinge" axis="0 1 0"/><inertial pos="{LENGTH / 2} 0 0" mass="{MASS}" diaginertia="{inertia}"/>'
    bodies = "".join(f'<body pos="{LENGTH if k else 0} 0 0">{one}' for k in range(links))
    text = (
        f'<mujoco><option timestep="{duration / steps!r}" integrator="{integrator}" gravity="0 0 {-GRAVITY}">'
        f'<flag contact="disable" constraint="disable"/></option><worldbody>{bodies}<site name="tip" pos="{LENGTH} 0'
        ' 0"/>'
        f"{'</body>' * links}</worldbody></mujoco>"
    )
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)

    def go() -> None:
        mujoco.mj_resetData(model, data)
        mujoco.mj_step(model, data, steps)
        mujoco.mj_kinematics(model, data)

    seconds = _median_seconds(go, repeats)
    return seconds, float(np.linalg.norm(data.site_xpos[0] - tip_at_the_end(links)))


def _median_seconds(go: Callable[[], None], repeats: int) -> float:
    seconds = []
    for _ in range(repeats):
        start = time.process_time()
        go()
        seconds.append(time.process_time() - start)
    return sorted(seconds)[len(seconds) // 2]
