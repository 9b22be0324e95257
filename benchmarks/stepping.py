"""Time per step of the compiled time loops, with what the stepper counted, beside SciPy's solve_ivp on the same
right-hand side.

    python -m benchmarks.stepping [--repeats 7] [--json out.json] [--quick]

Our loops take fixed steps; solve_ivp (DOP853) is asked for the error that the loop turned out to have. Both are held
against a reference run of DOP853 at 1e-12.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import date
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import eomgen
from benchmarks.measure import figure, machine, pin_to_core, table
from benchmarks.robots import ROBOTS, urdf
from eomgen.pipeline.model import Model
from eomgen.results.solution import Solution
from eomgen.scene.scene import Scene

Array = NDArray[np.float64]
EXAMPLES = Path(__file__).resolve().parent.parent / "examples"
SHORTEST = 0.05  # CPU seconds of what is timed
METHODS = ("generalized_alpha", "rk4")


@dataclass(frozen=True)
class Case:
    """A scene, the step and the time it is run for, both in seconds."""

    name: str
    step: float
    duration: float
    file: str = ""

    def scene(self) -> Scene:
        if self.file:
            return eomgen.load(EXAMPLES / self.file)
        robot = ROBOTS[self.name]
        return eomgen.load(urdf(robot), root=robot.root, lock=robot.locked)


CASES = (
    Case("pendulum on a shaking base", 1e-3, 10.0, "pendulum_on_shaking_base/scene.toml"),
    Case("active vehicle", 1e-3, 5.0, "active_vehicle/scene.toml"),
    Case("panda", 1e-3, 1.0),
)


@dataclass(frozen=True)
class Run:
    """One method on one scene; ``error`` is the largest one in q and v at the end, relative to the largest number
    there."""

    scene: str
    method: str
    nv: int
    steps: int
    microseconds: float
    spread: float
    newton_iterations: float
    factorizations: float
    evaluations: float
    error: float
    seconds_of_scipy: float
    evaluations_of_scipy: int

    @property
    def ratio(self) -> float:
        """SciPy's time for the same error, in units of ours."""
        return self.seconds_of_scipy / (self.microseconds * 1e-6 * self.steps)


def timed(model: Model, case: Case, method: str, repeats: int) -> tuple[list[float], Solution]:
    """Return CPU seconds of the compiled loop, which are a run's less those of a single step, and the last solution."""
    first, solution = run_for(model, case, method, case.duration, 1)
    calls = max(1, int(SHORTEST / first))
    seconds = []
    for _ in range(repeats):
        start, _ = run_for(model, case, method, case.step, calls)
        whole, solution = run_for(model, case, method, case.duration, calls)
        seconds.append((whole - start) / calls)
    return seconds, solution


def run_for(model: Model, case: Case, method: str, duration: float, calls: int) -> tuple[float, Solution]:
    """Return CPU seconds of some equal simulations, and the solution."""
    start = time.thread_time()
    for _ in range(calls):
        solution = model.simulate(duration, case.step, method=method, record_every=10**9, error_estimate=False)
    seconds = time.thread_time() - start
    if not solution.success:
        raise RuntimeError(f"{case.name}, {method}: {solution.message}")
    return seconds, solution


def scipy_run(model: Model, case: Case, tolerance: float) -> tuple[Array, float, int]:
    """Return the final state, CPU seconds and evaluations of DOP853."""
    start = time.thread_time()
    y = np.concatenate([model.initial_q, model.initial_v])
    run = solve_ivp(model.rhs, (0.0, case.duration), y, method="DOP853", rtol=tolerance, atol=1e-3 * tolerance)
    if not run.success:
        raise RuntimeError(f"{case.name}: {run.message}")
    return np.asarray(run.y[:, -1], dtype=np.float64), time.thread_time() - start, int(run.nfev)


def difference(state: Array, reference: Array) -> float:
    """Return the largest difference in units of the largest number of the reference."""
    return float(np.max(np.abs(state - reference)) / np.max(np.abs(reference)))


def measured(case: Case, repeats: int) -> list[Run]:
    """Return the runs of a scene by all methods that it allows."""
    model = eomgen.build(case.scene())
    reference, _, _ = scipy_run(model, case, 1e-12)
    runs = []
    for method in METHODS:
        seconds, solution = timed(model, case, method, repeats)
        stats = solution.stats
        steps = int(stats["steps"])
        error = difference(np.concatenate([solution.q[-1], solution.v[-1]]), reference)
        tolerance = min(1e-3, max(1e-12, error))
        _, of_scipy, evaluations = scipy_run(model, case, tolerance)
        middle, range_of_seconds = statistics.median(seconds), max(seconds) - min(seconds)
        counted = {name: stats[name] / steps for name in ("newton_iterations", "factorizations", "evaluations")}
        per_step = middle / (steps - 1) * 1e6
        spread = range_of_seconds / middle
        runs.append(
            Run(
                scene=case.name,
                method=method,
                nv=model.nv,
                steps=steps,
                microseconds=per_step,
                spread=spread,
                **counted,
                error=error,
                seconds_of_scipy=of_scipy,
                evaluations_of_scipy=evaluations,
            )
        )
    return runs


HEADER = (
    "scene", "method", "nv", "steps", "us per step", "iterations", "factorizations", "evaluations", "error",
    "SciPy ms", "SciPy calls", "SciPy / ours",
)  # fmt: skip  # a table


def lines_of(runs: Sequence[Run]) -> list[list[str]]:
    """Return the table's lines."""
    return [
        [
            run.scene,
            run.method,
            f"{run.nv}",
            f"{run.steps}",
            f"{figure(run.microseconds)} ±{50 * run.spread:.0f}%",
            figure(run.newton_iterations),
            figure(run.factorizations),
            figure(run.evaluations),
            f"{run.error:.1e}",
            figure(run.seconds_of_scipy * 1e3),
            f"{run.evaluations_of_scipy}",
            figure(run.ratio),
        ]
        for run in runs
    ]


def main(words: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.stepping", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("--core", type=int, help="the core to stay on (the last one by default)")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--quick", action="store_true", help="the pendulum for a tenth of a second, once")
    arguments = parser.parse_args(words)
    cases = (Case(CASES[0].name, 1e-3, 0.1, CASES[0].file),) if arguments.quick else CASES
    for case in cases:
        eomgen.build(case.scene())  # with both cores, before this process stays on one
    core = None if arguments.quick else pin_to_core(arguments.core)
    runs = [run for case in cases for run in measured(case, 1 if arguments.quick else arguments.repeats)]
    print(f"{machine()}, core {core}\n")
    print(table(HEADER, lines_of(runs)))
    if arguments.json:
        content = {"date": f"{date.today()}", "machine": machine(), "runs": [asdict(run) for run in runs]}
        arguments.json.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
