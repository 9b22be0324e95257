"""Checks of the start of a run: rates that explicit steps do not resolve, limits, impacts, and tyres deep in the
road.

Impacts that a run starts past, or on, and their effect on the motion, in words.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from eomgen.base.rounding import SUMMED
from eomgen.compiled.initial_state import InitialState
from eomgen.compiled.rest.state_warnings import SceneMeasures
from eomgen.lie import product
from eomgen.products.doubts.places import depth_note, place, poses_of
from eomgen.results.finding import Finding
from eomgen.simulation.accuracy.motion_size import reach_of
from eomgen.simulation.judgement.finished_run import Check, FinishedRun, RunStart
from eomgen.simulation.judgement.starts import starts_beyond_limits
from eomgen.simulation.stepping.run import Run
from eomgen.system.cancellation import LOST, cancellation, digits_kept, largest_cancellation, relative_error


def deep_tyres(run: Run, state: InitialState) -> list[str]:
    """Return one sentence for each tyre that starts with more than a quarter of its radius in the road.

    Models without ``poses`` have none, nor have roads by curves and waves at places that only a step knows.
    """
    model, t, p = run.model, run.grid.start, run.parameters
    drawing, notes = model.description.drawing, []
    if "poses" not in model.functions or not drawing.wheels:
        return []
    measures, poses = SceneMeasures(model, p, t, None), poses_of(model, t, state.q, p)
    rows = run.signals.rows(np.array([t]))[0].tolist() if run.takes_rows else []
    inputs = dict(zip(model.inputs, rows, strict=False))
    points = {point.name: point for point in drawing.points}
    for wheel in drawing.wheels:
        point = points[wheel.center]
        center = place(poses[point.body], measures.vector(point.position))
        notes.append(depth_note(wheel, center, t, measures.values, inputs))
    return list(filter(None, notes))


def impacts_at_start(run: Run, state: InitialState) -> list[str]:
    """Return one sentence for each impact whose function the initial state is already past, or on which the state rests
    without a side.

    For an impact of one direction, the free side has values of the function above zero (falling) or below (rising); an
    impact of both directions is met from either side, so that only a start on the impact has no side.
    """
    model, t = run.model, run.grid.start
    rows = model.library.layout["method"].get("events", {"rows": []})["rows"]
    if not any(row["action"] == "impact" for row in rows) or "events" not in model.functions:
        return []
    u = run.signals.rows(np.array([t]))[0] if model.nu else None
    reach = reach_of(model, state.q)
    ways = np.concatenate([np.zeros((1, model.nv)), np.diag(SUMMED * np.where(reach > 0.0, reach, 1.0))])
    places = product.update(model.factors, np.repeat(state.q[np.newaxis], len(ways), axis=0), ways)
    with np.errstate(all="ignore"):
        functions = model.evaluate(
            "events", places, state.v, np.zeros_like(state.v), t, u, z=state.z, parameters=run.parameters
        )
    values, rates = functions["event"], functions["event_rate"][0]
    rounding = np.abs(values[1:] - values[0]).sum(axis=0)  # when coordinates move by their rounding
    sentences = []
    for row, value, rate, off in zip(rows, values[0].tolist(), rates.tolist(), rounding.tolist(), strict=True):
        travel = abs(rate) * run.settings["step"]
        near = off + SUMMED * travel
        if row["action"] != "impact":
            continue
        name, sign = row["name"], row["sign"]
        if sign and value * sign > near:
            sentences.append(
                f"the run starts past the impact {name}, which is met from the side where its formula is"
                f" {'below' if sign > 0 else 'above'} zero: at the start it is {value:.4g}; try: another initial state,"
                f' or direction = "{"falling" if sign > 0 else "rising"}"'
            )
        elif not sign and abs(value) <= near and travel <= off:
            sentences.append(
                f"the run starts at rest on the impact {name}, which has no side: the motion may leave it either way;"
                ' try: direction = "falling" for a free side where its formula is above zero, "rising" for below'
            )
    return sentences


def _beginning_of(run: FinishedRun) -> RunStart:
    if run.beginning is None:
        raise ValueError("a check of the start needs the fact begun")
    return run.beginning


def _lost_digits(run: FinishedRun) -> Iterator[Finding]:
    """Yield a finding on accelerations at the start that lose digits when M is eliminated. Methods that iterate on the
    residual are as accurate as inverse dynamics, except for the start by forward dynamics; tdg2 and rosenbrock also
    record accelerations of each step from forward dynamics."""
    model, q = run.run.model, _beginning_of(run).state.q
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
        remedy = "the parameters of this run as defaults of the scene"
        better = [remedy] if not articulated and model.parameters else ["links that differ less"]
        if iterated:
            text = f"where forward dynamics gives them, at the start or at each recorded step, {text}"
        else:
            better = ["generalized_alpha", *better]
        yield Finding(value=lost, time=run.run.grid.start, text=text, hint=", or ".join(better))


def _start_beyond_limits(run: FinishedRun) -> Iterator[Finding]:
    beginning = _beginning_of(run)
    if not beginning.equilibrium:
        yield from map(Finding.of, starts_beyond_limits(run.run.model, beginning.state.q, run.run.parameters))


def _past_impacts(run: FinishedRun) -> Iterable[Finding]:
    return map(Finding.of, impacts_at_start(run.run, _beginning_of(run).state))


def _deep_start(run: FinishedRun) -> Iterator[Finding]:
    beginning = _beginning_of(run)
    if not beginning.equilibrium:
        yield from map(Finding.of, deep_tyres(run.run, beginning.state))


ROWS = (
    # Beyond the linear range of a beam no pivot of M says anything: the finding above names the beam.
    Check("lost_digits [W0245]", _lost_digits, ("begun", "no constraints"), unless=("linear_range",), limits=(LOST,)),
    Check("start_beyond_limits [W0246]", _start_beyond_limits, ("begun",), noted="start"),
    Check("start_on_impact [W0247]", _past_impacts, ("begun", "events"), noted="start"),
    Check("turned_start [W0248]", lambda run: map(Finding.of, _beginning_of(run).notes), ("begun",)),
    Check("deep_start [W0249]", _deep_start, ("begun", "parts")),
    Check("doubtful_start [W0250]", lambda run: map(Finding.of, _beginning_of(run).doubts), ("begun",)),
)
