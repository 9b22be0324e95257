"""Whether the steps of an explicit method can resolve the damping and friction of a scene, and its internal states.

Rates of decay are eigenvalues of M^-1 C; regularised friction is steepest at rest, so they are looked at there too.
Runge and Kutta's method bears 2.785 on the real axis: Hairer and Wanner, Solving Ordinary Differential Equations II, IV.2.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from eomgen.compiled.initial_state import InitialState
    from eomgen.compiled.model import Model

Array = NDArray[np.float64]
_REAL_AXIS = 2.785


def unresolved_states(model: Model, state: InitialState, t: float, u: Array | None, p: Array, step: float) -> str:
    """Return the same of internal states, whose rates of decay are eigenvalues of -Fz."""
    if "internal_partials" not in model.functions:
        return ""
    by_state = model.internal_partials(state.q, state.v, state.z, t, u, parameters=p).rate_z
    if not np.all(np.isfinite(by_state)):
        return ""
    return _too_fast("internal states decay", float((-np.linalg.eigvals(by_state).real).max(initial=0.0)), step)


def unresolved_damping(model: Model, state: InitialState, t: float, u: Array | None, p: Array, step: float) -> str:
    """Return what is wrong with a step of Runge and Kutta's method, and what to try; empty when nothing is known to be."""
    if "partials" not in model.functions:
        return ""
    fastest = 0.0
    for rate in (state.v, np.zeros_like(state.v)):
        _, C, M = model.partials(state.q, rate, np.zeros_like(rate), t, u, z=state.z, parameters=p)
        if np.all(np.isfinite(C)) and np.all(np.isfinite(M)) and np.linalg.matrix_rank(M) == len(M):
            fastest = max(fastest, float(np.linalg.eigvals(np.linalg.solve(M, C)).real.max(initial=0.0)))
    return _too_fast("damping or friction decays", fastest, step)


def _too_fast(what: str, fastest: float, step: float) -> str:
    if step * fastest <= _REAL_AXIS:
        return ""
    return (
        f"{what} at up to {fastest:.3g} 1/s at the start, too fast for an explicit method at this step; "
        f"try: generalized_alpha, or a step below {_REAL_AXIS / fastest:.2g} s"
    )
