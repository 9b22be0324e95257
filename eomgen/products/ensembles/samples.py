"""Runs of blocks of samples, side by side if possible, with the kept results and the reasons for failures."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, field, replace
from eomgen.base.messages import Log
from eomgen.compiled.consistent_states import consistent_samples
from eomgen.compiled.initial_state import initial_state, starts_of
from eomgen.compiled.model import CompiledModel
from eomgen.errors import EomgenError, FileError
from eomgen.formula.evaluate import symbols
from eomgen.products.ensembles.designs import Design
from eomgen.products.ensembles.side_by_side import (
    CommonRunData,
    SideBySide,
    SideBySideResults,
    side_by_side,
)
from eomgen.products.ensembles.statistics import ReducedSamples
from eomgen.products.ensembles.variations import LAWS, VariedOptions, variables_of_seed, with_scenes_laws
from eomgen.results.solution import Solution
from eomgen.simulation.simulate import simulate
from eomgen.simulation.stepping.inputs import HeldRows, InputSignals, read_signals
from eomgen.simulation.stepping.run import scene_inputs
from eomgen.simulation.stepping.settings import followed_laws
from eomgen.simulation.stepping.states import start_of


@dataclass
class LaneRunner:
    """Runner of samples side by side: turns values of varied quantities into parameters, inputs and starts.

    Attributes
    ----------
    options : varied quantities and common options
    runs : setup of the runs in lanes
    """

    model: CompiledModel
    options: VariedOptions
    runs: SideBySide

    def tables(self, values: Array) -> SideBySideResults:
        """Run samples with the values (samples, varied) side by side, and return their columns (samples, columns,
        rows). Alone, to be repeated, are also samples with refused parameters or starts, and with laws that cannot be
        followed."""
        parameters, inputs, starts, alone = self.begin(values)
        result = self.runs.tables(parameters, inputs, starts)
        return replace(result, alone=result.alone | alone)

    def begin(self, values: Array, *, common: bool = False) -> tuple[Array, Array | None, Array, NDArray[np.bool_]]:
        """Return parameters (samples, np), inputs as of ``SideBySide.tables``, starts (samples, nq + nv + nz), and a
        mask (samples,) of samples that have to run alone, for values (samples, varied). ``common``: an input table that
        all samples have in common is returned once."""
        parameters, alone = self._parameters(values)
        inputs = None if self.runs.needs_input_tables else self._held_inputs(values)
        if self.runs.needs_input_tables:
            varied = {item.block for item in self.options.items}
            alike = not (varied & {"inputs", *LAWS}) and not (parameters != self.runs.run.parameters).any()
            first = slice(0, 1 if common and alike else None)
            inputs = self._input_tables(values[first], parameters[first])
        starts, refused = self._starts(values, parameters)
        return parameters, inputs, starts, alone | refused | self._unfollowed_laws(parameters)

    def _parameters(self, values: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Return parameters (samples, np) for values (samples, varied), and a mask (samples,) of sets that the scene
        may refuse; these are replaced by the common parameters."""
        base, names = self.runs.run.parameters, list(self.model.parameters)
        parameters = np.repeat(base[np.newaxis], len(values), axis=0)
        for item, column in zip(self.options.items, values.T, strict=True):
            if item.block == "parameters":
                parameters[:, names.index(item.name)] = column
            elif item.block == "process":
                drawn = [variables_of_seed(self.model, item.place, seed) for seed in column]
                places = [names.index(name) for name in drawn[0]]
                parameters[:, places] = [list(row.values()) for row in drawn]
        try:
            self.model.parameter_array(parameters)
        except EomgenError:
            alone = _fill_rows(parameters, range(len(values)), lambda k: self.model.parameter_array(parameters[k]))
            parameters[alone] = base
            return parameters, alone
        return parameters, np.zeros(len(values), dtype=bool)

    def _input_tables(self, values: Array, parameters: Array) -> Array:
        """Return inputs that change with time, (samples, rows, nu)."""
        model, run, times = self.model, self.runs.run, self.runs.input_times
        signals, places = run.signals, {name: k for k, name in enumerate(model.inputs)}
        tables = np.repeat(signals.table(times)[np.newaxis], len(parameters), axis=0)
        by_formulas = [k for name, k in places.items() if name not in signals.given]
        if signals.formulas is not None and by_formulas and not signals.left_to_stepper:
            for k in np.flatnonzero(np.any(parameters != run.parameters, axis=1)).tolist():
                rows = model.evaluator.formula_inputs({"t": times, "p": parameters[k]})
                tables[k][:, by_formulas] = rows[:, by_formulas]
        for item, column in self.options.columns(values, "inputs"):
            tables[:, :, places[item.name]] = column[:, np.newaxis]
        for table, row, p in zip(tables, values, parameters, strict=True):
            for name, law in self.options.laws(row, partial(np.asarray, p)).items():
                by_law = law.over(times)  # a run alone names the value that is not finite
                table[:, places[name]] = np.where(np.isfinite(by_law), by_law, np.inf)
        return tables

    def _held_inputs(self, values: Array) -> Array | None:
        """Return inputs that are held over each run, (samples, nu), NaN for inputs by formulas of the scene; None if
        all inputs are given by formulas."""
        driven = self.runs.run.driven
        if not isinstance(driven, HeldRows):
            return None
        inputs = np.repeat(driven.row[np.newaxis], len(values), axis=0)
        for item, column in self.options.columns(values, "inputs"):
            inputs[:, self.model.inputs.index(item.name)] = column
        return inputs

    def _unfollowed_laws(self, parameters: Array) -> NDArray[np.bool_]:
        """Return a mask (samples,) of parameters (samples, np) at which a drive, or the base, cannot be followed; the
        ones with the common run's parameters of these laws are not checked again."""
        names, run = list(self.model.parameters), self.runs.run
        in_laws = {symbol.name for law in self.model.description.laws for symbol in symbols(law.formula)}
        places = [names.index(name) for name in in_laws.intersection(names)]
        result = np.zeros(len(parameters), dtype=bool)
        for k in np.flatnonzero((parameters[:, places] != run.parameters[places]).any(axis=1)):
            result[k] = bool(followed_laws(self.model, run.method, parameters[k], run.grid)[0])
        return result

    def _starts(self, values: Array, parameters: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Return initial states (samples, nq + nv + nz) on the constraints, or at rest, and a mask (samples,) of failed
        ones."""
        model, common = self.model, self.options.common
        changed = bool(common.get("initial")) or common.get("parameters") is not None
        changed = changed or any(item.block != "inputs" for item in self.options.items)
        # rows that are redundant in the scene may not be at other parameters
        if self.runs.at_rest or (model.library.layout["left_out"] and np.any(parameters != model.parameter_array())):
            return self._starts_one_by_one(values, parameters)
        guesses, refused = self._guesses(values, parameters, asked=changed)
        if not model.multipliers or (not changed and self.runs.run.grid.start == 0.0):
            return guesses, refused
        q, v, z = np.split(guesses, [model.nq, model.nq + model.nv], axis=1)
        varied = any(item.block in ("q", "v") for item in self.options.items)  # then whole arrays are given
        starts = () if varied else starts_of(model, common.get("initial"))
        result = consistent_samples(model, q, v, self.runs.run.grid.start, parameters, starts)
        return np.concatenate([result.q, result.v, z], axis=1), refused | ~result.met

    def _guesses(self, values: Array, parameters: Array, *, asked: bool) -> tuple[Array, NDArray[np.bool_]]:
        """Return initial states (samples, nq + nv + nz) before a correction onto constraints, and a mask of refused
        ones. `asked`: whether the states differ from the model's own start, which is on the constraints already."""
        model, common = self.model, self.options.common.get("initial")

        def start_at(p: Array) -> Array:
            start = initial_state(model, common, p, asked=asked)
            return np.concatenate([start.q, start.v, start.z])

        starts = np.repeat(start_at(self.runs.run.parameters)[np.newaxis], len(values), axis=0)
        changed = (parameters != self.runs.run.parameters).any(axis=1)
        if model.initial_at is None:  # else joints place the bodies at the parameters of each sample
            changed[:] = False
        refused = _fill_rows(starts, np.flatnonzero(changed), lambda k: start_at(parameters[k]))
        begins = {"q": 0, "v": model.nq, "z": model.nq + model.nv}
        for item, column in self.options.columns(values, *begins):
            starts[:, begins[item.block] + item.place] = column
        return starts, refused

    def _starts_one_by_one(self, values: Array, parameters: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Return starts (samples, nq + nv + nz) and a mask of refused samples, by the same search as in a run alone,
        for each. Needed for starts at rest, and for constraint rows that may be redundant at the scene's parameters
        only."""
        model = self.model
        starts = np.tile(np.concatenate([model.initial_q, model.initial_v, model.initial_z]), (len(values), 1))

        def start(k: int) -> Array:
            options = self.options.of(values[k])
            changed = bool(options.get("initial")) or options.get("parameters") is not None
            return self._start_of(parameters[k], options, changed=changed)

        return starts, _fill_rows(starts, range(len(values)), start)

    def _start_of(self, p: Array, options: Mapping[str, Any], *, changed: bool) -> Array:
        """Return q, v, z, (nq + nv + nz,), from which a run with parameters (np,) and `options` starts; errors as of
        ``simulate``."""
        run, model = self.runs.run, self.model
        input_values = read_signals(options.get("inputs"), model.inputs, run.grid.steps, model.input_units)
        formulas, grid = scene_inputs(model, p), run.grid
        signals = InputSignals(model.inputs, input_values, formulas, grid.step, grid.start, run.signals.left_to_stepper)
        run = replace(run, parameters=p, signals=signals)
        state, _, _ = start_of(run, options.get("initial"), equilibrium_start=self.runs.at_rest, changed=changed)
        return np.concatenate([state.q, state.v, state.z])


def _fill_rows(rows: Array, numbers: Iterable[int], row_of: Callable[[int], Array]) -> NDArray[np.bool_]:
    """Fill rows with some numbers in place; return a mask of the rows that are refused by an error of the package."""
    refused = np.zeros(len(rows), dtype=bool)
    for k in numbers:
        try:
            rows[k] = row_of(k)
        except EomgenError:
            refused[k] = True
    return refused


_LOG = Log(__name__)
#: Evaluations of a block of short runs at least, by which they outweigh the work of Python for a block.
_WORTH_A_BLOCK = 50_000
#: Kept statistics of each column of a run.
EXTREMES = ("min", "max", "final")


@dataclass(frozen=True)
class FailedSample:
    """A sample with a failed run: number, reason, and varied quantities by name."""

    number: int
    reason: str
    values: Mapping[str, float]


class _StoppedError(Exception):
    """A run without a receiver."""


@dataclass(frozen=True)
class SampleBlock:
    """Samples that were run together.

    Attributes
    ----------
    first : number of the first sample
    values : (samples, varied)
    rows : (samples, columns, times), NaN if a sample failed or ended before
    extremes : (samples, columns, 3), by ``EXTREMES``
    reduced : statistics of the samples, if these were reduced elsewhere: then there are no rows
    """

    first: int
    values: Array
    rows: Array
    extremes: Array
    failed: tuple[FailedSample, ...] = ()
    reduced: ReducedSamples | None = None


@dataclass(frozen=True)
class EnsemblePart:
    """Samples that a process of a cluster has run: content alone, never a path of the process, never machine code.

    Attributes
    ----------
    solutions : number of a sample -> the file of the sample's solution, for solutions to be kept
    seconds : that the samples took, without the model's compilation
    code : digest of the compiled model
    how : of ``SampleRunner``
    """

    block: SampleBlock
    solutions: Mapping[int, bytes]
    seconds: float
    code: str
    how: str


@dataclass
class SampleRunner:
    """Runs blocks of the samples of a design.

    Attributes
    ----------
    columns : names of the columns of solutions that are looked at
    times : (rows,) s, of the rows of whole runs
    thinned : places of the rows that are reduced
    alike : common part of the runs
    keep : numbers of samples whose solutions are written to ``folder``, as files that end in ``keep_as``
    stop : set if no further sample is to begin
    """

    model: CompiledModel
    design: Design
    options: VariedOptions
    span: tuple[float | str | None, float | str | None]
    columns: Sequence[str]
    times: Array
    thinned: Array
    alike: CommonRunData
    keep: frozenset[int] = frozenset()
    keep_as: str = "npz"
    folder: Path | None = None
    #: Device of the runs; on others than processors each block but the last one has ``block_size`` samples.
    device: ClassVar[str] = "cpu"
    stop: threading.Event = field(default_factory=threading.Event)
    #: Lock for threads that begin together: one thread makes lanes, the other threads wait.
    _making: threading.Lock = field(default_factory=threading.Lock, init=False, repr=False)
    _made: LaneRunner | str | None = field(default=None, init=False, repr=False)

    @staticmethod
    def block_size(samples: int, work: int, numbers: int, tables: int = 0) -> int:
        """Return the largest number of samples of a block for a design of `samples`: the same on every machine. `work`
        counts the evaluations times degrees of freedom of one sample, `numbers` the kept numbers of one sample,
        `tables` the numbers of its inputs that change with time.

        A block has 256 samples at most, or 4096 of short runs, or the samples of 8 MB; threads share four blocks at
        least, sixteen of a small ensemble.
        """
        worth = min(-(-_WORTH_A_BLOCK // max(work, 1)), 4096, 2**20 // numbers)
        shared = worth if samples <= worth else min(worth, -(-samples // 4))
        return max(1, shared, min(256, -(-samples // 16)))

    def prepare(self, count: int) -> None:
        """Raise an error if the device cannot run blocks of ``count`` samples; before a folder is made."""

    def block(self, first: int, count: int) -> SampleBlock | None:
        """Run `count` samples from number `first` on, and return them as a block; None if ``stop`` is set meanwhile."""
        values = self.design.values(first, count)
        rows, extremes = self.unknown(count)
        alone = self._side_by_side(first, values, rows, extremes)
        failed = self.run_alone(first, values, ((k, rows[k], extremes[k]) for k in alone))
        return None if failed is None else SampleBlock(first, values, rows, extremes, failed)

    def run_alone(
        self, first: int, values: Array, samples: Iterable[tuple[int, Array, Array]]
    ) -> tuple[FailedSample, ...] | None:
        """Run samples one by one, each given by the index in `values` (n, d) and by rows (columns, times) and extremes
        (columns, 3), which are filled in place. Returns the failed ones; None if ``stop`` is set meanwhile."""
        failed: list[FailedSample] = []
        for k, rows, extremes in samples:
            if self.stop.is_set():
                return None
            try:
                reason = self._one(first + k, values[k], rows, extremes)
            except _StoppedError:
                return None
            if reason:
                names = (item.name for item in self.options.items)
                failed.append(FailedSample(first + k, reason, dict(zip(names, values[k].tolist(), strict=True))))
        return tuple(failed)

    @property
    def lanes(self) -> LaneRunner | str:
        """The runner of samples side by side, or in words the reason for runs one after the other; made, with the code
        compiled, at first use."""
        with self._making:
            if self._made is None:
                runs = self.setup_of(side_by_side)
                self._made = runs if isinstance(runs, str) else LaneRunner(self.model, self.options, runs)
                _LOG.info("%s: samples run %s", self.model.name, self.how)
            return self._made

    def setup_of(self, make: Callable[..., SideBySide | str]) -> SideBySide | str:
        """Return the setup of runs by ``side_by_side`` or ``common_runs``, or the reason for which there is none."""
        options = self.options
        common = with_scenes_laws(self.model, options.items, options.common)
        inputs = [item.name for item in options.items if item.block == "inputs"]
        initial = any(item.block in ("q", "v", "z") for item in options.items)
        return make(self.model, common, inputs, self.alike, self.columns, initial_varies=initial)

    @property
    def how(self) -> str:
        """Description of the runs: ``side by side: 4 lanes``, or one after the other and the reason; empty before the
        first block."""
        if isinstance(self._made, LaneRunner):
            return f"side by side: {self._made.runs.count} lanes"
        return f"one after the other: {self._made}" if self._made else ""

    def _side_by_side(self, first: int, values: Array, rows: Array, extremes: Array) -> list[int]:
        """Run samples with values (n, d) side by side, fill their rows and extremes in place, and return the indices of
        samples that have to run alone: failures, samples whose solutions are kept, or all if lanes are not possible."""
        lanes = self.lanes
        if isinstance(lanes, str):
            return list(range(len(values)))
        kept = np.array([number - first for number in sorted(self.keep) if 0 <= number - first < len(values)], np.intp)
        left: list[int] = kept.tolist()
        others = np.delete(np.arange(len(values)), kept) if left else np.arange(len(values))
        together = lanes.runs.together
        for begin in range(0, len(others), together):
            if self.stop.is_set():
                break
            chosen = others[begin : begin + together]
            if lanes.runs.run.method.chooses_steps:  # a lane that is done waits for the last of its group
                chosen = chosen[neighbours(values[chosen], lanes.runs.count)]
            tables = lanes.tables(values[chosen])
            alone = tables.alone
            known = np.isfinite(tables.columns)
            if not known.all():
                here = np.arange(tables.columns.shape[2]) < tables.rows[:, np.newaxis]
                alone = alone | ~(known.all(axis=1) | ~here).all(axis=1)
            whole = ~alone & (tables.rows == len(self.times))
            columns = tables.columns if whole.all() else tables.columns[whole]
            rows[chosen[whole]] = columns[:, :, self.thinned]
            extremes[chosen[whole]] = extremes_of(columns)
            for k in np.flatnonzero(~(alone | whole)):
                sample = chosen[k]
                self._fill(tables.columns[k, :, : tables.rows[k]], tables.ends[k], rows[sample], extremes[sample])
            left += chosen[alone].tolist()
        return sorted(left)

    def save_those_before(self, first: int) -> None:
        """Repeat earlier samples whose solutions are to be kept, and are not kept yet."""
        for number in sorted(self.keep):
            if number < first and self.folder is not None and not self.file(number).exists():
                rows, extremes = self.unknown(1)
                self._one(number, self.design.values(number, 1)[0], rows[0], extremes[0])

    def unknown(self, count: int) -> tuple[Array, Array]:
        """Return rows (count, columns, times) and extremes (count, columns, 3) that are still to be filled."""
        rows = np.full((count, len(self.columns), len(self.thinned)), np.nan)
        return rows, np.full((count, len(self.columns), len(EXTREMES)), np.nan)

    def file(self, number: int) -> Path:
        """Return the file of the solution of a sample."""
        return (self.folder or Path()) / f"sample_{number:07d}.{self.keep_as}"

    def _look(self, done: int, steps: int) -> None:
        """End a run if no more samples are wanted; called every tenth of a second."""
        if self.stop.is_set():
            raise _StoppedError

    def _one(self, number: int, values: Array, rows: Array, extremes: Array) -> str:
        """Run one sample alone with values (d,), and fill rows (columns, times) and extremes (columns, 3) in place.
        Returns the reason of a failure, empty for success. A kept sample's solution is written to the folder. Raises
        FileError for the disk."""
        try:
            solution = simulate(
                self.model, *self.span, **self.options.of(values), error_estimate=False, progress=self._look
            )
            reason = "" if solution.success else solution.message
        except FileError:  # the disk's fault, and no sample's
            raise
        except EomgenError as error:
            return "; ".join(map(str, error.problems))  # a failure of the run, not of a call: without its title
        if number in self.keep and self.folder is not None:
            solution.save(self.file(number))
        if reason:
            return reason
        table = table_of(self.model, solution, self.columns)
        if not np.all(np.isfinite(table[:, -1])):
            wrong = [name for name, value in zip(self.columns, table[:, -1], strict=True) if not np.isfinite(value)]
            return f"{wrong[0]} is not finite at the end"
        self._fill(table, float(solution.t[-1]), rows, extremes)
        return ""

    def _fill(self, table: Array, end: float, rows: Array, extremes: Array) -> None:
        """Fill rows (columns, times) and extremes (columns, 3), in place, from the columns (columns, rows) of a run. A
        run that an event stopped at `end` in s has rows up to this time only."""
        extremes[:] = extremes_of(table)
        if table.shape[1] == len(self.times):
            rows[:] = table[:, self.thinned]
        else:  # stopped by an event
            met = self.thinned[self.times[self.thinned] <= end]
            met = met[met < table.shape[1]]
            rows[:, : len(met)] = table[:, met]


def neighbours(values: Array, lanes: int) -> NDArray[np.intp]:
    """Return an order (n,) of samples in which lanes hold samples of similar values (n, d), which need similar numbers
    of steps: halves by one quantity after the other, down to the lanes (J. L. Bentley, Commun. ACM 18 (1975) 509)."""
    count, quantities = values.shape
    halvings = max(0, count - 1).bit_length() - max(0, lanes - 1).bit_length()
    if halvings <= 0 or not quantities:
        return np.arange(count)
    size = lanes << (max(halvings, (-(-count // lanes) - 1).bit_length()))
    filled = np.full((size, quantities), np.inf)
    filled[:count] = values
    order = np.arange(size)[np.newaxis]
    for k in range((size // lanes).bit_length() - 1):
        places = np.argsort(filled[order, k % quantities], axis=1, kind="stable")
        order = np.take_along_axis(order, places, 1).reshape(2 * len(order), -1)
    result: NDArray[np.intp] = order.ravel()
    return np.asarray(result[result < count], np.intp)


def extremes_of(table: Array) -> Array:
    """Return the smallest, the largest and the last value of columns (..., columns, rows), (..., columns, 3)."""
    result = np.empty((*table.shape[:-1], 3))
    result[..., 0], result[..., 1] = np.fmin.reduce(table, axis=-1), np.fmax.reduce(table, axis=-1)
    result[..., 2] = table[..., -1]
    return result


def table_of(model: CompiledModel, solution: Solution, columns: Sequence[str]) -> Array:
    """Return columns of a solution, (columns, rows)."""
    every: Mapping[str, Any] = {**solution.columns(), **event_counts(model, solution)}
    return np.array([every[name] for name in columns])


def event_counts(model: CompiledModel, solution: Solution) -> dict[str, Array]:
    """Return the numbers (rows,) of the events of each name until each row, by column: ``event.NAME``. Events of the
    action ``count`` have no times, and no column."""
    data = model.library.layout["method"].get("events", {"rows": []})
    times = {row["name"]: solution.events[row["name"]].t for row in data["rows"] if row["action"] != "count"}
    return {f"event.{name}": np.searchsorted(t, solution.t, "right").astype(float) for name, t in times.items()}
