"""Seconds from a scene to a compiled model and its first step, in new processes: processor time of Python and of
compilers, and wall time.

    python -m benchmarks.build_time [--cases four_bar wishbone_car ...] [--repeats 3] [--json out.json]

Each scene is built with all functions (``eomgen.build``) and with the functions of its runs (``eomgen simulate``), with
an empty cache, then again from the cache.
"""

# ruff: noqa: PLC0415  # importing is part of what is measured
from __future__ import annotations

import argparse
import json
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from datetime import date
from itertools import pairwise
from pathlib import Path

#: The first three are scenes of ``build_scenes``, the others robots of ``robots``.
CASES = ("four_bar", "seven_bodies", "wishbone_car", "panda", "talos")
FUNCTIONS = ("all", "of runs")
QUANTITIES = ("read", "build", "step", "wall", "Python", "compilers")


def _seconds(who: int) -> float:
    usage = resource.getrusage(who)
    return usage.ru_utime + usage.ru_stime


def measured(case: str, functions: str) -> dict[str, float]:
    """Return wall seconds of reading (imports included), build and first step, and processor seconds of all; in this
    process."""
    laps = [time.perf_counter()]
    import eomgen
    from eomgen.pipeline.pipeline import built_for_run

    if case in CASES[:3]:
        from benchmarks import build_scenes

        scene = eomgen.load(getattr(build_scenes, case)())
    else:
        import importlib.metadata

        package = importlib.metadata.distribution("example-robot-data")
        files = {"panda": "panda_description/urdf/panda.urdf", "talos": "talos_data/robots/talos_reduced.urdf"}
        path = package.locate_file(f"cmeel.prefix/share/example-robot-data/robots/{files[case]}")
        scene = eomgen.load(str(path), root="fixed" if case == "panda" else "free")
    laps.append(time.perf_counter())
    method = "generalized_alpha"
    model = eomgen.build(scene, method=method) if functions == "all" else built_for_run(scene, method)
    laps.append(time.perf_counter())
    step = scene.simulation.step
    solution = model.simulate(step, step, method=method, error_estimate=False)
    laps.append(time.perf_counter())
    if not solution.success:
        raise RuntimeError(solution.message)
    parts = dict(zip(QUANTITIES, (after - before for before, after in pairwise(laps)), strict=False))
    return parts | {
        "wall": laps[-1] - laps[0],
        "Python": _seconds(resource.RUSAGE_SELF),
        "compilers": _seconds(resource.RUSAGE_CHILDREN),
    }


def in_process(case: str, functions: str, cache: Path) -> dict[str, float]:
    """Return what a new process measures."""
    command = [sys.executable, "-m", "benchmarks.build_time", "--one", case, functions]
    from benchmarks.measure import environment_of_users

    environment = environment_of_users(cache)
    folder = Path(__file__).resolve().parent.parent
    ran = subprocess.run(command, capture_output=True, text=True, check=False, cwd=folder, env=environment)
    if ran.returncode:
        raise RuntimeError(ran.stderr)
    return {str(name): float(value) for name, value in json.loads(ran.stdout).items()}


def rows(cases: Sequence[str], repeats: int) -> dict[str, dict[str, float]]:
    """Return medians by case, functions and state of the cache."""
    result: dict[str, dict[str, float]] = {}
    for case in cases:
        for functions in FUNCTIONS:
            runs: dict[str, list[dict[str, float]]] = {"empty cache": [], "cached": []}
            for _ in range(repeats):
                with tempfile.TemporaryDirectory() as folder:
                    for state in runs.values():
                        state.append(in_process(case, functions, Path(folder)))
            for state, ones in runs.items():
                medians = {key: statistics.median(one[key] for one in ones) for key in QUANTITIES}
                result[f"{case}, functions {functions}, {state}"] = medians
    return result


def main(words: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.build_time", description=(__doc__ or "").partition("\n\n")[0]
    )
    parser.add_argument("--cases", nargs="+", choices=CASES, default=list(CASES))
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--one", nargs=2, metavar=("CASE", "FUNCTIONS"), help="measure in this process, for the parent")
    arguments = parser.parse_args(words)
    if arguments.one:
        print(json.dumps(measured(*arguments.one)))
        return 0
    from benchmarks.measure import figure, machine, table

    print(machine())
    made = rows(arguments.cases, arguments.repeats)
    lines = [[name, *(figure(values[key]) for key in QUANTITIES)] for name, values in made.items()]
    print("\nWall seconds of reading, build and first step, and of all; processor seconds of Python and compilers\n")
    print(table(["scene", *QUANTITIES], lines))
    if arguments.json:
        content = {"date": f"{date.today()}", "machine": machine(), "rows": made}
        arguments.json.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
