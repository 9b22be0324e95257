"""Batches in lanes beside scalar code: the same bits, nanoseconds per sample of one core, and what two threads add.

    python -m benchmarks.lanes [--robots panda talos] [--samples 100000] [--rounds 15] [--json out.json] [--quick]

Compiled code alone is timed on 2000 samples again and again, what a caller in Python sees on the whole batch. Both take
turns with the other; figures are medians of processor time, ratios those of neighbouring turns.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

import eomgen
from benchmarks.measure import figure, machine, table
from benchmarks.robots import ROBOTS, Array, scene
from eomgen.base.threads import THREADS_VARIABLE
from eomgen.compiled.functions import LANES_VARIABLE, Functions
from eomgen.pipeline.model import Model
from eomgen.toolchain.compiler import RunningCompilers

FUNCTIONS = {"panda": ("inverse_dynamics", "forward_dynamics", "partials"), "talos": ("inverse_dynamics",)}
#: Samples that stay in a cache of 512 KiB.
CACHED = 2000


@dataclass(frozen=True)
class Row:
    """A function of a robot: nanoseconds of processor time per sample, and ratios."""

    robot: str
    function: str
    operations: int
    same_bits: bool
    scalar: float = 0.0
    lanes: float = 0.0
    ratio: float = 0.0
    python_scalar: float = 0.0
    python_lanes: float = 0.0
    python_ratio: float = 0.0
    threads: float = 0.0


@contextmanager
def environment(**variables: str) -> Iterator[None]:
    """Set variables of the environment, and what they were afterwards."""
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def inputs(model: Model, count: int) -> dict[str, Array]:
    """Return states of the robot, with quaternions of norm one, rates and accelerations or efforts."""
    rng = np.random.default_rng(20261122)
    nv = model.functions.sizes["v"]
    q = np.array(model.initial_q) + rng.uniform(-1.0, 1.0, (count, len(model.initial_q)))
    if len(model.initial_q) > nv:
        q[:, :4] /= np.linalg.norm(q[:, :4], axis=1, keepdims=True)
    blocks = {"q": q, "v": rng.uniform(-1.0, 1.0, (count, nv)), "a": rng.uniform(-1.0, 1.0, (count, nv))}
    return {**blocks, "t": np.zeros(()), "u": np.zeros(model.functions.sizes["u"]), "p": model.parameter_array()}


def turns(calls: Sequence[Callable[[], object]], rounds: int, clock: Callable[[], float]) -> list[list[float]]:
    """Return the seconds of each call, round by round, all in turns."""
    found: list[list[float]] = [[] for _ in calls]
    for _ in range(rounds):
        for call, kept in zip(calls, found, strict=True):
            began = clock()
            call()
            kept.append(clock() - began)
    return found


def median_ratio(slow: Sequence[float], fast: Sequence[float]) -> float:
    return statistics.median(one / other for one, other in zip(slow, fast, strict=True))


def measured(robot: str, model: Model, function: str, samples: int, rounds: int, *, timed: bool) -> Row:
    """Return a function's row; times are zero where only bits are compared."""
    functions, blocks = Functions(model.library), inputs(model, samples)

    def batch() -> tuple[Array, ...]:
        return functions(function, blocks)

    def scalar() -> tuple[Array, ...]:
        with environment(**{LANES_VARIABLE: "off"}):
            return batch()

    def lanes() -> tuple[Array, ...]:
        with environment(**{LANES_VARIABLE: "now"}):
            return batch()

    with environment(**{THREADS_VARIABLE: "1"}):
        same = all(np.array_equal(one, other) for one, other in zip(scalar(), lanes(), strict=True))
    layout = next(item for item in model.library.layout["functions"] if item["name"] == function)
    row = Row(robot, function, layout["operations"], same)
    make = model.library.companion
    if not timed or make is None:
        return row
    companion = make(function, RunningCompilers())
    assert companion is not None
    few = [
        np.ascontiguousarray(blocks[name] if blocks[name].ndim == 1 else blocks[name][:CACHED])
        for name in layout["inputs"]
        if name != "t"
    ]
    bound = []
    for library in (model.library, companion):
        call = library.bind(function, few, [np.empty((CACHED, item["size"])) for item in layout["outputs"]])
        bound.append(lambda call=call: [call() for _ in range(10)])
    c = turns(bound, 3 * rounds, time.thread_time)
    with environment(**{THREADS_VARIABLE: "1"}):
        python = turns([scalar, lanes], rounds, time.process_time)

    def shared() -> None:
        with environment(**{THREADS_VARIABLE: "2"}):
            lanes()

    def alone() -> None:
        with environment(**{THREADS_VARIABLE: "1"}):
            lanes()

    walls = turns([alone, shared], rounds, time.perf_counter)
    return Row(
        robot,
        function,
        row.operations,
        same,
        *(statistics.median(times) / (10 * CACHED) * 1e9 for times in c),
        median_ratio(*c),
        *(statistics.median(times) / samples * 1e9 for times in python),
        median_ratio(*python),
        median_ratio(*walls),
    )


def of_python(row: Row) -> tuple[float, float, float]:
    return row.python_scalar, row.python_lanes, row.python_ratio


def report(rows: Sequence[Row]) -> str:
    header = ["robot", "function", "scalar, ns", "lanes, ns", "ratio", "Python, scalar", "lanes", "ratio", "2 threads"]
    cells = [
        [row.robot, row.function, *map(figure, (row.scalar, row.lanes, row.ratio, *of_python(row), row.threads))]
        for row in rows
    ]
    return table(header, cells)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robots", nargs="+", choices=list(FUNCTIONS), default=list(FUNCTIONS))
    parser.add_argument("--samples", type=int, default=100_000)
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--quick", action="store_true", help="compare bits of a small batch, time nothing")
    options = parser.parse_args(arguments)
    robots = options.robots[:1] if options.quick else options.robots
    samples = 203 if options.quick else options.samples
    rows = []
    for robot in robots:
        names = FUNCTIONS[robot][:1] if options.quick else FUNCTIONS[robot]
        model = eomgen.build(scene(ROBOTS[robot]), names)
        rows += [measured(robot, model, name, samples, options.rounds, timed=not options.quick) for name in names]
    for row in rows:
        print(f"{row.robot} {row.function}: {'the same bits' if row.same_bits else 'OTHER BITS'}")
    if not options.quick:
        print(f"\n{machine()}\n\n{report(rows)}")
    if options.json:
        data = {"machine": machine(), "samples": samples, "rows": [asdict(row) for row in rows]}
        options.json.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
    return 0 if all(row.same_bits for row in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
