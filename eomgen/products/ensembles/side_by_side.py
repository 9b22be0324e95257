"""Runs of one model side by side, a trajectory in each lane of the processor's vectors.

Rows have the same bits as in separate runs, except that compilers may contract a multiplication and an addition into
one operation (profile ``fast``). The checks of a run cost more than its steps, so only cheap checks are made here; runs
that fail one of these are repeated separately, with all checks.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from functools import cached_property
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, field, replace
from eomgen.compiled.functions import LANES_VARIABLE, Choice
from eomgen.compiled.functions import chosen as chosen_lanes
from eomgen.compiled.model import CompiledModel
from eomgen.compiled.rest.state_warnings import shortenings
from eomgen.formula.evaluate import symbols
from eomgen.integrators.events import STOPPED
from eomgen.products.ensembles.lane_code import stepper_in_lanes
from eomgen.results.solution import Solution
from eomgen.simulation.judgement.beams import turned_elements
from eomgen.simulation.request import RunRequest
from eomgen.simulation.stepping.inputs import HeldRows
from eomgen.simulation.stepping.run import Run
from eomgen.simulation.stepping.settings import chosen_stepper
from eomgen.simulation.stepping.states import (
    PrescribedInputs,
    States,
    inputs_at_rows,
    row_values,
    starts_at_equilibrium,
)
from eomgen.simulation.stepping.stepper import LaneStepper, times_of_inputs
from eomgen.simulation.stepping.time_grid import TimeGrid, time_grid
from eomgen.system.description import component_names
from eomgen.toolchain.library import LaneLibrary, Library

#: Rows at which energies are looked at.
_LOOKED_AT = 17
#: Options of ``simulate`` with which samples may run side by side.
_OPTIONS = {
    *("method", "rho_inf", "alpha", "beta", "gamma", "order", "tolerance", "settings"),
    *("parameters", "inputs", "initial", "record_every", "t_start", "start"),
}


@dataclass(frozen=True)
class CommonRunData:
    """Method, time grid and columns common to the runs of all samples, from the run without variations; plain data.

    Attributes
    ----------
    method : name of the method
    grid : of steps
    every : steps between rows
    places : of each column, the attribute of the states, the output or the energy, and the index there
    """

    method: str
    grid: TimeGrid
    every: int
    places: Mapping[str, tuple[str, int]]

    @classmethod
    def of(cls, model: CompiledModel, pilot: Solution) -> CommonRunData:
        """Return the common data of runs like ``pilot``."""
        data = pilot.metadata
        span = float(data["t_start"]), float(data["t_end"]), float(data["settings"]["step"])
        grid = time_grid(*span, model.library.real)
        return cls(str(data["method"]), grid, int(data["record_every"]), _places(model, pilot))


@dataclass(frozen=True)
class SideBySideResults:
    """Results of runs side by side.

    Attributes
    ----------
    columns : (runs, columns, rows), not a number after the last row of a run
    alone : (runs,), mask of the runs that have to be repeated alone
    rows : (runs,), number of rows of each run; fewer if an event has stopped the run, with the row of the event as last
        row
    ends : (runs,) s, times of the last rows
    """

    columns: Array
    alone: NDArray[np.bool_]
    rows: NDArray[np.intp]
    ends: Array


@dataclass
class SideBySide:
    """Setup of runs of one model in lanes, which differ in parameters, inputs and the initial state.

    Attributes
    ----------
    run : the run without variations
    library : with the stepper
    lanes : the stepper in lanes; None if samples run elsewhere
    columns : names of the columns of solutions that are looked at
    places : of ``CommonRunData``
    at_rest : whether each run starts at its own static equilibrium
    """

    model: CompiledModel
    run: Run
    library: Library
    columns: Sequence[str]
    places: Mapping[str, tuple[str, int]]
    at_rest: bool = False
    lanes: LaneLibrary | None = None
    #: By the number of rows: times of the previous samples, and the inputs and the base at these.
    _common_before: dict[int, tuple[Array, PrescribedInputs]] = field(default_factory=dict, init=False, repr=False)

    @property
    def count(self) -> int:
        """Number of lanes."""
        return self.lanes.lanes if self.lanes else 1

    @property
    def together(self) -> int:
        """Number of samples that are evaluated together: a multiple of the lanes, such that the rows of all take 4 MB,
        which stay in a cache and are kept by the heap."""
        numbers = (self.run.grid.whole // self.run.every + 3) * self.width
        if self.needs_input_tables:
            numbers += len(self.input_times) * self.model.nu
        groups = max(1, int(5e5 / (numbers * self.count)))
        return self.count * min(groups, 1024)

    @property
    def width(self) -> int:
        """Length of a row of the record."""
        return sum(int(size) for _, size in self.library.layout["method"]["row"])

    @property
    def needs_input_tables(self) -> bool:
        """Whether the stepper takes inputs that change with time from a table, row by row."""
        return self.run.driven is not None and not isinstance(self.run.driven, HeldRows)

    @cached_property
    def input_times(self) -> Array:
        """Times of the rows of such inputs, s."""
        within = np.array(self.library.layout["method"]["input_times"])
        grid = self.run.grid
        times = times_of_inputs(within, float(self.run.settings["step"]), 0, grid.whole, grid.start)
        return np.concatenate([times, times[-1] + grid.rest * within[1:]]) if grid.rest else times

    def tables(self, parameters: Array, inputs: Array | None, starts: Array) -> SideBySideResults:
        """Run samples side by side, and return their columns and a mask of the runs that have to be repeated alone.

        Alone are runs that fail a cheap check: status, constraints, growth, energy, beams, or numbers that are not
        finite.

        Parameters
        ----------
        parameters : (runs, np)
        inputs : (runs, nu), held; or (runs, rows of inputs, nu), of ``input_tables``
        starts : (runs, nq + nv + nz)
        """
        count, lanes = len(starts), self.count
        last = -count % lanes
        parameters, states = _pad(parameters, last), np.empty((count + last, 1 + starts.shape[1]))
        states[:, 0], states[:, 1:] = self.run.grid.start, _pad(starts, last)
        inputs = None if inputs is None else _pad(inputs, last)
        stepper = LaneStepper(cast("LaneLibrary", self.lanes), self.run.settings)
        every, whole = self.between, self.run.grid.whole
        held, tables = (None, inputs) if self.needs_input_tables else (inputs, None)
        counts = every, whole // every, whole % every, self.run.grid.rest
        stepped = stepper.runs(states, parameters, held, *counts, tables)
        rows, modes, ends = (part[:count] for part in stepped[:3])
        parameters, statuses = parameters[:count], stepped[3][:count]
        stopped = statuses == STOPPED.number
        if self.run.grid.rest:
            rows[statuses == 0, -1, 0] = self.run.grid.end
        alone = (statuses != 0) & (~stopped if not self.needs_input_tables else True)
        number = np.full(count, rows.shape[1])
        for k in np.flatnonzero(stopped):  # rows after an event that stops a run repeat the event's row
            number[k] = np.isfinite(rows[k, :, 0]).sum()
            rows[k, number[k] :], modes[k, number[k] :] = rows[k, number[k] - 1], modes[k, number[k] - 1]
        present = self._present(parameters, modes)
        with np.errstate(all="ignore"):
            alone |= self._breaks_constraints(rows, parameters, ends[:, stepper.places.get("max_constraint", slice(0))])
            alone |= ~np.isfinite(rows).reshape(count, -1).all(axis=1)
            alone |= self._grows(rows) | self._gains_energy(rows, present)
            chosen = self.recorded_rows(rows.shape[1])
            asked = np.full(count, len(chosen))
            asked[stopped] = (chosen < number[stopped, np.newaxis] - 1).sum(axis=1) + 1
            if len(chosen) < rows.shape[1]:
                rows, present = rows[:, chosen], present if present.ndim == 2 else present[:, chosen]
            alone |= self._beams_fail(rows, parameters)
            columns = self._columns(rows, present, None if inputs is None else self._at_rows(inputs[:count]))
        for k in np.flatnonzero(stopped):
            columns[k, :, asked[k] :] = np.nan
        return SideBySideResults(columns, alone, asked, rows[:, -1, 0])

    @property
    def between(self) -> int:
        """Steps between the checked rows: as between recorded rows, or fewer if the run has few recorded rows."""
        every, whole = self.run.every, self.run.grid.whole
        if self.run.method.chooses_steps or whole // every >= _LOOKED_AT:
            return every
        parts = [part for part in range(1, every + 1) if every % part == 0 and whole // (every // part) >= _LOOKED_AT]
        return every // parts[0] if parts else 1

    def recorded_rows(self, count: int) -> NDArray[np.intp]:
        """Return the indices of the recorded rows among ``count`` checked rows."""
        chosen = np.arange(0, self.run.grid.whole // self.between + 1, self.run.every // self.between)
        return np.append(chosen, count - 1) if chosen[-1] != count - 1 else chosen

    @staticmethod
    def rows_with_energies(count: int) -> NDArray[np.intp]:
        """Return the indices of the rows, among ``count``, at which energies are looked at."""
        return np.unique(np.linspace(0, count - 1, _LOOKED_AT).astype(int))

    def _present(self, parameters: Array, modes: Array) -> Array:
        """Return the parameters at the rows: (lanes, rows, np) with modes (lanes, rows, modes), or (lanes, np) without
        modes. NaN modes, after the failure of a lane, leave the parameters as they are."""
        if not modes.shape[2]:
            return parameters
        present = np.repeat(parameters[:, np.newaxis], modes.shape[1], axis=1)
        places = [mode["parameter"] for mode in self.library.layout["method"]["events"]["modes"]]
        present[:, :, places] = np.where(np.isnan(modes), present[:, :, places], modes)  # until a lane failed
        return present

    def _at_rows(self, inputs: Array) -> Array:
        """Return inputs at the recorded rows, (lanes, rows, nu), from held inputs (lanes, nu) or tables (lanes, table
        rows, nu)."""
        grid = self.run.grid
        steps = np.arange(0, grid.whole + 1, self.run.every)
        if steps[-1] != grid.steps:
            steps = np.append(steps, grid.steps)
        if inputs.ndim == 2:
            return np.repeat(inputs[:, np.newaxis], len(steps), axis=1)
        each: int = self.library.layout["method"]["rows_per_step"]
        return inputs[:, steps * each]

    # -- columns of results --------------------------------------------------------------------------------------------

    def _states(self, rows: Array) -> States:
        """Return the states at rows (n, width)."""
        nq, nv, nz = self.model.nq, self.model.nv, self.model.nz
        ends = (1, 1 + nq, 1 + nq + nv, 1 + nq + 2 * nv, rows.shape[1] - nz, rows.shape[1])
        return States(rows[:, 0], *(_columns_of(rows, ends[k], ends[k + 1]) for k in range(5)))

    def _prescribe(self, states: States, present: Array, inputs: Array | None) -> PrescribedInputs:
        """Return inputs and base motion at states of all lanes. `present` are parameters of ``_present``; `inputs`
        (lanes * rows, nu) replace values by formulas unless NaN. Evaluated once if all lanes have the same parameters
        and times."""
        lanes, common, places = len(present), self.run.parameters, self._read_by_drivers
        t = states.t.reshape(lanes, -1)
        if (present[..., places] == common[places]).all() and (t == t[0]).all():
            of_one = self._in_common(t[0])
            tiled = (None if part is None else np.tile(part, (lanes, 1)) for part in of_one)
            prescribed_inputs = PrescribedInputs(*tiled)
        else:
            prescribed_inputs = inputs_at_rows(self.model, states.t, _at_each(present, t.shape[1]), None)
        if inputs is None or prescribed_inputs.u is None:
            return prescribed_inputs
        return PrescribedInputs(np.where(np.isnan(inputs), prescribed_inputs.u, inputs), prescribed_inputs.base)

    @cached_property
    def _read_by_drivers(self) -> list[int]:
        """Places of the parameters that formulas of inputs and laws of the base mention."""
        description = self.model.description
        formulas = [item.formula for item in description.inputs if item.formula is not None]
        formulas += [law.formula for law in description.laws]
        read = {symbol.name for formula in formulas for symbol in symbols(formula)}
        return [index for index, name in enumerate(self.model.parameters) if name in read]

    def _in_common(self, t: Array) -> PrescribedInputs:
        """Return inputs and the base at times (rows,), at the parameters of the run that all have in common."""
        known = self._common_before.get(len(t))
        if known is None or not np.array_equal(known[0], t):
            known = t.copy(), inputs_at_rows(self.model, t, self.run.parameters, None)
            self._common_before[len(t)] = known
        return known[1]

    def _columns(self, rows: Array, present: Array, inputs: Array | None) -> Array:
        """Return the asked columns (lanes, columns, rows) of rows (lanes, rows, width): states, inputs, outputs and
        energies. `present` are parameters of ``_present``, `inputs` (lanes, rows, nu) or None."""
        lanes, count, width = rows.shape
        states = self._states(rows.reshape(-1, width))
        result = np.empty((lanes, len(self.columns), count))
        groups: dict[str, Any] = {}
        p = _at_each(present, count)
        u = None if inputs is None else inputs.reshape(-1, inputs.shape[-1])
        needed = {self.places[name][0] for name in self.columns}
        prescribed_inputs = PrescribedInputs(None, None)
        if any(group.partition(".")[0] in ("output", "energy", "input") for group in needed):
            prescribed_inputs = self._prescribe(states, present, u)
        for kind, prefix in (("outputs", "output."), ("energy", "energy.")):
            if any(group.startswith(prefix) for group in needed):
                of_model = row_values(kind, self.model, states, prescribed_inputs, p)
                groups |= {f"{prefix}{name}": value for name, value in of_model.items()}
        for k, name in enumerate(self.columns):
            group, index = self.places[name]
            if group in groups:
                values = groups[group]
            elif group == "input":
                values = prescribed_inputs.u
            else:
                values = getattr(states, group)
            column = values if values.ndim == 1 else values[:, index]
            result[:, k] = column.reshape(lanes, count)
        return result

    def _grows(self, rows: Array) -> NDArray[np.bool_]:
        """Return a mask of the lanes whose velocities in the last quarter exceed all earlier ones five times. False
        for methods that choose their steps by errors. `rows` are (lanes, rows, width)."""
        if self.run.method.chooses_steps:
            return np.zeros(len(rows), dtype=bool)
        nq, nv = self.model.nq, self.model.nv
        late = 3 * rows.shape[1] // 4
        before, after = np.empty((nv, len(rows))), np.empty((nv, len(rows)))
        with np.errstate(all="ignore"):
            for k in range(nv):  # a maximum runs along memory
                speeds = np.abs(rows[:, :, 1 + nq + k])
                before[k], after[k] = speeds[:, : max(late, 1)].max(axis=1), speeds[:, late:].max(axis=1)
            floor = 1e-6 * np.maximum(before, after).max(axis=0, initial=0.0)
            result: NDArray[np.bool_] = np.any(after > 5.0 * np.maximum(before, floor), axis=0)
        return result

    def _breaks_constraints(self, rows: Array, parameters: Array, largest: Array) -> NDArray[np.bool_]:
        """Return a mask (lanes,) of runs whose largest constraint violation exceeds 1e-4 of the machine's size, or 1e-4
        rad; a run fails from 1e-3 on.

        Parameters
        ----------
        largest : (lanes, 1) of all steps, in the units of the rows; (lanes, 0) without constraints
        """
        if not self.model.multipliers or not largest.size:
            return np.zeros(len(rows), dtype=bool)
        result: NDArray[np.bool_] = ~(largest[:, 0] <= 1e-4 * machine_sizes(self.model, rows, parameters))
        return result

    def _gains_energy(self, rows: Array, present: Array) -> NDArray[np.bool_]:
        """Return a mask of the lanes whose total energy grows by a fifth of the energies at work, looked at in a few
        rows; a run fails from 0.49 on. False if forces may have power, or without the term energy. `rows` are (lanes,
        rows, width), `present` parameters."""
        lanes, count, width = rows.shape
        if "energy" not in self.model.functions or not self.model.library.layout["facts"]["conservative"]:
            return np.zeros(lanes, dtype=bool)
        chosen = self.rows_with_energies(count)
        states = self._states(rows[:, chosen].reshape(-1, width))
        looked = present if present.ndim == 2 else present[:, chosen]
        p = _at_each(looked, len(chosen))
        energy = row_values("energy", self.model, states, self._prescribe(states, looked, None), p)
        total, potential, kinetic = (energy[name].reshape(lanes, -1) for name in ("total", "potential", "kinetic"))
        moving = np.ptp(potential, axis=1) + kinetic.max(axis=1)
        gain: NDArray[np.bool_] = (total - total[:, :1]).max(axis=1) > 0.2 * moving
        return gain

    def _beams_fail(self, rows: Array, parameters: Array) -> NDArray[np.bool_]:
        """Return a mask (lanes,) of runs in which a modal beam is shortened by nine tenths, or an element of an exact
        beam turns by more than half a turn. `rows` are (lanes, rows, width), `parameters` (lanes, np)."""
        lanes = len(rows)
        model, places = self.model, slice(1, 1 + self.model.nq)
        shares = shortenings(model, rows[:, :, places].reshape(-1, model.nq))
        result: NDArray[np.bool_] = np.any(shares.reshape(lanes, -1) > 0.9, axis=1)
        for k in np.flatnonzero(~result) if model.description.exact_beams else ():
            result[k] = bool(turned_elements(model, rows[k, :, 0], rows[k, :, places], parameters[k]))
        return result


def machine_sizes(model: CompiledModel, rows: Array, parameters: Array) -> Array:
    """Return the size of the machine in m, or 1 if constraints have other units, in each lane, (lanes,). `rows` are
    (lanes, rows, width), `parameters` (lanes, np)."""
    lanes = len(rows)
    scale = np.ones(lanes)
    lengths = [unit not in ("1", "1/s") for unit in model.library.layout["row_units"]]
    if "constraint_size" in model.functions and any(lengths):
        looked = rows[:, [0, rows.shape[1] // 2, -1]]
        t, q = looked[:, :, 0].ravel(), looked[:, :, 1 : 1 + model.nq].reshape(-1, model.nq)
        p = np.repeat(parameters, looked.shape[1], axis=0)
        extents = np.asarray(model.evaluate("constraint_size", q, t=t, parameters=p)["extent"])
        machine = extents.reshape(lanes, -1).max(axis=1)
        scale = np.where(machine > 0.0, machine, 1.0)
        scale = scale if all(lengths) else np.minimum(scale, 1.0)
    return scale


def _columns_of(rows: Array, begin: int, end: int) -> Array:
    """Return a contiguous copy of columns of rows; for a few columns, copies one by one take a third of the time."""
    if end - begin > 3:
        return np.ascontiguousarray(rows[:, begin:end])
    result = np.empty((len(rows), end - begin))
    for k in range(end - begin):
        result[:, k] = rows[:, begin + k]
    return result


def _at_each(present: Array, count: int) -> Array:
    """Return parameters (lanes, np), or (lanes, rows, np), for each of ``count`` rows of each lane, (lanes * rows,
    np)."""
    return np.repeat(present, count, axis=0) if present.ndim == 2 else present.reshape(-1, present.shape[2])


def _pad(rows: Array, more: int) -> Array:
    """Return rows with the last row repeated, so that no lane is empty."""
    return np.concatenate([rows, np.repeat(rows[-1:], more, axis=0)])


def side_by_side(
    model: CompiledModel,
    options: Mapping[str, Any],
    varied_inputs: Collection[str],
    alike: CommonRunData,
    columns: Sequence[str],
    *,
    initial_varies: bool,
) -> SideBySide | str:
    """Return the setup of runs side by side; or in words, the reason for which runs have to be made one after the
    other.

    Parameters
    ----------
    options : of ``simulate``, that all runs have
    varied_inputs : names of inputs with different values in the runs, held over each run; different laws are among the
        options
    alike : method, grid and places of columns, from the run without variations
    columns : of solutions, that are looked at
    initial_varies : whether runs have different initial states
    """
    if chosen_lanes() is Choice.OFF:
        return f"{LANES_VARIABLE} is off"
    if model.library.real != "double":
        return f"numbers are of type {model.library.real}"
    if counted := [name for name in columns if alike.places.get(name, ("",))[0] == "event"]:
        return f"the column {counted[0]} counts events"
    runs = common_runs(model, options, varied_inputs, alike, columns, initial_varies=initial_varies)
    if isinstance(runs, str):
        return runs
    lanes = stepper_in_lanes(model, runs.library)
    return f"{runs.run.name} is not made for lanes: {lanes}" if isinstance(lanes, str) else replace(runs, lanes=lanes)


def common_runs(
    model: CompiledModel,
    options: Mapping[str, Any],
    varied_inputs: Collection[str],
    alike: CommonRunData,
    columns: Sequence[str],
    *,
    initial_varies: bool,
) -> SideBySide | str:
    """Return the setup of runs without lanes, or the reason, in words, for which runs have to be made one after the
    other. Arguments are as of ``side_by_side``."""
    others = sorted(set(options) - _OPTIONS)
    if others:
        return f"{others[0]} is given"
    given_start = initial_varies or options.get("initial") is not None
    of_scene = str(model.library.layout["defaults"]["start"])
    at_rest = starts_at_equilibrium(options.get("start"), given_start, of_scene)
    unknown = [name for name in columns if name not in alike.places]
    if unknown:
        return f"the column {unknown[0]} is of runs alone"
    named = {name: options.get(name) for name in ("rho_inf", "alpha", "beta", "gamma", "order", "tolerance")}
    chosen = chosen_stepper(model, alike.method, named, options.get("settings"))
    request = RunRequest(model, alike.grid.step, alike.grid.start, model.evaluator.one_set(options.get("parameters")))
    inputs = {**(options.get("inputs") or {}), **dict.fromkeys(varied_inputs, 0.0)}
    run = request.run(chosen, alike.grid, alike.every, inputs)
    return SideBySide(model, run, chosen.library, columns, alike.places, at_rest)


def _places(model: CompiledModel, pilot: Solution) -> dict[str, tuple[str, int]]:
    names = pilot.metadata.get("names", {})
    sizes = {"q": model.nq, "v": model.nv, "a": model.nv, "multipliers": len(model.multipliers), "z": model.nz}
    result: dict[str, tuple[str, int]] = {}
    for group, size in sizes.items():
        labels = names.get(group) or component_names("", group, size)
        result |= {label: (group, index) for index, label in enumerate(labels)}
    result |= {f"input.{name}": ("input", index) for index, name in enumerate(model.inputs)} | {"t": ("t", 0)}
    result |= {f"event.{name}": ("event", index) for index, name in enumerate(pilot.events.counts)}
    for name, array in pilot.outputs.items():
        size = 1 if array.ndim == 1 else array.shape[1]
        labels = component_names("output", name, size)
        result |= {label: (f"output.{name}", index) for index, label in enumerate(labels)}
    return result | {f"energy.{name}": (f"energy.{name}", 0) for name in pilot.energy}
