"""Seconds from a scene to a compiled model and its first step, in new processes: processor time of Python and of
compilers, and wall time.

    python -m benchmarks.build_time [--cases four_bar wishbone_car ...] [--repeats 3] [--json out.json]

Each scene is built with all functions (``eomgen.build``) and with the functions of its runs (``eomgen simulate``), with
an empty cache, then again from the cache, and robots once more with the mass of one link changed.
"""

# ruff: noqa: PLC0415  # importing is part of what is measured
from __future__ import annotations

import argparse
import json
import re
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

#: Files of robots, the others are scenes of ``build_scenes``.
FILES = {
    "panda": "panda_description/urdf/panda.urdf",
    "ur5": "ur_description/urdf/ur5_robot.urdf",
    "talos": "talos_data/robots/talos_reduced.urdf",
}
CASES = ("four_bar", "seven_bodies", "wishbone_car", *FILES)
#: Factor of the mass of a robot's heaviest link, by state of the cache before a build.
STATES = {"empty cache": 1.0, "cached": 1.0, "one mass changed": 1.01}
FUNCTIONS = ("all", "of runs")
QUANTITIES = ("read", "build", "step", "wall", "Python", "compilers")


def _seconds(who: int) -> float:
    usage = resource.getrusage(who)
    return usage.ru_utime + usage.ru_stime


def robot_file(case: str, factor: float, folder: Path) -> Path:
    """Write the file of a robot into a folder, with another mass of the heaviest link."""
    import importlib.metadata

    package = importlib.metadata.distribution("example-robot-data")
    there = Path(str(package.locate_file(f"cmeel.prefix/share/example-robot-data/robots/{FILES[case]}")))
    text = there.read_text(encoding="utf-8")
    heaviest = max(re.findall(r'<mass value="([^"]+)"', text), key=float)  # links on the base are in no equation
    text = text.replace(f'"{heaviest}"', f'"{factor * float(heaviest)!r}"', 1)
    file = folder / f"{case}.urdf"
    file.write_text(text, encoding="utf-8")
    return file


def measured(case: str, functions: str, robot: Path | None) -> dict[str, float]:
    """Return wall seconds of reading (imports included), build and first step, and processor seconds of all; in this
    process, from a file of a robot or a scene of ``build_scenes``."""
    laps = [time.perf_counter()]
    import eomgen

    if robot is None:
        from benchmarks import build_scenes

        scene = eomgen.load(getattr(build_scenes, case)())
    else:
        scene = eomgen.load(robot, root="free" if case == "talos" else "fixed")
    laps.append(time.perf_counter())
    method = "generalized_alpha"
    if functions == "all":
        model = eomgen.build(scene, method=method)
    else:
        from eomgen.pipeline.pipeline import build_for_run  # behind eomgen.load, by which users import NumPy

        model = build_for_run(scene, method)
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


def in_process(case: str, functions: str, cache: Path, factor: float) -> dict[str, float]:
    """Return what a new process measures; ``factor`` of a mass as in ``STATES``."""
    from benchmarks.measure import environment_of_users

    command = [sys.executable, "-m", "benchmarks.build_time", "--one", case, functions]
    if case in FILES:
        command.append(str(robot_file(case, factor, cache)))

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
            states = dict(STATES) if case in FILES else {name: 1.0 for name in STATES if STATES[name] == 1.0}
            runs: dict[str, list[dict[str, float]]] = {state: [] for state in states}
            for _ in range(repeats):
                with tempfile.TemporaryDirectory() as folder:
                    for state, factor in states.items():
                        runs[state].append(in_process(case, functions, Path(folder), factor))
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
    parser.add_argument(
        "--one", nargs="+", metavar="WORD", help="case, functions and file: measure in this process, for the parent"
    )
    arguments = parser.parse_args(words)
    if arguments.one:
        case, functions, *file = arguments.one
        print(json.dumps(measured(case, functions, Path(file[0]) if file else None)))
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
