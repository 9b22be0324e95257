"""Inverse dynamics, mass matrix, forward dynamics and partials of robots: eomgen beside Pinocchio, in one run on one
core.

    python -m benchmarks.robot_dynamics [--robots panda anymal_b talos] [--rounds 9] [--json out.json] [--quick]

All contestants read the same URDF file, right angles snapped, and are checked against Pinocchio's wheel before any is
timed.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import sys
import tempfile
from collections.abc import Iterator, Sequence
from datetime import date
from pathlib import Path

import numpy as np

from benchmarks.contestants import (
    CPP,
    EOMGEN,
    FUNCTIONS,
    TRACE,
    Contestant,
    left_out,
    missing_compiler,
    missing_for_cpp,
    missing_for_trace,
    missing_package,
    of_eomgen,
    of_pinocchio,
    of_trace,
)
from benchmarks.measure import Timing, figure, interleaved, machine, pin_to_core, table
from benchmarks.programs import default_folder
from benchmarks.robots import ROBOTS, Array, Robot, pinocchio_model, reference, scene

TOLERANCE = 1e-10


@dataclasses.dataclass(frozen=True)
class Row:
    """One contestant's outcome; ``timing`` is None when its numbers are wrong."""

    robot: str
    contestant: Contestant
    error: float
    timing: Timing | None

    def data(self) -> dict[str, object]:
        c, timing = self.contestant, self.timing
        return {
            "robot": self.robot,
            "function": c.function,
            "peer": c.peer,
            "variant": c.variant,
            "flags": c.flags,
            "error": self.error,
            "ns": timing.median if timing else None,
            "ns_smallest": timing.smallest if timing else None,
            "spread": timing.spread if timing else None,
            "operations": c.operations,
            "compile_seconds": c.seconds,
        }


def error_of(result: Array, expected: Array) -> float:
    """Return the largest difference, in units of the largest expected number."""
    return (
        float(np.max(np.abs(result - expected)) / np.max(np.abs(expected)))
        if result.shape == expected.shape
        else float("inf")
    )


@dataclasses.dataclass(frozen=True)
class Field:
    """The contestants for one robot, the reference they are held against, and what is missing for others."""

    robot: Robot
    contestants: list[Contestant]
    expected: dict[str, Array]
    missing: list[str]


def gather(robot: Robot, functions: Sequence[str], folder: Path, shelf: Path) -> Field:
    """Build all timing programs for a robot."""
    described = scene(robot)
    peer = pinocchio_model(robot, described)
    model, states, own_states = (folder / f"{robot.name}{suffix}" for suffix in (".model", ".states", ".eomgen.states"))
    model.write_text(peer.text, encoding="utf-8")
    peer.states.tofile(states)
    peer.states_of_eomgen().tofile(own_states)
    found, missing = list(of_eomgen(described, peer, own_states, shelf, functions)), []
    for name, lacking in ((CPP, missing_for_cpp()), (TRACE, missing_for_trace())):
        if lacking:
            missing.append(f"{name}: {lacking}")
        elif name == CPP:
            found += of_pinocchio(model, states, shelf, functions)
        else:
            found += of_trace(model, peer, states, shelf, functions)
            unbuilt = [f"{variant} {function}" for function in functions for variant in left_out(peer, function)]
            missing += [f"{TRACE}: {what} of {robot.name}, which gcc compiles for many minutes" for what in unbuilt]
    return Field(robot, found, reference(peer), missing)


def measured(field: Field, functions: Sequence[str], batches: int, rounds: int, folder: Path) -> list[Row]:
    """Return all rows of a robot: checked first, then timed in turns, function by function."""
    errors = [error_of(c.results(folder / "results"), field.expected[c.function]) for c in field.contestants]
    rows: list[Row] = []
    for function in functions:
        chosen = [(c, error) for c, error in zip(field.contestants, errors, strict=True) if c.function == function]
        right = [c for c, error in chosen if error <= TOLERANCE]
        timings = interleaved([c.timing(batches) for c in right], rounds)
        known = dict(zip(map(id, right), timings, strict=True))
        rows += [Row(field.robot.name, c, error, known.get(id(c))) for c, error in chosen]
    return rows


def best(rows: Sequence[Row], function: str, peer: str, flags: str) -> Row | None:
    """Return the fastest right variant of a peer; a wrong one when all are wrong; None when there is none."""
    wanted = (function, peer, flags)
    matching = [row for row in rows if (row.contestant.function, row.contestant.peer, row.contestant.flags) == wanted]
    return min(matching, key=lambda row: row.timing.median if row.timing else float("inf"), default=None)


def summary_rows(robot: str, rows: Sequence[Row], functions: Sequence[str]) -> list[list[str]]:
    """Return the lines of the table for a robot: the peers' fastest variants, and ratios with equal flags."""
    lines = []
    for function in functions:
        own, own_fast = (best(rows, function, EOMGEN, flags) for flags in ("O3", "fast"))
        trace, trace_fast = (best(rows, function, TRACE, flags) for flags in ("O3", "fast"))
        native = best(rows, function, CPP, "O3")
        lines.append(
            [
                robot,
                function,
                _time(own),
                _time(own_fast),
                _time(trace),
                _time(trace_fast),
                _time(native),
                _ratio(own, trace),
                _ratio(own_fast, trace_fast),
                _ratio(own, native),
                _operations(own),
                _operations(trace),
                _seconds(own),
                _seconds(trace),
                ", ".join(row.contestant.variant for row in (trace, native) if row),
            ]
        )
    return lines


HEADER = (
    "robot", "function", "eomgen O3", "eomgen fast", "CasADi O3", "CasADi fast", "C++ O3",
    "eomgen/CasADi O3", "eomgen/CasADi fast", "eomgen/C++",
    "ops eomgen", "ops CasADi", "gcc s eomgen", "gcc s CasADi", "peers' fastest variants",
)  # fmt: skip  # a table


def _time(row: Row | None) -> str:
    if row is None:
        return "missing"
    return f"{figure(row.timing.median)} ±{50 * row.timing.spread:.0f}%" if row.timing else f"WRONG ({row.error:.0e})"


def _ratio(own: Row | None, peer: Row | None) -> str:
    return f"{own.timing.median / peer.timing.median:.2f}" if own and peer and own.timing and peer.timing else "-"


def _operations(row: Row | None) -> str:
    return str(row.contestant.operations) if row and row.contestant.operations else "-"


def _seconds(row: Row | None) -> str:
    return f"{row.contestant.seconds:.2f}" if row and row.contestant.seconds is not None else "-"


def parsed(words: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.robot_dynamics", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--robots", nargs="+", choices=list(ROBOTS), default=["panda", "anymal_b"])
    parser.add_argument("--functions", nargs="+", choices=FUNCTIONS, default=list(FUNCTIONS))
    parser.add_argument("--rounds", type=int, default=9, help="turns in which every contestant runs once")
    parser.add_argument("--batches", type=int, default=21, help="batches of 2 ms in each turn")
    parser.add_argument("--core", type=int, help="the core to stay on (the last one by default)")
    parser.add_argument("--work", type=Path, default=default_folder(), help="where compiled programs are kept")
    parser.add_argument(
        "--json", type=Path, help="write everything here as JSON, - for standard output instead of the tables"
    )
    parser.add_argument("--quick", action="store_true", help="check eomgen's numbers on the Panda and time nothing")
    return parser.parse_args(words)


def own_errors(robot: Robot, functions: Sequence[str], folder: Path, shelf: Path) -> Iterator[tuple[Contestant, float]]:
    """Yield eomgen's programs with their errors against Pinocchio's wheel, without timing."""
    described = scene(robot)
    peer = pinocchio_model(robot, described)
    states = folder / "states"
    peer.states_of_eomgen().tofile(states)
    expected = reference(peer)
    for contestant in of_eomgen(described, peer, states, shelf, functions):
        yield contestant, error_of(contestant.results(folder / "results"), expected[contestant.function])


def quick(folder: Path, shelf: Path, functions: Sequence[str]) -> int:
    """Check eomgen alone against Pinocchio's wheel, without timing; return the exit status."""
    worst = 0.0
    for contestant, error in own_errors(ROBOTS["panda"], functions, folder, shelf):
        print(
            f"{contestant.function} {contestant.flags}: {'right' if error <= TOLERANCE else 'WRONG'}, error {error:.1e}"
        )
        worst = max(worst, error)
    return 0 if worst <= TOLERANCE else 1


def main(words: Sequence[str] | None = None) -> int:
    arguments = parsed(words)
    lacking = missing_package("example-robot-data") or missing_package("pin") or missing_compiler("gcc")
    if lacking:
        print(f"nothing can be measured: {lacking}", file=sys.stderr)
        return 1
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        if arguments.quick:
            return quick(folder, arguments.work, arguments.functions)
        fields = [gather(ROBOTS[name], arguments.functions, folder, arguments.work) for name in arguments.robots]
        core = pin_to_core(arguments.core)
        found = [measured(field, arguments.functions, arguments.batches, arguments.rounds, folder) for field in fields]
    rows = [row for one in found for row in one]
    missing = list(dict.fromkeys(item for field in fields for item in field.missing))
    if arguments.json:
        data = [row.data() for row in rows]
        content = {"date": f"{date.today()}", "machine": machine(), "core": core, "missing": missing, "rows": data}
        text = json.dumps(content, indent=1)
        if str(arguments.json) == "-":
            print(text)
        else:
            arguments.json.write_text(text + "\n", encoding="utf-8")
    if str(arguments.json) != "-":
        print(
            f"{machine()}, core {core}\nns per call: median of {arguments.rounds} turns, ± half the range of the"
            " turns\n"
        )
        by_robot = zip(arguments.robots, found, strict=True)
        print(table(HEADER, [line for name, own in by_robot for line in summary_rows(name, own, arguments.functions)]))
        print("\n" + detail(rows))
        print("\n".join(f"missing: {item}" for item in missing))
    return 0 if all(row.timing for row in rows) else 1


def detail(rows: Sequence[Row]) -> str:
    """Return a table of every contestant."""
    header = ("robot", "function", "peer", "variant", "flags", "ns", "smallest", "add+mul", "compile s", "error")
    cells = [
        [
            row.robot,
            row.contestant.function,
            row.contestant.peer,
            row.contestant.variant,
            row.contestant.flags,
            _time(row),
            figure(row.timing.smallest if row.timing else None),
            _operations(row),
            _seconds(row),
            f"{row.error:.0e}",
        ]
        for row in rows
    ]
    return table(header, cells)


if __name__ == "__main__":
    sys.exit(main())
