"""Starts of a run: poses, coordinates beyond limits, tyres without directions of slip, and the choice of method."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from eomgen.base.products import objects_of
from eomgen.compiled.initial_state import InitialState
from eomgen.compiled.model import CompiledModel
from eomgen.formula.evaluate import evaluate
from eomgen.formula.nodes import Formula
from eomgen.results.finding import NOTE, Finding
from eomgen.simulation.judgement.finished_run import Check, FinishedRun
from eomgen.simulation.stepping.run import Run

#: Register of functions of a start, as ``doubts_of_start``.
GROUP = "eomgen.starts"


def doubts_of_start(run: Run, state: InitialState) -> list[str]:
    """Return one sentence for each doubt of products about a run that starts at a state."""
    return [sentence for doubts in objects_of(GROUP) for sentence in doubts(run, state)]


def starts_beyond_limits(model: CompiledModel, q: NDArray[np.float64], p: NDArray[np.float64]) -> list[str]:
    """Return one sentence for each coordinate beyond a limit, including joint angles of absolute bodies that q holds.

    Parameters
    ----------
    q, p : (nq,), (np,)
    """
    if not model.description.limits:
        return []
    values = model.description.values(dict(zip(model.parameters, p.tolist(), strict=True)))
    places = {name: number for number, name in enumerate(model.q_names)}

    def value(formula: Formula) -> float:
        return evaluate(formula, lambda symbol: values[symbol.name])

    limits = [limit for limit in model.description.limits if limit.coordinate in places]
    return [note for limit in limits if (note := limit.passed(float(q[places[limit.coordinate]]), value))]


def _chosen_method(run: FinishedRun) -> Iterator[Finding]:
    if run.beginning is not None and run.beginning.choice:
        yield Finding.of(run.beginning.choice)


CHOSEN_METHOD = Check("chosen_method [W0251]", _chosen_method, ("begun",), severity=NOTE, noted="start")
