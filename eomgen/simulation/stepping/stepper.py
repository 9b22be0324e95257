"""The stepper of a compiled library, with its memory (settings, state, workspace and its log of events), and the
stepper of several trajectories side by side.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.integrators.stepper_layout import STEPPER_SIZES, row_layout, state_layout, statistics_kinds
from eomgen.simulation.stepping.controllers import CallerControllers
from eomgen.simulation.stepping.inputs import HeldRows, InputRows
from eomgen.simulation.stepping.time_grid import TimeGrid
from eomgen.toolchain.library import LaneLibrary, Library

Log = NDArray[Any]


def entry_type(layout: Mapping[str, Any], real: str) -> np.dtype[Any]:
    """Return the NumPy structured type of one event in the stepper's log: number of the event, time, and state. The
    state has q, v and z before and after the event, and the modes. `layout` is the library's, `real` ``double`` or
    ``float``."""
    number = "f4" if real == "float" else "f8"
    sizes, modes = layout["sizes"], len(layout["method"]["events"]["modes"])
    blocks = [(letter, int(sizes[letter])) for letter in "qvz"]
    state = [*((f"{name}_before", size) for name, size in blocks), *blocks, ("modes", modes)]
    members = [("event", np.dtype("l"), ()), ("t", number, ())]
    return np.dtype([*members, *((name, number, (size,)) for name, size in state if size)], align=True)


class StepperPlan:
    """Data common to all steppers of a library, read from its layout once.

    Attributes
    ----------
    sizes : by the names of ``STEPPER_SIZES``
    places, row_places : slices of the quantities of the flat state and of rows
    counted : name, place in the flat state, and whether it is a whole number, of each statistic
    entry : of the log of events; None without events
    input_times : times of the rows of inputs of a step, in steps
    pace : s, duration of a step in the last run; infinite before the first one
    paced_step, paced_by : the size of the steps of this run, and its settings as bytes: a tolerance may change the cost
        of rows much
    """

    def __init__(self, library: Library) -> None:
        method: Mapping[str, Any] = library.layout["method"]
        self.sizes = {name: int(library.lib.eomgen_stepper_size(k)) for k, name in enumerate(STEPPER_SIZES)}
        self.places, self.row_places = state_layout(method), row_layout(method)
        kinds = statistics_kinds(method).items()
        self.counted = [(name, self.places[name].start, kind == "long") for name, kind in kinds]
        self.entry = entry_type(library.layout, library.real) if "events" in method else None
        self.input_times = np.array(method.get("input_times", [0.0, 1.0]))
        self.input_times.setflags(write=False)
        self.nz = int(library.layout["sizes"]["z"])
        self.pace, self.paced_step, self.paced_by = math.inf, 1.0, b""


def plan_of(library: Library) -> StepperPlan:
    """Return the plan of a library's steppers, made at first use."""
    if "stepper" not in library.kept:
        library.kept["stepper"] = StepperPlan(library)
    plan: StepperPlan = library.kept["stepper"]
    return plan


class Stepper:
    """The stepper of a library with memory: settings, state and workspace.

    Parameters
    ----------
    library : Library
        Built with a method.
    settings : mapping from name to number
        In the order of ``integrators.stepper_layout.default_settings``.
    parameters : (np,) array
    controllers : CallerControllers, optional
        The caller's functions, which samples call.
    """

    def __init__(
        self,
        library: Library,
        settings: Mapping[str, float],
        parameters: Array,
        controllers: CallerControllers | None = None,
    ) -> None:
        """Allocate parameters, settings, state and workspace of a compiled stepper."""
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
        self.workspace = on_cache_lines(self.sizes["workspace"])
        memory = self.parameters, self.settings, self.state, self.workspace
        self._memory = [ffi.from_buffer(library.types[0], part) for part in memory]
        self._recorded = ffi.new("long *", 0)

    def close(self) -> None:
        """Give the workspace back; state and statistics stay readable, and no further step can be taken."""
        self.workspace, self._memory = np.empty(0), []

    def first_inputs(self, inputs: InputRows | None, grid: TimeGrid) -> Array | None:
        """Return the table of inputs for the first step of a time grid, (rows of a step, nu), from the function
        ``Run.driven``. None without the function, if the compiled code evaluates all inputs."""
        if inputs is None:
            return None
        if isinstance(inputs, HeldRows):
            return inputs.over(len(self.input_times))
        return inputs(grid.start + (grid.step if grid.whole else grid.rest) * self.input_times)

    @property
    def modes(self) -> Array | None:
        """Values of the modes; None before the first step, and if there are none."""
        known = "mode" in self.places and self.state[self.places["event_known"]][0]
        return self.state[self.places["mode"]].copy() if known else None

    @property
    def new_events(self) -> Log:
        """The log entries of the events in the last call of ``run``, as a structured array; empty without events."""
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
        """The current state as a row of the record: t, q, v, vdot, and multipliers and internal states if there are
        any."""
        u, table = self.inputs, None
        if u is not None and not math.isnan(sum(u.tolist())):
            table = np.empty((self.sizes["rows_per_step"] + 1, len(u)))
            table[:] = u
        return self.row_with(table)

    def row_with(self, table: Array | None) -> Array:
        """Return the current state as a row (width,), with accelerations at the inputs in the first row of ``table``.
        `table` is one of a single step; None if no inputs are given."""
        record = np.empty((1, self.sizes["row"]))
        _, rows = self.run(0, 1, table, record)
        return record[0] if rows else np.concatenate([self.state[self.places[name]] for name in self.row_places])

    @property
    def inputs(self) -> Array | None:
        """Inputs (nu,) with which the accelerations of the state were evaluated; None if the stepper does not keep
        these inputs."""
        return self.state[self.places["u"]].copy() if "u" in self.places else None

    @property
    def statistics(self) -> dict[str, int | float]:
        """Counts of the stepper since its last initialization."""
        state = self.state.tolist()
        return {name: int(state[index]) if whole else state[index] for name, index, whole in self.plan.counted}

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
        """Restore the state and the workspace from a copy of ``memory``."""
        self.state[:] = state
        self.workspace.view(np.uint8)[:] = workspace

    def initialize(self, t: float, q: Array, v: Array, u_table: Array | None, z: Array | None = None) -> int:
        """Set the state to time t in s, q (nq,), v (nv,) and z (nz,) with zero counts, and evaluate accelerations.
        ``u_table`` is a table of inputs of one step as in ``run``. Returns a status, 0 if all is well."""
        self.state[:] = 0.0
        for name, value in (("t", t), ("q", q), ("v", v), *((("z", z),) if self.plan.nz else ())):
            self.state[self.places[name]] = value
        p, settings, state, workspace = self._memory
        return int(self._lib.eomgen_initialize(p, settings, self._pointer(u_table), state, workspace))

    def run(self, steps: int, record_every: int, u_table: Array | None, record: Array | None) -> tuple[int, int]:
        """Take up to ``steps`` steps, and write every ``record_every``-th row into ``record`` (rows, width); return the
        status.

        Returns the status, 0 if all is well, and the number of rows written. 0 steps: only the row of the present state
        is written. ``u_table`` has rows (n, nu) of the inputs at the times of ``times_of``; None: formulas are
        evaluated in C. Raises an error of a caller's controller function.
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
        return times_of_inputs(self.input_times, self.step_size, first, steps, start)

    def _pointer(self, array: Array | None) -> Any:
        if array is None:
            return self._ffi.NULL
        return self._ffi.from_buffer(self.library.types[0], array)


def times_of_inputs(within: Array, step: float, first: int, steps: int, start: float) -> Array:
    """Return the times of the rows of an input table for ``steps`` steps, in s, from step number ``first``.

    Parameters
    ----------
    within : of the rows of a step, from 0 to 1
    step, start : of the grid, s
    """
    grid = np.arange(first, first + steps)[:, np.newaxis] + within[1:]
    times: Array = start + step * np.concatenate([[float(first)], grid.ravel()])
    return times


def _with_address(numbers: Sequence[float], address: int) -> Array:
    """Return the numbers as an array (n,), with an address stored one place after the end of the array. Compiled
    sampled controllers read the address from there."""
    room = np.zeros(len(numbers) + 1)
    room[:-1] = numbers
    room[-1:].view(np.uint64)[0] = address
    return room[:-1]


def on_cache_lines(size: int) -> Array:
    """Return zeros that begin at the start of a cache line, so that no vector of the workspace's first member crosses
    one."""
    room = np.zeros(size + 8)
    first = -room.__array_interface__["data"][0] % 64 // room.itemsize
    return room[first : first + size]


class LaneStepper:
    """The stepper of a library that steps several trajectories side by side, in the lanes of vectors, with its memory.

    Parameters
    ----------
    settings : mapping from name to number
        The same for all lanes, in the order of ``integrators.stepper_layout.default_settings``.

    Attributes
    ----------
    lanes : number of trajectories that are stepped together
    width : numbers of a row
    places, row_places : slices of the quantities of a flat state, and of a row
    """

    def __init__(self, library: LaneLibrary, settings: Mapping[str, float]) -> None:
        method: Mapping[str, Any] = library.layout["method"]
        self.lanes = library.lanes
        self.width = sum(int(size) for _, size in method["row"])
        self.places, self.row_places = state_layout(method), row_layout(method)
        self._modes = len(method.get("events", {"modes": ()})["modes"])
        self._size = max(index.stop for index in self.places.values())
        self._lib, self._ffi = library.lib, library.ffi
        self._settings = np.array([*settings.values(), 0.0])
        self._state, self._workspace = on_cache_lines(library.state_size), on_cache_lines(library.workspace_size)

    def runs(
        self,
        states: Array,
        parameters: Array,
        inputs: Array | None,
        steps: int,
        rows: int,
        rest: int,
        shorter: float = 0.0,
        tables: Array | None = None,
    ) -> tuple[Array, Array, Array, NDArray[np.intc]]:
        """Run n trajectories from their starts to the end, in groups of as many as there are lanes.

        Returns rows (n, 1 + rows, width), with one more row each for ``rest`` and ``shorter``, modes (n, ..., modes) at
        the rows, flat states (n, size) at the end and statuses (n,). Rows after a failure are NaN. The last row of a
        run stopped by an event is the row of the event.

        Parameters
        ----------
        states : (n, 1 + nq + nv + nz), n a multiple of the lanes
            Time in s, q, v, z.
        parameters : (n, np)
        inputs : (n, nu)
            Held over the run, NaN for inputs by a formula of the scene; None: all by formulas.
        steps, rows : a row after each ``steps`` steps; the first row is the start
        rest : steps before one row more, if any
        shorter : size of a last step, s, if there is one
        tables : (n, 1 + rows of inputs of all steps, nu)
            Inputs that change with time, in place of ``inputs``.
        """
        count = len(states)
        record = np.full((count, 1 + rows + (rest > 0) + (shorter > 0.0), self.width), np.nan)
        modes = np.full((*record.shape[:2], self._modes), np.nan)
        flat, statuses = np.empty((count, self._size)), np.zeros(count, dtype=np.intc)
        arrays = [np.ascontiguousarray(part, dtype=float) for part in (parameters, states)]
        beside = None if tables is None else self._beside(tables)
        held = None if inputs is None else np.ascontiguousarray(inputs, dtype=float)
        read = np.append(arrays[0].ravel(), 0.0), self._settings, held, beside, arrays[1], self._state, self._workspace
        written = record, modes if self._modes else None, flat
        sizes = count // self.lanes, steps, rows, rest, shorter
        pointers = [*map(self._doubles, read), *sizes, *map(self._doubles, written)]
        self._lib.eomgen_lanes_groups(*pointers, self._ffi.from_buffer("int[]", statuses))
        return record, modes, flat, statuses

    def _beside(self, tables: Array) -> Array:
        """Return tables (n, rows, nu) flattened, so that the numbers of the lanes of a group are adjacent in memory.
        The order is group, row, input, lane; n is a multiple of the number of lanes."""
        count, rows, size = tables.shape
        beside = on_cache_lines(tables.size)
        beside.reshape(-1, rows, size, self.lanes)[:] = np.moveaxis(
            tables.reshape(count // self.lanes, self.lanes, rows, size), 1, 3
        )
        return beside

    def _doubles(self, array: Array | None) -> Any:
        return self._ffi.NULL if array is None else self._ffi.from_buffer("double[]", array)
