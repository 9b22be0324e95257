"""Warnings of a run: doubts about its result, joints that start beyond their limits, steps too long for damping."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from eomgen.arrays import Array
from eomgen.formula.evaluate import evaluate
from eomgen.formula.nodes import Formula
from eomgen.results.error_estimate import NOTICED, ErrorEstimate
from eomgen.simulation.judgement.constraint_violation import Violation
from eomgen.simulation.judgement.energy_balance import REPORTED, Balance

if TYPE_CHECKING:
    from eomgen.compiled.initial_state import InitialState
    from eomgen.compiled.model import CompiledModel

#: Part of the motion above which no error may be unsaid, and the estimate from which on it may be there, since
#: estimates are good to a factor.
LARGE_ERROR, DOUBTFUL_ERROR = 0.1, 0.1 / 1.5
#: The same of velocities, as a part of the largest, of a beam's of its own: at one step they are some three times less
#: accurate.
WRONG_VELOCITY = 0.3
#: The part that advice aims at, and up to which errors follow powers of the step.
AIM, FOLLOWED = 0.01, 0.5
#: Part of velocities, or of 1 rad/s and 1 m/s, that differences of accelerations span.
_DIFFERENCE = 1e-7
#: The method whose multipliers have the least rounding.
ROUNDING_LEAST = "generalized_alpha"
#: Part of the multipliers that rounding may make.
ROUNDED = 0.01


def run_warnings(
    statistics: Mapping[str, float],
    balance: Balance,
    step: float,
    cause: Callable[[], str] = str,
    violation: Violation | None = None,
    error: ErrorEstimate | None = None,
    momentum: str = "",
    *,
    single: bool = False,
    method: str = "",
) -> str:
    """Return the warnings about a run that reached its end, with what to try; empty without any.

    ``cause`` looks for a cause other than too large a step, called only if there are warnings; its text says what to
    try. ``momentum`` says which one drifts that has to be kept. ``single``: numbers are of single precision, where
    errors without order are mostly rounding, of which smaller steps have more. ``method``: of the run.
    """
    found = []
    halvings = int(statistics.get("halvings", 0))
    if halvings and not (error is not None and error.relative < AIM):
        found.append(f"the step was halved {halvings} time{'s' * (halvings != 1)}")
    doubted = "" if error is None else large_error(error)
    if doubted:
        found.append(doubted)
    if balance.error is not None and balance.error > REPORTED:
        found.append(f"the energy is out of balance by {100.0 * balance.error:.3g} % of the energies at work")
    if momentum:
        found.append(momentum)
    if violation is not None:
        found.append(violation.what)
    rounding, coarser = statistics.get("max_rounding", 0.0), ""
    if single and error is not None and error.unordered:
        coarser = f"try: double precision; rounding grows where steps are smaller than {step:.3g} s"
    if rounding > ROUNDED:
        found.append(f"up to {100.0 * rounding:.2g} % of the multipliers is rounding, which grows as 1/step^2")
        other = "" if method == ROUNDING_LEAST else f"{ROUNDING_LEAST}, "
        coarser = f"try: {other}a step larger than {step:.3g} s{', or double precision' if single else ''}"
    if not found:
        return ""
    smaller = f"smaller than {step:.3g} s"
    if error is not None and found == [doubted] and error.relative > AIM:
        smaller = f"smaller than {step * error.refinement(AIM):.2g} s"
        if error.unordered or error.relative > FOLLOWED:
            end = error.above(min(LARGE_ERROR, error.relative / 2.0))
            smaller = f"much smaller than {step:.3g} s, or a run to t = {end:.6g} s"
    return f"{', and '.join(found)}; {coarser or cause() or f'try: a step {smaller}'}"


def large_error(error: ErrorEstimate) -> str:
    """Return what is doubtful of the estimated error of a run; empty where it is small, and shrinks with the step."""
    if error.largest is None or not (error.relative > DOUBTFUL_ERROR or error.unordered):
        fast = error.largest_velocity
        return f"the estimated error is {fast}" if fast is not None and fast.share > WRONG_VELOCITY else ""
    since = (
        f", above {100.0 * LARGE_ERROR:.0f} % from t = {error.above(LARGE_ERROR):.6g} s on"
        if error.relative > LARGE_ERROR
        else ""
    )
    unordered = ", and no less at half the step" if error.unordered else ""
    noticed = error.largest
    if error.relative <= NOTICED and error.largest_output is not None:
        noticed = error.largest_output
    return f"the estimated error is {noticed}{since}{unordered}"


def undefined_outputs(t: Array, outputs: Mapping[str, Array]) -> str:
    """Return which outputs have no value at some rows, and from when on; empty where all have one."""
    found = []
    for name, values in outputs.items():
        undefined = np.flatnonzero(~np.isfinite(values.reshape(len(t), -1)).all(axis=1))
        if len(undefined):
            found.append(f"{name} ({len(undefined)} of {len(t)} rows, from t = {t[undefined[0]]:.6g} s)")
    if not found:
        return ""
    many = f"outputs {', '.join(found)} have" if len(found) > 1 else f"output {found[0]} has"
    hint = "a formula that has one: no division by 0, no root or logarithm of what is negative"
    return f"the {many} no value there; try: {hint}"


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
    fastest = 0.0
    for rate in (state.v, np.zeros_like(state.v)):
        decay = _decay(model, state, rate, t, u, p)
        if decay is not None and np.all(np.isfinite(decay)):
            fastest = max(fastest, float(np.linalg.eigvals(decay).real.max(initial=0.0)))
    return _too_fast("damping or friction decays", fastest, step, limit)


def _decay(
    model: CompiledModel, state: InitialState, v: Array, t: float, u: Array | None, p: Array
) -> NDArray[np.floating[Any]] | None:
    """Return -d vdot/dv, (nv, nv), at velocities v: by partials, or by central differences where the model has none."""
    if "partials" in model.functions:
        _, C, M = model.partials(state.q, v, np.zeros_like(v), t, u, z=state.z, parameters=p)
        known = np.all(np.isfinite(C)) and np.all(np.isfinite(M)) and np.linalg.matrix_rank(M) == len(M)
        return np.linalg.solve(M, C) if known else None
    if "forward_dynamics" not in model.functions or not model.nv:
        return None
    ways = np.diag(_DIFFERENCE * np.maximum(1.0, np.abs(v)))
    with np.errstate(all="ignore"):
        ahead, behind = (
            model.forward_dynamics(state.q, v + sign * ways, t, u, z=state.z, parameters=p) for sign in (1.0, -1.0)
        )
        columns: Array = (behind - ahead) / (2.0 * np.diag(ways)[:, np.newaxis])
    return columns.T


def _too_fast(what: str, fastest: float, step: float, limit: float) -> str:
    if step * fastest <= limit:
        return ""
    return (
        f"{what} at up to {fastest:.3g} 1/s at the start, too fast for an explicit method at this step; "
        f"try: generalized_alpha, or a step below {limit / fastest:.2g} s"
    )


def overridden_starts(corrections: Sequence[str]) -> list[str]:
    """Return one sentence for each correction of an initial value that a drive prescribes."""
    return [
        f"{text}: its drive prescribes it, and the initial value is not taken"
        for text in corrections
        if ": driven " in text
    ]


def starts_beyond_limits(model: CompiledModel, q: NDArray[np.float64], p: NDArray[np.float64]) -> list[str]:
    """Return one sentence for each coordinate beyond a limit; of joints between absolute bodies where q has their
    angles."""
    values = model.description.values(dict(zip(model.parameters, p.tolist(), strict=True)))
    places = {name: number for number, name in enumerate(model.q_names)}

    def value(formula: Formula) -> float:
        return evaluate(formula, lambda symbol: values[symbol.name])

    limits = [limit for limit in model.description.limits if limit.coordinate in places]
    return [note for limit in limits if (note := limit.passed(float(q[places[limit.coordinate]]), value))]
