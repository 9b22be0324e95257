"""Runs that a configuration was not chosen on: under other conditions, each with a reference of its own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from eomgen.errors import EomgenError
from eomgen.products.studies.tuning.judge import Judge
from eomgen.products.studies.tuning.nearby_conditions import OWN, Condition
from eomgen.products.studies.work_precision.running import REACHED, Outcome

#: How many runs there are.
RUNS = 3


@dataclass(frozen=True)
class Verified:
    """One verification run.

    Attributes
    ----------
    what : condition, in words
    error : of the tuned quantity, infinite if the run did not reach its end
    uncertainty : of its reference
    by : its reference
    said : by the run
    """

    what: str
    error: float
    uncertainty: float
    by: str
    said: str = ""


def verified(judge: Judge, run: Mapping[str, Any], condition: Condition) -> Verified | None:
    """Return the error of a configuration under a condition; None if there is no reference.

    Parameters
    ----------
    run : arguments of ``Runner.run``: ``configuration``, ``per_row`` or ``tolerance``
    """
    try:
        held = judge.reference(condition)
    except EomgenError:
        return None
    outcome = under(judge, run, condition)
    if outcome.ended != REACHED or outcome.observation is None:
        return Verified(condition.label, np.inf, 0.0, "", outcome.said)
    error = judge.error(outcome.observation, condition)
    return Verified(condition.label, error, judge.bar(condition), held.described, outcome.said)


def under(judge: Judge, run: Mapping[str, Any], condition: Condition = OWN) -> Outcome:
    """Return the run of a configuration under a condition, from the start of its reference."""
    arguments = dict(condition.arguments)
    if "initial" in arguments:
        arguments["initial"] = judge.start(condition)
    return judge.runner.run(**run, **arguments, timed=False, estimated=False)
