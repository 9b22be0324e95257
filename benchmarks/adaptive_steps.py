"""Steps by a tolerance beside SciPy's Radau and EXUDYN's adaptive steps: a stiff transient of three rods on hinges.

    python -m benchmarks.adaptive_steps [--json out.json] [--quick]

The last hinge has a stiff, damped spring and starts off its rest: some 3000 rad/s that die out within a hundredth of a
second, then a motion of some rad/s. Contestants take turns; the figure is the CPU time that each needs for a largest
error of the tip, over forty rows, of 1e-4 and of 1e-6 m: the fastest run that meets it, of those tried. A second table
counts steps where the transient itself is asked for, by rows that are 0.5 ms apart.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import eomgen
from benchmarks.chains import INERTIA, LENGTH, MASS
from benchmarks.measure import figure, machine, pin_to_core, table
from benchmarks.multibody_peers import missing
from eomgen.integrators.families.register import method_named
from eomgen.simulation.stepping.settings import stepper_library, stepper_settings
from eomgen.simulation.stepping.stepper import Stepper

Array = NDArray[np.float64]
Found = tuple[Array, Array, int]
LINKS, DURATION, ROWS = 3, 2.0, 40
GRAVITY = 9.81
#: Of each hinge: N m/rad, N m s/rad, and its angle at the start; springs are at rest at zero.
STIFFNESS, DAMPING, START = (20.0, 10.0, 5e4), (0.4, 0.2, 20.0), (0.3, -0.2, 0.02)
TARGETS = (1e-4, 1e-6)
TOLERANCES = tuple(10.0 ** (-k / 2) for k in range(2, 21))
STEPS = tuple(ROWS * round(2 ** (k / 2)) for k in range(2, 29))
#: Rows that see the transient, and steps that fit them.
CLOSE_ROWS = 4000
CLOSE_STEPS = tuple(CLOSE_ROWS * round(2 ** (k / 2)) for k in range(2, 16))


@dataclass(frozen=True)
class Run:
    """CPU seconds of one run, its error in m, and what it took."""

    contestant: str
    setting: float
    error: float
    seconds: float
    steps: int


@cache
def model() -> eomgen.Model:
    builder = eomgen.SceneBuilder("stiff_chain", gravity=[0, 0, -GRAVITY])
    for k in range(LINKS):
        builder.body(f"rod{k}", MASS, center_of_mass=[LENGTH / 2, 0, 0], inertia=INERTIA.tolist())
        builder.joint(
            f"joint{k}",
            "revolute",
            f"rod{k - 1}" if k else "base",
            f"rod{k}",
            axis=[0, 1, 0],
            position=[LENGTH if k else 0.0, 0, 0],
            stiffness=STIFFNESS[k],
            damping=DAMPING[k],
            initial={"position": START[k]},
        )
    return eomgen.build(builder.simulation(step=1e-3, duration=DURATION).build())


def tips(q: Array) -> Array:
    """Return x and z of the tip (n, 2), m, for angles (n, links)."""
    angles = np.cumsum(q, axis=1)
    return LENGTH * np.stack([np.cos(angles).sum(axis=1), -np.sin(angles).sum(axis=1)], axis=1)


@cache
def reference() -> eomgen.Solution:
    """Return the motion by the explicit pair, which Radau confirms."""
    found = model().simulate(DURATION, DURATION / ROWS, method="rk45", tolerance=1e-11, error_estimate=False)
    if not np.abs(tips(radau(1e-11)[1]) - tips(found.q)).max() < 1e-8:
        raise SystemExit("the references disagree")
    return found


def largest_error(times: Array, q: Array) -> float:
    """Return the largest error of the tip at times, m."""
    return float(np.abs(tips(q) - tips(reference().at(times).q)).max())


# -- contestants: from a setting to times, angles at these and the number of steps -------------------------------------


def own(method: str, rows_wanted: int = ROWS) -> Callable[[float], Found]:
    def run(setting: float) -> Found:
        made = model()
        chosen = method_named(method, rho_inf=0.8, tolerance=setting if setting < 1 else None)
        step = DURATION / (rows_wanted if chosen.chooses_steps else setting)
        library = stepper_library(made, method, chosen)
        settings = stepper_settings(library.layout["method"], step, chosen, {})
        stepper = Stepper(library, settings, made.parameter_array())
        status = stepper.initialize(0.0, made.initial_q, made.initial_v, None)
        steps = rows_wanted if chosen.chooses_steps else int(setting)
        record = np.empty((rows_wanted + 1, stepper.sizes["row"]))
        taken, rows = stepper.run(steps, steps // rows_wanted, None, record)
        if status or taken:
            raise RuntimeError(stepper.status_text(status or taken))
        return record[:rows, 0], record[:rows, 1 : 1 + LINKS], int(stepper.statistics.get("own_steps", steps))

    return run


def by_simulate(setting: float) -> Found:
    """Return what a whole call of ``simulate`` gives, rows and outputs included."""
    found = model().simulate(DURATION, DURATION / ROWS, tolerance=setting, error_estimate=False)
    return found.t, found.q, int(found.stats["own_steps"])


def radau(setting: float) -> Found:
    made = model()

    def jacobian(t: float, y: Array) -> Array:
        q, v = y[:LINKS], y[LINKS:]
        rate = made.forward_dynamics(q, v, t)
        K, C, M = (np.asarray(part) for part in made.partials(q, v, rate, t))
        return np.block([[np.zeros((LINKS, LINKS)), np.eye(LINKS)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])

    start = np.concatenate([made.initial_q, made.initial_v])
    times = np.linspace(0.0, DURATION, ROWS + 1)
    tolerances = {"rtol": setting, "atol": 0.1 * setting}
    found = solve_ivp(made.rhs, (0.0, DURATION), start, "Radau", times, jac=jacobian, **tolerances)
    return found.t, found.y[:LINKS].T, 0


def exudyn(solver: str, adaptive: bool) -> Callable[[float], Found]:
    """Return a run of the same rods as a kinematic tree; a setting below 1 is a tolerance, above it so many steps."""
    library, items = import_module("exudyn"), import_module("exudyn.itemInterface")
    library.config.suppressWarnings = True
    library.SetWriteToConsole(False)
    system = library.SystemContainer().AddSystem()
    turn = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])  # columns: z of the first link along -y of the world
    coordinates = system.AddNode(
        items.NodeGenericODE2(
            referenceCoordinates=[0.0] * LINKS,
            initialCoordinates=list(START),
            initialCoordinates_t=[0.0] * LINKS,
            numberOfODE2Coordinates=LINKS,
        )
    )
    system.AddObject(
        items.ObjectKinematicTree(
            nodeNumber=coordinates,
            jointTypes=[library.JointType.RevoluteZ] * LINKS,
            linkParents=list(range(-1, LINKS - 1)),
            gravity=[0, 0, -GRAVITY],
            jointTransformations=library.Matrix3DList([turn, *[np.eye(3)] * (LINKS - 1)]),
            jointOffsets=library.Vector3DList([[0, 0, 0], *[[LENGTH, 0, 0]] * (LINKS - 1)]),
            linkInertiasCOM=library.Matrix3DList([np.diag(INERTIA[[0, 2, 1]])] * LINKS),
            linkCOMs=library.Vector3DList([[LENGTH / 2, 0, 0]] * LINKS),
            linkMasses=[MASS] * LINKS,
            jointPControlVector=list(STIFFNESS),
            jointDControlVector=list(DAMPING),
            jointPositionOffsetVector=[0.0] * LINKS,
            jointVelocityOffsetVector=[0.0] * LINKS,
        )
    )
    sensor = system.AddSensor(
        items.SensorNode(
            nodeNumber=coordinates,
            storeInternal=True,
            writeToFile=False,
            outputVariableType=library.OutputVariableType.Coordinates,
        )
    )
    system.Assemble()
    start = system.systemData.GetSystemState()

    def run(setting: float) -> Found:
        settings = library.SimulationSettings()
        way = settings.timeIntegration
        way.endTime, way.verboseMode = DURATION, 0
        way.automaticStepSize = way.adaptiveStep = adaptive
        if setting < 1:
            way.relativeTolerance, way.absoluteTolerance = setting, 0.1 * setting
            way.initialStepSize, way.numberOfSteps, way.minimumStepSize = 1e-5, ROWS, 1e-12
        else:
            way.numberOfSteps = int(setting)
        way.newton.useModifiedNewton = True
        way.generalizedAlpha.spectralRadius = 0.8
        settings.solution.file.write = False
        settings.solution.sensors.writePeriod = DURATION / ROWS
        settings.parallel.numberOfThreads = 1
        settings.linearSolver.solverType = library.LinearSolverType.EXUdense
        system.systemData.SetSystemState(start, configuration=library.ConfigurationType.Initial)
        library.SetWriteToConsole(False)
        solved = getattr(library.DynamicSolverType, solver)
        try:
            library.SolveDynamic(system, settings, solverType=solved, showHints=False, showCausingItems=False)
        finally:
            library.SetWriteToConsole(True)
        stored = np.array(system.GetSensorStoredData(sensor))
        return stored[:, 0], stored[:, 1:], 0

    return run


# -- measurement -------------------------------------------------------------------------------------------------------


def measured(name: str, run: Callable[[float], Found], settings: Sequence[float], longest: float) -> list[Run]:
    """Return the runs for all settings, up to one that takes longer than so many seconds."""
    found = []
    for setting in settings:
        began = time.thread_time()
        try:
            times, q, steps = run(setting)
        except Exception as error:  # EXUDYN's classes of errors differ between its versions
            print(f"{name} at {setting:.3g}: {str(error).strip().splitlines()[0][:100]}", file=sys.stderr)
            continue
        seconds = time.thread_time() - began
        found.append(Run(name, setting, largest_error(times, q), seconds, steps))
        if seconds > longest or found[-1].error < 1e-9:
            break
    return found


def best(runs: Sequence[Run], target: float) -> Run | None:
    """Return the fastest run that meets an error, of those whose next finer one meets it, too."""
    pairs = zip(runs, [*runs[1:], *runs[-1:]], strict=True)
    kept = [run for run, finer in pairs if max(run.error, finer.error) <= target]
    return min(kept, key=lambda run: run.seconds) if kept else None


def counted(every: int) -> list[list[str]]:
    """Return a row for each target: steps chosen by a tolerance and of one size that meet it over close rows, and how
    many times as many the latter are."""
    found = [
        measured(method, own(method, CLOSE_ROWS), settings[::every], 4.0)
        for method, settings in (("generalized_alpha_adaptive", TOLERANCES), ("generalized_alpha", CLOSE_STEPS))
    ]
    rows = []
    for target in TARGETS:
        ours, fixed = ([run.steps for run in runs if run.error <= target] for runs in found)
        if ours and fixed:
            rows.append([f"{target:.0e} m", str(min(ours)), str(min(fixed)), figure(min(fixed) / min(ours))])
    return rows


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, help="write everything that was measured")
    parser.add_argument("--quick", action="store_true", help="a few settings, and nothing timed twice")
    parser.add_argument("--core", type=int, default=None)
    given = parser.parse_args(arguments)
    pin_to_core(given.core)
    every = 4 if given.quick else 1
    contestants: dict[str, tuple[Callable[[float], Found], Sequence[float]]] = {
        "eomgen, generalized-alpha by a tolerance": (own("generalized_alpha_adaptive"), TOLERANCES[::every]),
        "the same, all of simulate": (by_simulate, TOLERANCES[::every]),
        "eomgen, rk45": (own("rk45"), TOLERANCES[::every]),
        "eomgen, generalized-alpha, fixed steps": (own("generalized_alpha"), STEPS[::every]),
        "SciPy, Radau": (radau, TOLERANCES[::every]),
    }
    if problem := missing("exudyn"):
        print(problem, file=sys.stderr)
    else:
        contestants["EXUDYN, generalized-alpha, adaptive"] = (exudyn("GeneralizedAlpha", True), STEPS[::every])
        contestants["EXUDYN, DOPRI5, adaptive"] = (exudyn("DOPRI5", True), TOLERANCES[::every])
    print(machine(), file=sys.stderr)
    runs = {name: measured(name, run, settings, 4.0) for name, (run, settings) in contestants.items()}
    chosen = {(name, target): best(found, target) for name, found in runs.items() for target in TARGETS}
    seconds: dict[tuple[str, float], list[float]] = {key: [] for key, run in chosen.items() if run}
    for _ in range(1 if given.quick else 15):
        for (name, target), times in seconds.items():
            run = chosen[name, target]
            assert run is not None
            began = time.thread_time()
            contestants[name][0](run.setting)
            times.append(time.thread_time() - began)
    first = "eomgen, generalized-alpha by a tolerance"
    rows = []
    for name in contestants:
        row = [name]
        for target in TARGETS:
            run = chosen[name, target]
            if run is None or chosen[first, target] is None:
                row += ["-", "-", "-"]
                continue
            middle = statistics.median(seconds[name, target])
            row += [
                figure(1e3 * middle),
                str(run.steps or "-"),
                figure(statistics.median(seconds[first, target]) / middle),
            ]
        rows.append(row)
    header = ["", *(text for target in TARGETS for text in (f"ms at {target:.0e} m", "steps", "ours by this"))]
    print(table(header, rows))
    closely = counted(every)
    print(table(["transient followed", "steps by a tolerance", "fixed steps", "times as many"], closely))
    if given.json:
        data: dict[str, Any] = {"machine": machine(), "runs": [asdict(run) for found in runs.values() for run in found]}
        data["milliseconds"] = [
            {"contestant": name, "target": target, "median": 1e3 * statistics.median(times)}
            for (name, target), times in seconds.items()
        ]
        given.json.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
