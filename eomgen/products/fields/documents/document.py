"""``Hamiltonian`` and ``FieldSystem``: checked files with ``kind = "hamiltonian"``, without and with a ``[mesh]``;
formulas as trees."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, field
from eomgen.errors import Problem, UsageError
from eomgen.formula.evaluate import evaluate, symbols
from eomgen.formula.nodes import ZERO, Formula, infix

if TYPE_CHECKING:
    from eomgen.products.fields.documents.tables import Chains, PowerTable, RunDefaults

#: Functions and commands for Hamiltonian systems, for messages.
OF_HAMILTONIANS = "eomgen.build(...).simulate(), or the commands info, simulate and generate"
#: Causes of an H that is infinite or not a number at a start.
NO_START = "another start, or other parameters: two bodies in one place, a mass of 0, the root of a negative number"
#: Least and largest length of a box: volumes, and squares of wave numbers, have to be numbers.
LENGTHS = (1e-100, 1e100)
#: Largest number of steps of a run or trajectory: above it, times of rows are not distinct doubles.
_MOST_STEPS = 1e15
#: Seeds are words of 64 bits with a sign.
MOST_SEED = 2**63 - 1
#: Dependence of a term of H: on momenta alone, on coordinates alone, or on both.
Dependence = Literal["kinetic", "potential", "coupled"]
DEPENDENCES: tuple[Dependence, ...] = get_args(Dependence)


@dataclass(frozen=True)
class NamedNumber:
    """A named number that runs may change: a parameter, or a coordinate or a momentum at the start.

    Attributes
    ----------
    value : float
        The value in the file; for a coordinate or momentum with a formula, the value at the parameters of the file.
    formula : Formula or None
        Formula of earlier parameters, which gives the value in runs with other values of them; None for a number.
    """

    name: str
    value: float
    unit: str = ""
    description: str = ""
    formula: Formula | None = None


@dataclass(frozen=True)
class HamiltonianTerm:
    """A summand of H.

    Attributes
    ----------
    name : key of the term in the file
    """

    name: str
    formula: Formula
    dependence: Dependence


@dataclass(frozen=True)
class StateOutput:
    """A quantity that is given along a run, a function of the state."""

    name: str
    formula: Formula
    unit: str = ""


@dataclass(frozen=True)
class Hamiltonian:
    """A system of q' = dH/dp, p' = -dH/dq.

    Attributes
    ----------
    name : str
        A legal C identifier.
    coordinates, momenta : tuple of NamedNumber
        In the same order.
    terms : tuple of HamiltonianTerm
        The sum of the terms is H.
    simulation : RunDefaults
        Defaults of ``simulate``.
    method_place : str
        File and line of the method, for messages; empty if the file names none.
    content : bytes
        All that determines the equations and the start; not how runs are made.
    definitions : mapping
        Named expressions of the formulas, as text.
    notes : tuple of str
        On definitions that no formula mentions.
    """

    name: str
    coordinates: tuple[NamedNumber, ...]
    momenta: tuple[NamedNumber, ...]
    terms: tuple[HamiltonianTerm, ...]
    simulation: RunDefaults
    method_place: str = ""
    parameters: tuple[NamedNumber, ...] = ()
    outputs: tuple[StateOutput, ...] = ()
    description: str = ""
    content: bytes = b""
    definitions: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @property
    def states(self) -> tuple[NamedNumber, ...]:
        """Coordinates, then momenta."""
        return (*self.coordinates, *self.momenta)

    @property
    def separable(self) -> bool:
        """Whether H is T(p) + V(q), by the terms."""
        return not self.coupled_terms

    @property
    def coupled_terms(self) -> list[str]:
        """Names of the terms of coordinates and of momenta."""
        return list(dict.fromkeys(term.name for term in self.terms if term.dependence == "coupled"))

    def parameter_values(self, changes: Mapping[str, float]) -> dict[str, float]:
        """Return the values of all parameters in a run, by name.

        Parameters
        ----------
        changes : mapping of names to numbers
            Values of the run that differ from the file. A parameter with a formula that is not among the changes
            follows the formula.

        Raises
        ------
        UsageError
            A formula has no finite real value with these changes.
        """
        if not changes:
            return {item.name: item.value for item in self.parameters}
        return _values_in_run("parameter", self.parameters, changes, {})

    def start(self, values: Mapping[str, float], initial: Mapping[str, float]) -> Array:
        """Return coordinates, then momenta at the start, shape (2 n,).

        Parameters
        ----------
        values : mapping
            Values of all parameters, by name.
        initial : mapping
            Coordinates and momenta, by name, that replace the values or formulas of the file.

        Raises
        ------
        UsageError
            A formula has no finite real value with these parameters.
        """
        return np.array(list(_values_in_run("start of", self.states, initial, values).values()), float)


def _values_in_run(
    kind: str, items: Iterable[NamedNumber], initial: Mapping[str, float], parameters: Mapping[str, float]
) -> dict[str, float]:
    """Return the value of each item in a run, by name: from ``initial``, else by the item's formula, else from the
    file. Formulas use ``parameters`` and the items before; ``kind`` is the kind of item in the message. Raises
    UsageError for a formula without a finite real value."""
    known, values = dict(parameters), dict[str, float]()
    for item in items:
        value = initial.get(item.name, item.value)
        if item.name not in initial and item.formula is not None:
            try:
                value = evaluate(item.formula, lambda symbol: known[symbol.name])
            except ArithmeticError as error:
                names = sorted({symbol.name for symbol in symbols(item.formula)})
                at = f"{infix(item.formula)}, has no finite real value with "
                at += ", ".join(f"{name} = {known[name]:.6g}" for name in names)
                fault = f"the {kind} {item.name}, {at}: {error} [E0708]"
                raise UsageError(Problem("parameters", fault, NO_START)) from None
        known[item.name] = values[item.name] = value
    return values


#: Kinds of an operator, by the key for the kind.
OperatorKind = Literal["white", "power", "lognormal_power", "filter", "smoothing", "difference", "mask"]
OPERATOR_KINDS: tuple[OperatorKind, ...] = get_args(OperatorKind)
#: Sources of numbers in the cells, by the key for the source.
DataKind = Literal["file", "formula", "poisson", "negative_binomial", "normal"]
DATA_KINDS: tuple[DataKind, ...] = get_args(DataKind)
#: Kinds of random data about fields of the truth, each with the parameter required in addition to the mean.
DRAWN: Mapping[str, str] = {"poisson": "", "negative_binomial": "beta", "normal": "deviation"}
#: Predefined names in formulas: of wave numbers, of centres of cells, of both.
OF_WAVES, OF_PLACES, VOLUME = ("k", "kx", "ky", "kz"), ("x", "y", "z"), "volume"
#: Suffix of an operator's name in the name of the operator's variance.
VARIANCE = "_variance"


@dataclass(frozen=True)
class Operator:
    """An operator from the white field, or from the result of the operator ``of``, to a field of cells.

    Attributes
    ----------
    formula : of wave numbers, of centres of cells for a mask; a number for a smoothing; unused for white and difference
    where : named formulas, each of the previous names
    table : a file of the power spectrum in place of a formula; None without
    axis : of a difference, from 0
    of : name of the operator that is applied before; empty for the white field
    """

    name: str
    kind: OperatorKind
    formula: Formula = ZERO
    where: tuple[tuple[str, Formula], ...] = ()
    table: PowerTable | None = None
    axis: int = 0
    of: str = ""


@dataclass(frozen=True)
class Data:
    """Numbers in the cells, read from a file, given by a formula, or drawn at random about a mean.

    Attributes
    ----------
    formula : the values, or the mean of random data; unused for a file
    spread : beta of a negative binomial distribution, deviation of a normal one
    file, column : path of a .npy or .csv, and column of a .csv
    minimum : the value below which data have no meaning
    """

    name: str
    kind: DataKind
    formula: Formula = ZERO
    spread: Formula | None = None
    file: str = ""
    column: str = ""
    minimum: float | None = None


@dataclass(frozen=True)
class FieldSystem:
    """Fields on a periodic mesh by a white prior and the energy of a cell.

    Attributes
    ----------
    cells, lengths : of the mesh, along each axis
    energy, where : formulas of a cell, as text
    definitions : named expressions of all formulas, as text
    fields, columns : operators and data that these name
    truth : seed of the white field that random data are made from; None without random data
    folder : folder of relative paths
    places : file and line of each key, for messages
    content : all that determines the posterior but for files of data
    notes : definitions that no formula mentions
    """

    name: str
    cells: tuple[int, ...]
    lengths: tuple[float, ...]
    energy: str
    operators: tuple[Operator, ...]
    sampling: Chains
    data: tuple[Data, ...] = ()
    where: Mapping[str, str] = field(default_factory=dict)
    fields: tuple[str, ...] = ()
    columns: tuple[str, ...] = ()
    parameters: tuple[NamedNumber, ...] = ()
    truth: int | None = None
    mass: str = "fisher"
    unit: str = ""
    description: str = ""
    folder: Path = Path()
    places: Mapping[str, str] = field(default_factory=dict)
    content: bytes = b""
    definitions: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @property
    def parameter_values(self) -> dict[str, float]:
        """Values of parameters by name, including ``volume``, the volume of a cell."""
        volume = math.prod(length / count for count, length in zip(self.cells, self.lengths, strict=True))
        return {VOLUME: volume, **{item.name: item.value for item in self.parameters}}

    def place(self, key: str) -> str:
        """Return file and line of a key, for messages."""
        return self.places.get(key, f"{self.name} ({key})")


def check_step_count(name: str, end: float, step: float) -> None:
    """Raise UsageError about the setting ``name`` if steps of size ``step`` to ``end`` are more than 1e15."""
    if abs(end) > _MOST_STEPS * abs(step):
        count = abs(end / step) if step else math.inf
        fault = f"{count:.3g} steps of {step:g} would lead to {end:g}; {_MOST_STEPS:.0e} are counted at most [E0788]"
        raise UsageError(Problem(name, fault, f"a step of {end / _MOST_STEPS:.3g} or more, or an earlier end"))
