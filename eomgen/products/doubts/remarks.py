"""Checks beyond error estimates of the steps: growth, fast forces, missed events, outputs, and calls that are allowed
but hardly intended.

Outputs that have no value at some rows of a run.

Springs whose ends pass one another in a run: at length zero the force reverses at once.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import replace
from eomgen.base.limits import Limit
from eomgen.base.messages import counted, listed
from eomgen.base.rounding import WRITTEN
from eomgen.compiled.model import CompiledModel
from eomgen.compiled.rest.state_warnings import SceneMeasures
from eomgen.formula.evaluate import evaluate_batch, symbols
from eomgen.integrators.families.register import without_effect
from eomgen.lie.numeric import rotated
from eomgen.products.doubts.accuracy import FOLLOWED, STEP_OF_GROWTH, not_followed, passages, passes_growth
from eomgen.products.doubts.fast_motions import EXCITED, NOTICED, UNRESOLVED, UNSEEN, fast_laws
from eomgen.products.doubts.places import BACK, place, poses_of, shortest
from eomgen.products.doubts.sampled_run import (
    ALIASED,
    ALIASED_PART,
    DEFECT,
    DEFECT_WITHIN,
    MISSED,
    MISSED_PART,
    UNDERSTATED,
    SampledRun,
)
from eomgen.results.finding import NOTE, Finding
from eomgen.simulation.accuracy.fastest_rates import STEEP_PART, Rate
from eomgen.simulation.judgement.failures import FAULTS
from eomgen.simulation.judgement.finished_run import ANY_FAILURE, ESTIMATED, Check, FinishedRun
from eomgen.simulation.judgement.instability import EACH, FAR_TRAVEL, OVERALL, unbounded_growth
from eomgen.simulation.judgement.stated_errors import LARGE_ERROR
from eomgen.simulation.stepping.inputs import InputSignals
from eomgen.simulation.stepping.run import Run
from eomgen.simulation.stepping.settings import followed_laws
from eomgen.simulation.stepping.states import States
from eomgen.simulation.stepping.time_grid import WHOLE, TimeGrid

EXCHANGED = Limit(100.0, "1", "step in parts of the run", "a choice")
FEW_VALUES = Limit(3.0, "1", "number of values of a rounded state", "a choice")
MANY_VALUES = Limit(8.0, "1", "number of values of its formula", "a choice")
IMPROBABLE = Limit(
    8.0, "1", "standard deviations of a standard normal variable", "exceeded with a probability of 1e-15"
)


def exchanged_times(grid: TimeGrid) -> list[str]:
    """Return one sentence if the step is longer than the run, as for exchanged arguments."""
    span = grid.end - grid.start
    if not 0.0 < span * (1.0 + WHOLE) < grid.step:
        return []
    sentence = f"the step, {grid.step:.6g} s, is longer than the run, {span:.6g} s, which is one shorter step"
    exchanged = f"; simulate({grid.step:.6g}, {span:.6g}) has the end first, and then the step"
    return [sentence + (exchanged if grid.step >= EXCHANGED * span else "")]


def doubtful_call(run: Run) -> list[str]:
    """Return one sentence for each doubt about a run: states sampled once, inputs that are 0 because neither scene nor
    run gives them, and improbable variables."""
    description, span = run.model.description, run.grid.end - run.grid.start
    periods = {
        state.sampling.controller or state.name: state.sampling.period
        for state in description.states
        if state.sampling is not None
    }
    notes = [
        f"{name} is sampled once: every {period:.6g} s in a run of {span:.6g} s [W0202]"
        for name, period in periods.items()
        if 0.0 < span * (1.0 + WHOLE) < period
    ]
    silent = [item.name for item in description.inputs if not item.given and item.name not in run.signals.given]
    if silent:
        many = len(silent) > 1
        sentence = f"the inputs {listed(silent)} are 0" if many else f"the input {silent[0]} is 0"
        notes.append(f"{sentence}: neither the scene nor the run gives {'them' if many else 'it'} [W0203]")
    return [*notes, *_improbable_variables(run.model, run.parameters)]


def _improbable_variables(model: CompiledModel, p: Array) -> list[str]:
    """Return a sentence, in a list, on standard normal variables of random processes and waves that are beyond 8; an
    empty list if there are none."""
    normal = {item.name for item in model.description.parameters if item.standard_normal}
    sizes = zip(np.abs(p).tolist(), model.parameters, strict=True)
    if not (beyond := [(size, name) for size, name in sizes if size > IMPROBABLE and name in normal]):
        return []
    size, name = max(beyond, key=lambda pair: pair[0])
    more = f" ({counted(len(beyond), 'variable')} beyond {IMPROBABLE:g})" if len(beyond) > 1 else ""
    of = f"it is a standard normal variable of a random process or sea{more}"
    return [f"{name} is {size:.6g} standard deviations out: {of}"]


MET = Limit(0.05, "1", "distance of the ends of a spring in parts of its length at rest", "a choice")
FAR = Limit(2.0, "1", "motion of these ends between two rows in lengths at rest", "rows are too sparse")
_HINT = "a smaller quantum: the difference of neighbouring values in the state's unit, and not a number of bits"


def _values_at_rows(
    model: CompiledModel, states: States, p: Array, signals: InputSignals
) -> dict[tuple[str, str, int], Array]:
    """Return the numbers that symbols of formulas have at rows of a run, at most 500, by kind, name and index; inputs
    without values at the rows are left out."""
    from eomgen.products.doubts.causes import values_of  # noqa: PLC0415  # few runs need it

    thinned = slice(None, None, -(-len(states.t) // 500))
    along = (states.t[thinned], states.q[thinned], states.v[thinned], states.z[thinned])
    rows = [values_of(model, float(t), q, v, z, p, signals) for t, q, v, z in zip(*along, strict=True)]
    known = set.intersection(*(set(row) for row in rows))
    return {name: np.array([row[name] for row in rows]) for name in known}


def coarse_quanta(run: FinishedRun) -> list[Finding]:
    """Return a finding on each sampled state whose quantum leaves at most three values of a formula that moves, or 0
    of a formula that is never 0."""
    model, states = run.run.model, run.states
    columns = dict(zip(model.z_names, states.z.T, strict=True))
    few = [
        (state, state.sampling, values)
        for state in model.description.states
        if state.sampling is not None and state.sampling.quantum and not state.sampling.controller
        if np.ptp(values := columns[f"z.{state.name}"]) < (FEW_VALUES - 0.5) * state.sampling.quantum
    ]
    if not few:
        return []
    numbers, findings = _values_at_rows(model, states, run.run.parameters, run.run.signals), []
    for state, sampling, rounded in few:
        try:
            exact = evaluate_batch(sampling.formula, lambda symbol: numbers[symbol.kind, symbol.name, symbol.index])
        except KeyError:  # a quantity of points, or the like
            continue
        unit = "" if state.unit in ("", "1") else f" {state.unit}"
        if not np.any(rounded) and np.min(np.abs(exact)) > WRITTEN * sampling.quantum and symbols(sampling.formula):
            least = float(exact[np.argmin(np.abs(exact))])
            text = f"{state.name} is 0 all the time, rounded to multiples of {sampling.quantum:.6g}{unit}: its formula"
            findings.append(Finding(text=f"{text} is {least:.3g}{unit} and more", hint=_HINT, value=sampling.quantum))
            continue
        if len(np.unique(np.round(exact / sampling.quantum, 6))) <= MANY_VALUES:
            continue
        count = counted(len(np.unique(np.round(rounded / sampling.quantum))), "value")
        span = f"its formula goes from {np.min(exact):.3g} to {np.max(exact):.3g}{unit}"
        text = f"{state.name} takes {count}, rounded to multiples of {sampling.quantum:.6g}{unit}: {span}"
        findings.append(Finding(text=text, hint=_HINT, value=sampling.quantum))
    return findings


def passed_springs(run: FinishedRun) -> Iterator[Finding]:
    """Yield a finding on springs whose ends pass one another between two rows of a run, if there are any.

    Springs without a length at rest are left out, since their force does not reverse, and models without the function
    ``poses``.
    """
    model, p, t, q = run.run.model, run.run.parameters, run.states.t, run.states.q
    drawing, measures = model.description.drawing, SceneMeasures(model, p, 0.0, None)
    lines = [line for line in drawing.lines if line.elastic and measures.number(line.length) > 0.0]
    if not lines or "poses" not in model.functions:
        return
    t, q = (array[:: -(-len(t) // 2048)] for array in (t, q))
    poses = {name: np.broadcast_to(pose, (len(t), 7)) for name, pose in poses_of(model, t, q, p).items()}
    points = {point.name: (point.body, measures.vector(point.position)) for point in drawing.points}
    result = {}
    for line in lines:
        ends = [points[line.first], points[line.second]]
        first, second = (place(poses[body], local) for body, local in ends)
        seen = np.array([rotated(poses[body][:, :4] * BACK, second - first) for body, _ in ends])  # in both bodies
        met = np.all(_meetings(seen, measures.number(line.length)), axis=0)
        if met.any():
            result[line.name] = float(t[np.argmax(met) + 1])
    if result:
        named = ", ".join(f"{name} at t = {time:.6g} s" for name, time in result.items())
        sentence = f"the ends of the spring{'s' * (len(result) > 1)} {named} pass one another"
        text = f"{sentence}, where a force along the line between them turns round"
        yield Finding(time=min(result.values()), text=text, hint="limits that stop the motion before")


def _meetings(vectors: Array, length: float) -> Array:
    """Return, (..., rows - 1), whether a spring turns round between two rows by way of next to no length; ``vectors``
    (..., rows, 3) lead from end to end in the axes of a body, ``length`` is at rest."""
    turned = np.sum(vectors[..., :-1, :] * vectors[..., 1:, :], axis=-1) < 0.0
    way = np.linalg.norm(np.diff(vectors, axis=-2), axis=-1)
    return np.asarray(turned & (shortest(vectors) < MET * length) & (way < FAR * length))


def undefined_outputs(t: Array, outputs: Mapping[str, Array]) -> Finding | None:
    """Return a finding on outputs without a value at some rows; None if there are none."""
    described, first = [], math.inf
    for name, values in outputs.items():
        undefined = np.flatnonzero(~np.isfinite(values.reshape(len(t), -1)).all(axis=1))
        if len(undefined):
            first = min(first, float(t[undefined[0]]))
            described.append(f"{name} ({len(undefined)} of {len(t)} rows, from t = {t[undefined[0]]:.6g} s)")
    if not described:
        return None
    many = f"outputs {', '.join(described)} have" if len(described) > 1 else f"output {described[0]} has"
    hint = "a formula that has one: no division by 0, no root or logarithm of a negative number"
    return Finding(time=first, text=f"the {many} no value there", hint=hint)


def _missed_event(run: FinishedRun) -> Iterator[Finding]:
    from eomgen.products.doubts.unseen_events import unseen_events  # noqa: PLC0415  # few runs have events

    hint = f"a step smaller than {run.settings['step']:.3g} s, in each of which events are looked for"
    if (pair := unseen_events(run)) is not None:
        yield replace(pair, hint=hint)
    elif run.error.passed_over and not run.error.relative > LARGE_ERROR:
        yield Finding(text=run.error.passed_over, hint=hint)


def _partly_examined(run: FinishedRun) -> Iterator[Finding]:
    if (examined := run.once(SampledRun).examined_share) < 1.0:
        part = f"{100.0 * examined:.2g} % of the run"
        yield Finding(
            text=f"laws that act between the steps were looked for in {part} only: it has thousands of steps to a row",
            hint="shorter rows, or a method of fixed steps",
            value=examined,
        )


def _bounded_steps(run: FinishedRun) -> Iterator[Finding]:
    if law := run.run.bounded_for:
        bound = run.settings["largest_step"]
        yield Finding.of(f"the steps are at most {bound:.3g} s, since steps by the tolerance pass over {law}", bound)


def _singular_passage(run: FinishedRun) -> Iterator[Finding]:
    count = int(run.statistics.get("singular_passages", 0))
    if passed := passages(count):
        tolerance = run.settings["tolerance"] if run.run.method.chooses_steps else math.inf
        yield Finding.of(f"{passed}{not_followed(run.error.relative, tolerance)}", count)


def _controller_cost(run: FinishedRun) -> Iterator[Finding]:
    if run.stepper.controllers is not None and (cost := run.stepper.controllers.cost(run.wall)):
        yield Finding.of(cost)


def _method_limits(run: FinishedRun) -> Iterator[Finding]:
    owner = run.run
    yield from map(Finding.of, owner.method.warnings(bool(owner.model.multipliers)))
    yield from map(Finding.of, without_effect(owner.name, owner.model.description.simulation))


def _steep_laws(run: FinishedRun) -> Iterable[Finding]:
    return map(Finding.of, followed_laws(run.run.model, run.run.method, run.run.parameters, run.run.grid)[1])


def _fast_damping(run: FinishedRun) -> Iterator[Finding]:
    decay = run.fastest.decay
    return _too_fast(run, decay, f"damping or friction of {decay.name.removeprefix('v.')} decays")


def _too_fast(run: FinishedRun, decay: Rate, text: str) -> Iterator[Finding]:
    limit = run.run.method.real_stability
    if run.settings["step"] * decay.rate > limit:
        text += (
            f" at up to {decay.rate:.3g} 1/s at t = {decay.time:.6g} s, too fast for an explicit method at this step"
        )
        hint = f"generalized_alpha, or a step below {limit / decay.rate:.2g} s"
        yield Finding(value=decay.rate, time=decay.time, text=text, hint=hint)


def _passed_growth(run: FinishedRun) -> Iterator[Finding]:
    step, (rate, time, name) = run.settings["step"], run.fastest.growth
    if passes_growth(run):
        law = f"friction, or another law of velocities, makes the motion of {name.removeprefix('v.')} grow"
        how = f"which steps of {step:.3g} s pass over, as do steps twice and half as long"
        text = f"{law} at {rate:.3g} 1/s at t = {time:.6g} s, {how}"
        yield Finding(value=rate, time=time, text=text, hint=f"a step below {1.0 / rate:.2g} s")


ROWS = (
    Check(
        "unbounded_growth [W0225]",
        lambda run: filter(None, [unbounded_growth(run.run, run.states)]),
        unless=FAULTS,
        behind="turned_element",
        limits=(EACH, OVERALL, FAR_TRAVEL),
    ),
    Check(
        "unresolved_motion [W0227]",
        lambda run: map(Finding.of, filter(None, [run.error.unresolved])),
        unless=(ANY_FAILURE,),
        alike=True,
        behind="unknown_error",
        limits=(UNRESOLVED, NOTICED, EXCITED),
    ),
    Check(
        "missed_event [W0228]",
        _missed_event,
        ("complete", "events", ESTIMATED),
        unless=(ANY_FAILURE,),
        limits=(MISSED, MISSED_PART),
    ),
    Check("fast_law [W0229]", fast_laws, ("complete", "two rows", ESTIMATED), alike=True, limits=(UNSEEN,)),
    Check(
        "unseen_law [W0230]",
        lambda run: [] if run.passed_over is None else [run.passed_over.finding],
        ("complete", "two rows", ESTIMATED),
        unless=("fast_law",),
        alike=True,
        limits=(DEFECT, DEFECT_WITHIN, ALIASED, ALIASED_PART, UNDERSTATED),
    ),
    Check(
        "partly_examined [W0231]",
        _partly_examined,
        ("complete", "two rows", ESTIMATED),
        severity=NOTE,
        unless=("unseen_law",),
    ),
    Check("bounded_steps [W0232]", _bounded_steps, severity=NOTE),
    Check("passed_spring [W0233]", passed_springs, ("complete", "two rows", "lines"), limits=(MET, FAR)),
    Check(
        "undefined_output [W0234]",
        lambda run: filter(None, [undefined_outputs(run.states.t, run.outputs)]),
        ("complete", "outputs"),
    ),
    Check(
        "singular_passage [W0235]", _singular_passage, ("complete", "constraints"), severity=NOTE, limits=(FOLLOWED,)
    ),
    Check(
        "coarse_quantum [W0236]",
        coarse_quanta,
        ("complete", "two rows"),
        severity=NOTE,
        limits=(FEW_VALUES, MANY_VALUES),
    ),
    Check("controller_cost [W0237]", _controller_cost, ("complete", "controllers"), severity=NOTE),
    Check("model_limits [W0238]", lambda run: map(Finding.of, run.run.model.library.layout["warnings"]), ()),
    Check("method_limits [W0239]", _method_limits, ()),
    Check("steep_law [W0240]", _steep_laws, ()),
    Check(
        "exchanged_times [W0241]",
        lambda run: map(Finding.of, exchanged_times(run.run.grid)),
        ("begun",),
        noted="call",
        limits=(EXCHANGED,),
    ),
    Check(
        "doubtful_call [W0242]",
        lambda run: map(Finding.of, doubtful_call(run.run)),
        ("begun",),
        severity=NOTE,
        said=False,
        noted="call",
        limits=(IMPROBABLE,),
    ),
    Check("unresolved_damping [W0243]", _fast_damping, ("explicit", ESTIMATED), alike=True, limits=(STEEP_PART,)),
    Check(
        "unresolved_states [W0244]",
        lambda run: _too_fast(run, run.fastest.states, "internal states decay"),
        ("explicit", ESTIMATED),
        alike=True,
    ),
    Check(
        "passed_growth [W0266]",
        _passed_growth,
        ("complete", "fixed steps", ESTIMATED),
        unless=("unresolved_damping",),
        alike=True,
        limits=(STEP_OF_GROWTH, STEEP_PART),
    ),
)
