"""Runs that a configuration was not chosen on: other initial states and parameters, each with a reference of its
own."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from eomgen.arrays import Array
from eomgen.errors import EomgenError
from eomgen.lie.product import difference, update
from eomgen.model import Model
from eomgen.studies.work_precision.axes import TOLERANCE, Candidate
from eomgen.studies.work_precision.observation import Observation
from eomgen.studies.work_precision.reference import reference
from eomgen.studies.work_precision.running import REACHED, Runner

#: Initial positions are moved by this part of what each coordinate moves in the run, velocities by this part of their
#: largest, parameters by this part of themselves.
POSITIONS, VELOCITIES, PARAMETERS = 0.05, 0.05, 0.03
#: How many runs there are.
RUNS = 3
_SEED = 20240607


@dataclass(frozen=True)
class Verified:
    """One verification run.

    Attributes
    ----------
    what : in words
    error : of the quantity that is tuned for, infinite where the run did not reach its end
    uncertainty : of its reference
    by : its reference
    said : by the run
    """

    what: str
    error: float
    uncertainty: float
    by: str
    said: str = ""


def conditions(
    model: Model, motion: Observation, parameters: Mapping[str, float]
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield other conditions of a run in words and as arguments of ``Runner.run``.

    Signs are drawn once and for all; a parameter that its scene refuses to be other than it is stays.
    """
    rng = np.random.default_rng(_SEED)
    moves = _moves(model, motion)
    speeds = np.abs(motion.v).max(axis=0)
    for number in range(RUNS):
        q = update(model.factors, motion.q[0], POSITIONS * moves * rng.choice([-1.0, 1.0], model.nv))
        v = motion.v[0] + VELOCITIES * speeds * rng.choice([-1.0, 1.0], model.nv)
        changed = {"initial": {"q": q, "v": v}}
        parts = f"positions by {100 * POSITIONS:g} % of their motion, velocities by {100 * VELOCITIES:g} %"
        what = f"{number + 1}: {parts}"
        others = _parameters(model, parameters, rng) if number else {}
        if others:
            what += f", parameters by {100 * PARAMETERS:g} %"
        yield what, {**changed, **({"parameters": others} if others else {})}


def _moves(model: Model, motion: Observation) -> Array:
    """Return how far each component moves from the start, (nv,)."""
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


def verified(
    runner: Runner,
    chosen: Candidate,
    others: Sequence[Candidate],
    run: Mapping[str, Any],
    target: tuple[str, str, float],
    effort: float,
    changed: tuple[str, dict[str, Any]],
) -> Verified | None:
    """Return the error of a configuration under other conditions; None where these cannot be had.

    Parameters
    ----------
    others : what may be a reference, of other families than ``chosen`` where there are such
    run : ``configuration``, ``per_row`` and ``tolerance`` of the configuration
    target : quantity, measure and demand
    effort : seconds for the reference
    """
    quantity, measure, demand = target
    what, conditions_ = changed
    outcome = runner.run(**run, timed=False, estimated=False, **conditions_)
    if outcome.ended != REACHED or outcome.observation is None:
        return Verified(what, np.inf, 0.0, "", outcome.said)
    own = [c for c in others if c.formulation == chosen.formulation]
    apart = [c for c in own if c.family is not chosen.family] or own
    first = 1 if TOLERANCE in run else math.ceil(run["per_row"])
    for possible in (apart, own):
        try:
            held = reference(
                runner,
                possible,
                effort,
                lambda _: None,
                settled=0.05 * demand,
                count=1,
                first_steps=first,
                **conditions_,
            )
        except EomgenError:
            continue
        uncertainty = held.bar(quantity, measure)
        if uncertainty > 0.3 * demand and possible is not own:
            continue
        size = held.errors_of(outcome.observation)[quantity]
        return Verified(what, float(getattr(size, measure)), uncertainty, held.described, outcome.said)
    return None
