"""Examinations of a finished run that several checks, the error estimate or a run with bounded steps ask for."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from eomgen.base.arrays import Array
from eomgen.results.finding import Finding
from eomgen.simulation.judgement.finished_run import FinishedRun, laws_between_steps
from eomgen.simulation.stepping.states import states_of

if TYPE_CHECKING:
    from eomgen.simulation.judgement.finished_run import UnseenLaw


def searches_left_out(run: FinishedRun) -> str:
    """Return the searches within steps that are left out with the error estimate, in words."""
    from eomgen.products.doubts.fast_motions import varies_with_time  # noqa: PLC0415  # on request

    model = run.run.model
    moves = model.nz or (model.nv and model.library.layout["facts"]["velocity_forces"])
    searches = {
        "laws that act between the steps": bool(laws_between_steps(run.run)),
        "laws of time that are faster than the steps": varies_with_time(run.run),
        "pairs of events": run.events is not None,
        "rates that the steps do not resolve": bool(moves) and not run.run.method.chooses_steps,
    }
    *names, last = ["", *(name for name, made in searches.items() if made)]
    names = [*filter(None, (", ".join(names[1:]), last))]
    return f", and with it the search for {' and '.join(names)}" if names else ""


def unresolved_motion(run: FinishedRun) -> str:
    """Return a sentence on an excited motion that is too fast for the steps; empty if there is none."""
    from eomgen.products.doubts import fast_motions  # noqa: PLC0415  # on request

    statistics, trajectory = run.statistics, run.trajectory
    taken = statistics.get("own_steps") or statistics.get("expansions") or max(trajectory.steps, 1)
    average = (float(run.states.t[-1]) - run.run.grid.start) / taken
    return fast_motions.unresolved_motion(run.run, trajectory.rows, average, run.events, run.changes, run.jumps)


def law_between_steps(run: FinishedRun) -> UnseenLaw | None:
    """Return a law that acts between the steps of a run with an error estimate."""
    from eomgen.products.doubts.unseen_laws import unseen_law  # noqa: PLC0415  # on request

    library, rows, inputs = run.stepper.library, run.trajectory.rows, run.prescribed.u
    ends, changes = run.parts.ends, run.changes
    known = library, rows, run.present, run.statistics, ends, changes, inputs
    return unseen_law(run.run, *known, lambda: run.error.relative if run.error.available else math.inf)


def examined_share(run: FinishedRun) -> float:
    """Return the share of the run in which laws between the steps were looked for."""
    from eomgen.simulation.accuracy.step_path import pieces  # noqa: PLC0415  # on request

    if not run.run.method.chooses_steps or not laws_between_steps(run.run):
        return 1.0
    rows = run.trajectory.rows
    repeated = pieces(run.run, rows, run.statistics)
    return min(1.0, repeated.number * repeated.duration / float(rows[-1, 0] - rows[0, 0]))


def unseen_event(run: FinishedRun) -> Finding | None:
    """Return a finding on an event of which pairs of roots lie within single steps; None if errors are not
    estimated."""
    from eomgen.products.doubts.unseen_events import unseen_events  # noqa: PLC0415  # on request

    if run.events is None or not run.estimated:
        return None
    library, rows, known = run.stepper.library, run.trajectory.rows, run.stepper.layout["method"]["events"]
    counts, changes = run.events.counts, run.changes
    return unseen_events(run.run, library, rows, run.present, run.statistics, known["rows"], counts, changes)


def between_rows(run: FinishedRun) -> tuple[Array, Array]:
    """Return q and z at the rows and, if known, at the ends of the steps between rows."""
    from eomgen.simulation.accuracy.step_path import step_rows  # noqa: PLC0415  # on request

    rows = run.trajectory.rows
    taken = step_rows(run.run, run.stepper.library, rows, run.present, run.statistics)
    states = run.states if taken is None else states_of(np.concatenate([rows, taken.rows]), run.run.model)
    return states.q, states.z
