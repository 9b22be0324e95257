"""Steps of one factorization beside iterated and explicit ones: errors and times on a shear frame with a pendulum, and
on a loop, the four-bar linkage.

    python -m benchmarks.real_time_steps [--rounds 41] [--quick] [--core N] [--json out.json] [--plot late.png]

Errors are those at 10 s against digits by DOP853, relative to the largest magnitude of each coordinate and velocity; of
the four-bar at 1 s, some five turns of its crank, against rk4_partitioned at steps of 2e-5 s, relative likewise.
Times are the processor's for whole runs in one call, methods in turns. Late steps by ``late_steps``, one by one, in a
real-time thread with its memory locked where the system allows it; the JSON has their histograms, in ns.
"""

from __future__ import annotations

import argparse
import itertools
import json
import statistics
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import eomgen
from benchmarks.late_steps import Lateness, draw, isolation, late_steps
from benchmarks.measure import machine, pin_to_core, table
from eomgen.integrators.families.register import method_named
from eomgen.simulation.timing import RepeatedRun
from tests.models.shear_frame import RESPONSE, SCALE, shear_frame

EXAMPLES = Path(__file__).parent.parent / "examples"
#: Rows of the table, and what they run with.
METHODS: Mapping[str, Mapping[str, Any]] = {
    "rosenbrock": {},
    "lsrt2": {},
    "corrected_predictor": {},
    "corrected_predictor, first matrix": {"settings": {"matrix_every": 0}},
    "trapezoidal": {},
    "rk4": {},
}
STEPS = (0.04, 0.02, 0.01, 0.005, 0.0025)
#: Scenes whose steps are timed one by one, by what methods, step in s and number of steps.
LATE, LATE_METHODS, LATE_STEP, LATE_STEPS = (
    ("robot_arm", "active_vehicle", "four_bar"),
    ("rosenbrock", "generalized_alpha"),
    1e-3,
    50_000,
)
END, TIMED = 10.0, 0.005
LOOP_METHODS = ("rosenbrock", "lsrt2", "generalized_alpha", "rattlie", "rk4_partitioned")
LOOP_STEPS = (4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4)
LOOP_END, LOOP_TIMED, REFERENCE_STEP = 1.0, 1e-3, 2e-5


def run(model: eomgen.Model, row: str, end: float, step: float) -> eomgen.Solution:
    method = row.partition(",")[0]
    return model.simulate(end, step, method=method, record_every=10**9, error_estimate=False, **METHODS.get(row, {}))


def errors(model: eomgen.Model, row: str) -> list[float]:
    """Return the error of each step."""
    found = []
    for step in STEPS:
        end = run(model, row, END, step)
        found.append(float(np.abs((np.concatenate([end.q[-1], end.v[-1]]) - RESPONSE) / SCALE).max()))
    return found


def errors_on_a_loop(model: eomgen.Model) -> dict[str, list[float]]:
    """Return the error of each method and step on the four-bar."""
    reference = model.simulate(LOOP_END, REFERENCE_STEP, method="rk4_partitioned", record_every=50)
    wanted = np.hstack([reference.q, reference.v])
    found: dict[str, list[float]] = {method: [] for method in LOOP_METHODS}
    for method, step in itertools.product(LOOP_METHODS, LOOP_STEPS):
        end = run(model, method, LOOP_END, step)
        difference = np.concatenate([end.q[-1], end.v[-1]]) - wanted[-1]
        found[method].append(float(np.abs(difference / np.abs(wanted).max(axis=0)).max()))
    return found


def times(
    model: eomgen.Model, rounds: int, names: Iterable[str] = METHODS, end: float = 10 * END, step: float = TIMED
) -> dict[str, float]:
    """Return ns per step of each row, medians over rounds in turns."""
    runs, steps = {}, round(end / step)
    for row in names:
        runs[row] = RepeatedRun(model, run(model, row, end, step), method_named(row.partition(",")[0]))
    taken: dict[str, list[float]] = {row: [] for row in runs}
    for _ in range(rounds):
        for row, repeated in runs.items():
            taken[row].append(1e9 * repeated.seconds() / steps)
    return {row: statistics.median(ns) for row, ns in taken.items()}


def late() -> dict[str, Lateness]:
    """Return how late the steps of each scene and method are."""
    found = {}
    for scene in LATE:
        model = eomgen.build(EXAMPLES / scene / "scene.toml")
        for method in LATE_METHODS:
            found[f"{scene}, {method}"] = late_steps(model, method, LATE_STEP, LATE_STEPS)
    return found


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--rounds", type=int, default=41)
    parser.add_argument("--quick", action="store_true", help="errors only")
    parser.add_argument("--core", type=int)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--plot", type=Path, help="draw how late the steps of rosenbrock are")
    options = parser.parse_args(arguments)
    pin_to_core(options.core)
    print(machine())
    model = eomgen.build(shear_frame())
    found = {method: errors(model, method) for method in METHODS}
    taken = {} if options.quick else times(model, options.rounds)
    rows = [[m, *(f"{e:.1e}" for e in found[m]), f"{taken[m]:.0f}" if taken else ""] for m in METHODS]
    print(table(["method", *(f"{step:g} s" for step in STEPS), "ns per step"], rows))
    loop = eomgen.build(EXAMPLES / "four_bar" / "scene.toml")
    of_loop = errors_on_a_loop(loop)
    loop_ns = {} if options.quick else times(loop, options.rounds, LOOP_METHODS, 10 * LOOP_END, LOOP_TIMED)
    rows = [[m, *(f"{e:.1e}" for e in of_loop[m]), f"{loop_ns[m]:.0f}" if loop_ns else ""] for m in LOOP_METHODS]
    print(table(["on the four-bar", *(f"{step:g} s" for step in LOOP_STEPS), "ns per step"], rows))
    timed = {} if options.quick else late()
    told = {name: lateness.summary() for name, lateness in timed.items()}
    if timed:
        print(f"isolation: {isolation()}")
        keys = ("median", "late", "longest", "late_by_median")
        rows = [
            [name, kind, *(f"{item[key]:.2f}" for key in keys), f"{100 * item['beyond']:.3f}"]
            for name, kinds in told.items()
            for kind, item in kinds.items()
        ]
        print(
            table(
                [
                    "scene and method",
                    "of",
                    "median us",
                    "99.99 % us",
                    "longest us",
                    "99.99 % by median",
                    "beyond 1.3, %",
                ],
                rows,
            )
        )
    if options.plot and timed:
        draw({name: lateness for name, lateness in timed.items() if "rosenbrock" in name}, options.plot)
    if options.json:
        histograms = {name: lateness.histograms() for name, lateness in timed.items()}
        content = {
            "errors": found,
            "ns": taken,
            "four_bar": {"errors": of_loop, "ns": loop_ns},
            "late": told,
            "histograms": histograms,
        }
        options.json.write_text(json.dumps(content), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
