"""``FieldSystem``: a checked file with ``kind = "hamiltonian"`` and a ``[mesh]``, formulas as trees."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from eomgen.formula.nodes import ZERO, Formula
from eomgen.products.fields.documents.document import Parameter

#: Kinds of an operator, by the key that gives it.
OperatorKind = Literal["white", "power", "lognormal_power", "filter", "smoothing", "difference", "mask"]
OPERATOR_KINDS: tuple[OperatorKind, ...] = (
    "white", "power", "lognormal_power", "filter", "smoothing", "difference", "mask"
)  # fmt: skip  # a list of kinds
#: Sources of numbers in the cells, by the key that gives them.
DataKind = Literal["file", "formula", "poisson", "negative_binomial", "normal"]
DATA_KINDS: tuple[DataKind, ...] = ("file", "formula", "poisson", "negative_binomial", "normal")
#: Kinds of random data about fields of the truth, each with the parameter that it needs in addition to its mean.
DRAWN: Mapping[str, str] = {"poisson": "", "negative_binomial": "beta", "normal": "deviation"}
#: Names that formulas have of their own: of wave numbers, of centres of cells, of both.
OF_WAVES, OF_PLACES, VOLUME = ("k", "kx", "ky", "kz"), ("x", "y", "z"), "volume"
#: Ending of an operator's name in the name of its variance.
VARIANCE = "_variance"


@dataclass(frozen=True)
class Table:
    """A file of two columns, wave numbers and values, each column by its name or by its place."""

    file: str
    columns: tuple[str, str] = ("", "")


@dataclass(frozen=True)
class Operator:
    """An operator from the white field, or from the result of the operator ``of``, to a field of cells.

    Attributes
    ----------
    formula : of wave numbers, of centres of cells for a mask; a number for a smoothing; read for kinds with one alone
    where : named formulas, each of the names before it
    axis : of a difference
    """

    name: str
    kind: OperatorKind
    formula: Formula = ZERO
    where: tuple[tuple[str, Formula], ...] = ()
    table: Table | None = None
    axis: int = 0
    of: str = ""


@dataclass(frozen=True)
class Data:
    """Numbers in the cells.

    Attributes
    ----------
    formula : the values, or the mean of random data; not read for a file
    spread : beta of a negative binomial distribution, deviation of a normal one
    minimum : the value below which they have no meaning
    """

    name: str
    kind: DataKind
    formula: Formula = ZERO
    spread: Formula | None = None
    file: str = ""
    column: str = ""
    minimum: float | None = None


@dataclass(frozen=True)
class Chains:
    """The defaults of ``sample``, which describes them."""

    method: str = "minimum_norm2"
    step: float = 0.0
    duration: float = 1.5
    first: str = "random"
    jitter: float = 0.2
    guard: float = 0.9
    chains: int = 2
    start: str = "mode"
    warm_up: int = 50
    samples: int = 200
    seed: int = 0
    field: str = ""
    watched: int = 500
    bins: int = 8
    transforms: str = "scipy"
    precision: str = "double"


@dataclass(frozen=True)
class FieldSystem:
    """Fields on a periodic mesh by a white prior and the energy of a cell.

    Attributes
    ----------
    cells, lengths : of the mesh, along each axis
    energy, where : formulas of a cell, as text
    fields, columns : operators and data that these name
    truth : seed of the white field behind random data; None without random data
    folder : folder of relative paths
    places : file and line of each key, for messages
    content : all that determines the posterior but for files of data
    """

    name: str
    cells: tuple[int, ...]
    lengths: tuple[float, ...]
    energy: str
    operators: tuple[Operator, ...]
    data: tuple[Data, ...] = ()
    where: Mapping[str, str] = field(default_factory=dict)
    fields: tuple[str, ...] = ()
    columns: tuple[str, ...] = ()
    parameters: tuple[Parameter, ...] = ()
    truth: int | None = None
    mass: str = "fisher"
    sampling: Chains = field(default_factory=Chains)
    unit: str = ""
    description: str = ""
    folder: Path = Path()
    places: Mapping[str, str] = field(default_factory=dict)
    content: bytes = b""

    @property
    def parameter_values(self) -> dict[str, float]:
        """Return values of parameters by name, the volume of a cell among them."""
        volume = 1.0
        for count, length in zip(self.cells, self.lengths, strict=True):
            volume *= length / count
        return {VOLUME: volume, **{item.name: item.value for item in self.parameters}}

    def place(self, key: str) -> str:
        """Return file and line of a key, for messages."""
        return self.places.get(key, f"{self.name} ({key})")
