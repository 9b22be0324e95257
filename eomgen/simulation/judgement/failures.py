"""Checks of the end of a run: early stops, and motions that do not follow the equations; the sentence on the end."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from eomgen.analysis.state_warnings import inertia_warning
from eomgen.compiled.consistent_states import tells_strain
from eomgen.compiled.model import CompiledModel
from eomgen.integrators.events import ACCUMULATED, CONTROLLER_FAILED, NO_VALUE, STATUSES, STOPPED
from eomgen.results.events import Events
from eomgen.results.finding import FAILURE, NOTE, Finding
from eomgen.simulation.judgement.diagnosis import (
    SMALLER_ANGLES,
    advice,
    failed_controller,
    fast_joint,
    first_non_finite,
    instability,
)
from eomgen.simulation.judgement.finished_run import Check, FinishedRun
from eomgen.simulation.judgement.instability import own_growth, unbounded_growth, unstable_growth
from eomgen.simulation.judgement.invariants import FAILED_VIOLATION
from eomgen.simulation.judgement.singular_positions import singular_ahead, way_past
from eomgen.simulation.stepping.chunks import Trajectory
from eomgen.simulation.stepping.events import ending, parameters_with, without_value
from eomgen.simulation.stepping.run import Run
from eomgen.simulation.stepping.states import states_of
from eomgen.simulation.stepping.stepper import Stepper
from eomgen.system.description import LARGEST_ANGLE

#: Remedy for a diverging motion without a growing linear mode and without a fast start.
OTHER_FORCES = (
    "other signs or sizes of gains, damping and stiffnesses, an initial position with smaller forces, or a smaller step"
)
#: Initial angles above this fraction of the largest angle for sines are the cause of larger angles.
_FAR = 0.1


def message_of(run: Run, stepper: Stepper, trajectory: Trajectory, events: Events | None) -> str:
    """Return a sentence on the end of a run, and a remedy if the run did not reach the end time.

    Parameters
    ----------
    run : with the parameters at its last row
    stepper : in the state after the run
    events : of the run, None if the scene has none
    """
    model, p, settings = run.model, run.parameters, run.settings
    t = trajectory.rows[-1, 0]
    if trajectory.failure is not None:
        return (
            f"stopped at t = {t:.9g} s, after {trajectory.steps} of {run.grid.steps} steps:"
            f" {trajectory.failure.problems[0]}"
        )
    if trajectory.interrupted:
        return f"interrupted at t = {t:.9g} s, after {trajectory.steps} of {run.grid.steps} steps"
    if trajectory.status == 0:
        return f"reached t = {t:.9g} s in {trajectory.steps} steps{_own_steps(stepper.statistics)}"
    unknown = without_value(run, trajectory.rows, events) if trajectory.status == NO_VALUE.number else []
    if sentence := ending(trajectory.status, stepper, unknown):
        taken = f"{trajectory.steps} of {run.grid.steps} steps{_own_steps(stepper.statistics)}"
        sentence = f"{sentence}, after {taken}"
        tried = next(item.advice for item in STATUSES if item.number == trajectory.status)
        if trajectory.status == ACCUMULATED.number and "least_interval" in sentence:
            tried = f"a shorter least_interval, or {tried}"
        return sentence if trajectory.status == STOPPED.number else f"{sentence}; try: {tried}"
    text = stepper.status_text(trajectory.status)
    if trajectory.status == CONTROLLER_FAILED:
        taken = f"stopped at t = {t:.9g} s, after {trajectory.steps} of {run.grid.steps} steps"
        fault, hint = failed_controller(stepper)
        return f"{taken}: {fault}; try: {hint}"
    _, q, v, a, _, z = (part[0] for part in states_of(trajectory.rows[-1:], model))
    last, behind = float(t), ""
    if events is not None and len(events) and events.t[-1] > last:  # the step that failed goes on from there
        *_, event = events
        last, behind = event.t, f", behind the event {event.name}"
        q, v, a, z = event.q, event.v, np.full_like(v, np.nan), event.z
        p = parameters_with(events, model, p, event.modes)
    block, already, cause = first_non_finite(model, last, (q, v, a, z), settings["step"], p, run.signals)
    block += behind if block else ""
    inertia = None if block else inertia_warning(model, q, p, trajectory.rows[0, 1 : 1 + model.nq], settings["step"])
    cause_of_step = inertia.text if inertia else fast_joint(model, float(t), q, v, p, settings["step"])
    details = (
        f"; the first block that is not finite is {block}" if block else f"; {cause_of_step}" if cause_of_step else ""
    )
    hint = inertia.hint if inertia else advice(run.method, trajectory.status, settings)
    times, positions = trajectory.rows[:, 0], trajectory.rows[:, 1 : 1 + model.nq]
    singular = None if block or cause_of_step else singular_ahead(model, times, positions, v, p, settings["step"])
    if singular:
        details = f"; {singular.text}"
        hint = way_past(run.method, settings["step"], at_start=len(times) == 1)
    if cause[0] and (by_method := unstable_growth(run, stepper.library, trajectory)):
        fault, hint = instability(by_method, run.method)
        details = f"; {fault}"
    elif cause[0]:
        details, hint = details + cause[0], cause[1]
        if hint == SMALLER_ANGLES and not _starts_far(run, trajectory):
            away = unbounded_growth(run, states_of(trajectory.rows, model))
            details = f"{details}; {away.text}" if away else details
            hint = away.hint if away else OTHER_FORCES
    elif already:
        hint = "other parameters, formulas or coordinates there: no smaller step helps"
    elif not (cause_of_step or singular) and (growth := own_growth(run, stepper.library, trajectory.rows)):
        details = f"{details}; {growth}"
        hint = (
            "the signs and sizes of forces, stiffnesses and gains, for it is the equations that diverge: no smaller"
            " step helps"
        )
    elif not (cause_of_step or singular) and (away := _grown(run, stepper, trajectory)):
        details, hint = f"{details}; {away.text}", away.hint
    if any(tells_strain(text) for text in run.corrections):  # the message says how much at the end
        hint = f"an initial state nearer to assembly, or lengths that fit, so that beams start unstrained; or {hint}"
    steps = f"{trajectory.steps} of {run.grid.steps} steps{_own_steps(stepper.statistics, model)}"
    return f"stopped at t = {t:.9g} s, after {steps}: {text}{details}; try: {hint}"


def _grown(run: Run, stepper: Stepper, trajectory: Trajectory) -> Finding | None:
    """Return a finding on a motion that grows without end, unless the growth is due to the method."""
    result = unbounded_growth(run, states_of(trajectory.rows, run.model))
    return None if result is None or unstable_growth(run, stepper.library, trajectory) else result


def _starts_far(run: Run, trajectory: Trajectory) -> bool:
    """Return whether initial angles and velocities alone lead to angles that are too large for their sines."""
    start, model = trajectory.rows[0], run.model
    span = float(trajectory.rows[-1, 0] - start[0]) + run.settings["step"]
    reach = np.abs(start[1 : 1 + model.nq]).max(initial=0.0)
    reach += span * np.abs(start[1 + model.nq : 1 + model.nq + model.nv]).max(initial=0.0)
    return bool(reach > _FAR * LARGEST_ANGLE)


def _own_steps(statistics: Mapping[str, int | float], model: CompiledModel | None = None) -> str:
    """Return the number of steps that the method chose, in words; with a model also the smallest step, and the
    component that required this step."""
    if not statistics.get("own_steps"):
        return ""
    text = f" ({statistics['own_steps']} of its own, {statistics['rejections']} taken again"
    if model is not None:
        name = (*model.v_names, *model.z_names)[int(statistics["hardest"])]
        smallest, where = statistics["smallest_step"], statistics["smallest_step_time"]
        text += f"; the smallest, {smallest:.3g} s at t = {where:.9g} s, for {name}"
    return f"{text})"


def end_of(run: FinishedRun) -> str:
    """Return the sentence on the end of a run."""
    return message_of(run.last_run, run.stepper, run.trajectory, run.events)


def _stopped(run: FinishedRun) -> Iterator[Finding]:
    if not run.complete:
        yield Finding.of(end_of(run), time=run.trajectory.rows[-1, 0])


def _checkpoint(run: FinishedRun) -> Iterator[Finding]:
    yield Finding.of(run.checkpoint)


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
    Check("stopped", _stopped, needs=(), severity=FAILURE),
    Check("checkpoint", _checkpoint, needs=("checkpoint",), severity=NOTE),
    Check("unstable", _unstable, needs=("complete", "fixed steps"), severity=FAILURE),
    Check("infinite_energy", _infinite_energy, severity=FAILURE, unless=("unstable",)),
    Check("broken_constraint", _broken_constraint, severity=FAILURE, unless=("unstable", "infinite_energy")),
)
#: Failures of runs that reached their end without following the equations.
FAULTS = ("unstable", "infinite_energy", "broken_constraint")
