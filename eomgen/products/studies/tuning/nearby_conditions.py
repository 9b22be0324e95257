"""Conditions of runs other than the scene's own: initial states, parameters and inputs near these."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.errors import EomgenError
from eomgen.formula.prescribed_motion import constant
from eomgen.lie.product import difference, update
from eomgen.pipeline.model import Model
from eomgen.products.studies.work_precision.observation import Observation
from eomgen.products.studies.work_precision.running import Runner

#: Initial positions are moved by this part of each coordinate's motion in the run, velocities by this part of their
#: largest, parameters and inputs by this part of themselves.
POSITIONS, VELOCITIES, PARAMETERS, INPUTS = 0.05, 0.05, 0.03, 0.03
#: Prescribed laws of time begin at another moment: later by this part of the run.
LATER = 0.03
_SEED = 20240607


@dataclass(frozen=True)
class Condition:
    """Under which a run is made.

    Attributes
    ----------
    label : in words, empty for the scene's own
    arguments : of ``Runner.run``
    """

    label: str = ""
    arguments: Mapping[str, Any] = field(default_factory=dict)


#: Arguments of the scene itself.
OWN = Condition()


def conditions(runner: Runner, motion: Observation) -> Iterator[Condition]:
    """Yield conditions near the scene's own, without end and the same at every call.

    Each second one has other parameters, too, and each has other inputs if the scene or the caller gives them:
    numbers and functions are multiplied, and prescribed laws of time begin at a later moment. A
    parameter that its scene refuses to be other than it is stays.

    Parameters
    ----------
    motion : of the scene's own formulation under its own conditions
    """
    rng = np.random.default_rng(_SEED)
    model = runner.model(runner.formulations.own)
    moves, speeds = _moves(model, motion), np.abs(motion.v).max(axis=0)
    moving = _over_time(model, runner)
    number = 0
    while True:
        number += 1
        q = update(model.factors, motion.q[0], POSITIONS * moves * rng.choice([-1.0, 1.0], model.nv))
        v = motion.v[0] + VELOCITIES * speeds * rng.choice([-1.0, 1.0], model.nv)
        arguments: dict[str, Any] = {"initial": {"q": q, "v": v}}
        words = [f"positions by {100 * POSITIONS:g} % of their motion, velocities by {100 * VELOCITIES:g} %"]
        if number % 2 == 0 and (others := _parameters(model, runner.parameters or {}, rng)):
            arguments["parameters"] = others
            words.append(f"parameters by {100 * PARAMETERS:g} %")
        if changed := _inputs(model, runner, rng):
            arguments["inputs"] = {**(runner.inputs or {}), **changed}
            words.append(f"inputs by {100 * INPUTS:g} %")
        if moving:
            arguments["later"] = max(1, round(LATER * rng.uniform(0.5, 1.0) * runner.grid.rows))
            seconds = arguments["later"] * runner.grid.row
            words.append(f"prescribed functions of time from {seconds:.3g} s on")
        yield Condition(f"{number}: {', '.join(words)}", arguments)


def _moves(model: Model, motion: Observation) -> Array:
    """Return the distance of each component from its start, (nv,)."""
    first = np.broadcast_to(motion.q[0], motion.q.shape)
    moves: Array = np.abs(difference(model.factors, first, motion.q)).max(axis=0)
    return moves


def _parameters(model: Model, given: Mapping[str, float], rng: np.random.Generator) -> dict[str, float]:
    values = {**dict(model.parameters), **given}
    for name, value in list(values.items()):
        changed = {**values, name: value * (1.0 + PARAMETERS * float(rng.choice([-1.0, 1.0])))}
        try:
            model.parameter_array(changed)
        except EomgenError:
            continue
        values = changed
    return values


def _inputs(model: Model, runner: Runner, rng: np.random.Generator) -> dict[str, Any]:
    """Return the caller's inputs, and the scene's constant ones, each multiplied."""
    given = runner.inputs or {}
    result: dict[str, Any] = {}
    sampled = _sampled(model, runner)
    for column, name in enumerate(model.inputs):
        factor = 1.0 + INPUTS * float(rng.choice([-1.0, 1.0]))
        if name in given:
            result[name] = _multiplied(given[name], factor)
        elif sampled is not None and np.ptp(sampled[:, column]) == 0.0 and sampled[0, column]:
            result[name] = factor * float(sampled[0, column])
    return result


def _multiplied(signal: Any, factor: float) -> Any:
    if not callable(signal):
        return factor * np.asarray(signal, dtype=float)
    original: Callable[[float], float] = signal
    return lambda t: factor * original(t)


def _sampled(model: Model, runner: Runner) -> Array | None:
    """Return the scene's inputs at some times of the run, (n, nu); None if it gives none."""
    if not model.inputs or "inputs" not in model.functions:
        return None
    grid = runner.grid
    times = np.linspace(grid.start, grid.end, 257)
    p = model.parameter_array(runner.parameters)
    values: Array = np.asarray(model.input_values(times, parameters=p), dtype=float)
    return values


def _over_time(model: Model, runner: Runner) -> bool:
    """Return whether the scene prescribes something over time: an input, a drive, the motion of its base, a force."""
    sampled = _sampled(model, runner)
    moves = sampled is not None and bool(np.any(np.ptp(sampled, axis=0) > 0.0))
    prescribed = (*(law.formula for law in model.description.laws), *model.description.formulas)
    return moves or any(not constant(formula) for formula in prescribed)
