"""The compiled time loop, run in chunks of a tenth of a second so that progress shows and Ctrl-C works."""

from __future__ import annotations

import math
import signal
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import FrameType
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from eomgen.arrays import Array
from eomgen.errors import UsageError
from eomgen.integrators.events import AT_EVENTS
from eomgen.integrators.stepper_layout import STEPPER_SIZES, row_layout, state_layout, statistics_kinds
from eomgen.progress import Progress
from eomgen.simulation.controllers import Controllers
from eomgen.simulation.event_log import Log, entry_type
from eomgen.simulation.inputs import HeldRows
from eomgen.simulation.time_grid import TimeGrid
from eomgen.toolchain.library import Library

#: Seconds of work between two looks at progress and interrupts.
CHUNK_SECONDS = 0.1
#: Steps of the windows whose every row is kept for a look at how the motion grows, whatever is recorded: see
#: ``growth``.
WINDOW = 16
#: Part of ``CHUNK_SECONDS`` that a first chunk may take by the pace of an earlier run, whose steps may have cost less.
_CAUTION = 0.25
_LARGEST_CHUNK = 1_000_000


class WritesCheckpoints(Protocol):
    """Interface of ``checkpoint.CheckpointWriter``."""

    def room(self, done: int) -> int | None: ...
    def look(self, stepper: Stepper, done: int, *, final: bool = False) -> None: ...


class StepperPlan:
    """What all steppers of a library have in common, read from its layout once.

    Attributes
    ----------
    sizes : by the names of ``STEPPER_SIZES``
    places, row_places : slices of the quantities of the flat state and of rows
    counted : C types of the statistics
    entry : of the log of events; None without events
    input_times : times of the rows of inputs of a step, in steps
    pace : s, what a step took at last; infinite before the first one
    paced_step, paced_by : of that run, the size of its steps, and its settings as bytes: a tolerance may change the
        cost of rows much
    """

    def __init__(self, library: Library) -> None:
        method: Mapping[str, Any] = library.layout["method"]
        self.sizes = {name: int(library.lib.eomgen_stepper_size(k)) for k, name in enumerate(STEPPER_SIZES)}
        self.places, self.row_places, self.counted = state_layout(method), row_layout(method), statistics_kinds(method)
        self.entry = entry_type(library.layout, library.real) if "events" in method else None
        self.input_times = np.array(method.get("input_times", [0.0, 1.0]))
        self.input_times.setflags(write=False)
        self.nz = int(library.layout["sizes"]["z"])
        self.pace, self.paced_step, self.paced_by = math.inf, 1.0, b""


def plan_of(library: Library) -> StepperPlan:
    """Return the plan of a library's steppers, made when it is first asked for."""
    if "stepper" not in library.kept:
        library.kept["stepper"] = StepperPlan(library)
    plan: StepperPlan = library.kept["stepper"]
    return plan


class Stepper:
    """The stepper of a library with its memory: settings, state and workspace.

    Parameters
    ----------
    library : Library
        Built with a method.
    settings : mapping from name to number
        In the order of ``integrators.stepper_layout.default_settings``.
    parameters : (np,) array
    controllers : Controllers, optional
        The caller's functions, which samples call.
    """

    def __init__(
        self,
        library: Library,
        settings: Mapping[str, float],
        parameters: Array,
        controllers: Controllers | None = None,
    ) -> None:
        ffi, self._lib = library.ffi, library.lib
        self._ffi = ffi
        self.library, self.layout = library, library.layout
        self.plan = plan = plan_of(library)
        self.sizes, self.places, self.row_places = plan.sizes, plan.places, plan.row_places
        self.input_times, self._entry = plan.input_times, plan.entry
        self.controllers = None if controllers is None else controllers.on(library)
        self.settings = _with_address(list(settings.values()), self.controllers.address if self.controllers else 0)
        self.step_size = float(settings["step"])
        self.parameters = np.zeros(len(parameters) + 1)
        self.parameters[:-1] = parameters
        self.state = np.zeros(self.sizes["state"])
        self.workspace = _on_cache_lines(self.sizes["workspace"])
        memory = self.parameters, self.settings, self.state, self.workspace
        self._memory = [ffi.from_buffer(library.types[0], part) for part in memory]
        self._recorded = ffi.new("long *", 0)

    def close(self) -> None:
        """Give the workspace back; state and statistics stay readable, and no further step can be taken."""
        self.workspace, self._memory = np.empty(0), []

    @property
    def modes(self) -> Array | None:
        """Values of the modes; None before the first step, and where there are none."""
        known = "mode" in self.places and self.state[self.places["event_known"]][0]
        return self.state[self.places["mode"]].copy() if known else None

    @property
    def found(self) -> Log:
        """The events of the last call of ``run``."""
        if self._entry is None:
            return np.empty(0)
        memory = self.workspace.view(np.uint8)
        start = self.sizes["found_count"]
        count = int(memory[start : start + np.dtype("l").itemsize].view("l")[0])
        start = self.sizes["found"]
        return memory[start : start + count * self._entry.itemsize].view(self._entry).copy()

    @property
    def t(self) -> float:
        return float(self.state[self.places["t"]][0])

    @property
    def row(self) -> Array:
        """The current state as a row of the record: t, q, v, vdot, and multipliers and internal states where there are
        any."""
        u, table = self.inputs, None
        if u is not None and not math.isnan(sum(u.tolist())):
            table = np.empty((self.sizes["rows_per_step"] + 1, len(u)))
            table[:] = u
        return self.row_with(table)

    def row_with(self, table: Array | None) -> Array:
        """Return the row of the current state, at whose time the inputs are the first of ``table``."""
        record = np.empty((1, self.sizes["row"]))
        _, rows = self.run(0, 1, table, record)
        return record[0] if rows else np.concatenate([self.state[self.places[name]] for name in self.row_places])

    @property
    def inputs(self) -> Array | None:
        """Inputs (nu,) with which the accelerations of the state were evaluated; None where the stepper does not
        say."""
        return self.state[self.places["u"]].copy() if "u" in self.places else None

    @property
    def statistics(self) -> dict[str, int | float]:
        """What the stepper counted since it was initialized."""
        state, places = self.state.tolist(), self.places
        values = ((name, kind, state[places[name].start]) for name, kind in self.plan.counted.items())
        return {name: int(value) if kind == "long" else value for name, kind, value in values}

    @property
    def count(self) -> int:
        """Steps done since the state was initialized."""
        return int(self.state[self.places["count"]][0])

    @property
    def origin(self) -> float:
        """Time of the initialized state: step k ends at origin + k step."""
        return float(self.state[self.places["origin"]][0])

    @property
    def memory(self) -> tuple[Array, NDArray[np.uint8]]:
        """Copies of the state and of the workspace, all that later steps depend on besides settings and parameters."""
        return self.state.copy(), self.workspace.view(np.uint8).copy()

    def restore(self, state: Array, workspace: NDArray[np.uint8]) -> None:
        """Put back what ``memory`` gave."""
        self.state[:] = state
        self.workspace.view(np.uint8)[:] = workspace

    def initialize(self, t: float, q: Array, v: Array, u_table: Array | None, z: Array | None = None) -> int:
        """Start at t, q, v, z; ``u_table`` as in ``run`` for one step. Returns a status, 0 when all is well."""
        self.state[:] = 0.0
        for name, value in (("t", t), ("q", q), ("v", v), *((("z", z),) if self.plan.nz else ())):
            self.state[self.places[name]] = value
        p, settings, state, workspace = self._memory
        return int(self._lib.eomgen_initialize(p, settings, self._pointer(u_table), state, workspace))

    def run(self, steps: int, record_every: int, u_table: Array | None, record: Array | None) -> tuple[int, int]:
        """Take up to ``steps`` steps and fill rows of ``record``, if any; 0: only write the state's row.

        Returns status and rows.
        """
        table, rows, recorded = self._pointer(u_table), self._pointer(record), self._recorded
        status = self._lib.eomgen_run(*self._memory, steps, record_every, table, rows, recorded)
        if status and self.controllers is not None:
            self.controllers.raise_failure()
        return int(status), int(recorded[0])

    def status_text(self, status: int) -> str:
        return str(self._ffi.string(self._lib.eomgen_status_text(status)).decode())

    def times_of(self, first: int, steps: int, start: float) -> Array:
        """Return the times of the rows of an input table for ``steps`` steps from step number ``first``."""
        within = self.input_times[1:]
        grid = np.arange(first, first + steps)[:, np.newaxis] + within
        times: Array = start + self.step_size * np.concatenate([[float(first)], grid.ravel()])
        return times

    def _pointer(self, array: Array | None) -> Any:
        if array is None:
            return self._ffi.NULL
        return self._ffi.from_buffer(self.library.types[0], array)


def _with_address(numbers: Sequence[float], address: int) -> Array:
    """Return numbers behind which an address lies in memory, where compiled code reads it."""
    room = np.zeros(len(numbers) + 1)
    room[:-1] = numbers
    room[-1:].view(np.uint64)[0] = address
    return room[:-1]


def _on_cache_lines(size: int) -> Array:
    """Return zeros that begin at the start of a cache line, so that no vector of the workspace's first member crosses
    one."""
    room = np.zeros(size + 8)
    first = -room.__array_interface__["data"][0] % 64 // room.itemsize
    return room[first : first + size]


@dataclass(frozen=True)
class Trajectory:
    """Rows (t, q, v, vdot, multipliers, z) of a run, how it ended (status 0: well), and whether it was interrupted.

    ``middle`` and ``end`` hold every row of a window in the middle of the run and of the two windows at its end, the
    row before the first step of each included; ``middle`` is empty in short runs, and both are in runs that did not
    come so far. ``events`` are the logs of its parts, ``modes`` the modes at their start; None:
    those of the parameters.
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

    What checkpoints hold last is the state after the last whole step, from which a run goes on with the grid of a later
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
    with _Interrupts(heeded=not at_once) as interrupted:
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
                    table = _rows_from(stepper, inputs, done, size, start)
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
                logs.append(stepper.found)
            found = record[:rows]
            if inside is not None:
                kept[inside].append(found)
                found = found[-(before + 1) % record_every :: record_every]
            if len(found):
                pieces.append(found.copy() if len(found) < len(record) // 2 else found)
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
                logs.append(stepper.found)
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
    """Take the step that is shorter than the others. Returns the status and the row at the end, None where the step
    failed."""
    table = None if inputs is None else np.ascontiguousarray(inputs(stepper.t + grid.rest * stepper.input_times))
    stepper.settings[0] = grid.rest
    record = np.empty((1, stepper.sizes["row"]))
    status, _ = stepper.run(1, 1, table, record)
    stepper.settings[0] = grid.step
    record[0, 0] = grid.end
    return status, None if status else record[0]


def _rows_from(stepper: Stepper, inputs: Callable[[Array], Array], done: int, size: int, start: float) -> Array:
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


class _Interrupts:
    """Within it the first Ctrl-C is only ``heard``, where it is heeded at all, and the second one interrupts as usual;
    in the main thread alone, since others never see Ctrl-C."""

    __slots__ = ("_heeded", "_previous", "heard")

    def __init__(self, *, heeded: bool) -> None:
        self.heard, self._heeded = False, heeded and threading.current_thread() is threading.main_thread()
        self._previous: Any = signal.default_int_handler

    def __enter__(self) -> _Interrupts:
        if self._heeded:  # None: a handler that was not set from Python
            self._previous = signal.signal(signal.SIGINT, self._hear) or signal.default_int_handler
        return self

    def __exit__(self, *_: object) -> None:
        if self._heeded:
            signal.signal(signal.SIGINT, self._previous)

    def _hear(self, number: int, frame: FrameType | None) -> None:
        self.heard = True
        signal.signal(signal.SIGINT, self._previous)
