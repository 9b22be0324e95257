"""Inverse and forward dynamics with two time derivatives beside each alone: operations, seconds to make, ns to run.

    python -m benchmarks.time_derivatives [--robots panda talos] [--rounds 9] [--json out.json] [--quick]

All functions of one robot are timed in turns on one core. Their numbers are held against the closed form on the Lie
group.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.measure import figure, interleaved, machine, pin_to_core, table
from benchmarks.programs import FLAGS, default_folder, timing_program
from benchmarks.robots import ROBOTS, STATES, Array, scene
from eomgen.codegen.convert import to_program
from eomgen.codegen.program import ProgramFunction
from eomgen.codegen.targets.c.target import generate_files
from eomgen.mechanics.derive import derive
from eomgen.scene.scene import Scene
from eomgen.symbolic.evaluate import evaluate
from eomgen.system.system import System

TOLERANCE = 1e-10
#: Functions that are timed; the first of each group is what the others are divided by.
GROUPS = (("inverse_dynamics", "rates_1", "rates"), ("forward_dynamics", "forward_rates_1", "forward_rates"))
BLOCKS = ("q", "v", "a", "j", "s")


@dataclass(frozen=True)
class Made:
    """One function: its system, what it cost to make, and the timing program, which runs on ``states``."""

    name: str
    system: System
    derive: float
    emit: float
    compile: float
    command: tuple[str, ...]
    states: Path

    def results(self, file: Path) -> Array:
        subprocess.run([*self.command, "results", str(self.states), str(file)], check=True)
        return np.fromfile(file).reshape(STATES, -1)


def random_states(system: System) -> dict[str, Array]:
    """Return configurations with unit quaternions, velocities, accelerations and their derivatives."""
    rng = np.random.default_rng(0)
    states = {"q": rng.uniform(-1.5, 1.5, (STATES, system.nq))}
    for factor in system.factors:
        if factor.group != "R":
            quaternion = states["q"][:, factor.q_start : factor.q_start + 4]
            quaternion /= np.linalg.norm(quaternion, axis=1, keepdims=True)
    return states | {block: rng.uniform(-1.5, 1.5, (STATES, system.nv)) for block in BLOCKS[1:]}


def make(robot: Scene, name: str, flags: str, shelf: Path, folder: Path) -> Made:
    start = time.process_time()
    system = derive(robot, [name])
    derived = time.process_time()
    program = to_program(system, functions=[name])
    files = generate_files(program)
    emitted = time.process_time()
    sources = {file: text for file, text in files.items() if file.endswith((".c", ".h")) and file != "main.c"}
    built = timing_program(shelf, sources, _call(program.prefix, program.functions[0], system), FLAGS[flags])
    states = folder / f"{program.prefix}.states"
    blocks = random_states(system)
    np.concatenate([blocks[block] for block in BLOCKS], axis=1).tofile(states)
    return Made(name, system, derived - start, emitted - derived, built.seconds, (str(built.file("run")),), states)


def _call(prefix: str, function: ProgramFunction, system: System) -> str:
    sizes = [system.nq] + [system.nv] * 4
    places = {block: f"state + {sum(sizes[:k])}" for k, block in enumerate(BLOCKS)}
    arguments, start = [places[block] for block in function.inputs], 0
    for output in function.outputs:
        arguments.append(f"result + {start}")
        start += output.size
    return (
        f'#include "{prefix}.h"\nenum {{ WIDTH = {sum(sizes)}, SIZE = {start} }};\n'
        "static inline void evaluate(const double *state, double *result)\n"
        f"{{\n    {prefix}_{function.name}({', '.join(arguments)});\n}}\n"
    )


def error_of(robot: Scene, made: Made, folder: Path) -> float:
    """Return the largest deviation of tau and its derivatives, each relative to its size, from the closed form.

    Of free motion, what tau and its derivatives leave of zero, relative to M times the highest derivative.
    """
    found = made.results(folder / "results")
    system = derive(robot, ["rates_closed", "mass"])
    states: dict[str, Array] = random_states(system)
    paths = found.reshape(STATES, -1, system.nv)
    if made.name.startswith("forward"):
        states |= {block: paths[:, k] for k, block in enumerate(("a", "j", "s")[: paths.shape[1]])}
    of: Mapping[str, Sequence[int]] = {block.name: block.refs for block in system.functions["rates_closed"].outputs}
    worst = 0.0
    for k, name in enumerate(("tau", "tau_dot", "tau_ddot")[: paths.shape[1]]):
        expected = evaluate(system.tape, of[name], states)
        if made.name.startswith("forward"):
            M = evaluate(system.tape, system.functions["mass"].refs, states).reshape(STATES, system.nv, system.nv)
            size = np.linalg.norm(M @ paths[:, k, :, np.newaxis], axis=(1, 2))
            worst = max(worst, float(np.max(np.linalg.norm(expected, axis=1) / size)))
        else:
            difference = np.linalg.norm(paths[:, k] - expected, axis=1)
            worst = max(worst, float(np.max(difference / np.linalg.norm(expected, axis=1))))
    return worst


def main(words: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.time_derivatives", description=__doc__.split("\n")[0])
    parser.add_argument("--robots", nargs="+", choices=list(ROBOTS), default=["panda", "talos"])
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--batches", type=int, default=21)
    parser.add_argument("--core", type=int)
    parser.add_argument("--work", type=Path, default=default_folder())
    parser.add_argument("--json", type=Path)
    parser.add_argument("--quick", action="store_true", help="check numbers of the Panda and time nothing")
    options = parser.parse_args(words)
    core = pin_to_core(options.core)
    print(f"{date.today()}, {machine()}, core {core}\n", file=sys.stderr)
    data: list[dict[str, Any]] = []
    right = True
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        for name in ["panda"] if options.quick else options.robots:
            robot = scene(ROBOTS[name])
            derive(robot, ["mass"])  # what the first derivation of a process loads is not counted
            for flags in FLAGS:
                made = [make(robot, function, flags, options.work, folder) for group in GROUPS for function in group]
                errors = [error_of(robot, item, folder) for item in made]
                right &= max(errors) <= TOLERANCE
                if options.quick:
                    print(
                        "\n".join(f"{item.name} {flags}: {error:.1e}" for item, error in zip(made, errors, strict=True))
                    )
                    continue
                commands = [[*item.command, "time", str(item.states), str(options.batches)] for item in made]
                timings = interleaved(commands, options.rounds)
                first = {group[0]: timings[k * len(group)].median for k, group in enumerate(GROUPS)}
                lines = []
                for item, error, timing in zip(made, errors, timings, strict=True):
                    alone = first[GROUPS[0][0] if "forward" not in item.name else GROUPS[1][0]]
                    operations = item.system.counts[item.name].flops
                    data.append(
                        {
                            "robot": name,
                            "function": item.name,
                            "flags": flags,
                            "operations": operations,
                            "error": error,
                            "derive": item.derive,
                            "emit": item.emit,
                            "compile": item.compile,
                            "ns": timing.median,
                            "spread": timing.spread,
                            "ratio": timing.median / alone,
                        }
                    )
                    lines.append(
                        [
                            item.name,
                            str(operations),
                            figure(item.derive, 2),
                            figure(item.emit, 2),
                            figure(item.compile, 2),
                            figure(timing.median),
                            f"{100 * timing.spread / 2:.0f} %",
                            f"{timing.median / alone:.2f}",
                            f"{error:.0e}",
                        ]
                    )
                print(f"{name}, {flags}\n")
                header = ["function", "operations", "derive s", "emit s", "gcc s", "ns", "+-", "x alone", "error"]
                print(table(header, lines) + "\n")
    if options.json:
        options.json.write_text(json.dumps(data, indent=1), encoding="utf-8")
    return 0 if right else 1


if __name__ == "__main__":
    raise SystemExit(main())
