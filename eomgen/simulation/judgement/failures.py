"""Checks of the end of a run: early stops, and motions that do not follow the equations; the sentence on the end."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from eomgen.base.arrays import Array
from eomgen.compiled.model import CompiledModel
from eomgen.compiled.rest.state_warnings import inertia_warning
from eomgen.errors import Message
from eomgen.integrators.events import ACCUMULATED, CONTROLLER_FAILED, NO_VALUE, STATUSES, STOPPED
from eomgen.results.events import Events
from eomgen.results.finding import FAILURE, NOTE, Finding
from eomgen.simulation.judgement.diagnosis import (
    SMALLER_ANGLES,
    advice,
    doubtful_formulas,
    failed_controller,
    fast_joint,
    first_non_finite,
    instability,
)
from eomgen.simulation.judgement.finished_run import Check, FinishedRun
from eomgen.simulation.judgement.instability import own_growth, unbounded_growth, unstable_growth
from eomgen.simulation.judgement.invariants import FAILED_VIOLATION
from eomgen.simulation.judgement.singular_positions import beyond_reach, singular_ahead, way_past, without_length
from eomgen.simulation.stepping.chunks import Trajectory
from eomgen.simulation.stepping.events import ending, parameters_with, without_value
from eomgen.simulation.stepping.run import Run
from eomgen.simulation.stepping.states import states_of
from eomgen.simulation.stepping.stepper import Stepper
from eomgen.system.description import LARGEST_ANGLE, STRAINED

#: Remedy for a diverging motion without a growing linear mode and without a fast start.
OTHER_FORCES = "other signs or sizes of gains, damping and stiffnesses, smaller forces at the start, or a smaller step"


class _LastState(NamedTuple):
    """The last state before a step that failed: t, q, v, a, z, with parameters ``p`` there. ``behind`` is a clause that
    names the event which gave the state; empty for a row of the run."""

    t: float
    q: Array
    v: Array
    a: Array
    z: Array
    p: Array
    behind: str


def end_of(run: FinishedRun) -> str:
    """Return a sentence on the end of a run: the time and the number of steps, and of an early stop cause and
    remedy."""
    last_run, stepper, trajectory = run.last_run, run.stepper, run.trajectory
    t = trajectory.rows[-1, 0]
    of_all = f"{trajectory.steps} of {last_run.grid.steps} steps"
    if trajectory.failure is not None:
        return f"stopped at t = {t:.9g} s, after {of_all}: {trajectory.failure.problems[0]}"
    if trajectory.interrupted:
        return f"interrupted at t = {t:.9g} s, after {of_all}"
    if trajectory.status == 0:
        return f"reached t = {t:.9g} s in {trajectory.steps} steps{_own_steps(stepper.statistics)}"
    unknown = without_value(last_run, trajectory.rows, run.events) if trajectory.status == NO_VALUE.number else []
    if sentence := str(Message(ending(trajectory.status, stepper, unknown))):
        sentence = f"{sentence}, after {of_all}{_own_steps(stepper.statistics)}"
        tried = next(item.advice for item in STATUSES if item.number == trajectory.status)
        if trajectory.status == ACCUMULATED.number and "least_interval" in sentence:
            tried = f"a shorter least_interval, or {tried}"
        return sentence if trajectory.status == STOPPED.number else f"{sentence}; try: {tried}"
    if trajectory.status == CONTROLLER_FAILED:
        fault, hint = failed_controller(stepper)
        return f"stopped at t = {t:.9g} s, after {of_all}: {fault}; try: {hint}"
    details, hint = _diagnosis(last_run, stepper, trajectory, _last_state(last_run, trajectory, run.events))
    if any(text.code == STRAINED for text in last_run.corrections):  # the message says how much at the end
        hint = f"an initial state nearer to assembly, or lengths that fit, so that beams start unstrained; or {hint}"
    steps = f"{of_all}{_own_steps(stepper.statistics, last_run.model)}"
    text = stepper.status_text(trajectory.status)
    return f"stopped at t = {t:.9g} s, after {steps}: {text}{details}; try: {hint}"


def _last_state(run: Run, trajectory: Trajectory, events: Events | None) -> _LastState:
    """Return the state of the last row, or the state after the last event if that came later, with NaN
    accelerations."""
    t, q, v, a, _, z = (part[0] for part in states_of(trajectory.rows[-1:], run.model))
    if events is None or not len(events) or events.t[-1] <= t:
        return _LastState(float(t), q, v, a, z, run.parameters, "")
    *_, event = events
    p = parameters_with(events, run.model, run.parameters, event.modes)
    return _LastState(event.t, event.q, event.v, np.full_like(v, np.nan), event.z, p, f", after the event {event.name}")


def _diagnosis(run: Run, stepper: Stepper, trajectory: Trajectory, last: _LastState) -> tuple[str, str]:
    """Return the cause of a failed step, as a clause that begins with "; ", and a remedy. The clause is empty if no
    cause is known. Causes are looked for in this order: values that are not finite, faults of the motion at the last
    state, instability of the method, growth by the equations, and doubtful formulas."""
    state = (last.q, last.v, last.a, last.z)
    step = run.settings["step"]
    block, already, (cause, cure) = first_non_finite(run.model, last.t, state, step, last.p, run.signals)
    fault = _fault_of_motion(run, trajectory, last, finite=not block)
    text = f"the first block that is not finite is {block}{last.behind}" if block else fault.text if fault else ""
    details = f"; {text}" if text else ""
    hint = fault.hint if fault else advice(run.method, trajectory.status, run.settings)
    if cause and (by_method := unstable_growth(run, stepper.library, trajectory)):
        text, hint = instability(by_method, run.method)
        return f"; {text}", hint
    if cause:
        details, hint = details + cause, cure
        if hint == SMALLER_ANGLES and not _starts_far(run, trajectory):
            away = unbounded_growth(run, states_of(trajectory.rows, run.model))
            details = f"{details}; {away.text}" if away else details
            hint = away.hint if away else OTHER_FORCES
        return details, hint
    if already:
        hint = "other parameters, formulas or coordinates there: no smaller step helps"
    elif not fault and (growth := _growth(run, stepper, trajectory)):
        return f"{details}; {growth.text}", growth.hint
    return details + ("" if fault else doubtful_formulas(run.model, trajectory.status, block)), hint


def _fault_of_motion(run: Run, trajectory: Trajectory, last: _LastState, *, finite: bool) -> Finding | None:
    """Return a finding on the state at the end of a failed run; None if the state shows no fault. Faults are a length
    that reaches 0, a bad inertia matrix, a drive beyond the reach of its loop, a joint that turns too fast, and a
    singular position. `finite` is false if some block at `last` is not finite: then only the length and the turn are
    examined."""
    model, step = run.model, run.settings["step"]
    times, positions = trajectory.rows[:, 0], trajectory.rows[:, 1 : 1 + model.nq]
    if ended := without_length(model, float(times[-1]), last.p, step):
        return ended
    if finite and (inertia := inertia_warning(model, last.q, last.p, positions[0], step)):
        return Finding(text=inertia.text, hint=inertia.hint)
    if finite and len(times) > 1 and (beyond := beyond_reach(model, float(times[-1]), positions[-1], last.p, step)):
        return beyond
    if turn := fast_joint(model, float(times[-1]), last.q, last.v, last.p, step):
        return Finding(text=turn, hint=advice(run.method, trajectory.status, run.settings))
    if finite and (singular := singular_ahead(model, times, positions, last.v, last.p, step)):
        return Finding(text=singular.text, hint=way_past(run.method, step, at_start=len(times) == 1))
    return None


def _growth(run: Run, stepper: Stepper, trajectory: Trajectory) -> Finding | None:
    """Return a finding on a motion that grows by its equations before a run stopped; None without such a growth."""
    if growth := own_growth(run, stepper.library, trajectory.rows):
        hint = "the signs and sizes of forces, stiffnesses and gains, for it is the equations that diverge: no smaller"
        hint += " step helps"
        return Finding(text=str(growth), hint=hint)
    result = unbounded_growth(run, states_of(trajectory.rows, run.model))
    return None if result is None or unstable_growth(run, stepper.library, trajectory) else result


def _starts_far(run: Run, trajectory: Trajectory) -> bool:
    """Return whether initial angles and velocities alone lead to angles that are too large for their sines."""
    start, model = trajectory.rows[0], run.model
    span = float(trajectory.rows[-1, 0] - start[0]) + run.settings["step"]
    reach = np.abs(start[1 : 1 + model.nq]).max(initial=0.0)
    reach += span * np.abs(start[1 + model.nq : 1 + model.nq + model.nv]).max(initial=0.0)
    return bool(reach > 0.1 * LARGEST_ANGLE)


def _own_steps(statistics: Mapping[str, int | float], model: CompiledModel | None = None) -> str:
    """Return a parenthesis on the steps that an adaptive method chose and repeated; empty for fixed steps. With a
    model, the text also names the smallest step and the component that required it."""
    if not statistics.get("own_steps"):
        return ""
    text = f" ({statistics['own_steps']} of its own, {statistics['rejections']} taken again"
    if model is not None:
        name = (*model.v_names, *model.z_names)[int(statistics["hardest"])]
        smallest, where = statistics["smallest_step"], statistics["smallest_step_time"]
        text += f"; the smallest, {smallest:.3g} s at t = {where:.9g} s, for {name}"
    return f"{text})"


def _early_end(run: FinishedRun) -> Iterator[Finding]:
    if not run.complete:
        yield Finding.of(end_of(run), time=run.trajectory.rows[-1, 0])


def _unstable(run: FinishedRun) -> Iterator[Finding]:
    growth = run.growth
    if growth is None:
        return
    totals = run.energy.get("total")
    energies = "" if totals is None else f", and the total energy from {totals[0]:.3g} to {totals[-1]:.3g} J"
    fault, hint = instability(growth, run.run.method)
    yield Finding(value=growth.after, time=growth.end, text=f"{fault}{energies}", hint=hint)


def _infinite_energy(run: FinishedRun) -> Iterator[Finding]:
    if (time := run.balance.infinite) is not None:
        grown = unbounded_growth(run.run, run.states)
        text = f"the energy is beyond the finite numbers from t = {time:.6g} s on"
        hint = "other initial velocities, forces or units" if grown is None else grown.hint
        yield Finding(time=time, text=text if grown is None else f"{text}: {grown.text}", hint=hint)


def _broken_constraint(run: FinishedRun) -> Iterator[Finding]:
    violation = run.violation
    if violation is not None and violation.share > FAILED_VIOLATION:
        text = f"{violation.text}, more than {FAILED_VIOLATION:g} of the size of the machine, or rad"
        yield Finding(value=violation.share, time=violation.time, text=text, hint="a smaller step")


ROWS = (
    Check("stopped [W0209]", _early_end, needs=(), severity=FAILURE),
    Check("checkpoint [W0210]", lambda run: [Finding.of(run.checkpoint)], needs=("checkpoint",), severity=NOTE),
    Check("unstable [W0211]", _unstable, needs=("complete", "fixed steps"), severity=FAILURE),
    Check("infinite_energy [W0212]", _infinite_energy, severity=FAILURE, unless=("unstable",)),
    Check(
        "broken_constraint [W0213]",
        _broken_constraint,
        severity=FAILURE,
        unless=("unstable", "infinite_energy"),
        limits=(FAILED_VIOLATION,),
    ),
)
#: Failures of runs that reached their end without following the equations.
FAULTS = ("unstable", "infinite_energy", "broken_constraint")
