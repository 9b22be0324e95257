"""Rates of decay at the start of a run, by which explicit methods are stable or not."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.compiled.equations import accelerations
from eomgen.simulation.accuracy.motion_size import reach_of

if TYPE_CHECKING:
    from eomgen.compiled.initial_state import InitialState
    from eomgen.compiled.model import CompiledModel

#: Difference step of velocities, relative to their size, and to the velocity that covers the coordinates in a step.
_DIFFERENCE, _OF_REACH = 1e-7, 1e-10


class Fastest(NamedTuple):
    """The fastest decay: subject and verb in words, rate in 1/s."""

    text: str
    rate: float


def decay_of_states(model: CompiledModel, state: InitialState, t: float, u: Array | None, p: Array) -> Fastest | None:
    """Return the fastest decay of internal states, by the eigenvalues of -Fz."""
    if "internal_partials" not in model.functions:
        return None
    by_state = model.internal_partials(state.q, state.v, state.z, t, u, parameters=p).rate_z
    if not np.all(np.isfinite(by_state)):
        return None
    return Fastest("internal states decay", float((-np.linalg.eigvals(by_state).real).max(initial=0.0)))


def decay_of_motion(
    model: CompiledModel, state: InitialState, t: float, u: Array | None, p: Array, step: float
) -> Fastest | None:
    """Return the fastest decay of velocities, at the initial ones and at rest."""
    fastest = 0.0
    for rate in (state.v, np.zeros_like(state.v)):
        decay = _decay(model, state, rate, t, u, p, step)
        if decay is not None and np.all(np.isfinite(decay)):
            fastest = max(fastest, float(np.linalg.eigvals(decay).real.max(initial=0.0)))
    return Fastest("damping or friction decays", fastest)


def _decay(
    model: CompiledModel, state: InitialState, v: Array, t: float, u: Array | None, p: Array, step: float
) -> NDArray[np.floating[Any]] | None:
    """Return -d vdot/dv, (nv, nv), at velocities v: by partials, or by central differences if the model has none."""
    if "partials" in model.functions:
        _, C, M = model.partials(state.q, v, np.zeros_like(v), t, u, z=state.z, parameters=p)
        known = np.all(np.isfinite(C)) and np.all(np.isfinite(M)) and np.linalg.matrix_rank(M) == len(M)
        return np.linalg.solve(M, C) if known else None
    if "forward_dynamics" not in model.functions or not model.nv:
        return None
    reach = reach_of(model, state.q)
    least = _OF_REACH * np.where(reach > 0.0, reach, 1.0) / step
    ways = np.diag(np.maximum(least, _DIFFERENCE * np.abs(v)))
    with np.errstate(all="ignore"):
        ahead, behind = (
            accelerations(model, state.q, v + sign * ways, t, u, z=state.z, parameters=p) for sign in (1.0, -1.0)
        )
        columns: Array = (behind - ahead) / (2.0 * np.diag(ways)[:, np.newaxis])
    return columns.T
