"""A geometrically exact beam that is thrown into space, by EXUDYN and PyElastica: time to an error at equal physics.

    python -m benchmarks.beam_peers [--quick] [--json out.json]

The flying spaghetti of Simo and Vu-Quoc as Hante, Tumiotto and Arnold (Multibody Syst. Dyn. 54 (2022) 97) have it, with
shear and stretch, until the load is gone at 5 s. The error of a run is the larger distance, m, of an end from where the
same program's finest runs go in the limit: EXUDYN's beams have the equations of ours, PyElastica's keep their volume
when stretched, by which its limit is some 2 cm away. Each program gets all pairs of a number of elements and a step;
the fastest that meets an error counts. EXUDYN integrates by generalized-alpha with rho = 0.9 and modified Newton,
PyElastica by its symplectic PositionVerlet, the couple set on two elements so that it acts on the end to second order.
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import eomgen
from benchmarks.frame_peers import missing
from benchmarks.measure import figure, machine, pin_to_core, table

Array = NDArray[np.float64]
LENGTH, TURN, END = 10.0, math.atan2(8.0, -6.0), 5.0
MEMBRANE, BENDING, ROTARY = 1e4, 500.0, 10.0
AXIS = np.array([math.cos(TURN), math.sin(TURN), 0.0])
START = np.array([6.0, 0.0, 0.0])
ERRORS = (0.3, 0.1, 0.03, 0.01)
ELEMENTS = (4, 8, 16, 32, 64)
STEPS = (0.1, 0.05, 0.02, 0.01, 0.005)
#: PyElastica is explicit: steps in units of an element's length by the speed of waves, 100 m/s.
COURANT = (0.8, 0.4, 0.2, 0.1)

Way = Callable[[], Array]


def pull(t: float) -> float:
    """Return the load, N, at a time: 1/10 of it is the force, (0, -1/2, -1) m times it the couple."""
    return 80.0 * min(t, END - t) if t < END else 0.0


@dataclass(frozen=True)
class Row:
    """One run."""

    program: str
    elements: int
    step: float
    ends: list[float]
    seconds: float


def eomgen_model(elements: int) -> eomgen.Model:
    stiff = dict.fromkeys(("stretch", "shear_y", "shear_z"), MEMBRANE)
    bending = dict.fromkeys(("torsion", "bending_y", "bending_z"), BENDING)
    description: dict[str, Any] = {
        "format": 1,
        "name": "thrown_beam",
        "gravity": [0, 0, 0],
        "beams": {
            "noodle": {
                "model": "cosserat",
                "length": LENGTH,
                "elements": elements,
                "mass_per_length": 1.0,
                "rotary_inertia": [ROTARY] * 3,
                "stiffness": stiff | bending,
            }
        },
        "joints": {
            "flight": {
                "type": "free",
                "parent": "base",
                "child": "noodle",
                "initial": {"position": START.tolist(), "rotation": [{"axis": [0, 0, 1], "angle": TURN}]},
            }
        },
        "inputs": {"load": {"formula": f"80 * min(t, {END} - t) if t < {END} else 0"}},
        "forces": {"throw": {"body": "noodle", "force": ["0.1 * load", 0, 0], "torque": [0, "-0.5 * load", "-load"]}},
    }
    return eomgen.build(description)


def eomgen_way(elements: int, step: float) -> Way:
    model = eomgen_model(elements)

    def run() -> Array:
        found = model.simulate(END, step, rho_inf=0.9, error_estimate=False)
        return np.concatenate([found.poses[name][-1][4:] for name in ("noodle", f"noodle.{elements}")])

    return run


def exudyn_way(elements: int, step: float) -> Way:
    exu, items = import_module("exudyn"), import_module("exudyn.itemInterface")

    def run() -> Array:
        system = exu.SystemContainer().AddSystem()
        section = exu.BeamSection()
        section.stiffnessMatrix = np.diag([MEMBRANE] * 3 + [BENDING] * 3)
        section.inertia, section.massPerLength = ROTARY * np.eye(3), 1.0
        turn = [math.cos(TURN / 2), 0.0, 0.0, math.sin(TURN / 2)]
        places = [START + LENGTH * k / elements * AXIS for k in range(elements + 1)]
        nodes = [system.AddNode(items.NodeRigidBodyEP(referenceCoordinates=[*place, *turn])) for place in places]
        for pair in pairwise(nodes):
            beam = items.ObjectBeamGeometricallyExact(
                nodeNumbers=list(pair), length=LENGTH / elements, sectionData=section
            )
            system.AddObject(beam)
        end = system.AddMarker(items.MarkerNodeRigid(nodeNumber=nodes[0]))
        for kind, direction in (
            (items.LoadForceVector, np.array([0.1, 0.0, 0.0])),
            (items.LoadTorqueVector, np.array([0.0, -0.5, -1.0])),
        ):
            load = kind(
                markerNumber=end,
                loadVector=[1, 0, 0],
                loadVectorUserFunction=lambda _, t, __, direction=direction: (pull(t) * direction).tolist(),
            )
            system.AddLoad(load)
        system.Assemble()
        settings = exu.SimulationSettings()
        settings.timeIntegration.numberOfSteps, settings.timeIntegration.endTime = round(END / step), END
        settings.timeIntegration.generalizedAlpha.spectralRadius = 0.9
        settings.timeIntegration.newton.useModifiedNewton = True
        settings.timeIntegration.verboseMode = 0
        settings.solution.file.write = False
        settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
        system.SolveDynamic(settings)
        found = [system.GetNodeOutput(node, exu.OutputVariableType.Position) for node in (nodes[0], nodes[-1])]
        return np.concatenate(found)

    return run


def elastica_way(elements: int, step: float) -> Way:
    elastica = import_module("elastica")

    class Scene(elastica.BaseSystemCollection, elastica.Forcing):  # type: ignore[name-defined,misc]
        pass

    class Throw(elastica.NoForces):  # type: ignore[name-defined,misc]
        def apply_forces(self, system: Any, time: float = 0.0) -> None:
            system.external_forces[0, 0] += 0.1 * pull(time)

        def apply_torques(self, system: Any, time: float = 0.0) -> None:
            couple = pull(time) * np.array([0.0, -0.5, -1.0])
            for element, share in ((0, 1.5), (1, -0.5)):
                system.external_torques[:, element] += share * system.director_collection[:, :, element] @ couple

    radius = 0.1
    area = math.pi * radius**2
    stiff = {"density": 1 / area, "youngs_modulus": MEMBRANE / area, "shear_modulus": MEMBRANE / area}

    def run() -> Array:
        rod = elastica.CosseratRod.straight_rod(
            elements, START, AXIS, np.array([0.0, 0.0, 1.0]), LENGTH, radius, **stiff
        )
        inertia = ROTARY * LENGTH / elements
        for matrix, size in (
            (rod.shear_matrix, MEMBRANE),
            (rod.bend_matrix, BENDING),
            (rod.mass_second_moment_of_inertia, inertia),
            (rod.inv_mass_second_moment_of_inertia, 1.0 / inertia),
        ):
            matrix[:] = size * np.eye(3)[:, :, None]
        scene = Scene()
        scene.append(rod)
        scene.add_forcing_to(rod).using(Throw)
        scene.finalize()
        stepper, t = elastica.PositionVerlet(), np.float64(0.0)
        for _ in range(round(END / step)):
            t = stepper.step(scene, t, np.float64(step))
        return np.concatenate([rod.position_collection[:, 0], rod.position_collection[:, -1]])

    return run


def rows_of(program: str, pairs: Sequence[tuple[int, float]], rounds: int) -> list[Row]:
    """Return a row for each pair of elements and a step that runs to the end."""
    way = {"eomgen": eomgen_way, "exudyn": exudyn_way, "pyelastica": elastica_way}[program]
    found = []
    for elements, step in pairs:
        run = way(elements, step)
        try:
            ends = run()
            taken = []
            for _ in range(rounds):
                began = time.thread_time()
                run()
                taken.append(time.thread_time() - began)
        except (eomgen.EomgenError, ValueError, RuntimeError):
            continue
        if np.all(np.isfinite(ends)):
            found.append(Row(program, elements, step, ends.tolist(), statistics.median(taken)))
    return found


def limit(rows: Sequence[Row]) -> Array:
    """Return where the ends go by runs of order 2 with the smallest step of each of the two finest meshes."""
    fine, finest = (
        min((row for row in rows if row.elements == elements), key=lambda row: row.step)
        for elements in sorted({row.elements for row in rows})[-2:]
    )
    ratio = (finest.elements / fine.elements) ** 2
    limit: Array = (ratio * np.array(finest.ends) - np.array(fine.ends)) / (ratio - 1.0)
    return limit


def error(row: Row, at: Array) -> float:
    return float(np.linalg.norm((np.array(row.ends) - at).reshape(2, 3), axis=1).max())


def pairs_of(program: str, quick: bool) -> list[tuple[int, float]]:
    elements = ELEMENTS[:3] if quick else ELEMENTS
    if program == "pyelastica":
        return [(n, share * 1e-2 * LENGTH / n) for n in elements for share in (COURANT[1:2] if quick else COURANT)]
    return [(n, step) for n in elements for step in (STEPS[2:3] if quick else STEPS)]


def compare(quick: bool) -> Mapping[str, list[Row]]:
    """Return the runs of all programs that are there."""
    found = {}
    for program in ("eomgen", "exudyn", "pyelastica"):
        if program != "eomgen" and (said := missing(program)):
            print(said, file=sys.stderr)
            continue
        found[program] = rows_of(program, pairs_of(program, quick), 1 if quick else 5)
    return found


def report(found: Mapping[str, Sequence[Row]], errors: Sequence[float] = ERRORS) -> str:
    """Return the fastest run of each program for each error, and the ratio to eomgen's time."""
    header = ["error, m", *(f"{name}: n, step, ms" for name in found), *(f"eomgen / {name}" for name in found)]
    lines = []
    for wanted in errors:
        cells, seconds = [], {}
        for program, rows in found.items():
            at = limit(rows)
            best = min((row for row in rows if error(row, at) <= wanted), key=lambda row: row.seconds, default=None)
            seconds[program] = best.seconds if best else None
            cells.append(f"{best.elements}, {best.step:.3g}, {1e3 * best.seconds:.3g}" if best else "-")
        own = seconds["eomgen"]
        ratios = [figure(own / other) if own and other else "-" for other in seconds.values()]
        lines.append([f"{wanted:g}", *cells, *ratios])
    return table(header, lines)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="three numbers of elements, one step")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--core", type=int)
    options = parser.parse_args(arguments)
    pin_to_core(options.core)
    found = compare(options.quick)
    print(machine())
    print(report(found, ERRORS[:1] if options.quick else ERRORS))
    for program, rows in found.items():
        print(f"{program}: the ends go to {np.array2string(limit(rows), precision=4)} m")
    if options.json:
        runs = {program: [asdict(row) for row in rows] for program, rows in found.items()}
        options.json.write_text(json.dumps({"machine": machine(), "runs": runs}, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
