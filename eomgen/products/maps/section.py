"""The section of maps: schema, and reading of grids from lists, CSV and NetCDF files."""

from __future__ import annotations

import io
import math
from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from eomgen.base.arrays import Array
from eomgen.base.files import read_bytes
from eomgen.base.messages import counted, is_number, key_of, listed, shown
from eomgen.base.rounding import COMPUTED
from eomgen.errors import FileError
from eomgen.formula.units.conversion import coherent
from eomgen.formula.units.parser import dimension_of, read_unit
from eomgen.products.maps.surface import MapSurface
from eomgen.scene.reading.key_metadata import Table, key, optional
from eomgen.scene.reading.kinds import Description, Numbers, Unit
from eomgen.scene.reading.values import Values
from eomgen.scene.section import Reading, Section, UnusedEntries
from eomgen.scene.signals.curves import LARGEST, fault, unit_factor
from eomgen.scene.signals.tables import TableError, is_in_si, note_of_label, read_columns, unit_of_title, without_unit

#: Largest number of nodes, and of nodes along the shorter axis: each line of the grid is a spline in the C.
MOST_NODES, MOST_LINES = 100_000, 200
_COLUMN = "title or number from 0"
#: First bytes of a file of NetCDF 4.
_HDF5 = b"\x89HDF"
#: Columns of a map, and the keys of their units.
_NAMES = ("x", "y", "value")
_UNITS = tuple(f"{name}_unit" for name in _NAMES)
#: Arrays x (n,), y (m,) and z (n, m), with the title of each.
_TitledGrid = tuple[tuple[Array, Array, Array], tuple[str, str, str]]


class MapFile(Table):
    """A grid in a file: three columns of a CSV file with one row for each node, or three variables of a NetCDF file."""

    file: Annotated[str, Field(min_length=1, max_length=1000)] = key(
        "path of a CSV file, or of a NetCDF file (`.nc`), from the folder of the scene file",
        kind="text",
        path=True,
    )
    x: str | int = key("column, or variable (n,), of the first argument", 0, kind=_COLUMN)
    y: str | int = key("column, or variable (m,), of the second argument", 1, kind=_COLUMN)
    value: str | int = key("column, or variable (n, m), of the value", 2, kind=_COLUMN)
    x_unit: Unit = key("unit that the first argument is in, to be brought to SI: `rpm`", "")
    y_unit: Unit = key("unit that the second argument is in, to be brought to SI: `deg`", "")
    value_unit: Unit = key("unit that the value is in, to be brought to SI", "")
    delimiter: Literal["comma", "semicolon", "tab", "space"] | None = optional(
        "mark between columns", shown_default="the first of tab, semicolon, comma, space that is in the first row"
    )
    decimal: Literal[".", ","] = key("mark in numbers", ".", kind="`.` or `,`")


class MapEntry(Table):
    """A function of two arguments through a grid of values, which formulas ask for by `map.NAME(x, y)`."""

    table: MapFile | None = optional("the grid from a file, in place of `x`, `y` and `values`")
    x: Numbers | None = optional("nodes of the first argument, increasing", kind="list of numbers")
    y: Numbers | None = optional("nodes of the second argument, increasing", kind="list of numbers")
    values: Annotated[tuple[Numbers, ...], Field(strict=False)] | None = optional(
        "one list for each node of `x`, with one value for each node of `y`", kind="list of lists of numbers"
    )
    x_unit: Unit = key("unit that the list `x` is in, to be brought to SI: `rpm`", "")
    y_unit: Unit = key("unit that the list `y` is in, to be brought to SI: `deg`", "")
    value_unit: Unit = key("unit that the list `values` is in, to be brought to SI", "")
    interpolation: Literal["quintic", "linear"] = key("method between nodes", "quintic", kind="`quintic` or `linear`")
    outside: Literal["error", "hold", "periodic"] = key(
        "values beyond the grid on both axes, as of [curves](curves.md)", "error", kind="`error`, `hold` or `periodic`"
    )
    unit: Unit = key("label of the value", "")
    description: Description = key("text of one line for tables", "")


class _GridError(Exception):
    """A grid without a surface, with key, fault and remedy for the report."""


class _Grid:
    """Reads the grid of one map from lists or a file; faults go to the report."""

    def __init__(self, where: str, name: str, entry: MapEntry, values: Values, folder: Path) -> None:
        self.key, self.name, self.entry, self.values, self.folder = where, name, entry, values, folder
        self.report = values.report
        self.units: MapFile | MapEntry = entry if entry.table is None else entry.table

    def surface(self) -> MapSurface | None:
        """Return the surface through the grid; None for a reported fault: nodes that do not increase, values that are
        too large, too many nodes, or a periodic map with open ends."""
        try:
            grid = self._listed() if self.entry.table is None else self._from_file(self.entry.table)
            if grid is None:
                return None
            self._check(*grid)
        except _GridError as error:
            self.report.add(*error.args)
            return None
        return MapSurface(self.name, *grid, self.entry.interpolation, self.entry.outside, self._units())

    def _check(self, x: Array, y: Array, z: Array) -> None:
        """Raise _GridError for nodes and values without a surface."""
        for axis, nodes in (("x", x), ("y", y)):
            key, hint = f"{self.key}.{axis}", f"increasing nodes of {axis}, values in the same order"
            if len(nodes) < 2:
                text = f"a grid has two nodes or more of {axis}, not {len(nodes)} [E0917]"
                raise _GridError(key, text, f"more nodes of {axis}")
            # of values that are all equal: the nodes are judged here
            if wrong := fault(nodes, np.zeros(len(nodes)), self.entry.interpolation, self.entry.outside):
                raise _GridError(key, f"node {wrong[0] + 1} of {axis}: {wrong[1]} [E0916]", hint)
        if len(large := np.argwhere(np.abs(z) > LARGEST)):
            i, j = large[0]
            text = f"the value at x = {x[i]:.9g}, y = {y[j]:.9g} is beyond {LARGEST:.0e} [E0907]"
            raise _GridError(self.key, text, "other units")
        if z.size > MOST_NODES or min(z.shape) > MOST_LINES:
            text = f"the grid has {len(x)} x {len(y)} nodes, more than {MOST_NODES} or than {MOST_LINES} along both"
            raise _GridError(self.key, f"{text} axes [E0908]", "every second node, or the part that is needed")
        if self.entry.outside == "periodic":
            ends = {"x": z[0] - z[-1], "y": z[:, 0] - z[:, -1]}
            rounding = COMPUTED * float(np.max(np.abs(z)))
            if axes := [axis for axis, change in ends.items() if np.max(np.abs(change)) > rounding]:
                text = "the values of a periodic map differ between the first and the last node along"
                hint = "the first values again at the end of each axis"
                raise _GridError(self.key, f"{text} {listed(axes)} [E0909]", hint)

    def _units(self) -> tuple[str, str, str]:
        """Return the units in SI of x, y and the value; empty for a column without a unit. A label of the entry that
        contradicts the value's unit is reported."""
        units = [self.units.x_unit, self.units.y_unit, self.units.value_unit]
        if not any(unit.strip() for unit in units):
            return "", "", self.entry.unit

        x, y, value = (coherent(read_unit(unit)) if unit.strip() else "" for unit in units)
        label = dimension_of(self.entry.unit)
        if value and label and (label != dimension_of(value) or not is_in_si(self.entry.unit)):
            fault = f"the values are in {value}, and the label {shown(self.entry.unit)} says otherwise [E0918]"
            self.report.add(f"{self.key}.unit", fault, f'unit = "{value}", or no unit')
        return x, y, value or self.entry.unit

    def _listed(self) -> tuple[Array, Array, Array] | None:
        """Return x, y and values from lists in SI units; None for a unit with a fault, which is reported. Raises
        _GridError for other faults."""
        entry = self.entry
        missing = [name for name in ("x", "y", "values") if getattr(entry, name) is None]
        if missing:
            raise _GridError(self.key, f"a map needs {listed(missing)} [E0920]", "x, y and values, or a table")
        x, y, rows = np.array(entry.x), np.array(entry.y), entry.values or ()
        if len(rows) != len(x):
            text = f"{counted(len(rows), 'list')} of values for {counted(len(x), 'node')} of x [E0921]"
            raise _GridError(f"{self.key}.values", text, "one list for each node of x")
        for index, row in enumerate(rows):
            if len(row) != len(y):
                text = f"{counted(len(row), 'value')} for {counted(len(y), 'node')} of y [E0922]"
                raise _GridError(f"{self.key}.values[{index}]", text, "one value for each node of y")
        return self._in_si(self.key, (x, y, np.array(rows)))

    def _in_si(
        self, key: str, grid: tuple[Array, Array, Array], titles: Sequence[str] = ("", "", "")
    ) -> tuple[Array, Array, Array] | None:
        """Return a grid (x, y, values) in SI; None for a unit with a fault, which is reported below ``key``. Columns
        without a unit, if others have one, are noted, unless their ``titles`` have units."""
        before = len(self.report.noted)
        names_with_unit = [name for name in _NAMES if getattr(self.units, f"{name}_unit").strip()]
        for name, title in zip(_NAMES, titles, strict=True):
            labelled = name == "value" and self.entry.unit.strip()
            if names_with_unit and name not in names_with_unit and not labelled and not unit_of_title(title):
                self.values.note([f"{key}.{name}: {without_unit(name, names_with_unit)}"])
        factors = [unit_factor(f"{key}.{name}", getattr(self.units, name), self.report) for name in _UNITS]
        if len(self.report.noted) > before:
            return None
        x, y, z = (factor * part for factor, part in zip(factors, grid, strict=True))
        return x, y, z

    def _from_file(self, table: MapFile) -> tuple[Array, Array, Array] | None:
        """Return x (n,), y (m,) and values (n, m) from a CSV or NetCDF file; None for a fault, which is reported. Lists
        or their units in addition to the table are a fault. Numbers are converted to SI by ``x_unit``, ``y_unit`` and
        ``value_unit`` of the table; a unit in a title or an attribute converts no numbers, and is noted if not SI."""
        names = [name for name in ("x", "y", "values") if getattr(self.entry, name) is not None]
        if names:
            text = f"table and {listed(names)} are both given [E0923]"
            raise _GridError(f"{self.key}.table", text, "either the table or lists")
        for name in _UNITS:
            if unit := getattr(self.entry, name):
                hint = f'table = {{ file = ..., {name} = "{unit}" }}'
                text = f"{name} is the unit of a list, and a table has its own [E0924]"
                raise _GridError(f"{self.key}.{name}", text, hint)
        columns = (table.x, table.y, table.value)
        path = self.folder / table.file
        try:
            grid, titles = _netcdf(path, columns) if path.suffix == ".nc" else self._csv(path, table, columns)
        except FileError as error:
            self.report.add_file_error(f"{self.key}.table", error)
            return None
        for name, title in zip(_NAMES, titles, strict=True):
            unit = "" if getattr(table, f"{name}_unit").strip() else unit_of_title(title)
            if unit and not is_in_si(unit):
                note = f"the numbers of the column {shown(title)} are taken in SI without a conversion"
                self.values.note([f'{self.key}.table.{name}: {note}; try: {name}_unit = "{unit}"'])
        return self._in_si(f"{self.key}.table", grid, titles)

    def _csv(self, path: Path, table: MapFile, columns: Sequence[str | int]) -> _TitledGrid:
        """Return the grid and titles of a CSV file with a row x, y, value for each node, in any order. Raises
        TableError for nodes that are missing or that occur twice."""
        options: dict[str, Any] = {"delimiter": table.delimiter, "decimal": table.decimal}
        options["quotes"] = path.resolve().is_relative_to(self.folder.resolve())
        first = read_columns(path, columns[0], columns[1], **options)
        third = read_columns(path, columns[0], columns[2], **options)
        values = third.value
        titles = (*first.titles, third.titles[1])
        if table.x == table.y:
            raise TableError(
                path.name, f"x and y are the same column {shown(str(table.x))} [E0925]", "a column for each argument"
            )
        x, rows = np.unique(first.argument, return_inverse=True)
        y, places = np.unique(first.value, return_inverse=True)
        count = np.zeros((len(x), len(y)), dtype=int)
        np.add.at(count, (rows, places), 1)
        if np.any(count > 1):
            row = int(np.argmax(count[rows, places] > 1))
            text = f"the node x = {first.argument[row]:.9g}, y = {first.value[row]:.9g} has several values [E0926]"
            raise TableError(f"{path.name}:{int(first.lines[row])}", text, "one row for each node")
        if not np.all(count):
            holes = np.argwhere(count == 0)
            text = f"the grid of {len(x)} x {len(y)} nodes has {counted(len(holes), 'hole')}, the first at"
            text += f" x = {x[holes[0, 0]]:.9g}, y = {y[holes[0, 1]]:.9g} [E0927]"
            hint = "a row for each pair of the values of x and y that occur"
            if any(is_number(title) and math.isfinite(float(title)) for title in titles):
                hint = "a row x, y, value for each node: a first row of numbers is of a matrix"
            raise TableError(path.name, text, hint)
        z = np.zeros(count.shape)
        z[rows, places] = values
        return (x, y, z), titles


def _opened(path: Path) -> Any:
    """Return an open NetCDF file, with scaled and masked variables. Raises TableError if NetCDF 4 needs a package that
    is not installed."""
    data = read_bytes(path, path.stat().st_size)  # for the digest of the file, by which readings are kept
    if data.startswith(_HDF5):
        try:
            return import_module("netCDF4").Dataset(path.name, memory=data)
        except ImportError:
            fault = "files of NetCDF 4 are read by the package netCDF4, which is not installed [E0928]"
            hint = "pip install 'eomgen[netcdf]', or the classic format (nccopy -k classic)"
            raise TableError(path.name, fault, hint) from None
    from scipy.io import netcdf_file  # noqa: PLC0415  # few maps are NetCDF

    return netcdf_file(io.BytesIO(data), mmap=False, maskandscale=True)


def _netcdf(path: Path, columns: Sequence[str | int]) -> _TitledGrid:
    """Return the grid and titles of three variables x (n,), y (m,) and values (n, m) or, by its dimensions, (m, n) of a
    NetCDF file. Raises TableError for missing variables, wrong shapes and missing values."""
    try:
        with _opened(path) as file:
            names = list(file.variables)
            for column in columns:
                if column not in names:
                    text = f"there is no variable {shown(str(column))} [E0929]"
                    raise TableError(path.name, text, f"one of {listed(names)}")
            variables = [file.variables[str(column)] for column in columns]
            x, y, z = (np.ma.filled(np.ma.asarray(item[:], np.float64), np.nan) for item in variables)
            turned = variables[2].dimensions == (*variables[1].dimensions, *variables[0].dimensions)
            units = [getattr(item, "units", "") for item in variables]
    except (OSError, TypeError, ValueError, IndexError, KeyError) as error:
        hint = "a NetCDF file as written by xarray or netCDF4, or a CSV file"
        raise TableError(path.name, f"the file cannot be read as NetCDF: {error} [E0930]", hint) from None
    z = z.T if turned and x.ndim == y.ndim == 1 else z
    if x.ndim != 1 or y.ndim != 1 or z.shape != (len(x), len(y)):
        text = f"the variables have the shapes {x.shape}, {y.shape} and {z.shape}, not (n,), (m,) and (n, m) [E0931]"
        raise TableError(path.name, text, "the arguments of a grid, and the values with x first")
    if not np.all(np.isfinite(np.concatenate([x, y]))):
        text = "a node of the arguments is not a number [E0932]"
        raise TableError(path.name, text, "arguments without missing values")
    if len(holes := np.argwhere(~np.isfinite(z))):
        text = f"the value at x = {x[holes[0, 0]]:.9g}, y = {y[holes[0, 1]]:.9g} is not a number, or the file's mark"
        raise TableError(path.name, f"{text} of a missing value [E0933]", "a grid without holes")
    texts = (unit.decode("ascii", "replace") if isinstance(unit, bytes) else str(unit) for unit in units)
    named = [f"{column} [{unit}]" for column, unit in zip(columns, texts, strict=True)]
    return (x, y, z), (named[0], named[1], named[2])


class _Maps(Section):
    def names(self, reading: Reading) -> Mapping[str, Any]:
        return {"entries": {"maps": {}}}

    def read(self, reading: Reading) -> Mapping[str, Any]:
        surfaces = reading.tables["entries"]["maps"]
        for name, entry in reading.document.section("maps").items():
            read = _Grid(key_of("maps", name), name, entry, reading.values, reading.folder).surface()
            surfaces[name] = read or _flat(name)
            if not (entry.table or entry).value_unit.strip():
                remedy = f'value_unit = "{entry.unit}", which converts the values'
                reading.values.note(note_of_label(key_of("maps", name), entry.unit, remedy))
        surfaces |= {name: _flat(name) for name in sorted(reading.refused["maps"])}
        return {name: surfaces[name] for name in reading.document.section("maps")}

    def unused(self, reading: Reading) -> UnusedEntries:
        mentioned = reading.values.mentioned
        names = [name for name in reading.document.section("maps") if ("maps", name) not in mentioned]
        return UnusedEntries("map", "maps", names)

    def fields(self, reading: Reading) -> Mapping[str, Any]:
        return {"parts": {"maps": tuple(reading.items["maps"].values())}}


def _flat(name: str) -> MapSurface:
    """Return a surface in place of a refused one, so that reading goes on to the next problem."""
    return MapSurface(name, np.array([0.0, 1.0]), np.array([0.0, 1.0]), np.zeros((2, 2)), "linear", "hold")


MAPS = _Maps(
    key="maps",
    entry=MapEntry,
    after=("parameters",),
    before=("inputs", "bodies", "definitions"),
    documentation="""
    Add a function of two arguments through a grid of values, from lists or a ``table``, for formulas:
    ``map.NAME(x, y)``.""",
)
