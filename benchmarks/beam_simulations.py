"""Seconds of ``eomgen simulate`` of a cantilever with many elements, as a user runs it: from a file, in a new process.

    python -m benchmarks.beam_simulations [--elements 50 200 800] [--repeats 3] [--json out.json] [--quick]

First with an empty cache, then again with the library in it; solution, tables and plots are written. Wall time, CPU
seconds of Python and of the compilers that it waits for, and the largest memory of a process.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from benchmarks.measure import environment_of_users, figure, machine, table

COLUMNS = ("wall, s", "CPU, s", "MB")
CASES = ("empty cache", "cached")
CANTILEVER = """
format = 1
name = "cantilever"

[beams.beam]
model = "cosserat"
length = 2.0
elements = ELEMENTS
mass_per_length = 1.2
rotary_inertia = [1.2e-3, 6e-4, 6e-4]
stiffness = { stretch = 2.8e7, shear_y = 1e7, shear_z = 1e7, torsion = 1e4, bending_y = 1.4e4, bending_z = 1.4e4 }

[joints.clamp]
type = "fixed"
parent = "base"
child = "beam"

[simulation]
duration = 0.05
step = 1e-3
"""


def command(folder: Path, elements: int) -> dict[str, float]:
    """Run the command on a beam once, with the cache in a folder."""
    scene = folder / "cantilever.toml"
    scene.write_text(CANTILEVER.replace("ELEMENTS", f"{elements}"), encoding="utf-8")
    words = [sys.executable, "-m", "eomgen", "simulate", str(scene), "--out", str(folder / "out")]
    with (folder / "printed.txt").open("wb") as printed:
        began = time.perf_counter()
        told = [(os.POSIX_SPAWN_DUP2, printed.fileno(), number) for number in (1, 2)]
        process = os.posix_spawn(words[0], words, environment_of_users(folder / "cache"), file_actions=told)
        _, status, usage = os.wait4(process, 0)
        wall = time.perf_counter() - began
    if os.waitstatus_to_exitcode(status):
        raise RuntimeError((folder / "printed.txt").read_text(encoding="utf-8"))
    return {"wall, s": wall, "CPU, s": usage.ru_utime + usage.ru_stime, "MB": usage.ru_maxrss / 1e3}


def first_and_second(elements: int) -> dict[str, dict[str, float]]:
    """Return the figures of a first run, and of one that finds its library."""
    with tempfile.TemporaryDirectory() as folder:
        return {case: command(Path(folder), elements) for case in CASES}


def main(words: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.beam_simulations", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--elements", nargs="+", type=int, default=[50, 200, 800])
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--quick", action="store_true", help="one beam of few elements, once")
    arguments = parser.parse_args(words)
    if arguments.quick:
        arguments.elements, arguments.repeats = [3], 1
    print(machine())
    lines, data = [], []
    for elements in arguments.elements:
        runs = [first_and_second(elements) for _ in range(arguments.repeats)]
        data.append({"elements": elements, "runs": runs})
        for case in CASES:
            medians = [statistics.median(run[case][column] for run in runs) for column in COLUMNS]
            lines.append(
                [f"{elements}", case, *(figure(number) if number < 100 else f"{number:.0f}" for number in medians)]
            )
    print("\neomgen simulate of a cantilever; medians\n")
    print(table(["elements", "", *COLUMNS], lines))
    if arguments.json:
        arguments.json.write_text(json.dumps({"machine": machine(), "beams": data}, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
