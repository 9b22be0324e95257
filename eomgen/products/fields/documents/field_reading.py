"""Reading of files with ``kind = "hamiltonian"`` and a ``[mesh]``: every problem by key and line."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields as fields_of
from pathlib import Path
from typing import Any

from eomgen.base.messages import NAME_RULE, is_legal, listed, nearest, shown
from eomgen.errors import DescriptionError, Message, Problem, UsageError
from eomgen.formula.evaluate import symbols
from eomgen.formula.nodes import ZERO, Formula  # ZERO: in place of refused values, which are reported
from eomgen.formula.words import RESERVED
from eomgen.products.fields.documents.document import (
    DATA_KINDS,
    DRAWN,
    OF_PLACES,
    OF_WAVES,
    OPERATOR_KINDS,
    VARIANCE,
    VOLUME,
    Chains,
    Data,
    DataKind,
    FieldSystem,
    Operator,
    Parameter,
    Table,
)
from eomgen.products.fields.documents.entries import KIND, FieldEntries, cell_formula, check_keys
from eomgen.scene.formula.namespaces import mentions_any
from eomgen.scene.formula.scope import SceneNames, Scope
from eomgen.scene.reading.kinds import described
from eomgen.scene.reading.report import Report
from eomgen.scene.sources.source import read_text, shown_file
from eomgen.scene.sources.toml import toml_data

#: Commands and keys for Hamiltonian systems of coordinates, for messages.
OF_COORDINATES = "eomgen simulate, or a [mesh] with cells and length"
#: Reserved words of formulas, which are not valid names; the time is refused at its use.
_WORDS = RESERVED - {"t"}
_KEYS = (
    "format", "kind", "name", "description", "mesh", "parameters", "definitions", "operators", "prior", "truth",
    "data", "cell", "mass", "sampling",
)  # fmt: skip  # a list of keys
_KINDS = frozenset({"parameter", "state"})
_WAVES = Scope(f"{', '.join(OF_WAVES)}, {VOLUME} of a cell, parameters, definitions and names of where", _KINDS)
_PLACES = Scope(f"{', '.join(OF_PLACES)} of a cell's centre, parameters, and data above", _KINDS)
_DRAWN = Scope(f"operators, {', '.join(OF_PLACES)} of a cell's centre, parameters, and data above", _KINDS)
_ANYWHERE = Scope("wave numbers, places, operators, data, parameters and other definitions", _KINDS)
#: Data that cannot be below 0, by name.
_NOT_NEGATIVE = ("counts", "response")
_MASSES = ("fisher", "prior", "unit")
_FILES = (".npy", ".csv")
#: Text like the path of a file with another ending: no formula of places has a name with a dot.
_PATH = re.compile(r"[^\s()+*]*[A-Za-z_]\w*\.[A-Za-z]\w*")
_MOST_SEED = 2**63 - 1


def load_fields(path: str | os.PathLike[str]) -> FieldSystem:
    """Read a system of fields from a TOML file.

    Raises
    ------
    FileError, DescriptionError, UsageError
        DescriptionError contains all faults of the content.
    """
    path = Path(path).expanduser()
    if path.suffix.lower() != ".toml":
        raise UsageError(
            Problem(str(path), "a system of fields is read from a .toml file [E0723]", f"{path.stem}.toml")
        )
    file = shown_file(path)
    data, lines = toml_data(read_text(path), file)
    return fields_from_data(data, file=file, lines=lines, folder=path.parent)


def fields_from_data(
    data: Mapping[str, Any],
    *,
    file: str = "system",
    lines: Mapping[str, int | str] | None = None,
    folder: Path | None = None,
) -> FieldSystem:
    """Check nested data, in the form of a file of fields, and return the system.

    Parameters
    ----------
    folder : Path, optional
        Folder of relative paths; the current folder by default.

    Raises
    ------
    DescriptionError
        With every problem that could be found.
    """
    report = Report(file, lines or {})
    if data.get("kind") != KIND:
        fault = "this is not a file of fields: a system to be sampled has a kind and a mesh [E0724]"
        report.add("kind" if "kind" in data else "", fault, f'kind = "{KIND}", [mesh], [operators] and [cell]')
        report.raise_problems()
    if "mesh" not in data:
        fault = "there is no mesh: samples are of fields of cells, not of motions of coordinates [E0725]"
        report.add("mesh", fault, OF_COORDINATES)
        report.raise_problems()
    result = _FieldReader(data, report, folder or Path()).read()
    report.raise_problems()
    assert result is not None  # without problems there is a system
    return result


class _FieldReader(FieldEntries):
    def __init__(self, data: Mapping[str, Any], report: Report, folder: Path) -> None:
        super().__init__(data, report)
        self.folder = folder
        self.known: list[Parameter] = []
        self.axes: tuple[str, ...] = ()

    def read(self) -> FieldSystem | None:
        """Return the system; None if a problem has been reported."""
        data, report = self.data, self.report
        name = self.head(_KEYS)
        self.known = self.parameters()
        cells, lengths, unit = self.mesh()
        self.axes = OF_PLACES[: len(cells)]
        self.check_names()
        own = [*self.section("operators")]
        more = (*self.axes, *own, *(f"{name}{VARIANCE}" for name in own), *self.section("data"))
        self.definitions(self.names(self.waves, more), _ANYWHERE, "exp(-(4*k)**2)")
        given = self.columns()
        operators = self.operators([item.name for item in given if item.kind not in DRAWN])
        truth = self.truth(given)
        self.white_prior()
        mass = self.mass()
        energy, where = self.cell()
        fields = _last(operators)
        columns: tuple[str, ...] = ()
        if not (report.concerns("operators") or report.concerns("data")):  # else names are unknown because of faults
            given = self.drawn(given, operators)
            named, columns = self.used(energy, where, operators, given)
            fields = named or fields
        sampling = self.sampling(fields)
        if report.noted:
            return None
        return FieldSystem(
            name,
            tuple(cells),
            tuple(lengths),
            energy,
            tuple(operators),
            tuple(given),
            where,
            fields,
            columns,
            tuple(self.known),
            truth,
            mass,
            sampling,
            unit,
            self.text("", data, "description"),
            self.folder,
            {key: report.where(key) for key in self.places(operators, given)},
            json.dumps(
                {key: item for key, item in data.items() if key not in ("sampling", "description")},
                sort_keys=True,
                default=str,
            ).encode(),
            {name: item.text for name, item in self.defined.items()},
            tuple(map(Message, self.unused())),
        )

    def places(self, operators: Iterable[Operator], given: Iterable[Data]) -> list[str]:
        """Return the keys that later messages name."""
        keys = ["mesh", "mesh.cells", "cell", "cell.energy", "mass", "operators", "data"]
        keys += [f"sampling.{name}" for name in self.section("sampling")]
        keys += [f"operators.{item.name}" for item in operators]
        return keys + [f"data.{item.name}" for item in given]

    # -- mesh --------------------------------------------------------------------------------------------------------

    def mesh(self) -> tuple[list[int], list[float], str]:
        """Return cells and lengths along each axis, and the unit of length."""
        report, table = self.report, self.section("mesh")
        check_keys("mesh", table, ("cells", "length", "unit"), report)
        cells, length = table.get("cells"), table.get("length")
        whole = [cells] if isinstance(cells, int) and not isinstance(cells, bool) else cells
        counts = [count for count in whole if _is_whole(count, 2)] if isinstance(whole, list) else []
        if not isinstance(whole, list) or len(counts) != len(whole) or not 1 <= len(counts) <= 3:
            fault = f"the numbers of cells {'are missing' if cells is None else f'cannot be {_said(cells)}'} [E0726]"
            report.add("mesh.cells", fault, "1 to 3 whole numbers from 2 on: cells = [64, 64, 64]")
            counts = [2]
        sides = length if isinstance(length, list) else [length] * len(counts)
        if len(sides) != len(counts) or not all(_is_length(side) for side in sides):
            fault = f"the length of the box {'is missing' if length is None else f'cannot be {_said(length)}'} [E0727]"
            report.add("mesh.length", fault, "a number above 0 (1e-100 to 1e100), or one for each axis: length = 500.0")
            sides = [1.0] * len(counts)
        return counts, [float(side) for side in sides if side is not None], self.text("mesh", table, "unit")

    def check_names(self) -> None:
        """Report names that are not legal, that are words of formulas, and that two entries have."""
        seen: dict[str, str] = {}
        for section in ("parameters", "definitions", "operators", "data"):
            for name in self.section(section):
                key = f"{section}.{name}"
                if not is_legal(name):
                    self.report.add(key, f"the name {shown(name)} is not legal [E0715]", NAME_RULE)
                elif name in _own_names():
                    fault = f"formulas have {name} of their own [E0728]"
                    self.report.add(key, fault, f"another name than {', '.join(_own_names())}")
                elif name in _WORDS:
                    self.report.add(key, f"the name {name} is a word of formulas [E0729]", f"{name}_value")
                elif name in seen:
                    self.report.add(key, f"the name {name} is given twice, in {seen[name]} too [E0730]", "another name")
                seen.setdefault(name, f"[{section}]")
        for name in self.section("operators"):
            if f"{name}{VARIANCE}" in seen:
                key = f"{seen[f'{name}{VARIANCE}'].strip('[]')}.{name}{VARIANCE}"
                self.report.add(key, f"this is the name of the variance of {name} [E0731]", "another name")

    @property
    def waves(self) -> tuple[str, ...]:
        """Names of wave numbers: k and components of k."""
        return OF_WAVES[: 1 + len(self.axes)]

    # -- operators ---------------------------------------------------------------------------------------------------

    def operators(self, data: Sequence[str]) -> list[Operator]:
        made: list[Operator] = []
        entries = self.section("operators")
        if not entries and not self.report.concerns("operators"):
            hint = '[operators] and density = { power = "300*exp(-(4*k)**2)" }: by which white noise becomes a field'
            self.report.add("operators", "there is no operator [E0732]", hint)
        for name, entry in entries.items():
            key = f"operators.{name}"
            if not isinstance(entry, Mapping):
                hint = f'{name} = {{ power = "300*exp(-(4*k)**2)" }}'
                self.report.add(key, f"a table is needed here, not {described(entry)} [E0716]", hint)
                continue
            result = self.operator(key, name, entry, data, [item.name for item in made])
            if result is not None:
                made.append(result)
        return made

    def operator(
        self, key: str, name: str, entry: Mapping[str, Any], data: Sequence[str], above: Sequence[str]
    ) -> Operator | None:
        kind = self.kind_of(key, entry, OPERATOR_KINDS, ("of", "where"))
        of = entry.get("of", "")
        if of and of not in above:
            hint = nearest(str(of), above) or "an operator above it"
            self.report.add(f"{key}.of", f"there is no operator {shown(of)} above this one [E0733]", hint)
            of = ""
        if kind is None:
            return None
        where, value = self.named(f"{key}.where", entry.get("where", {}), self.waves), entry[kind]
        if kind == "white":
            if value is not True:
                self.report.add(f"{key}.white", f"this is {described(value)} [E0719]", f"{name} = {{ white = true }}")
            return Operator(name, "white", of=of)
        if kind == "smoothing":
            radius, _ = self.number(f"{key}.smoothing", value, self.known)
            if radius < 0.0:
                self.report.add(f"{key}.smoothing", f"the radius is {radius:.6g} [E0734]", "a radius from 0 on")
            return Operator(name, "smoothing", self.formula(key, radius, SceneNames(), _WAVES) or ZERO, of=of)
        if kind == "difference":
            if value not in self.axes:
                self.report.add(
                    f"{key}.difference", f"there is no axis {_said(value)} [E0735]", f"one of {listed(self.axes)}"
                )
                return None
            return Operator(name, "difference", axis=self.axes.index(value), of=of)
        if kind == "mask":
            names = self.names(self.axes, data)
            return Operator(name, "mask", self.formula(f"{key}.mask", value, names, _PLACES) or ZERO, of=of)
        if isinstance(value, Mapping):
            if kind == "filter":
                fault = "a table is of a power spectrum, and a filter is a formula [E0736]"
                self.report.add(f"{key}.filter", fault, 'filter = "exp(-(k/0.2)**2)"')
            return Operator(name, kind, table=self.table(f"{key}.{kind}", value), of=of)
        names, inner = self.names(self.waves, [*dict(where)]), self.names(self.waves, ())
        made = self.formula(f"{key}.{kind}", value, names, _WAVES, inner)
        return Operator(name, kind, made or ZERO, where, of=of)

    def kind_of(self, key: str, entry: Mapping[str, Any], kinds: Sequence[str], more: Sequence[str]) -> Any:
        """Return the key of an entry that determines its kind."""
        check_keys(key, entry, (*kinds, *more), self.report)
        said = [kind for kind in kinds if kind in entry]
        if len(said) != 1:
            fault = f"{listed(said)} are said together [E0737]" if said else "no key gives its kind [E0738]"
            self.report.add(key, fault, f"one of {listed(kinds)}")
            return None
        return said[0]

    def table(self, key: str, entry: Mapping[str, Any]) -> Table:
        """Return a table of P by k."""
        check_keys(key, entry, ("file", "columns"), self.report)
        columns = entry.get("columns", ["", ""])
        if not (isinstance(columns, list) and len(columns) == 2 and all(isinstance(name, str) for name in columns)):
            hint = 'columns = ["k", "P"]; the first two if nothing is said'
            self.report.add(
                f"{key}.columns", f"two names of columns are needed, not {described(columns)} [E0739]", hint
            )
            columns = ["", ""]
        file = self.text(key, entry, "file")
        if not file:
            self.report.add(key, "the file is missing [E0740]", 'file = "power.csv", a table of k and P')
        return Table(file, (columns[0], columns[1]))

    def named(self, key: str, entry: object, own: Sequence[str]) -> tuple[tuple[str, Formula], ...]:
        """Return the formulas of a table ``where``; each formula may use the previous names."""
        made: list[tuple[str, Formula]] = []
        if not isinstance(entry, Mapping):
            self.report.add(key, f"a table is needed here, not {described(entry)} [E0716]", 'where = { q = "k/0.2" }')
            return ()
        for name, text in entry.items():
            if not is_legal(name) or name in (*_own_names(), *(item.name for item in self.known), *self.defined):
                self.report.add(f"{key}.{name}", f"the name {shown(name)} cannot be taken here [E0741]", NAME_RULE)
            elif name in _WORDS:
                self.report.add(f"{key}.{name}", f"the name {name} is a word of formulas [E0729]", f"{name}_value")
            names = self.names(own, [one for one, _ in made])
            result = self.formula(f"{key}.{name}", text, names, _WAVES, self.names(own, ()))
            if result is not None:
                made.append((name, result))
        return tuple(made)

    def names(self, own: Sequence[str], more: Iterable[str]) -> SceneNames:
        """Return the names for a formula: parameters, predefined variables, and further names."""
        values = dict.fromkeys((VOLUME, *(item.name for item in self.known)), True)
        return SceneNames(parameters=values, states=(*own, *more), definitions=self.defined)

    # -- data --------------------------------------------------------------------------------------------------------

    def columns(self) -> list[Data]:
        """Return data that need no fields; ``drawn`` reads the formulas of random data."""
        made: list[Data] = []
        for name, entry in self.section("data").items():
            key = f"data.{name}"
            if isinstance(entry, str) and (entry.lower().endswith(_FILES) or _PATH.fullmatch(entry)):
                table: Mapping[str, Any] = {"file": entry}
            else:
                table = entry if isinstance(entry, Mapping) else {"formula": entry}
            kind: DataKind | None = self.kind_of(key, table, DATA_KINDS, ("column", "minimum", "beta", "deviation"))
            if kind is None:
                continue
            least = self.minimum(key, name, table)
            inner = f"{key}.{kind}" if isinstance(entry, Mapping) else key
            if kind == "file":
                file = table["file"]
                if not isinstance(file, str) or not file.lower().endswith(_FILES):
                    self.report.add(
                        inner, f"{_said(file)} is not a file of data [E0742]", "a path that ends with .npy or .csv"
                    )
                made.append(Data(name, kind, file=str(file), column=self.text(key, table, "column"), minimum=least))
            elif kind == "formula":
                above = [item.name for item in made if item.kind not in DRAWN]
                read = self.formula(inner, table["formula"], self.names(self.axes, above), _PLACES)
                made.append(Data(name, kind, read or ZERO, minimum=least))
            else:
                made.append(Data(name, kind, minimum=least))
        return made

    def drawn(self, given: Sequence[Data], operators: Sequence[Operator]) -> list[Data]:
        """Return data with the formulas of random data, which are about fields of the truth."""
        made: list[Data] = []
        own = [item.name for item in operators]
        for item in given:
            key = f"data.{item.name}"
            if item.kind not in DRAWN:
                made.append(item)
                continue
            entry = self.section("data")[item.name]
            more = [*own, *(f"{name}{VARIANCE}" for name in own), *(one.name for one in made)]
            names = self.names(self.axes, more)
            mean = self.formula(f"{key}.{item.kind}", entry[item.kind], names, _DRAWN)
            needed, spread = DRAWN[item.kind], None
            if needed and needed not in entry:
                self.report.add(key, f"{needed} is missing [E0743]", f'{item.kind} = "...", {needed} = 0.5')
            elif needed:
                spread = self.formula(f"{key}.{needed}", entry[needed], names, _DRAWN)
            made.append(Data(item.name, item.kind, mean or ZERO, spread, minimum=item.minimum))
        return made

    def minimum(self, key: str, name: str, table: Mapping[str, Any]) -> float | None:
        if "minimum" not in table:
            return 0.0 if name in _NOT_NEGATIVE else None
        return self.number(f"{key}.minimum", table["minimum"], self.known)[0]

    def truth(self, given: Sequence[Data]) -> int | None:
        """Return the seed of the truth; None without one."""
        table, drawn = self.section("truth"), [item.name for item in given if item.kind in DRAWN]
        check_keys("truth", table, ("seed",), self.report)
        if "truth" not in self.data:
            if drawn:
                fault = f"{listed(drawn)} is drawn about fields of a truth that is missing [E0744]"
                self.report.add(f"data.{drawn[0]}", fault, "[truth] and seed = 1")
            return None
        seed = table.get("seed")
        if "seed" not in table:
            self.report.add("truth", "the seed is missing [E0745]", "[truth] and seed = 1")
            return None
        if not isinstance(seed, int) or not _is_whole(seed, 0) or seed > _MOST_SEED:
            self.report.add(
                "truth.seed", f"{_said(seed)} is not a seed [E0746]", f"a whole number from 0 to {_MOST_SEED}"
            )
            return None
        return seed

    # -- energy ------------------------------------------------------------------------------------------------------

    def cell(self) -> tuple[str, dict[str, str]]:
        """Return the formula of a cell, and the named formulas of the cell."""
        table = self.section("cell")
        check_keys("cell", table, ("energy", "where"), self.report)
        energy, where = table.get("energy"), table.get("where", {})
        if isinstance(energy, int | float) and not isinstance(energy, bool):
            energy = repr(energy)
        if not isinstance(energy, str) or not energy.strip():
            fault = (
                "the energy of a cell is missing [E0748]"
                if energy is None
                else f"a formula is needed, not {_said(energy)} [E0749]"
            )
            hint = 'energy = "exp(e) - counts*e", minus the logarithm of a likelihood; "0" for the prior alone'
            self.report.add("cell.energy", fault, hint)
            energy = ""
        if not isinstance(where, Mapping) or not all(isinstance(text, str) for text in where.values()):
            hint = '[cell.where] and e = "log(mean) + density"'
            self.report.add("cell.where", f"a table of formulas is needed here, not {described(where)} [E0750]", hint)
            where = {}
        return energy, dict(where)

    def used(
        self, energy: str, where: Mapping[str, str], operators: Sequence[Operator], given: Sequence[Data]
    ) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Return the operators and the data named in formulas of a cell, in the order of the file."""
        own, columns = [item.name for item in operators], [item.name for item in given]
        known = [*own, *(f"{name}{VARIANCE}" for name in own), *columns, VOLUME, *(item.name for item in self.known)]
        result: set[str] = set()
        of_where: list[str] = []
        for name, text in (*((f"where.{name}", text) for name, text in where.items()), ("energy", energy)):
            key = f"cell.{name}"
            label = name.removeprefix("where.")
            if name != "energy" and (not is_legal(label) or label in (*known, *of_where, *self.defined)):
                self.report.add(key, f"the name {shown(label)} is taken, or not legal [E0751]", NAME_RULE)
            elif name != "energy" and label in _WORDS:
                self.report.add(key, f"the name {label} is a word of formulas [E0729]", f"{label}_value")
            if text:
                result |= self.named_in_cell(key, text, known, of_where)
            if name != "energy":
                of_where.append(label)
        return tuple(name for name in own if name in result), tuple(name for name in columns if name in result)

    def named_in_cell(self, key: str, text: str, known: Sequence[str], of_where: Sequence[str]) -> set[str]:
        """Return the names in a formula of a cell; none for a faulty formula, which is reported."""
        try:
            formula = cell_formula(self.report.where(key), text, known, self.defined, of_where)
            return {symbol.name for symbol in symbols(formula)}
        except DescriptionError as error:
            for problem in error.problems if not mentions_any(text, self.refused) else ():
                self.report.add(key, problem.what, problem.hint)
        return set()

    # -- the rest ----------------------------------------------------------------------------------------------------

    def white_prior(self) -> None:
        """Check ``[prior]``, which may only state the default: the state is white noise."""
        table = self.section("prior")
        check_keys("prior", table, ("white",), self.report)
        if table.get("white", True) is not True:
            fault = "the state is independent standard normal numbers, and nothing else [E0752]"
            self.report.add("prior.white", fault, "white = true, and an operator that gives the field its covariance")

    def mass(self) -> str:
        table = self.section("mass")
        check_keys("mass", table, ("choice",), self.report)
        choice = table.get("choice", "fisher")
        if choice not in _MASSES:
            self.report.add("mass.choice", f"there is no mass {_said(choice)} [E0753]", f"one of {listed(_MASSES)}")
            return "fisher"
        return str(choice)

    def sampling(self, watched: Sequence[str]) -> Chains:
        """Return the defaults of ``sample``."""
        table, standard = self.section("sampling"), Chains()
        check_keys("sampling", table, [item.name for item in fields_of(Chains)], self.report)
        given: dict[str, Any] = {}
        for name, value in table.items():
            if name not in Chains.__dataclass_fields__:
                continue
            wanted, key = getattr(standard, name), f"sampling.{name}"
            if isinstance(wanted, str):
                given[name] = self.text("sampling", table, name)
                if wanted and value == "":
                    self.report.add(key, f"the name of {name} is empty [E0754]", f"{name} = {wanted!r}, or no {name}")
            elif isinstance(wanted, int):
                if _is_whole(value, 0):
                    given[name] = value
                else:
                    self.report.add(
                        key, f"a whole number is needed here, not {_said(value)} [E0755]", f"{name} = {wanted}"
                    )
            elif isinstance(value, bool) or not isinstance(value, int | float) or math.isnan(value):
                self.report.add(key, f"a number is needed here, not {_said(value)} [E0756]", f"{name} = {wanted}")
            else:
                given[name] = float(value)
        unknown = given.get("field") and given["field"] not in watched
        if unknown and not self.report.concerns("operators"):
            hint = listed(watched) or "no field"
            self.report.add("sampling.field", f"there is no field {shown(given['field'])} in the energy [E0757]", hint)
        return Chains(**given)


def _own_names() -> tuple[str, ...]:
    return (*OF_WAVES, *OF_PLACES, VOLUME)


def _last(operators: Sequence[Operator]) -> tuple[str, ...]:
    """Return the operators that no other follows."""
    before = {item.of for item in operators}
    return tuple(item.name for item in operators if item.name not in before)


def _is_whole(value: object, least: int) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= least


def _is_length(value: object) -> bool:
    """Return whether volumes of a box, and squares of wave numbers of the box, are finite numbers."""
    return isinstance(value, int | float) and not isinstance(value, bool) and 1e-100 <= value <= 1e100


def _said(value: object) -> str:
    return f"[{', '.join(map(repr, value))}]"[:60] if isinstance(value, list) else described(value)
