"""Reading of files with ``kind = "hamiltonian"`` and a ``[mesh]``: every problem by key and line."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping, Sequence
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
from eomgen.products.fields.documents.entries import FieldEntries, cell_formula
from eomgen.products.fields.documents.schema import (
    DATA_FILES,
    KIND,
    DataTable,
    FieldFile,
    OperatorTable,
    PowerTable,
    said,
)
from eomgen.scene.formula.namespaces import mentions_any
from eomgen.scene.formula.scope import SceneNames, Scope
from eomgen.scene.reading.report import Report
from eomgen.scene.sources.source import read_text, shown_file
from eomgen.scene.sources.toml import toml_data

#: Commands and keys for Hamiltonian systems of coordinates, for messages.
OF_COORDINATES = "eomgen simulate, or a [mesh] with cells and length"
#: Sections of entries by name.
_SECTIONS = ("parameters", "definitions", "operators", "data")
_KINDS = frozenset({"parameter", "state"})
_WAVES = Scope(f"{', '.join(OF_WAVES)}, {VOLUME} of a cell, parameters, definitions and names of where", _KINDS)
_PLACES = Scope(f"{', '.join(OF_PLACES)} of a cell's centre, parameters, and data above", _KINDS)
_DRAWN = Scope(f"operators, {', '.join(OF_PLACES)} of a cell's centre, parameters, and data above", _KINDS)
_ANYWHERE = Scope("wave numbers, places, operators, data, parameters and other definitions", _KINDS)
#: Data that cannot be below 0, by name.
_NOT_NEGATIVE = ("counts", "response")


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


class _FieldReader(FieldEntries[FieldFile]):
    words = RESERVED - {"t"}  # the time is refused at its use

    def __init__(self, data: Mapping[str, Any], report: Report, folder: Path) -> None:
        super().__init__(data, report, FieldFile, _SECTIONS)
        self.folder = folder
        self.known: list[Parameter] = []
        self.axes: tuple[str, ...] = ()

    def read(self) -> FieldSystem | None:
        """Return the system; None if a problem has been reported."""
        data, report, file = self.data, self.report, self.file
        self.known = self.parameters()
        cells, lengths = file.mesh.cells, self.lengths()
        self.axes = OF_PLACES[: len(cells)]
        self.check_every_name()
        own = self.names_in("operators")
        more = (*self.axes, *own, *(f"{name}{VARIANCE}" for name in own), *self.names_in("data"))
        self.definitions(self.names(self.waves, more), _ANYWHERE)
        given = self.columns()
        operators = self.operators([item.name for item in given if item.kind not in DRAWN])
        truth = self.truth(given)
        energy, where = _text(file.cell.energy), {name: _text(text) for name, text in file.cell.where.items()}
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
            file.name,
            cells,
            lengths,
            energy,
            tuple(operators),
            tuple(given),
            where,
            fields,
            columns,
            tuple(self.known),
            truth,
            file.mass.choice,
            sampling,
            file.mesh.unit,
            file.description,
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
        keys += [f"sampling.{name}" for name in self.file.sampling.model_fields_set]
        keys += [f"operators.{item.name}" for item in operators]
        return keys + [f"data.{item.name}" for item in given]

    # -- mesh --------------------------------------------------------------------------------------------------------

    def lengths(self) -> tuple[float, ...]:
        """Return the length along each axis."""
        sides, axes = self.file.mesh.length, len(self.file.mesh.cells)
        if not isinstance(sides, tuple):
            return (sides,) * axes
        if len(sides) != axes:
            fault = f"the length of the box cannot be {said(sides)} [E0727]"
            self.report.add("mesh.length", fault, f"one number for all axes, or a list of {axes}")
        return sides

    def check_every_name(self) -> None:
        """Report names that are not legal, that formulas have, and that two entries have."""
        own = _own_names()
        taken = {
            name: (f"formulas have {name} of their own [E0728]", f"another name than {', '.join(own)}") for name in own
        }
        given = self.keys_in("parameters", "definitions", "operators", "data")
        seen = self.check_names(given, taken)
        for name in self.names_in("operators"):
            if f"{name}{VARIANCE}" in seen:
                key = f"{seen[f'{name}{VARIANCE}']}.{name}{VARIANCE}"
                self.report.add(key, f"this is the name of the variance of {name} [E0731]", "another name")

    @property
    def waves(self) -> tuple[str, ...]:
        """Names of wave numbers: k and components of k."""
        return OF_WAVES[: 1 + len(self.axes)]

    # -- operators ---------------------------------------------------------------------------------------------------

    def operators(self, data: Sequence[str]) -> list[Operator]:
        made: list[Operator] = []
        if not self.file.operators and not self.report.concerns("operators"):
            hint = '[operators] and density = { power = "300*exp(-(4*k)**2)" }: by which white noise becomes a field'
            self.report.add("operators", "there is no operator [E0732]", hint)
        every = list(self.data.get("operators", {}))  # refused ones too, which exist
        for name, entry in self.file.operators.items():
            result = self.operator(f"operators.{name}", name, entry, data, every[: every.index(name)])
            if result is not None:
                made.append(result)
        return made

    def operator(
        self, key: str, name: str, entry: OperatorTable, data: Sequence[str], above: Sequence[str]
    ) -> Operator | None:
        kind = self.kind_of(key, entry, OPERATOR_KINDS)
        of = entry.of
        if of and of not in above:
            hint = nearest(of, above) or "an operator above it"
            self.report.add(f"{key}.of", f"there is no operator {shown(of)} above this one [E0733]", hint)
            of = ""
        if kind is None:
            return None
        where, value = self.named(f"{key}.where", entry.where, self.waves), getattr(entry, kind)
        if kind == "white":
            return Operator(name, "white", of=of)
        if kind == "smoothing":
            radius, _ = self.number(f"{key}.smoothing", value, self.known)
            if radius < 0.0:
                self.report.add(f"{key}.smoothing", f"the radius is {radius:.6g} [E0734]", "a radius from 0 on")
            return Operator(name, "smoothing", self.formula(key, radius, SceneNames(), _WAVES) or ZERO, of=of)
        if kind == "difference":
            if value not in self.axes:
                fault = f"there is no axis {shown(value)} [E0735]"
                self.report.add(f"{key}.difference", fault, f"one of {listed(self.axes)}")
                return None
            return Operator(name, "difference", axis=self.axes.index(value), of=of)
        if kind == "mask":
            names = self.names(self.axes, data)
            return Operator(name, "mask", self.formula(f"{key}.mask", value, names, _PLACES) or ZERO, of=of)
        if isinstance(value, PowerTable):
            return Operator(name, kind, table=Table(**dict(value)), of=of)
        names, inner = self.names(self.waves, [*dict(where)]), self.names(self.waves, ())
        made = self.formula(f"{key}.{kind}", value, names, _WAVES, inner)
        return Operator(name, kind, made or ZERO, where, of=of)

    def kind_of(self, key: str, entry: object, kinds: Sequence[str]) -> Any:
        """Return the key of an entry that determines its kind."""
        given = [kind for kind in kinds if getattr(entry, kind) is not None]
        if len(given) != 1:
            fault = f"{listed(given)} are said together [E0737]" if given else "no key gives its kind [E0738]"
            self.report.add(key, fault, f"one of {listed(kinds)}")
            return None
        return given[0]

    def named(self, key: str, entry: Mapping[str, float | str], own: Sequence[str]) -> tuple[tuple[str, Formula], ...]:
        """Return the formulas of a table ``where``; each formula may use the previous names."""
        made: list[tuple[str, Formula]] = []
        for name, text in entry.items():
            if not is_legal(name) or name in (*_own_names(), *(item.name for item in self.known), *self.defined):
                self.report.add(f"{key}.{name}", f"the name {shown(name)} cannot be taken here [E0741]", NAME_RULE)
            elif name in self.words:
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
        for name, entry in self.file.data.items():
            key = f"data.{name}"
            kind: DataKind | None = self.kind_of(key, entry, DATA_KINDS)
            if kind is None:
                continue
            least = self.minimum(key, name, entry)
            inner = f"{key}.{kind}" if isinstance(self.data["data"][name], Mapping) else key
            if kind == "file":
                file = str(entry.file)
                if not file.lower().endswith(DATA_FILES):
                    fault = f"{shown(file)} is not a file of data [E0742]"
                    self.report.add(inner, fault, "a path that ends with .npy or .csv")
                made.append(Data(name, kind, file=file, column=entry.column, minimum=least))
            elif kind == "formula":
                above = [item.name for item in made if item.kind not in DRAWN]
                read = self.formula(inner, getattr(entry, kind), self.names(self.axes, above), _PLACES)
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
            entry = self.file.data[item.name]
            more = [*own, *(f"{name}{VARIANCE}" for name in own), *(one.name for one in made)]
            names = self.names(self.axes, more)
            mean = self.formula(f"{key}.{item.kind}", getattr(entry, item.kind), names, _DRAWN)
            needed, spread = DRAWN[item.kind], None
            if needed and getattr(entry, needed) is None:
                self.report.add(key, f"{needed} is missing [E0743]", f'{item.kind} = "...", {needed} = 0.5')
            elif needed:
                spread = self.formula(f"{key}.{needed}", getattr(entry, needed), names, _DRAWN)
            made.append(Data(item.name, item.kind, mean or ZERO, spread, minimum=item.minimum))
        return made

    def minimum(self, key: str, name: str, entry: DataTable) -> float | None:
        if entry.minimum is None:
            return 0.0 if name in _NOT_NEGATIVE else None
        return self.number(f"{key}.minimum", entry.minimum, self.known)[0]

    def truth(self, given: Sequence[Data]) -> int | None:
        """Return the seed of the truth; None without one."""
        drawn = [item.name for item in given if item.kind in DRAWN]
        if drawn and "truth" not in self.data:
            fault = f"{listed(drawn)} is drawn about fields of a truth that is missing [E0744]"
            self.report.add(f"data.{drawn[0]}", fault, "[truth] and seed = 1")
        return None if self.file.truth is None else self.file.truth.seed

    # -- energy ------------------------------------------------------------------------------------------------------

    def used(
        self, energy: str, where: Mapping[str, str], operators: Sequence[Operator], given: Sequence[Data]
    ) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Return the operators and the data named in formulas of a cell, in the order of the file."""
        own, columns = [item.name for item in operators], [item.name for item in given]
        known = [
            *own,
            *(f"{name}{VARIANCE}" for name in own),
            *columns,
            VOLUME,
            *(item.name for item in self.known),
            *self.left_out,
        ]
        result: set[str] = set()
        of_where: list[str] = []
        for name, text in (*((f"where.{name}", text) for name, text in where.items()), ("energy", energy)):
            key = f"cell.{name}"
            label = name.removeprefix("where.")
            if name != "energy" and (not is_legal(label) or label in (*known, *of_where, *self.defined)):
                self.report.add(key, f"the name {shown(label)} is taken, or not legal [E0751]", NAME_RULE)
            elif name != "energy" and label in self.words:
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

    def sampling(self, watched: Sequence[str]) -> Chains:
        """Return the defaults of ``sample``."""
        given = self.file.sampling.model_dump(exclude_unset=True)
        for name, value in given.items():
            if value == "" and (standard := getattr(Chains(), name)):
                hint = f"{name} = {standard!r}, or no {name}"
                self.report.add(f"sampling.{name}", f"the name of {name} is empty [E0754]", hint)
        unknown = given.get("field") and given["field"] not in watched
        if unknown and not (self.report.concerns("operators") or self.report.concerns("data")):
            hint = listed(watched) or "no field"
            self.report.add("sampling.field", f"there is no field {shown(given['field'])} in the energy [E0757]", hint)
        return Chains(**given)


def _own_names() -> tuple[str, ...]:
    return (*OF_WAVES, *OF_PLACES, VOLUME)


def _last(operators: Sequence[Operator]) -> tuple[str, ...]:
    """Return the operators that no other follows."""
    before = {item.of for item in operators}
    return tuple(item.name for item in operators if item.name not in before)


def _text(formula: float | str) -> str:
    return formula if isinstance(formula, str) else repr(formula)
