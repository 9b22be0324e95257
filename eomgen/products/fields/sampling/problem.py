"""From a file of fields to a posterior: memory first, then operators, data from files or drawn, and the energy."""

from __future__ import annotations

import contextlib
import hashlib
import math
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.csv_tables import read_table
from eomgen.base.data import dataclass
from eomgen.base.files import nearby, open_file
from eomgen.base.messages import counted, listed, nearest
from eomgen.base.rounding import COMPUTED, SUMMED
from eomgen.errors import DescriptionError, EomgenError, FileError, ModelError, Problem, UsageError
from eomgen.formula.evaluate import evaluate_batch, symbols
from eomgen.formula.nodes import Formula
from eomgen.products.fields.documents.document import DRAWN, OF_PLACES, OF_WAVES, VARIANCE, Data, FieldSystem, Operator
from eomgen.products.fields.documents.tables import PowerTable
from eomgen.products.fields.posteriors import (
    CellEnergy,
    FieldPosterior,
    LinearOperator,
    Mesh,
    amplitude,
    check_transforms,
    difference,
    lognormal_amplitude,
    mask,
    smoothing,
    white,
)
from eomgen.products.fields.posteriors.mesh import numbers_of_cells

#: Columns kept of each trajectory, besides cells and bins of a sample.
TRAJECTORY = ("dH", "accepted", "gradients", "U")
Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class FieldProblem:
    """A posterior that a file describes.

    Attributes
    ----------
    operators : all of the file, by name
    truth : the white field, as a spectrum, that data were drawn about; None if there is none
    memory : bytes that sampling takes, worked out before anything was made
    digest : of all inputs that determine the posterior, including data
    """

    system: FieldSystem
    posterior: FieldPosterior
    operators: Mapping[str, LinearOperator]
    truth: Complex | None
    memory: int
    digest: str

    @property
    def mesh(self) -> Mesh:
        return self.posterior.mesh

    @property
    def watched(self) -> str:
        """Name of the field whose samples are recorded."""
        return self.system.sampling.field or self.system.fields[0]

    @property
    def notes(self) -> list[str]:
        """Notes on the file, and deviations of each field in the energy from the request in the file."""
        deviations = [f"{name}: {note}" for name in self.system.fields if (note := self.operators[name].note)]
        return [*self.system.notes, *deviations]

    def true_field(self) -> Array | None:
        """Return the watched field of the truth.

        Returns
        -------
        ndarray or None
            Shape of the mesh; None without a truth.
        """
        return None if self.truth is None else self.operators[self.watched].apply(self.truth)


def field_problem(system: FieldSystem, chains: int = 0) -> FieldProblem:
    """Return the posterior that a file describes: read or draw the data, and compile the energy of a cell.

    Parameters
    ----------
    system : FieldSystem
        The file.
    chains : int, optional
        Number of chains for which there has to be memory; 0: the file's.

    Returns
    -------
    FieldProblem
        The posterior with operators, truth (None without ``[truth]`` in the file) and memory.

    Raises
    ------
    ModelError
        A mesh that does not fit the memory, negative power, a power or filter that differs at k and -k, a field that is
        0 or has an infinite variance, data that cannot be or have another shape than the mesh.
    DescriptionError
        A formula of the energy that cannot be taken.
    FileError
        A file of data or of a power spectrum cannot be read, holds another kind of table or array, or does not cover
        the wave numbers of the mesh.
    UsageError
        Transforms or a precision that there are not, or FFTW without its package.
    """
    check_transforms(system.sampling.transforms, system.sampling.precision)
    memory = memory_of(system, chains)
    mesh = Mesh(system.cells, system.lengths)
    made = _FileObjects(system, mesh)
    for item in system.data:
        if item.kind not in DRAWN:
            made.data[item.name] = made.fixed_data(item)
    for operator in system.operators:
        with _at(system, f"operators.{operator.name}"):
            made.operators[operator.name] = made.operator(operator)
    for name in system.fields:
        with _at(system, f"operators.{name}"):
            if made.operators[name].variance == 0.0:
                fault = f"the field {name} is 0 in all cells, and so are all of its samples [E0833]"
                raise ModelError(Problem("operator", fault, "a power, a filter or a mask that is not 0 everywhere"))
    truth = None
    if system.truth is not None:
        truth = mesh.white(np.random.Generator(np.random.Philox(system.truth)))
        made.draw(system.truth, truth)
    energy = CellEnergy(
        system.energy,
        system.where,
        {**system.parameter_values, **made.variances()},
        {item.name: item.minimum for item in system.data if item.minimum is not None},
        system.definitions,
    )
    with _at(system, "cell.energy"):
        posterior = FieldPosterior(
            mesh,
            energy,
            {name: made.operators[name] for name in system.fields},
            {name: made.data[name] for name in system.columns},
            transforms=system.sampling.transforms,
            precision=system.sampling.precision,
        )
    digest = hashlib.sha256(system.content)
    for values in made.data.values():
        digest.update(np.ascontiguousarray(values).tobytes())
    return FieldProblem(system, posterior, made.operators, truth, memory, digest.hexdigest())


def memory_of(system: FieldSystem, chains: int = 0) -> int:
    """Return the largest number of bytes of all arrays that sampling takes, without making an array.

    Parameters
    ----------
    system : FieldSystem
        The file; samples, trajectories of the warm-up and watched cells are as in its ``[sampling]``.
    chains : int, optional
        Number of chains; 0: the file's.

    Returns
    -------
    int
        Bytes.

    Raises
    ------
    ModelError
        The machine has less physical memory, or the mesh cannot be.
    """
    chains = chains or system.sampling.chains
    filters = sum(2 if item.kind == "difference" else 1 for item in system.operators)  # twice half a field each
    masks = sum(2 for item in system.operators if item.kind == "mask")
    single = system.sampling.precision == "single"  # a spectrum and fields in addition to the double ones
    fields = (3 if single else 2) * len(system.fields) + 2 * len(system.data) + filters + masks
    # fields in a record of samples and in the results: mean, squares, change, deviation, and temporary ones
    fields += 6 + 2 * (system.truth is not None)
    chosen = system.sampling
    with _at(system, "mesh.cells"):
        mesh = Mesh(system.cells, system.lengths)
        slopes = 0 if chosen.first == "drift" else 1 + chains  # gradients if trajectories begin with kicks
        watched = min(chosen.watched, mesh.size) + chosen.bins + len(TRAJECTORY)
        numbers = chains * (chosen.samples * watched + chosen.warm_up * len(TRAJECTORY))
        purpose = f"sampling with {counted(chains, 'chain')}"
        # a trajectory and Newton's method hold nine half spectra at most, besides the chains
        return mesh.require_memory(9 + chains + slopes + single, fields, purpose, numbers)


@contextlib.contextmanager
def at_settings(system: FieldSystem, given: Collection[str] = ()) -> Iterator[None]:
    """Add the line of the file to the error of transforms whose package is not installed, within a ``with`` statement.

    Parameters
    ----------
    system : FieldSystem
        The file, whose other settings have been checked.
    given : collection of str, optional
        Settings of the caller, whose errors stay as they are.

    Yields
    ------
    None
        Within the statement.

    Raises
    ------
    DescriptionError
        In place of a UsageError about ``transforms`` in the file. All other errors stay.
    """
    try:
        yield
    except UsageError as error:
        key, (problem, *_) = "sampling.transforms", error.problems
        if problem.where != "transforms" or "transforms" in given or key not in system.places:
            raise
        raise DescriptionError(Problem(system.place(key), problem.what, problem.hint)) from None


@contextlib.contextmanager
def _at(system: FieldSystem, key: str) -> Iterator[None]:
    """Within a ``with`` statement, change errors to name a place in the file: data named by the error, else ``key``.
    Errors of files stay."""
    try:
        yield
    except EomgenError as error:
        if isinstance(error, FileError):
            raise
        said = set(system.places.values())
        problems = []
        for problem in error.problems:
            where = problem.where if problem.where.startswith("data.") else key
            where = problem.where if problem.where in said else system.place(where)
            problems.append(Problem(where, problem.what, problem.hint))
        raise (DescriptionError if isinstance(error, DescriptionError) else ModelError)(problems) from None


class _FileObjects:
    """Operators and data of a file, as arrays on the mesh of the file; callers fill ``operators`` and ``data`` by
    name."""

    def __init__(self, system: FieldSystem, mesh: Mesh) -> None:
        self.system, self.mesh = system, mesh
        self.values = system.parameter_values
        self.data: dict[str, Array] = {}
        self.operators: dict[str, LinearOperator] = {}

    def variances(self) -> dict[str, float]:
        """Return the variances of the fields by their names in formulas, NAME_variance."""
        return {f"{name}{VARIANCE}": operator.variance for name, operator in self.operators.items()}

    # -- operators ---------------------------------------------------------------------------------------------------

    def operator(self, item: Operator) -> LinearOperator:
        """Return the operator of an entry, composed with the preceding operator. Raises ModelError for an infinite
        variance."""
        mesh = self.mesh
        if item.kind == "white":
            made = white(mesh)
        elif item.kind == "difference":
            made = difference(mesh, item.axis)
        elif item.kind == "mask":
            made = mask(mesh, np.broadcast_to(self.in_cells(item.formula, {}), mesh.cells))
        elif item.kind == "smoothing":
            made = smoothing(mesh, float(evaluate_batch(item.formula, lambda _: 0.0)))
        elif item.kind == "filter":
            made = LinearOperator("filter", mesh, self.symbol(item))
        else:
            power = self.interpolate_power(item.table) if item.table is not None else self.symbol(item)
            made = amplitude(mesh, power) if item.kind == "power" else lognormal_amplitude(mesh, power, warn=False)
        made = made @ self.operators[item.of] if item.of else made
        if not math.isfinite(made.variance):
            fault = f"the variance of the field {item.name} is {made.variance} [E0834]"
            raise ModelError(Problem("operator", fault, "a smaller power"))
        return made

    def symbol(self, item: Operator) -> Array:
        """Return the values of an operator's power spectrum or real filter, shape ``mesh.half``. Raises ModelError for
        values that differ at k and -k, and for values of a filter that are not finite."""
        values, turned = self.symbol_values(item, 1.0), self.symbol_values(item, -1.0)
        finite = np.isfinite(values) & np.isfinite(turned)
        if item.kind == "filter" and not np.all(np.isfinite(values)):
            cell = np.unravel_index(int(np.argmax(~np.isfinite(values))), values.shape)
            fault = f"the filter has no finite value at k = {self.mesh.wave_numbers[cell]:.6g} [E0836]"
            raise ModelError(Problem("filter", fault, "a formula with finite values, at k = 0 too"))
        if not np.allclose(values[finite], turned[finite], rtol=SUMMED, atol=1e-300):
            noun = "filter" if item.kind == "filter" else "power"
            fault = f"the {noun} is not the same at k and at -k, and the {noun} of a real field is [E0835]"
            raise ModelError(Problem(noun, fault, 'a formula of k, or of squares of kx; difference = "x" for slopes'))
        return values

    def symbol_values(self, item: Operator, sign: float) -> Array:
        """Return the values of an operator's formula at all wave numbers, shape ``mesh.half``; components kx, ky, kz
        are multiplied by ``sign`` (1 or -1)."""
        mesh = self.mesh
        known: dict[str, Any] = {"k": mesh.wave_numbers, **self.values}
        known |= {name: sign * part for name, part in zip(OF_WAVES[1:], mesh.wave_vectors, strict=False)}
        for name, formula in item.where:
            known[name] = evaluate_batch(formula, lambda symbol: known[symbol.name])
        result = evaluate_batch(item.formula, lambda symbol: known[symbol.name])
        return np.array(np.broadcast_to(result, mesh.half))

    def interpolate_power(self, table: PowerTable) -> Array:
        """Return the power spectrum of a file of k and P at the wave numbers, shape ``mesh.half``, linear in the
        logarithms; 0 at k = 0. Raises FileError for a table that is faulty or does not cover the mesh."""
        path = self.system.folder / table.file
        names, rows = read_table(path)
        places = []
        for which, name in enumerate(table.columns):
            if name and name not in names:
                fault = f"there is no column {name!r} [E0669]"
                raise FileError(Problem(str(path), fault, nearest(name, names) or listed(names)))
            places.append(names.index(name) if name else which)
        if len(names) < 2 or len(rows) < 2:
            size = f"{counted(len(names), 'column')} and {counted(len(rows), 'row')}"
            fault = f"a table of {size} is not a power spectrum [E0838]"
            raise FileError(Problem(str(path), fault, "two columns, k and P, and two rows at least"))
        k, power = rows[:, places[0]], rows[:, places[1]]
        wrong = ~(np.isfinite(k) & np.isfinite(power)) | (k <= 0.0) | (power <= 0.0)
        if np.any(wrong) or np.any(np.diff(k) <= 0.0):
            row = int(np.argmax(wrong)) if np.any(wrong) else int(np.argmax(np.diff(k) <= 0.0)) + 1
            fault = f"k = {k[row]:.6g}, P = {power[row]:.6g} in row {row + 1} are not positive or in order [E0839]"
            raise FileError(Problem(str(path), fault, "k above 0 that increases, and P above 0"))
        numbers = self.mesh.wave_numbers
        low, high = float(numbers[numbers > 0.0].min()), float(numbers.max())
        if low < k[0] * (1.0 - COMPUTED) or high > k[-1] * (1.0 + COMPUTED):
            fault = f"the table is from k = {k[0]:.6g} to {k[-1]:.6g}, the mesh from {low:.6g} to {high:.6g} [E0840]"
            raise FileError(Problem(str(path), fault, "a table of all of these"))
        with np.errstate(divide="ignore"):
            values = np.exp(np.interp(np.log(numbers), np.log(k), np.log(power)))
        return np.where(numbers > 0.0, values, 0.0)

    # -- data --------------------------------------------------------------------------------------------------------

    def in_cells(self, formula: Formula, more: Mapping[str, Any]) -> Array:
        """Return the values of a formula at the centres of cells, of a shape that broadcasts to the mesh; ``more`` has
        values by name in addition to parameters and data."""
        mesh, known = self.mesh, {**self.values, **self.data, **more}
        used = {symbol.name for symbol in symbols(formula)}
        for axis, (name, count, length) in enumerate(zip(OF_PLACES, mesh.cells, mesh.lengths, strict=False)):
            if name in used:
                shape = [1] * len(mesh.cells)
                shape[axis] = -1
                known[name] = ((np.arange(count) + 0.5) * (length / count)).reshape(shape)
        return evaluate_batch(formula, lambda symbol: known[symbol.name])

    def fixed_data(self, item: Data) -> Array:
        """Return numbers from a file or by a formula. Raises FileError, ModelError."""
        return self.check(item, self.read(item) if item.kind == "file" else self.in_cells(item.formula, {}))

    def check(self, item: Data, values: Array) -> Array:
        """Return numbers for all cells, broadcast from ``values``. Raises ModelError for numbers that are not finite or
        below the minimum."""
        least = -math.inf if item.minimum is None else item.minimum
        return numbers_of_cells(self.mesh, values, least, self.system.place(f"data.{item.name}"))

    def read(self, item: Data) -> Array:
        """Return the numbers of a file, of the shape of the mesh. Raises FileError, ModelError."""
        path, cells = self.system.folder / item.file, self.mesh.cells
        if path.suffix.lower() == ".csv":
            names, rows = read_table(path)
            column = item.column or (item.name if item.name in names else names[0] if len(names) == 1 else "")
            if column not in names:
                fault = f"there is no column {column or item.name!r} [E0669]"
                raise FileError(Problem(str(path), fault, f"column = one of {listed(names)} in data.{item.name}"))
            numbers = rows[:, names.index(column)]
            if len(numbers) != self.mesh.size:
                fault = f"{path} has {counted(len(numbers), 'row')}, and the mesh {self.mesh.size} cells [E0843]"
                raise ModelError(Problem(self.system.place(f"data.{item.name}"), fault, "a row for each cell"))
            return numbers.reshape(cells)
        stored = _numbers_of(path)
        if stored.shape != cells:
            fault = f"{path} has the shape {stored.shape}, and the mesh {cells} [E0841]"
            raise ModelError(Problem(self.system.place(f"data.{item.name}"), fault, f"an array of {cells}"))
        return np.asarray(stored, dtype=float)

    def draw(self, seed: int, truth: Complex) -> None:
        """Draw the random data about fields of the truth (a white field) and add them to ``data``; each entry has a
        separate random stream by ``seed``. Raises ModelError for an impossible mean or spread."""
        variances, fields = self.variances(), dict[str, Array]()
        for number, item in enumerate(self.system.data):
            if item.kind not in DRAWN:
                continue
            formulas = [item.formula] if item.spread is None else [item.formula, item.spread]
            for name in {symbol.name for formula in formulas for symbol in symbols(formula)} & set(self.operators):
                if name not in fields:
                    fields[name] = self.operators[name].apply(truth)
            mean, *spread = (
                np.broadcast_to(self.in_cells(formula, {**variances, **fields}), self.mesh.cells)
                for formula in formulas
            )
            least = -math.inf if item.kind == "normal" else 0.0
            key = self.system.place(f"data.{item.name}")
            for name, values, low in [("mean", mean, least), *((DRAWN[item.kind], values, 0.0) for values in spread)]:
                above = name == "beta"  # 0 is not a valid shape of a distribution
                if not np.all(np.isfinite(values)) or float(values.min()) < low or (above and not values.all()):
                    fault = f"the {name} of drawn fields is {float(values.min()):.6g} somewhere, or not finite [E0844]"
                    bound = " above 0" if above else "" if low else " from 0 on"
                    raise ModelError(Problem(key, fault, f"a formula of finite values{bound}"))
            stream = np.random.Generator(np.random.Philox(key=[seed, number + 1]))
            with _at(self.system, f"data.{item.name}"):
                self.data[item.name] = self.check(item, _draw(item, stream, mean, spread))


def _draw(item: Data, stream: np.random.Generator, mean: Array, spread: list[Array]) -> Array:
    try:
        if item.kind == "normal":
            return mean + spread[0] * stream.standard_normal(mean.shape)
        if item.kind == "negative_binomial":
            return stream.poisson(stream.gamma(spread[0], mean / spread[0])).astype(float)
        return stream.poisson(mean).astype(float)
    except ValueError:  # of NumPy, whose whole numbers end there
        fault = f"the mean of drawn fields is {float(mean.max()):.6g} somewhere, too large for whole numbers [E0845]"
        raise ModelError(Problem(f"data.{item.name}", fault, "a smaller mean")) from None


def _numbers_of(path: Path) -> NDArray[Any]:
    """Return the numbers of a ``.npy`` file, memory-mapped, so that they are read at use. Raises FileError."""
    try:
        open_file(path).close()
        stored = np.load(path, mmap_mode="r", allow_pickle=False)
    except OSError as error:
        fault = f"cannot be read: {error.strerror or error} [E0115]"
        raise FileError(Problem(str(path), fault, nearby(path))) from None
    except (ValueError, EOFError, SyntaxError, MemoryError, OverflowError):  # whose texts are about pickles
        fault = "this is not a .npy file of numbers [E0846]"
        raise FileError(Problem(str(path), fault, "numpy.save of an array of real numbers")) from None
    if not isinstance(stored, np.ndarray) or stored.dtype.kind not in "biuf":
        kind = stored.dtype if isinstance(stored, np.ndarray) else "an archive"
        raise FileError(Problem(str(path), f"{kind} are not real numbers [E0847]", "an array of real numbers"))
    return stored


def start_fields(path: Path, problem: FieldProblem, chains: int) -> list[Complex]:
    """Return the spectra of the white fields in a ``.npy`` file, one for each chain; the file has one field for all
    chains, of the shape of the mesh, or (chains, ...). Raises FileError, ModelError."""
    stored, cells = _numbers_of(path), problem.mesh.cells
    if stored.shape not in (cells, (chains, *cells)) or not np.all(np.isfinite(stored)):
        fault = f"it has the shape {stored.shape}, or numbers that are not finite [E0848]"
        raise ModelError(Problem(str(path), fault, f"finite numbers of the shape {cells}, or {(chains, *cells)}"))
    fields = stored if stored.ndim > len(cells) else np.broadcast_to(stored, (chains, *cells))
    return [problem.mesh.spectrum(np.asarray(values, float)) for values in fields]
