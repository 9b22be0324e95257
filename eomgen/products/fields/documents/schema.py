"""Schemas of files with ``kind = "hamiltonian"``, for coordinates and for fields on a mesh."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Generic, Literal, TypeVar

from pydantic import Discriminator, Field, PlainValidator, Tag, WithJsonSchema, model_validator
from pydantic_core import PydanticCustomError

from eomgen.base.messages import NAME_LENGTH
from eomgen.products.fields.documents.document import LENGTHS, MOST_SEED
from eomgen.products.fields.documents.tables import Chains, PowerTable, RunDefaults
from eomgen.scene.reading.key_metadata import Table, key, optional
from eomgen.scene.reading.kinds import Description, Pair, Value, describe, is_plain_number

#: Value of the key ``kind`` in files of Hamiltonian systems.
KIND = "hamiltonian"
#: Endings of files of data.
DATA_FILES = (".npy", ".csv")
#: Text like the path of a file with another ending: no formula of places has a name with a dot.
_PATH = re.compile(r"[^\s()+*]*[A-Za-z_]\w*\.[A-Za-z]\w*")
_POWER = '{ power = "300*exp(-(4*k)**2)" }'
_START = "{ initial = [0.1, 0.0] }"


def _cells(value: object) -> tuple[int, ...]:
    """Return the numbers of cells along one to three axes, given as a list or a single number; raise an error of
    pydantic for others, such as a number below 2."""
    counts = value if isinstance(value, list | tuple) else [value]
    if not 1 <= len(counts) <= 3 or any(type(count) is not int or count < 2 for count in counts):
        text = f"the numbers of cells cannot be {value_text(value)} [E0726]"
        raise PydanticCustomError("cells", "{text}", {"text": text})
    return tuple(counts)


def _sides(value: object) -> float | tuple[float, ...]:
    """Return the length of all sides, or a tuple of each; raise an error of pydantic for a length outside the range
    1e-100 to 1e100. So volumes and squared wave numbers are finite."""
    sides = value if isinstance(value, list | tuple) else [value]
    lengths = [float(side) for side in sides if is_plain_number(side) and LENGTHS[0] <= side <= LENGTHS[1]]
    if not sides or len(lengths) < len(sides):
        text = f"the length of the box cannot be {value_text(value)} [E0727]"
        raise PydanticCustomError("length", "{text}", {"text": text})
    return tuple(lengths) if sides is value else lengths[0]


def value_text(value: object) -> str:
    """Return a value as messages say it, lists with their entries."""
    return f"[{', '.join(map(repr, value))}]"[:60] if isinstance(value, list | tuple) else describe(value)


def _either(kind: str, least: int) -> dict[str, Any]:
    """Return the JSON Schema of one number, or of one to three."""
    entry = {"type": kind, "minimum": least}
    return {"anyOf": [entry, {"type": "array", "minItems": 1, "maxItems": 3, "items": entry}]}


def _shape(value: object) -> str:
    return "#table" if isinstance(value, Mapping) else "#formula"


Yes = Literal[True]
Legal = Annotated[str, WithJsonSchema({"type": "string", "pattern": f"^[A-Za-z_][A-Za-z0-9_]{{0,{NAME_LENGTH - 1}}}$"})]
Counts = Annotated[tuple[int, ...], PlainValidator(_cells), WithJsonSchema(_either("integer", 2))]
Sides = Annotated[float | tuple[float, ...], PlainValidator(_sides), WithJsonSchema(_either("number", 0))]
Formulas = dict[str, Value]
#: Names of entries: legal, or of copies, with indices in braces.
Name = TypeVar("Name", bound=str)


class ShortTable(Table):
    """A table of which any other value is the key ``short``."""

    @model_validator(mode="before")
    @classmethod
    def _from_short(cls, data: object) -> object:
        return data if isinstance(data, Mapping) else {cls.short: data}


class ParameterTable(ShortTable):
    """A named number, or a formula of the parameters above it."""

    short: ClassVar[str] = "value"

    value: Value = key("a number, or a formula of parameters", example="a finite number, or a formula of parameters")
    unit: str = key("a label", "", example='unit = "m"')
    description: Description = key("text of one line for tables", "", example='description = "in words"')


class CoordinateTable(Table):
    """A coordinate with its momentum."""

    initial: Pair = key("initial position and momentum", example="initial = [0.1, 0.0]: the position and the momentum")
    momentum: str = key("name of the momentum; p_ and the coordinate by default", "", example='momentum = "p"')
    unit: str = key("a label", "", example='unit = "m"')
    momentum_unit: str = key("a label", "", example='momentum_unit = "kg m/s"')


class OutputTable(ShortTable):
    """A quantity of the state along a run."""

    short: ClassVar[str] = "formula"

    formula: Value = key("formula of the state and parameters", example='a text: "p_x**2/2"')
    unit: str = key("a label", "", example='unit = "m"')


#: A formula, or a table of formulas by name.
_Terms = Annotated[Annotated[Value, Tag("#formula")] | Annotated[Formulas, Tag("#table")], Discriminator(_shape)]


class _Named(Table, Generic[Name]):
    parameters: dict[Name, ParameterTable] = key(
        "numbers that runs may change", {}, example="[parameters] and NAME = 1.0"
    )
    definitions: dict[Name, Value] = key(
        "names of formulas, in any order", {}, example='[definitions] and NAME = "sin(x)"'
    )


class _Sections(_Named[Name], Generic[Name]):
    coordinates: dict[Name, CoordinateTable] = key(
        "coordinates and momenta", {}, example=f"[coordinates] and NAME = {_START}"
    )
    hamiltonian: _Terms = key("H, or terms whose sum it is", "", example='a text: "p_x**2/2"')
    outputs: dict[Name, OutputTable] = key("quantities of the state along a run", {}, example='[outputs] and r = "x"')


class Copies(_Sections[str]):
    """Copies of entries, with indices in braces."""

    indices: dict[str, Any] = key("i = 3, from 0 on, or i = [1, 3]: the first and the last")
    where: str = key("a condition of indices", "")


class File(_Named[Legal]):
    """All of a file."""

    format: Literal[1] = key("version of the format of the file", example="format = 1")
    kind: Literal["hamiltonian"] = key("kind of the file", example=f'kind = "{KIND}"')
    name: Legal = key("name of the system, a legal C identifier", example='name = "system"')
    description: Description = key("text of one line for tables", "", example='description = "in words"')


class HamiltonianFile(_Sections[Legal], File):
    """A system of coordinates and momenta."""

    simulation: RunDefaults = key("defaults of runs", RunDefaults.model_construct(), example="[simulation]")
    repeat: dict[str, Copies] = key("copies", {})


class MeshTable(Table):
    """A periodic mesh."""

    cells: Counts = key("numbers of cells by axis", example="1 to 3 whole numbers from 2 on: cells = [64, 64, 64]")
    length: Sides = key(
        "length of the box, or lengths of its sides",
        example="a number above 0 (1e-100 to 1e100), or one for each axis: length = 500.0",
    )
    unit: str = key("unit of length, a label", "", example='unit = "m"')


_Power = Annotated[Annotated[Value, Tag("#formula")] | Annotated[PowerTable, Tag("#table")], Discriminator(_shape)]


class OperatorTable(Table):
    """An operator from the white field, or from the result of another operator."""

    white: Yes | None = optional("the white field itself: true", example="white = true")
    power: _Power | None = optional("the power spectrum: a formula of k, or a table", example='power = "exp(-k)"')
    lognormal_power: _Power | None = optional("the power spectrum of exp(field)", example='lognormal_power = "exp(-k)"')
    filter: Value | None = optional("a formula of wave numbers", example='filter = "exp(-(k/0.2)**2)"')
    smoothing: Value | None = optional("the radius of a Gaussian filter", example="smoothing = 5.0")
    difference: Literal["x", "y", "z"] | None = optional("the axis of a derivative")
    mask: Value | None = optional("a formula of places", example='mask = "1 if x < 20 else 0"')
    of: str = key("the operator before this one", "", example='of = "OPERATOR"')
    where: Formulas = key("formulas with a name", {}, example='where = { q = "k/0.2" }')


class DataTable(Table):
    """Numbers in the cells."""

    file: str | None = optional("a .npy or .csv", example="a path that ends with .npy or .csv")
    formula: Value | None = optional("the values", example='formula = "x + y"')
    poisson: Value | None = optional("the mean of random numbers", example='poisson = "exp(s)"')
    negative_binomial: Value | None = optional("the mean of random numbers", example='negative_binomial = "exp(s)"')
    normal: Value | None = optional("the mean of random numbers", example='normal = "2*s"')
    column: str = key("column of the .csv file", "", example='column = "counts"')
    minimum: Value | None = optional("the value below which data have no meaning", example="minimum = 0.0")
    beta: Value | None = optional("parameter beta of a negative binomial distribution", example="beta = 2.0")
    deviation: Value | None = optional("standard deviation of a normal distribution", example="deviation = 0.5")

    @model_validator(mode="before")
    @classmethod
    def _from_short(cls, data: object) -> object:
        if isinstance(data, Mapping):
            return data
        is_path = isinstance(data, str) and (data.lower().endswith(DATA_FILES) or _PATH.fullmatch(data))
        return {"file" if is_path else "formula": data}


class PriorTable(Table):
    """The distribution of the state."""

    white: Yes = key(
        "independent standard normal numbers",
        True,
        example="white = true, and an operator that gives the field its covariance",
    )


class TruthTable(Table):
    """The field from which random data are made."""

    seed: Annotated[int, Field(ge=0, le=MOST_SEED)] = key("seed of the white field", example="seed = 1")


class CellTable(Table):
    """The energy of a cell."""

    energy: Value = key(
        "energy of fields and data",
        example='energy = "exp(e) - counts*e", minus the logarithm of a likelihood; "0" for the prior alone',
    )
    where: Formulas = key("formulas with a name", {}, example='[cell.where] and e = "log(mean) + density"')


class MassTable(Table):
    """The mass matrix of the momenta."""

    choice: Literal["fisher", "prior", "unit"] = key("kind of the mass matrix of the momenta", "fisher")


class FieldFile(File):
    """Fields on a periodic mesh by a white prior and the energy of a cell."""

    mesh: MeshTable = key("mesh of the fields", example="[mesh] and cells = [64, 64, 64], length = 500.0")
    operators: dict[Legal, OperatorTable] = key(
        "operators from the white field", example=f"[operators] and density = {_POWER}"
    )
    prior: PriorTable = key("prior of the state", PriorTable.model_construct(), example="[prior]")
    truth: TruthTable | None = optional("field from which random data are made", example="[truth] and seed = 1")
    data: dict[Legal, DataTable] = key("numbers in the cells", {}, example='[data] and NAME = "counts.npy"')
    cell: CellTable = key("the energy", example='[cell] and energy = "exp(e) - counts*e"')
    mass: MassTable = key("mass matrix of momenta", MassTable.model_construct(), example='[mass] and choice = "fisher"')
    sampling: Chains = key("defaults of sample", Chains.model_construct(), example="[sampling]")
