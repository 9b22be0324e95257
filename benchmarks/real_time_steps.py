"""Steps of one factorization beside iterated and explicit ones: errors and times on a shear frame with a pendulum.

    python -m benchmarks.real_time_steps [--rounds 41] [--quick] [--core N] [--json out.json]

Errors are those at 10 s against digits by DOP853, relative to the largest magnitude of each coordinate and velocity.
Times are the processor's for whole runs in one call, methods in turns; late steps are called one by one.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import eomgen
from benchmarks.measure import machine, pin_to_core, table
from eomgen.integrators.methods import method_named
from eomgen.simulation.timing import Repeated, step_times
from tests.models.shear_frame import RESPONSE, SCALE, shear_frame

EXAMPLES = Path(__file__).parent.parent / "examples"
METHODS = ("rosenbrock", "lsrt2", "trapezoidal", "rk4")
STEPS = (0.04, 0.02, 0.01, 0.005, 0.0025)
#: Scenes whose steps are timed one by one.
LATE = ("robot_arm", "active_vehicle")
END, TIMED = 10.0, 0.005


def errors(model: eomgen.Model, method: str) -> list[float]:
    """Return the error of each step."""
    found = []
    for step in STEPS:
        end = model.simulate(END, step, method=method, record_every=100_000, error_estimate=False)
        found.append(float(np.abs((np.concatenate([end.q[-1], end.v[-1]]) - RESPONSE) / SCALE).max()))
    return found


def times(model: eomgen.Model, rounds: int) -> dict[str, float]:
    """Return ns per step of each method, medians over rounds in turns."""
    runs, steps = {}, round(10 * END / TIMED)
    for method in METHODS:
        solution = model.simulate(10 * END, TIMED, method=method, record_every=steps, error_estimate=False)
        runs[method] = Repeated(model, solution, method_named(method))
    taken: dict[str, list[float]] = {method: [] for method in METHODS}
    for _ in range(rounds):
        for method, run in runs.items():
            taken[method].append(1e9 * run.seconds() / steps)
    return {method: statistics.median(ns) for method, ns in taken.items()}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--rounds", type=int, default=41)
    parser.add_argument("--quick", action="store_true", help="errors only")
    parser.add_argument("--core", type=int)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args(arguments)
    pin_to_core(options.core)
    print(machine())
    model = eomgen.build(shear_frame())
    found = {method: errors(model, method) for method in METHODS}
    taken = {} if options.quick else times(model, options.rounds)
    rows = [[m, *(f"{e:.1e}" for e in found[m]), f"{taken[m]:.0f}" if taken else ""] for m in METHODS]
    print(table(["method", *(f"{step:g} s" for step in STEPS), "ns per step"], rows))
    late = {}
    for scene in () if options.quick else LATE:
        made = eomgen.build(EXAMPLES / scene / "scene.toml")
        for method in ("rosenbrock", "generalized_alpha"):
            solution = made.simulate(1.0, 1e-3, method=method, error_estimate=False)
            late[f"{scene}, {method}"] = step_times(made, solution, count=100_000).summary()
    if late:
        keys = ("median", "late", "longest")
        rows = [[name, *(f"{1e6 * item[key]:.2f}" for key in keys)] for name, item in late.items()]
        print(table(["scene and method", "median us", "99.99 % us", "longest us"], rows))
    if options.json:
        options.json.write_text(json.dumps({"errors": found, "ns": taken, "late": late}, indent=1), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
