"""Checks beyond error estimates of the steps: large deflections, growth, fast forces, missed events, outputs."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

from eomgen.results.finding import FAILURE, NOTE, Finding
from eomgen.simulation.judgement.check import ANY_FAILURE, Check
from eomgen.simulation.judgement.doubtful_calls import doubtful_call, exchanged_times
from eomgen.simulation.judgement.doubts import LARGE_ERROR
from eomgen.simulation.judgement.failures import FAULTS
from eomgen.simulation.judgement.fast_laws import fast_laws
from eomgen.simulation.judgement.finished_run import FinishedRun
from eomgen.simulation.judgement.singular_positions import not_followed, passages
from eomgen.simulation.judgement.spring_lengths import passed_springs
from eomgen.simulation.judgement.turned_elements import turned_elements
from eomgen.simulation.judgement.unbounded_growth import unbounded_growth
from eomgen.simulation.judgement.undefined_outputs import undefined_outputs
from eomgen.simulation.stepping.settings import followed_laws


def _large_deflection(run: FinishedRun) -> Iterator[Finding]:
    if (bending := run.bending) is not None:
        yield Finding.of(str(bending), bending.shortening, bending.time)


def _impossible_deflection(run: FinishedRun) -> bool:
    return run.bending is not None and not run.bending.possible


def _turned_element(run: FinishedRun) -> Iterator[Finding]:
    finding = turned_elements(run.run.model, run.states.t, run.states.q, run.run.parameters)
    if finding is not None:
        yield finding


def _unbounded_growth(run: FinishedRun) -> Iterator[Finding]:
    finding = unbounded_growth(run.run, run.states)
    if finding is not None:
        yield finding


def _unresolved_motion(run: FinishedRun) -> Iterator[Finding]:
    if run.error.unresolved:
        yield Finding.of(run.error.unresolved)


def _missed_event(run: FinishedRun) -> Iterator[Finding]:
    hint = f"a step smaller than {run.settings['step']:.3g} s, in each of which events are looked for"
    if run.unseen_events is not None:
        yield replace(run.unseen_events, hint=hint)
    elif run.error.passed_over and not run.error.relative > LARGE_ERROR:
        yield Finding(text=run.error.passed_over, hint=hint)


def _fast_law(run: FinishedRun) -> Iterator[Finding]:
    finding = fast_laws(run.run, run.stepper.input_times, run.parts.ends, run.states, run.present)
    if finding is not None:
        yield finding


def _unseen_law(run: FinishedRun) -> Iterator[Finding]:
    if run.unseen_law is not None:
        yield run.unseen_law


def _partly_examined(run: FinishedRun) -> Iterator[Finding]:
    if run.examined < 1.0:
        part = f"{100.0 * run.examined:.2g} % of the run"
        yield Finding(
            text=f"laws that act between the steps were looked for in {part} only: it has thousands of steps to a row",
            hint="shorter rows, or a method of fixed steps",
            value=run.examined,
        )


def _bounded_steps(run: FinishedRun) -> Iterator[Finding]:
    if law := run.run.bounded_for:
        bound = run.settings["largest_step"]
        yield Finding.of(f"the steps are at most {bound:.3g} s, since steps by the tolerance pass over {law}", bound)


def _unknown_error(run: FinishedRun) -> Iterator[Finding]:
    if run.error.remedy:
        yield Finding(text=f"the discretisation error is not known: {run.error.reason}", hint=run.error.remedy)


def _passed_spring(run: FinishedRun) -> Iterator[Finding]:
    finding = passed_springs(run.run.model, run.states.t, run.states.q, run.run.parameters)
    if finding is not None:
        yield finding


def _undefined_output(run: FinishedRun) -> Iterator[Finding]:
    finding = undefined_outputs(run.states.t, run.outputs)
    if finding is not None:
        yield finding


def _singular_passage(run: FinishedRun) -> Iterator[Finding]:
    count = int(run.statistics.get("singular_passages", 0))
    if passed := passages(count):
        tolerance = run.settings["tolerance"] if run.run.method.chooses_steps else math.inf
        yield Finding.of(f"{passed}{not_followed(run.error.relative, tolerance)}", count)


def _controller_cost(run: FinishedRun) -> Iterator[Finding]:
    if run.stepper.controllers is not None and (cost := run.stepper.controllers.cost(run.wall)):
        yield Finding.of(cost)


def _model_limits(run: FinishedRun) -> Iterator[Finding]:
    yield from map(Finding.of, run.run.model.library.layout["warnings"])


def _method_limits(run: FinishedRun) -> Iterator[Finding]:
    yield from map(Finding.of, run.run.method.warnings(bool(run.run.model.multipliers)))


def _steep_law(run: FinishedRun) -> Iterator[Finding]:
    owner = run.run
    yield from map(Finding.of, followed_laws(owner.model, owner.method, owner.parameters, owner.grid)[1])


def _exchanged_times(run: FinishedRun) -> Iterator[Finding]:
    yield from map(Finding.of, exchanged_times(run.run.grid))


def _doubtful_call(run: FinishedRun) -> Iterator[Finding]:
    yield from map(Finding.of, doubtful_call(run.run.model, run.run.grid, run.run.signals.given, run.run.parameters))


ROWS = (
    Check(
        "large_deflection",
        _large_deflection,
        ("complete", "modal beams"),
        severity=FAILURE,
        fails=_impossible_deflection,
        unless=(ANY_FAILURE,),
    ),
    Check("turned_element", _turned_element, ("two rows", "exact beams"), severity=FAILURE),
    Check("unbounded_growth", _unbounded_growth, unless=FAULTS),
    Check("unknown_error", _unknown_error, unless=(ANY_FAILURE,)),
    Check("unresolved_motion", _unresolved_motion, unless=(ANY_FAILURE,)),
    Check("missed_event", _missed_event, ("complete", "events"), unless=(ANY_FAILURE,)),
    Check("fast_law", _fast_law, ("complete", "two rows")),
    Check("unseen_law", _unseen_law, ("complete", "two rows"), unless=("fast_law",)),
    Check("partly_examined", _partly_examined, ("complete", "two rows"), severity=NOTE, unless=("unseen_law",)),
    Check("bounded_steps", _bounded_steps, severity=NOTE),
    Check("passed_spring", _passed_spring, ("complete", "two rows", "lines")),
    Check("undefined_output", _undefined_output, ("complete", "outputs")),
    Check("singular_passage", _singular_passage, ("complete", "constraints"), severity=NOTE),
    Check("controller_cost", _controller_cost, ("complete", "controllers"), severity=NOTE),
    Check("model_limits", _model_limits, ()),
    Check("method_limits", _method_limits, ()),
    Check("steep_law", _steep_law, ()),
    Check("exchanged_times", _exchanged_times, ("begun",)),
    Check("doubtful_call", _doubtful_call, ("begun",), severity=NOTE, said=False),
)
