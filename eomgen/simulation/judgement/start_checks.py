"""Checks of the start of a run: rates that explicit steps do not resolve, limits, impacts, and the choice of method.

Impacts that a run starts behind, or on, and their effect on the motion, in words.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.compiled.initial_state import InitialState
from eomgen.compiled.model import CompiledModel
from eomgen.formula.evaluate import evaluate
from eomgen.formula.nodes import Formula
from eomgen.lie import product
from eomgen.results.finding import NOTE, Finding
from eomgen.simulation.accuracy.motion_size import reach_of
from eomgen.simulation.judgement.check import Check
from eomgen.simulation.judgement.deep_tyres import deep_tyres
from eomgen.simulation.judgement.fast_decay import Fastest, decay_of_motion, decay_of_states
from eomgen.simulation.judgement.finished_run import Beginning, FinishedRun
from eomgen.simulation.stepping.run import Run
from eomgen.system.cancellation import LOST, cancellation, digits_kept, largest_cancellation, relative_error

#: Part of the coordinates, and of the rate within a step, by which a function on its root may be off.
_ON = 1e-12


def impacts_at_start(run: Run, state: InitialState) -> list[str]:
    """Return one sentence for each impact that the initial state is behind, or rests on without a side.

    An impact of a direction has its free side at values of its function above zero (falling) or below (rising); an
    impact of both directions is met from either side, so that only a start on it has no side.
    """
    model, t = run.model, run.grid.start
    rows = model.library.layout["method"].get("events", {"rows": []})["rows"]
    if not any(row["action"] == "impact" for row in rows) or "events" not in model.functions:
        return []
    u = run.signals.rows(np.array([t]))[0] if model.nu else None
    reach = reach_of(model, state.q)
    ways = np.concatenate([np.zeros((1, model.nv)), np.diag(_ON * np.where(reach > 0.0, reach, 1.0))])
    places = product.update(model.factors, np.repeat(state.q[np.newaxis], len(ways), axis=0), ways)
    with np.errstate(all="ignore"):
        functions = model.evaluate(
            "events", places, state.v, np.zeros_like(state.v), t, u, z=state.z, parameters=run.parameters
        )
    values, rates = functions["event"], functions["event_rate"][0]
    rounding = np.abs(values[1:] - values[0]).sum(axis=0)  # when coordinates move by theirs
    sentences = []
    for row, value, rate, off in zip(rows, values[0].tolist(), rates.tolist(), rounding.tolist(), strict=True):
        travel = abs(rate) * run.settings["step"]
        near = off + _ON * travel
        if row["action"] != "impact":
            continue
        name, sign = row["name"], row["sign"]
        if sign and value * sign > near:
            sentences.append(
                f"the run starts behind the impact {name}, which is met from the side where its formula is"
                f" {'below' if sign > 0 else 'above'} zero: at the start it is {value:.4g}; try: another initial state,"
                f' or direction = "{"falling" if sign > 0 else "rising"}"'
            )
        elif not sign and abs(value) <= near and travel <= off:
            sentences.append(
                f"the run starts at rest on the impact {name}, which has no side: the motion may leave it either way;"
                ' try: direction = "falling" for a free side where its formula is above zero, "rising" for below'
            )
    return sentences


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


def _unresolved_damping(run: FinishedRun) -> Iterator[Finding]:
    yield from _too_fast(run, decay_of_motion(*_state_at_start(run), run.settings["step"]))


def _unresolved_states(run: FinishedRun) -> Iterator[Finding]:
    yield from _too_fast(run, decay_of_states(*_state_at_start(run)))


def _state_at_start(run: FinishedRun) -> tuple[CompiledModel, InitialState, float, Array | None, Array]:
    owner, t = run.run, run.run.grid.start
    u = owner.signals.rows(np.array([t]))[0] if owner.takes_rows else None
    return owner.model, _begun(run).state, t, u, owner.parameters


def _too_fast(run: FinishedRun, decay: Fastest | None) -> Iterator[Finding]:
    limit = run.run.method.real_stability
    if decay is not None and run.settings["step"] * decay.rate > limit:
        text = f"{decay.text} at up to {decay.rate:.3g} 1/s at the start, too fast for an explicit method at this step"
        hint = f"generalized_alpha, or a step below {limit / decay.rate:.2g} s"
        yield Finding(value=decay.rate, time=run.run.grid.start, text=text, hint=hint)


def _begun(run: FinishedRun) -> Beginning:
    if run.beginning is None:
        raise ValueError("a check of the start needs the fact begun")
    return run.beginning


def _lost_digits(run: FinishedRun) -> Iterator[Finding]:
    """Find accelerations that lose digits when M is eliminated.

    Methods that iterate on the residual have the digits of inverse dynamics, but for the start by forward
    dynamics; tdg2 and rosenbrock record the accelerations of each step by it, too.
    """
    model, q = run.run.model, _begun(run).state.q
    facts = model.library.layout["facts"]
    articulated = facts["ill_scaled"]
    terms = run.run.method.terms(False, facts["internal_states"], not articulated)
    iterated = "mass" not in terms and bool({"residual", "equations"} & set(terms))
    if "mass" not in model.functions or (iterated and "forward_dynamics" not in terms):
        return
    (inertia,) = model.evaluator.functions("mass", {"q": q, "p": run.run.parameters})
    M = np.asarray(inertia, dtype=float)
    if relative_error(largest_cancellation(M), articulated=articulated) <= LOST:
        return
    ratio = float(cancellation(M[np.newaxis], [factor.v for factor in model.factors])[0])
    lost = relative_error(ratio, articulated=articulated)
    if lost > LOST:
        text = f"{digits_kept(lost)}: inertias differ by a factor of {ratio:.1g} with joints locked and free"
        other = "the parameters of this run as defaults of the scene"
        better = [other] if not articulated and model.parameters else ["links that differ less"]
        if iterated:
            text = f"where forward dynamics gives them, at the start or at each recorded step, {text}"
        else:
            better = ["generalized_alpha", *better]
        yield Finding(value=lost, time=run.run.grid.start, text=text, hint=", or ".join(better))


def _start_beyond_limits(run: FinishedRun) -> Iterator[Finding]:
    beginning = _begun(run)
    if not beginning.equilibrium:
        yield from map(Finding.of, starts_beyond_limits(run.run.model, beginning.state.q, run.run.parameters))


def _start_on_impact(run: FinishedRun) -> Iterator[Finding]:
    yield from map(Finding.of, impacts_at_start(run.run, _begun(run).state))


def _turned_start(run: FinishedRun) -> Iterator[Finding]:
    yield from map(Finding.of, _begun(run).notes)


def _deep_start(run: FinishedRun) -> Iterator[Finding]:
    beginning, owner = _begun(run), run.run
    if not beginning.equilibrium:
        signals = owner.signals if owner.takes_rows else None
        yield from map(
            Finding.of, deep_tyres(owner.model, owner.grid.start, beginning.state.q, owner.parameters, signals)
        )


def _doubtful_start(run: FinishedRun) -> Iterator[Finding]:
    yield from map(Finding.of, _begun(run).doubts)


def _chosen_method(run: FinishedRun) -> Iterator[Finding]:
    if choice := _begun(run).choice:
        yield Finding.of(choice)


ROWS = (
    Check("unresolved_damping", _unresolved_damping, ("begun", "explicit", "no constraints")),
    Check("unresolved_states", _unresolved_states, ("begun", "explicit")),
    # Beyond the linear range of a beam no pivot of M says anything: the finding above names the beam.
    Check("lost_digits", _lost_digits, ("begun", "no constraints"), unless=("linear_range",)),
    Check("start_beyond_limits", _start_beyond_limits, ("begun",)),
    Check("start_on_impact", _start_on_impact, ("begun", "events")),
    Check("turned_start", _turned_start, ("begun",)),
    Check("deep_start", _deep_start, ("begun", "tyres")),
    Check("doubtful_start", _doubtful_start, ("begun",)),
    Check("chosen_method", _chosen_method, ("begun",), severity=NOTE),
)
