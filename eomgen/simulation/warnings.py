"""Warnings of a run: joints that start beyond their limits, and noticeable numerical damping."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from eomgen.arrays import Array
from eomgen.formula.evaluate import evaluate
from eomgen.formula.nodes import Formula

if TYPE_CHECKING:
    from eomgen.compiled.initial_state import InitialState
    from eomgen.compiled.model import CompiledModel


def unresolved_states(
    model: CompiledModel, state: InitialState, t: float, u: Array | None, p: Array, step: float, limit: float
) -> str:
    """Return the same of internal states, whose rates of decay are eigenvalues of -Fz."""
    if "internal_partials" not in model.functions:
        return ""
    by_state = model.internal_partials(state.q, state.v, state.z, t, u, parameters=p).rate_z
    if not np.all(np.isfinite(by_state)):
        return ""
    return _too_fast("internal states decay", float((-np.linalg.eigvals(by_state).real).max(initial=0.0)), step, limit)


def unresolved_damping(
    model: CompiledModel, state: InitialState, t: float, u: Array | None, p: Array, step: float, limit: float
) -> str:
    """Return what is wrong with a step of an explicit method, and what to try; empty when nothing is known to be.

    ``limit``: the largest step times rate of decay at which the method is stable.
    """
    if "partials" not in model.functions:
        return ""
    fastest = 0.0
    for rate in (state.v, np.zeros_like(state.v)):
        _, C, M = model.partials(state.q, rate, np.zeros_like(rate), t, u, z=state.z, parameters=p)
        if np.all(np.isfinite(C)) and np.all(np.isfinite(M)) and np.linalg.matrix_rank(M) == len(M):
            fastest = max(fastest, float(np.linalg.eigvals(np.linalg.solve(M, C)).real.max(initial=0.0)))
    return _too_fast("damping or friction decays", fastest, step, limit)


def _too_fast(what: str, fastest: float, step: float, limit: float) -> str:
    if step * fastest <= limit:
        return ""
    return (
        f"{what} at up to {fastest:.3g} 1/s at the start, too fast for an explicit method at this step; "
        f"try: generalized_alpha, or a step below {limit / fastest:.2g} s"
    )


def starts_beyond_limits(model: CompiledModel, q: NDArray[np.float64], p: NDArray[np.float64]) -> list[str]:
    """Return one sentence for each coordinate beyond a limit; of joints between absolute bodies where q has their
    angles."""
    values = model.description.values(dict(zip(model.parameters, p.tolist(), strict=True)))
    places = {name: number for number, name in enumerate(model.q_names)}

    def value(formula: Formula) -> float:
        return evaluate(formula, lambda symbol: values[symbol.name])

    limits = [limit for limit in model.description.limits if limit.coordinate in places]
    return [note for limit in limits if (note := limit.passed(float(q[places[limit.coordinate]]), value))]
