"""What Python costs around a short run of ``simulate``, and what is paid when somebody asks for more than its states.

    python -m benchmarks.run_overhead [--rounds 300] [--steps 10] [--core N] [--json out.json]

Times are those of the processor in this thread, medians over rounds; beyond the C means less the compiled calls that
the same run makes (initialization, all steps and their rows).
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

import eomgen
from benchmarks.measure import machine, pin_to_core
from eomgen.integrators.families.register import method_named
from eomgen.pipeline.model import Model
from eomgen.results.solution import Solution
from eomgen.simulation.timing import RepeatedRun

EXAMPLES = Path(__file__).parents[1] / "examples"
CASES = (
    ("symmetric_top", "taylor"),
    ("symmetric_top", "rk4"),
    ("symmetric_top", "generalized_alpha"),
    ("robot_arm", "taylor"),
    ("robot_arm", "rk4"),
    ("robot_arm", "generalized_alpha"),
    ("four_bar", "generalized_alpha"),
)


def microseconds(work: Callable[[], object], rounds: int) -> float:
    """Return the median of the processor's time for one call, us."""
    taken = []
    for _ in range(rounds):
        began = time.thread_time_ns()
        work()
        taken.append(1e-3 * (time.thread_time_ns() - began))
    return statistics.median(taken)


def compiled(model: Model, solution: Solution) -> Callable[[], object]:
    """Return what makes the compiled calls of a run alone: its start, its steps and their rows."""
    described = solution.metadata
    repeated = RepeatedRun(model, solution, method_named(described["method"], **described["method_parameters"]))
    return repeated.seconds


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=300)
    parser.add_argument("--steps", type=int, default=10)
    parser.add_argument("--core", type=int, default=None)
    parser.add_argument("--json", type=Path, default=None)
    chosen = parser.parse_args(arguments)
    pin_to_core(chosen.core)
    print(machine())
    print(f"us of CPU time for a run of {chosen.steps} steps; medians of {chosen.rounds} rounds")
    rows = {}
    for name, method in CASES:
        model = eomgen.build(EXAMPLES / name / "scene.toml", method=method)
        step = 0.1 * float(model.library.layout["defaults"]["step"])
        end = chosen.steps * step
        initial = {"q": model.initial_q, "v": model.initial_v}

        def run(model: Model = model, end: float = end, step: float = step, **options: object) -> Solution:
            return model.simulate(end, step, **options)

        bare = microseconds(compiled(model, run()), chosen.rounds)
        whole = microseconds(lambda run=run: float(run().q[-1, 0]), chosen.rounds)
        others = {
            "initial": microseconds(lambda run=run, initial=initial: run(initial=initial), chosen.rounds),
            "success": microseconds(lambda run=run: run().success, chosen.rounds),
            "message": microseconds(lambda run=run: run(error_estimate=False).message, chosen.rounds),
            "with estimate": microseconds(lambda run=run: run().message, max(chosen.rounds // 5, 1)),
        }
        rows[f"{name}, {method}"] = {"compiled": bare, "run": whole, "beyond": whole - bare, **others}
        rest = "  ".join(f"{key} {value:7.1f}" for key, value in others.items())
        print(f"  {name:14} {method:18} C {bare:6.1f}  run {whole:6.1f}  beyond the C {whole - bare:5.1f}  {rest}")
    if chosen.json:
        chosen.json.write_text(json.dumps(rows, indent=1), encoding="utf-8")
    return 0 if all(np.isfinite(row["run"]) for row in rows.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
