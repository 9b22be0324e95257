"""A contestant in a process of its own: it prepares itself from a task, then gives its results or a time when asked.

    python SCRIPT CORES

reads JSON lines: the task first, then commands; it answers each with one JSON line. What the peer prints goes to
standard error. Imports nothing but NumPy and the standard library: it runs in the peers' environments.
"""

from __future__ import annotations

import importlib.metadata
import json
import os
import resource
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

#: How long pieces with clocks of their own may take with all that is around them, in units of what is asked for: one
#: may be a call of some 100 ns in a process of its own.
_AROUND = 10.0


@dataclass
class Prepared:
    """A contestant that is ready.

    Attributes
    ----------
    run : one piece of the work.
    units : how many calls, steps or trajectories that piece is; times are for one of them.
    results : the numbers that are checked.
    packages : whose versions are told.
    note : the settings that were chosen.
    taken : runs one piece and returns its seconds, where ``run`` would also set the piece up, or has its own clock.
    """

    run: Callable[[], object]
    units: float
    results: Callable[[], Any]
    packages: Sequence[str]
    note: str = ""
    taken: Callable[[], float] | None = None


def serve(prepare: Callable[[dict[str, Any]], Prepared]) -> None:
    """Answer until the input ends."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    if hasattr(os, "sched_setaffinity") and len(sys.argv) > 1:
        os.sched_setaffinity(0, {int(core) for core in sys.argv[1].split(",")})
    contestant: Prepared | None = None
    for line in sys.stdin:
        request = json.loads(line)
        try:
            if contestant is None:
                contestant = prepare(request)
                answer: dict[str, Any] = {"note": contestant.note, "versions": _versions(contestant.packages)}
            elif "results" in request:
                np.save(request["results"], np.asarray(contestant.results(), dtype=np.float64))
                answer = {}
            else:
                clock = time.perf_counter if request["clock"] == "wall" else _processor_seconds
                answer = {"seconds": _seconds(contestant, request["at_least"], clock)}
        except ModuleNotFoundError as error:
            answer = {"missing": str(error)}
        except Exception as error:  # a peer may raise anything: the row says so
            traceback.print_exc()
            text = str(error).strip().splitlines() or [""]
            answer = {"failed": f"{type(error).__name__}: {text[0]}"[:300]}
        answers.write(json.dumps(answer) + "\n")
        answers.flush()


def _versions(packages: Sequence[str]) -> dict[str, str]:
    return {package: importlib.metadata.version(package) for package in packages}


def _processor_seconds() -> float:
    """Return CPU seconds of all threads of this process and of the processes it waited for."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def _seconds(contestant: Prepared, at_least: float, clock: Callable[[], float]) -> float:
    if contestant.taken is not None:
        began, pieces = clock(), [contestant.taken()]
        while sum(pieces) < at_least and clock() - began < _AROUND * at_least:
            pieces.append(contestant.taken())
        return sum(pieces) / (len(pieces) * contestant.units)
    runs, began = 1, clock()
    contestant.run()
    if clock() - began < at_least:  # a short first run brings back caches and pages that others' turns have cost
        runs, began = 0, clock()
    while not runs or clock() - began < at_least:
        contestant.run()
        runs += 1
    return (clock() - began) / (runs * contestant.units)


def largest_difference(found: Any, expected: Any) -> float:
    """Return the largest difference, infinity where a number is not finite or the shapes differ."""
    found, expected = np.asarray(found, dtype=np.float64), np.asarray(expected, dtype=np.float64)
    if found.shape != expected.shape or not np.all(np.isfinite(found)):
        return float("inf")
    return float(np.max(np.abs(found - expected)))
