"""The compiled time loop, run in chunks of a tenth of a second so that progress shows and Ctrl-C works."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.progress import Interrupts, Progress
from eomgen.errors import UsageError
from eomgen.integrators.events import AT_EVENTS
from eomgen.simulation.stepping.event_log import Log
from eomgen.simulation.stepping.inputs import HeldRows
from eomgen.simulation.stepping.stepper import Stepper
from eomgen.simulation.stepping.time_grid import TimeGrid

#: Seconds of work between two looks at progress and interrupts.
CHUNK_SECONDS = 0.1
#: Steps of the windows of which every row is kept to examine growth, independent of the recorded rows: see
#: ``instability``.
WINDOW = 16
#: Part of ``CHUNK_SECONDS`` that a first chunk may take by the pace of an earlier run, whose steps may have cost less.
_CAUTION = 0.25
_LARGEST_CHUNK = 1_000_000


class WritesCheckpoints(Protocol):
    """Interface of ``checkpoint.CheckpointWriter``."""

    def room(self, done: int) -> int | None: ...
    def look(self, stepper: Stepper, done: int, *, final: bool = False) -> None: ...


@dataclass(frozen=True)
class Trajectory:
    """Rows (t, q, v, vdot, multipliers, z) of a run, how it ended (status 0: well), and whether it was interrupted.

    ``middle`` and ``end`` hold every row of a window in the middle of the run and of the two windows at its end, the
    row before the first step of each included; ``middle`` is empty in short runs, and both are in runs that did not
    come so far. ``events`` are the logs of its parts, ``modes`` the modes at their start; None: the modes in the
    parameters.
    """

    rows: Array
    status: int
    interrupted: bool
    steps: int
    failure: UsageError | None = None
    middle: Array | None = None
    end: Array | None = None
    events: Sequence[Log] = ()
    modes: Array | None = None


def run_chunks(
    stepper: Stepper,
    grid: TimeGrid,
    record_every: int,
    inputs: Callable[[Array], Array] | None,
    progress: Progress | None = None,
    writer: WritesCheckpoints | None = None,
) -> Trajectory:
    """Run an initialized stepper to the end of its time grid; the first and the last good state are always recorded.

    The last checkpoint holds the state after the last whole step, from which a run goes on with the grid of a later
    end.

    Parameters
    ----------
    inputs : callable, optional
        From times (n,) to rows (n, nu); without it the scene's formulas are evaluated in C.
    progress : callable, optional
        Called with the steps done and all steps after every chunk.
    writer : CheckpointWriter, optional
        Writes checkpoints of good states between chunks, and of the last one unless a step failed.
    """
    start, plan = stepper.origin, stepper.plan
    width = stepper.sizes["row"]
    first = done = stepper.count
    held = inputs if isinstance(inputs, HeldRows) and not done else None
    pieces = [(stepper.row if held is None else stepper.row_with(held.over(len(stepper.input_times))))[np.newaxis]]
    settings, step = stepper.settings[1:].tobytes(), stepper.step_size
    pace = plan.pace if plan.paced_by == settings else math.inf
    if step > plan.paced_step:  # a row of a method that chooses its steps may cost so much more
        pace *= step / plan.paced_step
    status, chunk = 0, max(1, min(_LARGEST_CHUNK, int(_CAUTION * CHUNK_SECONDS / pace)))
    last_recorded = done
    windows = _windows(done, grid.whole)
    whole = record_every == 1  # every row of the windows is one of the run
    kept: list[list[Array]] = [[] for _ in windows]
    failure: UsageError | None = None
    logs: list[Log] = []
    modes = stepper.modes
    at_once = writer is None and chunk >= grid.whole - done  # then it is too short for a Ctrl-C to be kept from it
    with Interrupts(heeded=not at_once) as interrupted:
        while done < grid.whole and status == 0 and not interrupted.heard:
            inside, size = None, min(chunk, grid.whole - done)
            if not whole:
                inside = next((number for number, (begin, end) in enumerate(windows) if begin <= done < end), None)
                edge = windows[inside][1] if inside is not None else min(begin for begin, _ in windows if begin > done)
                size = min(chunk, edge - done)
            if writer is not None and (room := writer.room(done)) is not None:
                size = min(size, room)
            began = time.perf_counter()
            table = None
            if inputs is not None:
                try:
                    table = rows_from(stepper, inputs, done, size, start)
                except UsageError as error:  # go on to the last step before the one at which the input fails
                    if size > 1:
                        chunk = size // 2
                        continue
                    failure = error
                    break
            before, every = done, record_every if inside is None else 1
            if inside is not None and not kept[inside]:
                kept[inside].append(stepper.row[np.newaxis])
            record = np.empty((size // every + 1, width))
            status, rows = stepper.run(size, every, table, record)
            done = stepper.count
            if plan.entry is not None:
                logs.append(stepper.new_events)
            new_rows = record[:rows]
            if inside is not None:
                kept[inside].append(new_rows)
                new_rows = new_rows[-(before + 1) % record_every :: record_every]
            if len(new_rows):
                pieces.append(new_rows.copy() if len(new_rows) < len(record) // 2 else new_rows)
                last_recorded = done - done % record_every
            elapsed = time.perf_counter() - began
            if writer is not None and status == 0:
                writer.look(stepper, done)
            if progress is not None:
                progress(done, grid.steps)
            if status == 0 and done == before:
                raise RuntimeError("the stepper made no step and gave no reason")
            pace = max(elapsed, 1e-9) / max(done - before, 1)
            plan.pace, plan.paced_step, plan.paced_by = pace, step, settings
            chunk = max(1, min(_LARGEST_CHUNK, 4 * max(size, chunk), int(CHUNK_SECONDS / pace)))
        stopped = interrupted.heard and done < grid.steps
        if writer is not None and status == 0:
            writer.look(stepper, done, final=True)
        last_row = None
        if grid.rest and status == 0 and failure is None and not stopped:
            try:
                status, last_row = _last_step(stepper, grid, inputs)
                logs.append(stepper.new_events)
            except UsageError as error:
                failure = error
    if last_row is not None:
        done += 1
        pieces.append(last_row[np.newaxis])
        if progress is not None:
            progress(done, grid.steps)
    elif last_recorded != done or status in AT_EVENTS:
        pieces.append(stepper.row[np.newaxis])
    recorded = np.concatenate(pieces)
    if whole:
        kept = [[recorded[begin - first : end - first + 1]] if begin < done else [] for begin, end in windows]
    *middle, last = (np.concatenate(rows) if len(rows) > 1 else rows[0] if rows else None for rows in kept)
    return Trajectory(
        recorded,
        status,
        stopped,
        done,
        failure,
        middle[0] if middle else None,
        last,
        [log for log in logs if len(log)],
        modes,
    )


def _windows(done: int, whole: int) -> list[tuple[int, int]]:
    """Return the steps of the windows whose every row is kept, of a run from one step to its last whole one."""
    last = max(done, whole - 2 * WINDOW)
    half = done + (whole - done) // 2
    return [(half, half + WINDOW)] * (half + WINDOW < last) + [(last, whole)]


def _last_step(stepper: Stepper, grid: TimeGrid, inputs: Callable[[Array], Array] | None) -> tuple[int, Array | None]:
    """Take the step that is shorter than the others. Returns the status and the row at the end, None if the step
    failed."""
    table = None if inputs is None else np.ascontiguousarray(inputs(stepper.t + grid.rest * stepper.input_times))
    stepper.settings[0] = grid.rest
    record = np.empty((1, stepper.sizes["row"]))
    status, _ = stepper.run(1, 1, table, record)
    stepper.settings[0] = grid.step
    record[0, 0] = grid.end
    return status, None if status else record[0]


def rows_from(stepper: Stepper, inputs: Callable[[Array], Array], done: int, size: int, start: float) -> Array:
    """Return rows of inputs (n, nu) for a chunk of steps; the first is the one that the stepper's last step ended
    with."""
    if isinstance(inputs, HeldRows):
        table = inputs.over(size * (len(stepper.input_times) - 1) + 1)
        if done and (before := stepper.inputs) is not None:
            table = table.copy()
            table[0] = before
        return table
    before = stepper.inputs
    times = stepper.times_of(done, size, start)
    if before is None:
        return np.ascontiguousarray(inputs(times))
    return np.concatenate([before[np.newaxis], inputs(times[1:])])
