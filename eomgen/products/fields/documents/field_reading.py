"""Reading of files with ``kind = "hamiltonian"`` and a ``[mesh]``: every problem by key and line."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from eomgen.base.messages import NAME_RULE, listed, nearest, shown
from eomgen.errors import Message, UsageError
from eomgen.formula.evaluate import symbols
from eomgen.formula.nodes import ZERO, Formula, Number  # ZERO: in place of refused values, which are reported
from eomgen.formula.words import RESERVED
from eomgen.integrators.compositions import composition_named
from eomgen.products.fields.documents.document import (
    DATA_KINDS,
    DRAWN,
    OF_PLACES,
    OF_WAVES,
    OPERATOR_KINDS,
    VARIANCE,
    VOLUME,
    Data,
    DataKind,
    FieldSystem,
    NamedNumber,
    Operator,
)
from eomgen.products.fields.documents.entries import FieldEntries, toml_file
from eomgen.products.fields.documents.schema import KIND, FieldFile, OperatorTable, value_text
from eomgen.products.fields.documents.tables import Chains, PowerTable
from eomgen.scene.formula.scope import SceneNames, Scope
from eomgen.scene.reading.report import Report

#: Commands and keys for Hamiltonian systems of coordinates, for messages.
OF_COORDINATES = "eomgen simulate, or a [mesh] with cells and length"
#: Names that formulas have of their own.
_OWN_NAMES = (*OF_WAVES, *OF_PLACES, VOLUME)
#: Sections of entries by name.
_SECTIONS = ("parameters", "definitions", "operators", "data")
_KINDS = frozenset({"parameter", "state"})
_WAVES = Scope(f"{', '.join(OF_WAVES)}, {VOLUME} of a cell, parameters, definitions and names of where", _KINDS)
_PLACES = Scope(f"{', '.join(OF_PLACES)} of a cell's centre, parameters, and data above", _KINDS)
_DRAWN = Scope(f"operators, {', '.join(OF_PLACES)} of a cell's centre, parameters, and data above", _KINDS)
_CELL = Scope("fields, data, parameters, definitions and names of where", _KINDS)
_ANYWHERE = Scope("wave numbers, places, operators, data, parameters and other definitions", _KINDS)
#: Data that cannot be below 0, by name.
_NOT_NEGATIVE = ("counts", "response")
#: Starts of chains, besides files.
STARTS = ("mode", "prior", "zero")


def load_fields(path: str | os.PathLike[str]) -> FieldSystem:
    """Read a system of fields from a TOML file.

    Raises
    ------
    FileError, DescriptionError, UsageError
        DescriptionError contains all faults of the content.
    """
    data, lines, file = toml_file(path)
    return fields_from_data(data, file=file, lines=lines, folder=Path(path).expanduser().parent)


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
    file : str
        Name in messages.
    lines : mapping, optional
        Line or place of each key in the file.
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
        fault = "there is no mesh: sampling draws fields on the cells of a mesh, not motions of coordinates [E0725]"
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
        self.known: list[NamedNumber] = []
        self.axes: tuple[str, ...] = ()

    def read(self) -> FieldSystem | None:
        """Return the system of fields; None if a problem has been reported."""
        report, file = self.report, self.file
        self.known = self.parameters()
        cells, lengths = file.mesh.cells, self.lengths()
        self.axes = OF_PLACES[: len(cells)]
        self.check_every_name()
        more = (*self.axes, *_with_variances(self.names_in("operators")), *self.names_in("data"))
        self.definitions(self.names(self.waves, more), _ANYWHERE)
        kinds = self.kinds_of_data()
        operators = self.operators([name for name, kind in kinds.items() if kind not in DRAWN])
        numbers = self.numbers_in_cells(kinds, operators)
        truth = self.truth(numbers)
        energy, where = _text(file.cell.energy), {name: _text(text) for name, text in file.cell.where.items()}
        before = {item.of for item in operators}
        fields = tuple(item.name for item in operators if item.name not in before)
        columns: tuple[str, ...] = ()
        if not (report.concerns("operators") or report.concerns("data")):  # else names are unknown because of faults
            named, columns = self.names_in_cell(energy, where, operators, numbers)
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
            sampling,
            tuple(numbers),
            where,
            fields,
            columns,
            tuple(self.known),
            truth,
            file.mass.choice,
            file.mesh.unit,
            file.description,
            self.folder,
            {key: report.where(key) for key in report.lines},
            self.content_without("sampling", "description"),
            {name: item.text for name, item in self.defined.items()},
            tuple(map(Message, self.note_on_unused())),
        )

    # -- mesh --------------------------------------------------------------------------------------------------------

    def lengths(self) -> tuple[float, ...]:
        """Return the length of the box along each axis; a wrong number of lengths is reported."""
        sides, axes = self.file.mesh.length, len(self.file.mesh.cells)
        if not isinstance(sides, tuple):
            return (sides,) * axes
        if len(sides) != axes:
            fault = f"the length of the box cannot be {value_text(sides)} [E0727]"
            self.report.add("mesh.length", fault, f"one number for all axes, or a list of {axes}")
        return sides

    def check_every_name(self) -> None:
        """Report names of entries that are not legal, that formulas predefine (wave numbers, places, volume), that two
        entries have, or that belong to the variance of an operator."""
        hint = f"another name than {', '.join(_OWN_NAMES)}"
        taken = {name: (f"formulas have {name} of their own [E0728]", hint) for name in _OWN_NAMES}
        seen = self.check_names(self.keys_in("parameters", "definitions", "operators", "data"), taken)
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
            result = self.operator(name, entry, data, every[: every.index(name)])
            if result is not None:
                made.append(result)
        return made

    def operator(self, name: str, entry: OperatorTable, data: Sequence[str], above: Sequence[str]) -> Operator | None:
        """Return the operator of an entry; None for an entry without exactly one kind, or with an unknown axis. Faults
        are reported. ``data`` are names that a mask may use, ``above`` the names of the operators before this one in
        the file."""
        key, of = f"operators.{name}", entry.of
        kind = self.kind_of(key, entry, OPERATOR_KINDS)
        if of and of not in above:
            hint = nearest(of, above) or "an operator above it"
            self.report.add(f"{key}.of", f"there is no operator {shown(of)} above this one [E0733]", hint)
            of = ""
        if kind is None:
            return None
        where, value = self.auxiliary_formulas(f"{key}.where", entry.where, self.waves), getattr(entry, kind)
        formula: Formula | None = None
        more: dict[str, Any] = {}
        if kind == "smoothing":
            radius, _ = self.number(f"{key}.smoothing", value, self.known)
            if radius < 0.0:
                self.report.add(f"{key}.smoothing", f"the radius is {radius:.6g} [E0734]", "a radius from 0 on")
            formula = Number(radius)
        elif kind == "difference":
            if value not in self.axes:
                fault = f"there is no axis {shown(value)} [E0735]"
                self.report.add(f"{key}.difference", fault, f"one of {listed(self.axes)}")
                return None
            more = {"axis": self.axes.index(value)}
        elif kind == "mask":
            formula = self.formula(f"{key}.mask", value, self.names(self.axes, data), _PLACES)
        elif isinstance(value, PowerTable):
            more = {"table": value}
        elif kind != "white":
            names, inner = self.names(self.waves, [*dict(where)]), self.names(self.waves, ())
            formula, more = self.formula(f"{key}.{kind}", value, names, _WAVES, inner), {"where": where}
        return Operator(name, kind, formula or ZERO, of=of, **more)

    def kind_of(self, key: str, entry: object, kinds: Sequence[str]) -> Any:
        """Return the only one of the keys ``kinds`` that an entry has; None, after a report, for none or several."""
        present = [kind for kind in kinds if getattr(entry, kind) is not None]
        if len(present) != 1:
            fault = f"{listed(present)} are said together [E0737]" if present else "no key gives its kind [E0738]"
            self.report.add(key, fault, f"one of {listed(kinds)}")
            return None
        return present[0]

    def auxiliary_formulas(
        self, key: str, entry: Mapping[str, float | str], names_of_cell: Sequence[str]
    ) -> tuple[tuple[str, Formula], ...]:
        """Return name and formula of each entry of a table ``where``; each formula may use ``names_of_cell``,
        parameters and previous names. Faulty formulas are reported and left out."""
        made: list[tuple[str, Formula]] = []
        for name, text in entry.items():
            taken = (*_OWN_NAMES, *(item.name for item in self.known), *self.defined)
            fault = f"the name {shown(name)} cannot be taken here [E0741]", NAME_RULE
            self.check_names([(f"{key}.{name}", name)], dict.fromkeys(taken, fault))
            names = self.names(names_of_cell, [known_name for known_name, _ in made])
            result = self.formula(f"{key}.{name}", text, names, _WAVES, self.names(names_of_cell, ()))
            if result is not None:
                made.append((name, result))
        return tuple(made)

    def names(self, known: Sequence[str], more: Iterable[str]) -> SceneNames:
        """Return the names for a formula: parameters, predefined variables, and further names."""
        values = dict.fromkeys((VOLUME, *(item.name for item in self.known)), True)
        return SceneNames(parameters=values, states=(*known, *more), definitions=self.defined)

    # -- data --------------------------------------------------------------------------------------------------------

    def kinds_of_data(self) -> dict[str, DataKind]:
        """Return the kind of each entry; entries without exactly one are reported and left out."""
        kinds = {name: self.kind_of(f"data.{name}", entry, DATA_KINDS) for name, entry in self.file.data.items()}
        return {name: kind for name, kind in kinds.items() if kind is not None}

    def numbers_in_cells(self, kinds: Mapping[str, DataKind], operators: Sequence[Operator]) -> list[Data]:
        """Return the data of all kinds; random data have formulas of mean and spread, which may use fields of the
        truth, and are read if no operator or entry has a fault. Faults, such as a missing spread, are reported."""
        made: list[Data] = []
        faulty = self.report.concerns("operators") or self.report.concerns("data")
        operator_names = _with_variances(item.name for item in operators)
        for name, kind in kinds.items():
            key, entry = f"data.{name}", self.file.data[name]
            least = 0.0 if name in _NOT_NEGATIVE else None
            if entry.minimum is not None:
                least, _ = self.number(f"{key}.minimum", entry.minimum, self.known)
            inner = f"{key}.{kind}" if isinstance(self.data["data"][name], Mapping) else key
            read: Formula | None = ZERO
            spread: Formula | None = None
            if kind == "formula":
                above = [item.name for item in made if item.kind not in DRAWN]
                read = self.formula(inner, getattr(entry, kind), self.names(self.axes, above), _PLACES)
            elif kind in DRAWN and not faulty:
                names = self.names(self.axes, [*operator_names, *(item.name for item in made)])
                read, needed = self.formula(f"{key}.{kind}", getattr(entry, kind), names, _DRAWN), DRAWN[kind]
                if needed and getattr(entry, needed) is None:
                    self.report.add(key, f"{needed} is missing [E0743]", f'{kind} = "...", {needed} = 0.5')
                elif needed:
                    spread = self.formula(f"{key}.{needed}", getattr(entry, needed), names, _DRAWN)
            made.append(Data(name, kind, read or ZERO, spread, entry.file or "", entry.column, least))
        return made

    def truth(self, data: Sequence[Data]) -> int | None:
        """Return the seed of the truth, from which random data are drawn; None without one, which is reported if there
        are random data."""
        drawn = [item.name for item in data if item.kind in DRAWN]
        if drawn and "truth" not in self.data:
            fault = f"{listed(drawn)} is drawn about fields of a truth that is missing [E0744]"
            self.report.add(f"data.{drawn[0]}", fault, "[truth] and seed = 1")
        return None if self.file.truth is None else self.file.truth.seed

    # -- energy ------------------------------------------------------------------------------------------------------

    def names_in_cell(
        self, energy: str, where: Mapping[str, str], operators: Sequence[Operator], data: Sequence[Data]
    ) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Return the operators and the data that the energy, or the formulas of ``where``, name, each in the order of
        the file. Operators are named also by their variances."""
        operator_names, columns = [item.name for item in operators], [item.name for item in data]
        known = [*_with_variances(operator_names), *columns]
        inner, of_where = self.names(known, ()), list[str]()
        taken = [*known, *inner.parameters, *self.left_out, *self.defined]
        result: set[str] = set()
        for name, text in [*where.items(), ("", energy)]:
            key = f"cell.where.{name}" if name else "cell.energy"
            if name:
                fault = f"the name {shown(name)} is taken [E0751]", NAME_RULE
                self.check_names([(key, name)], dict.fromkeys([*taken, *of_where], fault))
            formula = self.formula(key, text, self.names(known, of_where), _CELL, inner) if text else None
            result |= {symbol.name for symbol in symbols(formula)} if formula is not None else set()
            of_where.append(name)
        in_order = [tuple(name for name in every if name in result) for every in (operator_names, columns)]
        return in_order[0], in_order[1]

    def sampling(self, watched: Sequence[str]) -> Chains:
        """Return the defaults of ``sample`` by the file; report an unknown method or start, and a field that is not
        among ``watched``."""
        chosen, report = self.file.sampling, self.report
        try:
            composition_named(chosen.method)
        except UsageError as error:
            report.add_error("sampling.method", error)
        unknown = chosen.field and chosen.field not in watched
        if unknown and not (report.concerns("operators") or report.concerns("data")):
            hint = listed(watched) or "no field"
            report.add("sampling.field", f"there is no field {shown(chosen.field)} in the energy [E0757]", hint)
        if chosen.start.endswith(".npy"):
            return chosen.model_copy(update={"start": str(self.folder / chosen.start)})
        if chosen.start not in STARTS:
            hint = f"{listed(STARTS)} or the path of a .npy file of white fields"
            report.add("sampling.start", f"{shown(chosen.start)} is not a start [E0829]", hint)
        return chosen


def _with_variances(operators: Iterable[str]) -> list[str]:
    """Return the names of operators, and of their variances in formulas."""
    names = list(operators)
    return [*names, *(f"{name}{VARIANCE}" for name in names)]


def _text(formula: float | str) -> str:
    return formula if isinstance(formula, str) else repr(formula)
