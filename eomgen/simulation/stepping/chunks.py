"""The compiled time loop: in chunks of a tenth of a second, so that progress shows and Ctrl-C works, and step by step
for a simulator, with inputs that are held, that move, or that follow functions.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Protocol

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.progress import Interrupts, Progress
from eomgen.errors import UsageError
from eomgen.integrators.events import AT_EVENTS
from eomgen.simulation.stepping.inputs import HeldRows, InputRows
from eomgen.simulation.stepping.stepper import Log, Stepper
from eomgen.simulation.stepping.time_grid import TimeGrid
from eomgen.toolchain.library import Library

#: Seconds of work between two looks at progress and interrupts.
CHUNK_SECONDS = 0.1
#: Steps of the windows of which every row is kept to examine growth, independent of the recorded rows: see
#: ``instability``.
WINDOW = 16
_LARGEST_CHUNK = 1_000_000


class WritesCheckpoints(Protocol):
    """Interface of ``checkpoint.CheckpointWriter``."""

    def room(self, done: int) -> int | None: ...
    def look(self, stepper: Stepper, done: int, *, final: bool = False) -> None: ...


@dataclass(frozen=True)
class Trajectory:
    """The recorded rows of a run, and how it ended.

    Attributes
    ----------
    rows : (n, width): t, q, v, vdot, multipliers and z
    status : of the stepper at the end; 0: success
    interrupted : whether Ctrl-C ended the run
    steps : number of steps done
    failure : error of an input's function that ended the run
    middle, end : every row of a window in the middle of the run, and of the two windows at its end, the row before the
        first step of each included; None if not recorded, without ``middle`` in short runs
    events : logs of the events of the parts of the run
    modes : modes at the start; None: the modes in the parameters
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
    inputs: InputRows | None,
    progress: Progress | None = None,
    writer: WritesCheckpoints | None = None,
    *,
    windows: bool = True,
) -> Trajectory:
    """Run an initialized stepper to the end of its time grid, and return its trajectory.

    The first and the last good state are always recorded. Ctrl-C ends the run after the present chunk. The last
    checkpoint holds the state after the last whole step, from which a run goes on with the grid of a later end.

    Parameters
    ----------
    record_every : int
        Number of steps between two recorded rows.
    inputs : callable, optional
        From times (n,) to rows (n, nu); without this function the scene's formulas are evaluated in C.
    progress : callable, optional
        Called with the steps done and all steps after every chunk.
    writer : CheckpointWriter, optional
        Writes checkpoints of good states between chunks, and of the last good state unless a step failed.
    windows : bool
        Whether every row of the windows in the middle and at the end is kept as well.
    """
    recorder, pace = _RowRecorder(stepper, grid, record_every, inputs, windows), _ChunkSize(stepper)
    last_row, modes = None, stepper.modes
    at_once = writer is None and pace.chunk >= grid.whole - recorder.done  # too short for Ctrl-C to be useful
    with Interrupts(heeded=not at_once) as interrupted:
        status, failure = _whole_steps(recorder, pace, grid, inputs, progress, writer, interrupted)
        done = recorder.done
        stopped = interrupted.heard and done < grid.steps
        if writer is not None and status == 0:
            writer.look(stepper, done, final=True)
        if grid.rest and status == 0 and failure is None and not stopped:
            try:
                status, last_row = _last_step(stepper, grid, inputs)
                recorder.logs.append(stepper.new_events)
            except UsageError as error:
                failure = error
    if last_row is not None:
        done += 1
        recorder.append(last_row)
        if progress is not None:
            progress(done, grid.steps)
    elif recorder.last != done or status in AT_EVENTS:
        recorder.append(stepper.row)
    rows, middle, end = recorder.recorded_rows(done)
    return Trajectory(rows, status, stopped, done, failure, middle, end, list(filter(len, recorder.logs)), modes)


def _whole_steps(
    recorder: _RowRecorder,
    pace: _ChunkSize,
    grid: TimeGrid,
    inputs: InputRows | None,
    progress: Progress | None,
    writer: WritesCheckpoints | None,
    interrupted: Interrupts,
) -> tuple[int, UsageError | None]:
    """Take the whole steps of the grid; return the status, and the error of the input that ended the steps, None
    without one."""
    stepper, status = recorder.stepper, 0
    while (done := recorder.done) < grid.whole and status == 0 and not interrupted.heard:
        size = min(pace.chunk, grid.whole - done)  # a run of all rows has the rows of the windows
        window, size = (None, size) if recorder.every == 1 else recorder.part(size)
        if writer is not None and (room := writer.room(done)) is not None:
            size = min(size, room)
        began = time.perf_counter()
        try:
            table = None if inputs is None else rows_from(stepper, inputs, done, size, stepper.origin)
        except UsageError as error:  # continue to the last step before the step at which the input fails
            if size > 1:
                pace.chunk = size // 2
                continue
            return status, error
        status = recorder.steps(size, window, table)
        elapsed = time.perf_counter() - began
        if writer is not None and status == 0:
            writer.look(stepper, recorder.done)
        if progress is not None:
            progress(recorder.done, grid.steps)
        if status == 0 and recorder.done == done:
            raise RuntimeError("the stepper made no step and gave no reason")
        pace.adapt(elapsed, size, recorder.done - done)
    return status, None


class _ChunkSize:
    """Number of steps of the next chunk, ``chunk``, chosen so that a chunk takes about a tenth of a second. The time of
    a step is taken from the last chunk, or at first from an earlier run with the same settings."""

    def __init__(self, stepper: Stepper) -> None:
        self.plan, self.step = stepper.plan, stepper.step_size
        self.settings = stepper.settings[1:].tobytes()
        pace = self.plan.pace if self.plan.paced_by == self.settings else math.inf
        if self.step > self.plan.paced_step:  # a row of an adaptive method may cost so much more
            pace *= self.step / self.plan.paced_step
        # the steps of an earlier run may have cost less
        self.chunk = max(1, min(_LARGEST_CHUNK, int(0.25 * CHUNK_SECONDS / pace)))

    def adapt(self, seconds: float, size: int, steps: int) -> None:
        """Adapt the chunk size to a measured duration, s, of ``steps`` steps in a chunk of ``size`` steps."""
        pace = max(seconds, 1e-9) / max(steps, 1)
        self.plan.pace, self.plan.paced_step, self.plan.paced_by = pace, self.step, self.settings
        self.chunk = max(1, min(_LARGEST_CHUNK, 4 * max(size, self.chunk), int(CHUNK_SECONDS / pace)))


class _RowRecorder:
    """The record of a run while it is stepped: every `every`-th row, and all rows of windows in the middle and at the
    end.

    Attributes
    ----------
    done, begin, last : number of steps so far, at the beginning of the run, and at the last recorded row
    windows, kept : first and last step of each window, and its rows
    logs : events of each call of the stepper
    """

    def __init__(self, stepper: Stepper, grid: TimeGrid, every: int, inputs: InputRows | None, windows: bool) -> None:
        """Begin the record with the row of the present state. `every` is the number of steps between rows; `inputs`
        gives rows of inputs for times; `windows`: whether all rows of windows are kept."""
        self.stepper, self.every = stepper, every
        self.begin = self.last = self.done = stepper.count
        expected, width = 3 + (grid.whole - self.begin) // every, stepper.sizes["row"]
        self.logs: list[Log] = []
        held = inputs if isinstance(inputs, HeldRows) and not self.begin else None
        first = stepper.row if held is None else stepper.row_with(held.over(len(stepper.input_times)))
        self._rows, self._used = np.empty((expected, width)), 1  # the system gives memory to rows that are written
        self._rows[0] = first
        self.windows = _windows(self.begin, grid.whole) if windows else []
        self.kept: list[list[Array]] = [[] for _ in self.windows]

    def append(self, rows: Array) -> None:
        """Record a row (width,) or rows (n, width)."""
        end = self._used + (len(rows) if rows.ndim > 1 else 1)
        self._rows[self._used : end] = rows
        self._used = end

    def part(self, size: int) -> tuple[int | None, int]:
        """Return the number of the window in which the next step lies, None outside, and how many steps lie on the same
        side. At most `size` steps, up to the next beginning or end of a window."""
        if not self.windows:
            return None, size
        done = self.done
        window = next((number for number, (begin, end) in enumerate(self.windows) if begin <= done < end), None)
        edge = min(begin for begin, _ in self.windows if begin > done) if window is None else self.windows[window][1]
        return window, min(size, edge - done)

    def steps(self, size: int, window: int | None, table: Array | None) -> int:
        """Take `size` steps, record their rows and events, and return the status of the stepper. `window` is the number
        of the window in which all these steps lie; None outside. `table` has the rows of inputs."""
        stepper = self.stepper
        before, every = self.done, self.every if window is None else 1
        if window is not None and not self.kept[window]:
            self.kept[window].append(stepper.row[np.newaxis])
        record = np.empty((size // every + 1, stepper.sizes["row"]))
        status, count = stepper.run(size, every, table, record)
        self.done = stepper.count
        if stepper.plan.entry is not None:
            self.logs.append(stepper.new_events)
        rows = record[:count]
        if window is not None:
            self.kept[window].append(rows)
            rows = rows[-(before + 1) % self.every :: self.every]
        if len(rows):
            self.append(rows)
            self.last = self.done - self.done % self.every
        return status

    def recorded_rows(self, done: int) -> tuple[Array, Array | None, Array | None]:
        """Return the recorded rows (n, width), and all rows of the window in the middle and of the one at the end, or
        None. `done` is the number of steps of the whole run."""
        recorded, kept = self._rows[: self._used], self.kept
        if not self.windows:
            return recorded, None, None
        if self.every == 1:
            first = self.begin
            kept = [[recorded[begin - first : end - first + 1]] if begin < done else [] for begin, end in self.windows]
        *middle, last = (np.concatenate(rows) if len(rows) > 1 else rows[0] if rows else None for rows in kept)
        return recorded, middle[0] if middle else None, last


def _windows(done: int, whole: int) -> list[tuple[int, int]]:
    """Return the first and last steps of the windows in which every row is recorded, for a run from step ``done`` to
    its last whole step ``whole``."""
    last = max(done, whole - 2 * WINDOW)
    half = done + (whole - done) // 2
    return [(half, half + WINDOW)] * (half + WINDOW < last) + [(last, whole)]


def _last_step(stepper: Stepper, grid: TimeGrid, inputs: InputRows | None) -> tuple[int, Array | None]:
    """Take the last step of a time grid, which is shorter than the others. Returns the status and the row (width,) at
    the end; None in place of the row if the step failed. The setting of the step size is restored."""
    table = None if inputs is None else np.ascontiguousarray(inputs(stepper.t + grid.rest * stepper.input_times))
    stepper.settings[0] = grid.rest
    record = np.empty((1, stepper.sizes["row"]))
    status, _ = stepper.run(1, 1, table, record)
    stepper.settings[0] = grid.step
    record[0, 0] = grid.end
    return status, None if status else record[0]


def rows_from(stepper: Stepper, inputs: InputRows, done: int, size: int, start: float) -> Array:
    """Return rows of inputs (n, nu) for `size` steps after `done` steps, from a function of times. The first row has
    the inputs of the stepper's present state if the stepper keeps these. `start` is the time of step 0, s."""
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


#: Number and time in s of each event that came, in order.
Events = list[tuple[int, float]]


class CompiledSteps:
    """Calls of a library's steps on the memory of a stepper.

    Attributes
    ----------
    u : (nu,) inputs of ``one``, and after ``move`` the inputs at the end of the last step
    one, free : one step with the inputs u, and one with the scene's formulas; give a status
    events : events of the last call of ``move`` or ``follow``
    """

    def __init__(self, library: Library, stepper: Stepper, nu: int) -> None:
        self._stepper = stepper
        self._time, self._last_step = stepper.state, stepper.state[stepper.places["step"]]
        self.u, self._end = np.zeros(nu), np.zeros(nu)
        pointer = partial(library.ffi.from_buffer, "double[]")
        memory = [pointer(part) for part in (stepper.parameters, stepper.settings, stepper.state, stepper.workspace)]
        self._call = partial(library.lib.eomgen_run_inputs, *memory)
        self._none = library.ffi.NULL
        self._first, self._last = (pointer(part) if nu else self._none for part in (self.u, self._end))
        self.events: Events = []
        self.one = partial(self._call, 1, self._first, self._none)
        self.free = partial(self._call, 1, self._none, self._none)

    def move(self, n: int, first: Array, last: Array | None) -> int:
        """Take up to n steps with inputs (nu,) that go linearly from `first` to `last`, or are held at `first` if last
        is None. Returns the status of the stepper, 0 if all is well; ``u`` then has the inputs at the end, ``events``
        the events."""

        def part(done: int, size: int) -> int:
            self.u[:], self._end[:] = between(first, last, done / n), between(first, last, (done + size) / n)
            return int(self._call(size, self._first, self._none if last is None else self._last))

        done, status = self._parts(n, part)
        self.u[:] = between(first, last, done / n)
        return status

    def follow(self, n: int, driven: InputRows | None) -> int:
        """Take up to n steps with the inputs (n, nu) that a function gives for times (n,); None: by the scene's
        formulas. Returns the status of the stepper, 0 if all is well; ``events`` has the events of these steps."""
        return self._parts(n, lambda _, size: self._some(size, driven))[1]

    def _parts(self, n: int, part: Callable[[int, int], int]) -> tuple[int, int]:
        """Take up to n steps in parts, since compiled code hears no Ctrl-C. Returns the number of steps and the status
        of the last part.
        ``part`` takes the number of steps done and the size of the next part, and returns its status."""
        done, status = 0, 0
        self.events = []
        while done < n and not status:
            before = self._count
            status = part(done, min(n - done, 10_000))
            done += self._count - before
            self.events += self._events
        return done, status

    def _some(self, n: int, driven: InputRows | None) -> int:
        if driven is None:
            return int(self._call(n, self._none, self._none))
        stepper, count = self._stepper, self._count
        times = stepper.times_of(count, n, stepper.origin if count else float(self._time[0]))
        return stepper.run(n, 0, np.ascontiguousarray(driven(times)), None)[0]

    @property
    def _count(self) -> int:
        """Steps on the present grid; 0 if the next step begins another grid."""
        return self._stepper.count if abs(self._last_step[0]) == self._stepper.step_size else 0

    @property
    def _events(self) -> Events:
        """Events of the last call."""
        log = self._stepper.new_events
        return [(int(k), float(t)) for k, t in zip(log["event"], log["t"], strict=True)] if len(log) else []


def between(first: Array, last: Array | None, share: float) -> Array:
    """Return the inputs after a share of the way from first to last, or the held inputs if last is None."""
    return first if last is None else (1.0 - share) * first + share * last
