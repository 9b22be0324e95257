"""Seconds from a description to a compiled model, stage by stage, and from a cached model to its first step.

    python -m benchmarks.generation_time [--cases panda panda-partials ...] [--repeats 3] [--slow] [--json out.json]
    [--quick]

Every repeat is a process of its own. Beside it the same arm by SymPy's KanesMethod, common subexpressions and gcc.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path

import numpy as np

from benchmarks.measure import environment_of_users, figure, machine, table
from benchmarks.programs import default_folder
from benchmarks.robots import ROBOTS, scene, shortened, urdf

STAGES = ("import", "read", "derive", "program", "files", "compile")
BUILT = ("Python", "compilers")
PARTS = ("import", "read", "build", "first step")
WITHOUT_PARTIALS = ("mass", "coupling", "force", "inverse_dynamics", "forward_dynamics", "poses", "twists", "energy")


@dataclass(frozen=True)
class Case:
    """A robot, the terms asked for, and the seconds it should take at most."""

    robot: str
    partials: bool
    budget: float

    @property
    def terms(self) -> tuple[str, ...]:
        return (*WITHOUT_PARTIALS, "residual", "partials") if self.partials else WITHOUT_PARTIALS

    @property
    def method(self) -> str:
        return "generalized_alpha" if self.partials else "rk4"


CASES = {
    "panda": Case("panda", False, 1.5),
    "panda-partials": Case("panda", True, 4.0),
    "anymal_b": Case("anymal_b", True, 30.0),
    "talos": Case("talos", True, 30.0),
}
CACHED_BUDGET = 0.5


def in_process(what: str, case: Case, cache: Path, **more: str) -> dict[str, float]:
    """Run ``benchmarks.stages`` in a process of its own and return what it measured."""
    robot = ROBOTS[case.robot]
    task = {
        "urdf": str(urdf(robot)),
        "root": robot.root,
        "lock": robot.locked,
        "terms": case.terms,
        "method": case.method,
    }
    result = subprocess.run(
        [sys.executable, "-m", "benchmarks.stages", what, json.dumps(task | more)],
        capture_output=True,
        text=True,
        check=False,
        cwd=Path(__file__).resolve().parent.parent,
        env=environment_of_users(cache),
    )
    if result.returncode:
        raise RuntimeError(result.stderr)
    return {str(name): float(value) for name, value in json.loads(result.stdout).items()}


def stage_rows(names: Sequence[str], repeats: int) -> tuple[list[list[str]], dict[str, object]]:
    """Return table lines and data: the wrapper of cffi, which all models share, is compiled before the repeats."""
    lines: list[list[str]] = []
    data: dict[str, object] = {}
    for name in names:
        with tempfile.TemporaryDirectory() as folder:
            runs = [in_process("stages", CASES[name], Path(folder), mark=f"{k}") for k in range(repeats + 1)]
        middle = {key: statistics.median(run[key] for run in runs[1:]) for key in runs[0]}
        data[name] = {"runs": runs, "median": middle, "budget": CASES[name].budget}
        by_stage = [figure(middle[stage]) for stage in STAGES]
        size, budget = f"{middle['kB of C']:.0f}", f"{CASES[name].budget}"
        lines.append([name, *by_stage, *_totals(runs[1:]), figure(runs[0]["CPU"]), size, budget])
    return lines, data


def build_rows(names: Sequence[str], repeats: int) -> tuple[list[list[str]], dict[str, object]]:
    """Return table lines and data of first builds by ``eomgen.build``, which compiles while it writes: by profile, with
    an empty cache, and with one that holds the wrapper and the templates' bytecode of another model."""
    lines: list[list[str]] = []
    data: dict[str, object] = {}
    for name, profile in ((name, profile) for name in names for profile in ("fast", "quick")):
        with tempfile.TemporaryDirectory() as folder:
            runs = [
                in_process("first build", CASES[name], Path(folder), mark=f"{k}", profile=profile)
                for k in range(repeats + 1)
            ]
        middle = {key: statistics.median(run[key] for run in runs[1:]) for key in runs[0]}
        data[f"{name}, {profile}"] = {"runs": runs, "median": middle}
        empty = [figure(runs[0][key]) for key in ("CPU", "wall")]
        lines.append([name, profile, *(figure(middle[key]) for key in BUILT), *_totals(runs[1:]), *empty])
    return lines, data


def cached_rows(names: Sequence[str], repeats: int) -> tuple[list[list[str]], dict[str, object]]:
    """Return table lines and data of runs that find their model in the cache."""
    lines: list[list[str]] = []
    data: dict[str, object] = {}
    for name in names:
        with tempfile.TemporaryDirectory() as folder:
            runs = [in_process("first step", CASES[name], Path(folder)) for _ in range(repeats + 1)][1:]
        middle = {key: statistics.median(run[key] for run in runs) for key in runs[0]}
        data[name] = {"runs": runs, "median": middle, "budget": CACHED_BUDGET}
        lines.append([name, *(figure(middle[key]) for key in PARTS), *_totals(runs), f"{CACHED_BUDGET}"])
    return lines, data


def _totals(runs: Sequence[Mapping[str, float]]) -> list[str]:
    """Return CPU and wall seconds: median (smallest to largest)."""
    texts = []
    for key in ("CPU", "wall"):
        values = [run[key] for run in runs]
        texts.append(f"{figure(statistics.median(values))} ({figure(min(values))} to {figure(max(values))})")
    return texts


def kane_rows(joints: Sequence[int], shelf: Path) -> list[list[str]]:
    """Return table lines of SymPy's road and of eomgen's for the first joints of the Panda, checked against each
    other."""
    from benchmarks.kane import kane  # noqa: PLC0415  # imports SymPy
    from eomgen.mechanics.derive import derive  # noqa: PLC0415  # imports SymPy
    from eomgen.symbolic.evaluate import evaluate  # noqa: PLC0415

    lines = []
    described = scene(ROBOTS["panda"])
    for count in joints:
        short = shortened(described, count)
        q, v = 0.3 + 0.1 * np.arange(count, dtype=np.float64), 0.1 * np.arange(1, count + 1, dtype=np.float64)
        started = time.process_time()
        system = derive(short, ["mass", "coupling", "force"])
        ours = time.process_time() - started
        run = kane(short, count, q, v, shelf)
        blocks = {"q": q, "v": v}
        M, h, Q = (evaluate(system.tape, system.functions[name].refs, blocks) for name in ("mass", "coupling", "force"))
        error = max(
            float(np.max(np.abs(np.reshape(M, (count, count)) - run.mass))), float(np.max(np.abs(Q - h - run.forcing)))
        )
        operations = sum(system.counts[name].flops for name in ("mass", "coupling", "force"))
        theirs = [figure(seconds) for seconds in (run.derive, run.print_code, run.compile)]
        said = f"{error:.0e}" if error < 1e-9 else f"WRONG {error:.0e}"
        lines.append([f"{count}", *theirs, f"{run.operations}", figure(ours), f"{operations}", said])
    return lines


def quick() -> int:
    """Go through every stage once, from an empty cache, and through Kane's method for two joints; return the exit
    status."""
    with tempfile.TemporaryDirectory() as folder:
        measured = in_process("stages", CASES["panda"], Path(folder), mark="quick")
        built = in_process("first build", CASES["panda"], Path(folder), mark="quick", profile="quick")
        stepped = in_process("first step", CASES["panda"], Path(folder))
    print(f"stages: {', '.join(measured)}\nfirst build: {', '.join(built)}\nfirst step: {', '.join(stepped)}")
    [line] = kane_rows((2,), default_folder())
    print(f"difference from Kane's method: {line[-1]}")
    return 1 if "WRONG" in line[-1] else 0


def main(words: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.generation_time", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--cases", nargs="+", choices=list(CASES), default=list(CASES))
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--slow", action="store_true", help="SymPy's road for all seven joints too: half a minute")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--quick", action="store_true", help="go through all stages of the arm without partials, once")
    arguments = parser.parse_args(words)
    if arguments.quick:
        return quick()
    cases, repeats = arguments.cases, arguments.repeats
    print(machine())
    lines, stages = stage_rows(cases, repeats)
    print(
        "\nCPU seconds of each stage, compilers included; all of it in CPU and in wall seconds, median (smallest to"
        " largest)\n"
    )
    print(table(["case", *STAGES, "CPU", "wall", "CPU, empty cache", "kB of C", "budget"], lines))
    lines, built = build_rows(cases, repeats)
    print(
        "\nThe first build of a model by eomgen.build, where another one was built before, and with an empty cache:"
        " CPU seconds of Python and of compilers, and of all in CPU and wall seconds, median (smallest to largest)\n"
    )
    print(table(["case", "profile", *BUILT, "CPU", "wall", "CPU, empty cache", "wall, empty cache"], lines))
    lines, cached = cached_rows(cases, repeats)
    print("\nCPU seconds from the start of Python through the cache to the state after one step\n")
    print(table(["case", *PARTS, "CPU", "wall", "budget"], lines))
    lines = kane_rows((3, 7) if arguments.slow else (3,), default_folder())
    print(
        "\nThe first joints of the Panda, CPU seconds of M and the right-hand side: SymPy's KanesMethod, cse, gcc -O2\n"
    )
    header = ["joints", "Kane", "cse and print", "gcc", "operations", "eomgen derives", "its operations", "difference"]
    print(table(header, lines))
    if arguments.json:
        content = {"date": f"{date.today()}", "machine": machine(), "stages": stages, "built": built, "cached": cached}
        arguments.json.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
