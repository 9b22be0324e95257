"""Rows of the functions of robots: generated C beside Pinocchio in C++ and traced by CasADi, as in robot_dynamics."""

from __future__ import annotations

import importlib.metadata
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from benchmarks import robot_dynamics
from benchmarks.contestants import CPP, EOMGEN, TRACE, missing_compiler, missing_package
from benchmarks.robots import ROBOTS
from benchmarks.suite.contest import Context, pinned
from benchmarks.suite.outcomes import CHECKED, MEASURED, MISSING, WRONG, Outcome

#: Whose versions are told.
_PACKAGES: Mapping[str, Sequence[str]] = {EOMGEN: ["eomgen"], CPP: ["pin"], TRACE: ["pin", "casadi"]}
_FLAGS = "O3"
#: Batches of 2 ms in each turn.
_BATCHES = 15


def robot_row(robot: str, function: str) -> Callable[[Context], list[Outcome]]:
    """Return the run of a row: one function, by each contestant compiled alone with ``gcc -O3 -march=native``."""
    return lambda context: _run(context, robot, function)


def _run(context: Context, robot: str, function: str) -> list[Outcome]:
    lacking = missing_package("example-robot-data") or missing_package("pin") or missing_compiler("gcc")
    if lacking:
        return [Outcome(EOMGEN, MISSING, note=lacking)]
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        if context.quick:
            errors = robot_dynamics.own_errors(ROBOTS[robot], [function], folder, context.shelf)
            return [
                Outcome(EOMGEN, CHECKED if error <= robot_dynamics.TOLERANCE else WRONG, error=error)
                for one, error in errors
                if one.flags == _FLAGS
            ]
        field = robot_dynamics.gather(ROBOTS[robot], [function], folder, context.shelf)
        with pinned(context.core):
            rows = robot_dynamics.measured(field, [function], _BATCHES, context.rounds, folder)
    fastest = [robot_dynamics.best(rows, function, peer, _FLAGS) for peer in (EOMGEN, TRACE, CPP)]
    outcomes = [_outcome(row) for row in fastest if row is not None]
    there = {one.name for one in outcomes}
    reasons = (item.partition(": ") for item in field.missing)
    return outcomes + [Outcome(peer, MISSING, note=why) for peer, _, why in reasons if peer not in there]


def _outcome(row: robot_dynamics.Row) -> Outcome:
    one, timing = row.contestant, row.timing
    versions = {package: importlib.metadata.version(package) for package in _PACKAGES[one.peer]}
    note = "; ".join(filter(None, [one.variant, f"{one.operations} + and *" if one.operations else ""]))
    if timing is None:
        return Outcome(one.peer, WRONG, error=row.error, note=note, versions=versions)
    return Outcome(one.peer, MEASURED, 1e-9 * timing.median, timing.spread, row.error, note, versions)
