"""Ensembles on a GPU: a thread for each sample, statistics over samples reduced on the device.

The device is one more executor of the contract of ``SampleRunner``: it takes the same parameters, inputs and starts as
lanes, and samples that fail a check there are repeated alone on the processor, with all checks and reasons.
"""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.compiled.equations import ENERGIES
from eomgen.compiled.model import CompiledModel
from eomgen.errors import NumericalError, Problem, UsageError
from eomgen.pipeline.content import library_content
from eomgen.pipeline.documents import as_document
from eomgen.pipeline.generation import exported_program
from eomgen.products.ensembles.samples import LaneRunner, SampleBlock, SampleRunner
from eomgen.products.ensembles.side_by_side import SideBySide, common_runs, machine_sizes
from eomgen.products.ensembles.statistics import CENTROIDS, ReducedSamples, are_kept, places_of_centroids
from eomgen.products.gpu.driver import Device, Function, Memory, Module, driver
from eomgen.products.gpu.nvrtc import EXACT, Cubin, compile_cubin, nvrtc, options_for
from eomgen.products.gpu.target import CUDA, RUNS, run_texts
from eomgen.system.terms import Selection
from eomgen.toolchain.library import Library

#: Samples of a chunk at most and at least, numbers of the record at most, and evaluations times degrees of freedom from
#: which on there are fewer samples, so that a chunk takes about a second: for progress and Ctrl-C.
_MOST, _LEAST, _RECORD, _WORK = 2**17, 2**13, 2**27, 2e11
#: Threads that a multiprocessor holds, each of which has a stack as soon as a kernel is started.
_RESIDENT = 2048
#: Largest violation of constraints, in sizes of the machine, above which a sample is checked alone;
#: samples fail from 1e-3 on.
_VIOLATION = 1e-5


class SampleArray(ctypes.Structure):
    """An array of samples, as ``eg_array`` of ``eomgen_cuda.h``; by default the address NULL."""

    _fields_ = (("at", ctypes.c_void_p), ("sample", ctypes.c_longlong), ("component", ctypes.c_longlong))


@dataclass(frozen=True)
class _Kernels:
    """The code of a model on a device.

    Attributes
    ----------
    columns : number of columns of the record
    rows : (rows, 3), steps before each row, and the codes of its uses, also for the row of an event before it
    times : (rows,) s, from which on the row of an event before a row takes its place in the record
    """

    device: Device
    module: Module
    prefix: str
    columns: int
    rows: NDArray[np.intc]
    times: Array
    places: int

    @property
    def runs(self) -> Function:
        return self.module.function(f"{self.prefix}_runs")

    def reduce(self, name: str, threads: int, *arguments: Any) -> None:
        """Run a kernel of reductions, with memory or whole numbers as arguments."""
        self.module.function(name).launch(threads, [_argument(item) for item in arguments])


def _argument(item: Memory | int) -> Any:
    return ctypes.c_longlong(item) if isinstance(item, int) else ctypes.c_void_p(item.pointer)


class DeviceSamples(SampleRunner):
    """Runs chunks of the samples of a design on a GPU."""

    device = "gpu"

    @staticmethod
    def block_size(samples: int, work: int, numbers: int, tables: int = 0) -> int:
        """Return the number of samples of a chunk, the same on every machine. `work` counts the evaluations times
        degrees of freedom of one sample, `numbers` the kept numbers of one sample, `tables` the numbers of its inputs
        that change with time."""
        by_work = max(_LEAST, int(_WORK / max(work, 1)))
        most = max(1, min(_MOST, by_work, _RECORD // (numbers + tables)))
        return min(samples, 1 << (most.bit_length() - 1))

    @cached_property
    def _setup(self) -> tuple[LaneRunner, _Kernels]:
        """The runs of samples and their code, made at first use. Raises UsageError for parts of a run that no device
        has."""
        model, options = self.model, self.options
        if self.options.common.get("controllers"):
            fault = "controllers are functions of Python, which no device can call"
            raise _refusal(fault, 'sampled controllers in C, or by formulas; device="cpu"')
        runs = self.setup_of(common_runs)
        if isinstance(runs, str):
            raise _refusal(runs)
        library, device = runs.library, driver().device(0)
        places = self.alike.places
        code = compile_runs(model, runs.run.name, library, self.columns, places, device.architecture)
        module = device.load(code.image)
        rows = self._rows(runs)
        kernels = _Kernels(device, module, library.layout["prefix"], len(self.columns), *rows, len(self.thinned))
        return LaneRunner(model, options, runs), kernels

    def _rows(self, runs: SideBySide) -> tuple[NDArray[np.intc], Array]:
        """Return rows and times of ``_Kernels`` for each checked row."""
        grid, every = runs.run.grid, runs.between
        steps = [0, *[every] * (grid.whole // every), *filter(None, [grid.whole % every]), *[-1] * (grid.rest > 0.0)]
        count = len(steps)
        use = np.zeros(count, np.intc)
        recorded = runs.recorded_rows(count)
        use[recorded] = 1
        use[runs.rows_with_energies(count)] |= 2
        if not runs.run.method.chooses_steps:
            use[3 * count // 4 :] |= 4
        use[recorded[self.thinned]] += 8 * np.arange(1, 1 + len(self.thinned), dtype=np.intc)
        place = np.searchsorted(recorded, np.arange(count))  # an event's row follows the recorded rows before it
        stopped = (use[recorded][place] & ~7) | (use[-1] & 4) | 3
        times = np.append(self.times[:-1], -np.inf)[place]  # the last row, as of a whole run
        return np.ascontiguousarray(np.stack([np.array(steps, np.intc), use, stopped], axis=1)), times

    @property
    def lanes(self) -> LaneRunner | str:
        """The runner of samples, for which the code is compiled at first use."""
        return self._setup[0]

    @property
    def how(self) -> str:
        """Description of the runs: ``on the device H100``."""
        return f"on the device {self._setup[1].device.name}" if "_setup" in self.__dict__ else ""

    @cached_property
    def _size(self) -> float:
        """Size of the machine at the scene's initial configuration, by which violations of constraints are judged."""
        runs = self._setup[0].runs
        row = np.concatenate([[runs.run.grid.start], self.model.initial_q])[np.newaxis, np.newaxis]
        return float(machine_sizes(self.model, row, runs.run.parameters[np.newaxis])[0])

    def prepare(self, count: int) -> None:
        """Compile the code at first use. Raises UsageError for parts of a run that no device has, and NumericalError if
        the device has not the memory for a chunk of ``count`` samples."""
        lanes, kernels = self._setup
        model, cells = self.model, len(self.columns) * len(self.thinned)
        parts = 1 << ((count - 1).bit_length() + 1) // 2
        each = 2 + len(model.parameters) + 3 * kernels.columns + model.nq + 2 * model.nv + model.nz + model.nu
        rows = len(lanes.runs.input_times) * model.nu if lanes.runs.needs_input_tables else 0
        alike = all(item.block in ("q", "v", "z") for item in self.options.items)
        needed = {
            "record": 8 * cells * count,
            "samples": 8 * count * each,
            "inputs": 8 * rows * (1 if alike else count),
            "sums": 8 * parts * cells * (4 + (kernels.columns + 1) // 2),
            "stacks of threads": kernels.runs.local_bytes * kernels.device.processors * _RESIDENT,
        }
        free, total = kernels.device.memory()
        if sum(needed.values()) > free:
            parts_of = ", ".join(f"{name} {size / 1e9:.3g} GB" for name, size in needed.items() if size)
            fault = f"{count} samples need {sum(needed.values()) / 1e9:.3g} GB ({parts_of}), and {free / 1e9:.3g} of"
            fault = f"{fault} {total / 1e9:.3g} GB are free [E2303]"
            raise NumericalError(Problem(f"memory of {kernels.device.name}", fault, "fewer columns or points"))

    @property
    def _number(self) -> type[np.floating[Any]]:
        """Number type of the model on the device; parameters and results are doubles."""
        return np.float32 if self.model.library.real == "float" else np.float64

    # -- a chunk -------------------------------------------------------------------------------------------------------

    def block(self, first: int, count: int) -> SampleBlock | None:
        """Run `count` samples from number `first` on, and return them as a block with reduced statistics; None if
        ``stop`` is set meanwhile."""
        lanes, kernels = self._setup
        values = self.design.values(first, count)
        parameters, inputs, starts, alone = lanes.begin(values, common=True)
        cells = len(self.columns) * len(self.thinned)
        record = kernels.device.allocate(8 * cells * count).forget()
        extremes, findings, most = self._run(lanes, kernels, parameters, inputs, starts, record)
        alone[[number - first for number in self.keep if 0 <= number - first < count]] = True
        alone |= (findings != 0) | ~(most <= _VIOLATION * self._size)
        again = np.flatnonzero(alone)
        rows, ends = self.unknown(len(again))
        failed = self.run_alone(first, values, zip(again.tolist(), rows, ends, strict=True))
        if failed is None:
            return None
        extremes[again] = ends
        whole = True
        if len(again):
            self._put(kernels, record, rows, again, count)
            known = np.isfinite(rows)
            whole = bool((known.all(axis=1) == known.any(axis=1)).all())
        reduced = self._reduce(kernels, record, count, by_device=whole)
        return SampleBlock(first, values, rows[:0], extremes, failed, reduced)

    def _run(
        self,
        lanes: LaneRunner,
        kernels: _Kernels,
        parameters: Array,
        inputs: Array | None,
        starts: Array,
        record: Memory,
    ) -> tuple[Array, NDArray[np.intc], Array]:
        """Run a chunk, and return extremes (samples, columns, 3), findings and largest violations (samples,)."""
        device, run = kernels.device, lanes.runs.run
        count, columns, numbers = len(starts), kernels.columns, np.array([*run.settings.values(), 0.0])
        states = np.concatenate([np.full((count, 1), run.grid.start), starts], axis=1)
        kept: list[Memory] = []

        def place(rows: Array | None, *, along: bool = False) -> SampleArray:
            """Return an array on the device: of each sample, or common to all if there is one row."""
            if rows is None:
                return SampleArray()
            kept.append(device.upload(rows if along else np.ascontiguousarray(rows.T)))
            many = len(rows) > 1
            size = rows[0].size
            return SampleArray(kept[-1].pointer, (size if along else 1) * many, 1 if along else len(rows))

        def memory(item: Memory) -> ctypes.c_void_p:
            kept.append(item)
            return ctypes.c_void_p(item.pointer)

        harmonics = lanes.runs.library.layout["method"].get("harmonics", {})
        tables = inputs if lanes.runs.needs_input_tables else None
        held = None if tables is not None else inputs
        if not (parameters != parameters[0]).any():
            parameters = parameters[:1]
        extremes, most = np.empty((3, columns, count)), np.empty(count)
        findings = np.empty(count, np.intc)
        arguments = [
            place(numbers[np.newaxis]),
            place(parameters),
            place(states),
            place(held),
            place(tables if tables is None else tables.astype(self._number), along=True),
            memory(device.upload(kernels.rows)),
            memory(device.upload(kernels.times)),
            ctypes.c_int(len(kernels.rows)),
            ctypes.c_double(run.grid.rest),
            ctypes.c_double(run.grid.end),
            memory(device.allocate(32 * harmonics.get("frequencies", 0) * harmonics.get("pairs", 0))),
            memory(record),
        ]
        results: list[NDArray[Any]] = [extremes, findings, most]
        there = [device.allocate(array.nbytes) for array in results]
        arguments += [*map(memory, there), ctypes.c_longlong(count)]
        kernels.runs.launch(count, arguments)
        for source, array in zip(there, results, strict=True):
            source.read(array)
        return np.ascontiguousarray(extremes.transpose(2, 1, 0)), findings, most

    def _put(self, kernels: _Kernels, record: Memory, rows: Array, numbers: NDArray[np.intp], count: int) -> None:
        """Put rows (samples, columns, times) of samples that ran alone, by number, into the record."""
        cells = np.ascontiguousarray(rows.transpose(0, 2, 1)).reshape(len(rows), -1)
        there, places = kernels.device.upload(cells), kernels.device.upload(numbers.astype(np.int64))
        kernels.reduce("eg_put", cells.size, record, there, places, len(rows), cells.shape[1], count)
        kernels.device.wait()

    def _reduce(self, kernels: _Kernels, record: Memory, count: int, *, by_device: bool) -> ReducedSamples:
        """Return the statistics of a record of `count` samples, each known at a time in all columns or in none; other
        samples are reduced by the processor."""
        device, columns, times = kernels.device, kernels.columns, kernels.places
        cells, total = columns * times, columns * times * self.design.samples
        if not by_device:
            whole = record.read(np.empty((times, columns, count)))
            return ReducedSamples.of(np.ascontiguousarray(whole.transpose(2, 1, 0)))
        parts = 1 << ((count - 1).bit_length() + 1) // 2  # as many as samples of a part
        sums = np.empty((cells, parts, 4))
        there = device.allocate(sums.nbytes)
        kernels.reduce("eg_sums", cells * parts, record, there, cells, parts, count)
        there.read(sums)
        known, added = sums[..., 0].sum(axis=1), sums[..., 1].sum(axis=1)
        mean = added / np.maximum(known, 1.0)
        pairs = columns * (columns + 1) // 2
        products = np.empty((times, pairs, parts))
        there = device.allocate(products.nbytes)
        middle = device.upload(mean)
        kernels.reduce("eg_products", products.size, record, middle, there, times, columns, parts, count)
        there.read(products)
        square = np.empty((times, columns, columns))
        a, b = np.tril_indices(columns)
        square[:, a, b] = square[:, b, a] = products.sum(axis=2)
        self._sort(kernels, record, cells, count)
        moments = (known, mean, square.diagonal(axis1=1, axis2=2), sums[..., 2].min(axis=1), sums[..., 3].max(axis=1))
        count_, mean_, squares, low, high = (part.reshape(times, columns).T for part in moments)
        ends = low, high, count_[0], mean_.T
        kept, centroids, weights = None, None, None
        if are_kept(total):
            kept = _cells(record.read(np.empty((times, columns, count))))
        else:
            centroids, weights = (_cells(part) for part in self._centroids(kernels, record, known, count))
        return ReducedSamples(count_, mean_, squares, *ends, square, kept, centroids, weights)

    def _sort(self, kernels: _Kernels, record: Memory, cells: int, count: int) -> None:
        """Sort the numbers of each cell of the record by a network of pairs (K. E. Batcher, AFIPS 32 (1968) 307)."""
        size, pairs = 2, 1 << max(0, (count - 1).bit_length() - 1)
        while size < 2 * count:
            part, turned = size, 1
            while part > 1:
                arguments = [
                    _argument(record),
                    *map(_argument, (cells, pairs, part)),
                    ctypes.c_int(turned),
                    _argument(count),
                ]
                kernels.module.function("eg_sort").launch(cells * pairs, arguments)
                part, turned = (part // 2, 0)
            size *= 2
        kernels.device.wait()

    def _centroids(self, kernels: _Kernels, record: Memory, known: Array, count: int) -> tuple[Array, Array]:
        """Return the centroids of a sorted record and their weights, (times, columns, centroids) each."""
        columns, times = kernels.columns, kernels.places
        counts, which = np.unique(known.astype(int), return_inverse=True)
        edges = np.array([places_of_centroids(number) for number in counts], np.intc)[which]
        result = np.empty((times, columns, CENTROIDS))
        there, at = kernels.device.allocate(result.nbytes), kernels.device.upload(edges)
        kernels.reduce("eg_centroids", result.size, record, at, there, len(edges), CENTROIDS, count)
        return there.read(result), np.diff(edges).astype(float).reshape(result.shape)


def _cells(record: Array) -> Array:
    """Return the numbers (times, columns, n) by column and time, (columns * times, n)."""
    return np.ascontiguousarray(record.transpose(1, 0, 2)).reshape(-1, record.shape[2])


def _refusal(fault: str, remedy: str = 'device="cpu"') -> UsageError:
    return UsageError(Problem("device", f"samples cannot run on a device: {fault} [E2304]", remedy))


def compile_runs(
    model: CompiledModel,
    method: str,
    library: Library,
    columns: Sequence[str],
    places: Mapping[str, tuple[str, int]],
    architecture: str,
) -> Cubin:
    """Return the machine code that runs samples of a model by a method and records some columns, from the cache if
    possible. ``library`` has the stepper; ``places`` are of ``CommonRunData``."""
    document, front_end = as_document(model.scene)
    selection = Selection.from_data(library.layout["selection"])  # derived with other terms, equations have other bits
    if selection.terms is not None:
        wanted = [name for name in ("outputs", "energy", "poses") if name in model.functions]
        selection = Selection(tuple(dict.fromkeys((*selection.terms, *wanted))), selection.start)
    values = [f"take({k}, {_value(model, library, *places[name])})" for k, name in enumerate(columns)]
    head = f"#define EG_COLUMN_COUNT {len(columns)}\n#define EG_COLUMNS(take) {' '.join(values)}\n"
    if model.description.exact_beams and "poses" in model.functions:
        pose = {name: f"{7 * k}" for k, name in enumerate(model.bodies)}
        pairs = (f"{{ {pose[a]}, {pose[b]} }}" for nodes in model.description.exact_beams for a, b in pairwise(nodes))
        head += f"#define EG_TURNS {{ {', '.join(pairs)} }}\n"

    def texts() -> tuple[Mapping[str, str], Sequence[str]]:
        program, refusal = exported_program(document, front_end, CUDA, selection.terms, method)
        if refusal:
            raise _refusal(refusal)
        files, size = run_texts(program, head, library.real)
        return files, options_for(size, nvrtc().version)

    content = library_content(document, front_end, selection, method) + head.encode()
    options = (*EXACT, *(["-DEOMGEN_REAL_FLOAT"] if library.real == "float" else []))
    return compile_cubin(texts, RUNS, architecture, options, content=content)


def _value(model: CompiledModel, library: Library, group: str, index: int) -> str:
    """Return the text of a column in the kernel of runs, by its place in ``CommonRunData.places``."""
    kind, _, name = group.partition(".")
    if kind == "event":
        return f"(double)state.event_state.count[{index}]"
    if kind == "input":
        return f"input[{index}]"
    if kind == "energy":
        return "(double)energy[0] + energy[1]" if name == "total" else f"energy[{ENERGIES.index(name)}]"
    if kind == "output":
        items = model.library.layout["outputs"]
        names = [item["name"] for item in items]
        return f"output[{sum(int(item['size']) for item in items[: names.index(name)]) + index}]"
    nq, nv, row = model.nq, model.nv, sum(int(size) for _, size in library.layout["method"]["row"])
    first = {"t": 0, "q": 1, "v": 1 + nq, "a": 1 + nq + nv, "multipliers": 1 + nq + 2 * nv, "z": row - model.nz}[group]
    return f"line[{first + index}]"
