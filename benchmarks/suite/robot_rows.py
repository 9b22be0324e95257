"""Rows of the functions of robots: one call at a time, as in robot_dynamics, and many states at once from Python."""

from __future__ import annotations

import importlib.metadata
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from benchmarks import robot_dynamics
from benchmarks.contestants import CPP, EOMGEN, TRACE, missing_compiler, missing_package
from benchmarks.robots import ROBOTS, Array, pinocchio_model, reference, scene
from benchmarks.suite.contest import Context, Entry, contest, pinned, relative_to_largest
from benchmarks.suite.environments import ADAM, JAX
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


SCALAR_LOOP = "eomgen, scalar loop"
WITHOUT_LANES = "eomgen, without lanes"
TWO_THREADS = "eomgen, two threads"
FROM_JAX = "eomgen, from JAX"
_JAX_PEERS = {"frax": (JAX, "frax"), "adam": (ADAM, "adam-robotics")}
#: s; adam with the JAX that it works with took more than four minutes of 100 000 states.
_JAX_PATIENCE = 60.0
#: Calls before the first that counts.
_WARM = 2


def batch_row(robot: str, function: str, states: int, *, with_jax: bool = False) -> Callable[[Context], list[Outcome]]:
    """Return the run of a row: many states in one call from Python, beside loops in C and C++ on as many cores."""
    return lambda context: _batch(context, robot, function, states, with_jax=with_jax)


def _batch(context: Context, robot: str, function: str, states: int, *, with_jax: bool) -> list[Outcome]:
    task = {"robot": robot, "function": function, "shelf": str(context.shelf), "batch": states}
    warm = {"warm": _WARM, "lanes": "now"}
    small = {"batch": 64, "warm": 0, "lanes": "off"}
    own = [
        Entry(EOMGEN, "eomgen_functions.py", task=task | warm, small=small),
        Entry(WITHOUT_LANES, "eomgen_functions.py", task=task | warm | {"lanes": "off"}, small=small),
    ]
    if with_jax:
        own.append(Entry(FROM_JAX, "eomgen_jax.py", task=task | warm, small=small))
    own.append(Entry(SCALAR_LOOP, "robot_programs.py", task={**task, "peer": EOMGEN}))
    if not context.quick:  # a minute or two of g++ where its program is not there yet
        own.append(Entry(CPP, "robot_programs.py", task={**task, "peer": CPP}, patience=600.0))
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        expected, told = _described(robot, function, folder)
        peers = [
            Entry(name, "jax_functions.py", group, {**task, **told, "peer": package}, small, patience=_JAX_PATIENCE)
            for name, (group, package) in _JAX_PEERS.items()
            if with_jax
        ]
        return contest(
            context, [*own, *peers], robot_dynamics.TOLERANCE, reference=expected, measure=relative_to_largest
        )


def thread_row(robot: str, function: str) -> Callable[[Context], list[Outcome]]:
    """Return the run of a row: the same call on one and on two cores, in wall time."""

    def run(context: Context) -> list[Outcome]:
        task = {"robot": robot, "function": function, "batch": 400_000, "warm": _WARM, "lanes": "now"}
        small = {"batch": 64, "warm": 0, "lanes": "off"}
        entries = [
            Entry(EOMGEN, "eomgen_functions.py", task=task, small=small),
            Entry(TWO_THREADS, "eomgen_functions.py", task=task, small=small, threads=2),
        ]
        with tempfile.TemporaryDirectory() as temporary:
            expected, _ = _described(robot, function, Path(temporary))
            return contest(
                context,
                entries,
                robot_dynamics.TOLERANCE,
                reference=expected,
                measure=relative_to_largest,
                clock="wall",
            )

    return run


def _described(robot: str, function: str, folder: Path) -> tuple[Array, dict[str, object]]:
    """Return what Pinocchio's wheel computes, and what peers of other environments are told of the robot."""
    described = scene(ROBOTS[robot])
    peer = pinocchio_model(ROBOTS[robot], described)
    model, states = folder / "robot.txt", folder / "states.npy"
    model.write_text(peer.text, encoding="utf-8")
    np.save(states, peer.states)
    told = {"model": str(model), "states": str(states), "gravity": peer.model.gravity.linear.tolist()}
    return reference(peer)[function], told


def _outcome(row: robot_dynamics.Row) -> Outcome:
    one, timing = row.contestant, row.timing
    versions = {package: importlib.metadata.version(package) for package in _PACKAGES[one.peer]}
    note = "; ".join(filter(None, [one.variant, f"{one.operations} + and *" if one.operations else ""]))
    if timing is None:
        return Outcome(one.peer, WRONG, error=row.error, note=note, versions=versions)
    return Outcome(one.peer, MEASURED, 1e-9 * timing.median, timing.spread, row.error, note, versions)
