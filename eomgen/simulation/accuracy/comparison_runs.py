"""Runs of the same motion at other steps or tolerances, on rows that all of them have with the run itself."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.progress import Progress
from eomgen.errors import UsageError
from eomgen.integrators.events import STOPPED
from eomgen.results.events import Events
from eomgen.simulation.stepping.chunks import run_chunks
from eomgen.simulation.stepping.events import parameters_over, table_of
from eomgen.simulation.stepping.run import Run
from eomgen.simulation.stepping.stepper import Stepper
from eomgen.simulation.stepping.time_grid import time_grid
from eomgen.toolchain.library import Library

#: Rows that are compared at most, the last one aside.
MOST_ROWS = 1000
#: Part of a bound on own steps that bounds these in shorter steps of the grid, at least.
_LEAST_BOUND = 0.125
#: Times of rows agree within this part of a step.
SAME_TIME = 1e-4


@dataclass(frozen=True)
class Span:
    """The compared part of a run: rows at multiples of an interval from a first row on, and the last row.

    Attributes
    ----------
    rows, parameters : (n, width), and the parameters there, (np,) or (n, np)
    stride : steps of the run between them
    steps : of the run over the span
    """

    rows: Array
    parameters: Array
    stride: int
    steps: int


@dataclass(frozen=True)
class Comparison:
    """Rows of a comparison run, the parameters there and its events; why it came no further, empty at the end or an
    event; the counts of its stepper."""

    rows: Array
    parameters: Array
    stopped: str = ""
    interrupted: bool = False
    events: Events | None = None
    statistics: Mapping[str, int | float] = field(default_factory=dict)


def span_of(run: Run, rows: Array, parameters: Array) -> Span:
    """Return the compared part of a run with given rows, (n, width), and parameters there, (np,) or (n, np).

    Rows lie at multiples of the interval of recording, but for the first one of a resumed run and the last one.
    """
    step, every, times = run.settings["step"], min(run.every, run.grid.steps + 1), rows[:, 0]
    numbers = np.rint((times - run.grid.start) / step).astype(np.int64)
    first, last = 1 if numbers[0] % every and len(times) > 2 else 0, len(times) - 1
    steps = int(numbers[last] - numbers[first])
    stride = every * max(1, math.ceil(steps / every / MOST_ROWS))
    chosen = np.append(np.arange(first, last, stride // every), last)
    return Span(rows[chosen], parameters if parameters.ndim == 1 else parameters[chosen], stride, steps)


def comparison_run(
    run: Run,
    library: Library,
    span: Span,
    *,
    multiple: float = 1.0,
    tolerance: float | None = None,
    every: int | None = None,
    progress: Progress | None = None,
) -> Comparison:
    """Run over a span with another step or tolerance; record rows at the common times of this run and the span.

    Parameters
    ----------
    multiple : ratio of the steps, as 2, 4 or 1/2; relative to the span if the run's step is longer than the span
    every : steps between the rows; by default the common rows
    """
    model = run.model
    changed = {} if tolerance is None else {"tolerance": tolerance}
    begin, start, end = span.rows[0], float(span.rows[0, 0]), float(span.rows[-1, 0])
    settings = {**run.settings, "step": min(run.settings["step"], end - start) * multiple, **changed}
    if "largest_step" in settings:
        settings["largest_step"] *= min(max(multiple, _LEAST_BOUND), 1.0)
    p = span.parameters if span.parameters.ndim == 1 else span.parameters[0]
    q, v, z = begin[1 : 1 + model.nq], begin[1 + model.nq : 1 + model.nq + model.nv], begin[len(begin) - model.nz :]
    try:
        grid = time_grid(start, end, settings["step"], library.real)
        stepper = Stepper(library, settings, p, run.controllers)
        first = (grid.step if grid.whole else grid.rest) * stepper.input_times
        table = run.driven(start + first) if run.driven else None
        status = stepper.initialize(start, q, v, table, z)
        if status:
            return Comparison(span.rows[:0], p, stepper.status_text(status))
        whole = max(1, round(multiple))
        every = min(every or round(math.lcm(span.stride, whole) / multiple), grid.steps + 1)
        result = run_chunks(stepper, grid, every, run.driven, progress)
    except UsageError as error:
        return Comparison(span.rows[:0], p, str(error.problems[0]))
    reason = stepper.status_text(result.status) if result.status not in (0, STOPPED.number) else ""
    times = result.rows[:, 0]
    events = table_of(result, stepper, p)
    present = parameters_over(events, model, p, times)
    stopped = reason or str(result.failure or "")
    return Comparison(result.rows, present, stopped, result.interrupted, events, stepper.statistics)


def counted(progress: Progress | None, before: int, total: int) -> Progress | None:
    """Return a report of progress in which other steps came before, of so many in all."""
    if progress is None:
        return None
    return lambda done, _: progress(before + done, max(total, before + done))
