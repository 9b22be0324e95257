"""Conversion of unit strings in scene data to SI, by the unit of each key or of a curve's columns, before any other
validation.

A quantity that cannot be converted is reported and becomes a ``FaultyText`` text, which later checks pass over.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from eomgen.base.data import dataclass, field
from eomgen.base.messages import key_of, shown
from eomgen.formula.units.conversion import coherent, is_coherent, misplaced_kind, to_si, to_unit, unit_fault
from eomgen.formula.units.parser import (
    Factors,
    QuantityWithUnit,
    UnitError,
    dimension_of,
    factors_of,
    is_quantity,
    read_quantity,
    read_unit,
)
from eomgen.formula.units.table import measure, names
from eomgen.scene.document.schema import document_for
from eomgen.scene.formula.namespaces import IncludedText
from eomgen.scene.joints.schema import Initial
from eomgen.scene.reading.key_metadata import ANY_UNIT, Column, Inner, KeyMetadata, Table, Units, fields_of
from eomgen.scene.reading.kinds import FaultyText
from eomgen.scene.reading.report import Report
from eomgen.scene.signals.tables import MOST_ROWS


@dataclass
class ColumnUnits:
    """The units that the columns of one curve have.

    Attributes
    ----------
    argument, value : labels, or units in SI; empty until a label or a quantity says the unit.
    converted : columns in which a unit was converted.
    """

    argument: str = ""
    value: str = ""
    converted: set[Column] = field(default_factory=set)

    def of(self, column: Column) -> str:
        """Return the SI unit of a column; empty if the unit is not known yet."""
        label = self.argument if column == "argument" else self.value
        factors = factors_of(label)
        return "" if factors is None else coherent(factors)

    def learn(self, column: Column, text: str) -> str:
        """Return the SI unit of a column; without a label, the unit in ``text``, a quantity in the column, becomes the
        column's unit. Empty for a quantity that cannot be read."""
        self.converted.add(column)
        if not self.of(column):
            try:
                unit = coherent(read_quantity(text).factors)
            except UnitError:  # reported by the conversion of the quantity
                return ""
            setattr(self, column, unit)
        return self.of(column)

    def fault_of_unit(self, column: Column, text: str) -> tuple[str, str] | None:
        """Return reason and remedy if the unit ``text`` of a table's column does not fit the column's label; None if
        the unit fits. The column's unit is set to SI of ``text`` if unknown."""

        try:
            factors = read_unit(text)
        except UnitError as error:
            return error.what, error.hint
        self.converted.add(column)
        if not self.of(column):
            setattr(self, column, coherent(factors))
        return unit_fault(text, factors, self.of(column))

    def fault_of_label(self, column: Column, label: object) -> tuple[str, str] | None:
        """Return reason and remedy if a column's label says another unit than the column's SI unit; None if the label
        is right or absent."""
        if not isinstance(label, str) or not label.strip():
            return None
        unit, word = self.of(column), "unit" if column == "value" else "argument_unit"
        if not unit or ((factors := factors_of(label)) is not None and _is_same(factors, unit)):
            return None
        fault = f"its {column}s are in {unit}, and the label {shown(label)} says otherwise [E1470]"
        hint = f'{word} = "{unit}", or no {word}'
        if dimension_of(label) == dimension_of(unit):
            hint += f'; numbers in {label.strip()} have their unit in the points, "3 {label.strip()}", or in a table'
        return fault, hint


def _is_same(factors: Factors, unit: str) -> bool:

    return measure(factors) == measure(read_unit(unit))


_NUMBER_AND_UNIT = re.compile(r"[-+0-9.eE \t]+([A-Za-z%].*)", re.DOTALL)
#: Labels of numbers without a unit.
_WITHOUT_UNIT = frozenset({"-", "1", "--", "none", "dimensionless"})
#: A number with a unit, times the time.
_WITH_TIME = re.compile(r"([^*]*[^* \t])[ \t]*\*[ \t]*t[ \t]*")


def in_si(data: Mapping[str, Any], report: Report) -> tuple[dict[str, Any], list[str], dict[str, str]]:
    """Return a scene's data with numbers in place of unit strings, notes on unit labels that do not convert, and the SI
    unit of each formula's value by dotted key.

    Parameters
    ----------
    data : mapping
        As ``tomllib`` reads a scene file; malformed parts are not changed.
    report : Report
        Takes quantities that cannot be converted, which become ``FaultyText``.
    """
    converter = _Converter(data, report)
    return converter.table(document_for(data), "", data, None), converter.notes, converter.units


def start_in_si(data: Mapping[str, Any], joint: str, key: str, start: Mapping[str, Any], report: Report) -> Any:
    """Return ``start``, the initial state of the joint ``joint`` in a scene's data, with numbers in SI in place of unit
    strings; faults are reported at the dotted ``key``."""
    return _Converter(data, report).entry(Initial, key, start, data["joints"][joint].get("type"), None)


class _Converter:
    def __init__(self, data: Mapping[str, Any], report: Report) -> None:
        self.report = report
        self.notes: list[str] = []
        self.units: dict[str, str] = {}
        self.entry_key = ""  # of the entry of a section that is converted
        self.follows: tuple[str, ...] = ()  # keys below which a fault explains that a key has no unit
        sections = {name: section for name, section in data.items() if isinstance(section, Mapping)}
        self.joints = sections.get("joints", {})
        bare = [row.key for row in document_for(data).rows if row.bare]
        entries = {str(name): entry for section in bare for name, entry in sections.get(section, {}).items()}
        self.known = set(entries)
        self.parameters = frozenset(sections.get("parameters", {}))
        self.labels = {name: label for name, entry in entries.items() if (label := _label(entry))}

    def table(
        self, model: type[Table], key: str, data: Mapping[str, Any], kind: object, columns: ColumnUnits | None = None
    ) -> dict[str, Any]:
        """Return a table of the class ``model`` at the dotted ``key`` with values in SI. ``kind`` and ``columns`` are
        the type and the curve's columns of the table around, for tables that have none. Units of formulas are noted in
        ``self.units``, and doubts in ``self.notes``."""
        labels = model.column_labels(data)
        table_columns = labels and ColumnUnits(*labels)
        columns = table_columns or columns
        kind = data.get("type", kind or self.kind_of_joint(data))
        kind = kind if isinstance(kind, str) else None
        result = dict(data)
        fields = fields_of(model)
        for name, (meaning, inner) in fields.items():
            if name not in data:
                continue
            value_key = f"{key}.{name}" if key else name
            if inner is not None:
                result[name] = self.inner(inner, value_key, data[name], kind, columns)
            elif meaning.column and columns is not None:
                result[name] = self.in_columns(meaning, columns, value_key, data[name])
            elif meaning.unit or meaning.names is not None:
                component = data.get("index", 0) if "index" in fields else None
                over_time = meaning.names is not None and "time" in meaning.names.kinds
                self.follows = self.reasons(meaning, kind, data)
                result[name] = self.value(_unit(meaning, kind, component), value_key, data[name], over_time=over_time)
                self.follows = ()
            if meaning.unit == ANY_UNIT and "unit" in fields:
                self.label(key, data, result, name)
                if isinstance(result[name], str) and isinstance(label := result.get("unit"), str):
                    self.units[value_key] = label
        if table_columns is not None:
            self.label_columns(model, key, table_columns, result)
        return result

    def in_columns(self, meaning: KeyMetadata, columns: ColumnUnits, key: str, value: Any) -> Any:
        """Return a value of a curve's columns with numbers in SI: a number, pairs of numbers, or the unit of a table's
        column, which is "" after a report. ``columns`` learns units from the value; ``meaning`` says the column of each
        number."""
        if isinstance(meaning.column, tuple):
            if not isinstance(value, list | tuple) or len(value) > MOST_ROWS:
                return value
            self.beside_units(columns, meaning.column, key, value)
            return [
                [
                    self.in_column(columns, column, f"{key}[{row}][{index}]", cell)
                    for index, (column, cell) in enumerate(zip(meaning.column, cells, strict=True))
                ]
                if isinstance(cells, list | tuple) and len(cells) == len(meaning.column)
                else cells
                for row, cells in enumerate(value)
            ]
        if meaning.unit:
            return self.in_column(columns, meaning.column, key, value)
        if not isinstance(value, str) or not value.strip():
            return value
        if fault := columns.fault_of_unit(meaning.column, value):
            self.report.add(key, *fault)
            return ""
        return value

    def in_column(self, columns: ColumnUnits, column: Column, key: str, value: Any) -> Any:
        if isinstance(value, str) and not isinstance(value, FaultyText | IncludedText) and is_quantity(value):
            columns.learn(column, value)
        return self.value(columns.of(column) or ANY_UNIT, key, value) if isinstance(value, str) else value

    def label_columns(self, model: type[Table], key: str, columns: ColumnUnits, result: dict[str, Any]) -> None:
        """Set the labels ``unit`` and ``argument_unit`` of the curve ``result``, in place, to the units in which the
        columns are now; report a contradictory label at the dotted ``key``."""
        if "unit" in model.model_fields and "value" in columns.converted:
            label = result.get("unit", "")
            if not model.labels_values:
                self.squared_values(key, label, columns)
            elif fault := columns.fault_of_label("value", label):
                self.report.add(f"{key}.unit", *fault)
            elif isinstance(label, str) and not label.strip():
                result["unit"] = columns.of("value")
        if "argument_unit" in model.model_fields and (unit := columns.of("argument")):
            if fault := columns.fault_of_label("argument", result.get("argument_unit")):
                self.report.add(f"{key}.argument_unit", *fault)
            result["argument_unit"] = unit

    def squared_values(self, key: str, label: object, columns: ColumnUnits) -> None:
        """Report the label of a quantity whose squares are the values of a curve, converted to SI, if the label is not
        the SI unit of the quantity."""
        factors = factors_of(label) if isinstance(label, str) else None
        if factors and not _is_same(factors, unit := coherent(factors)):
            fault = f"its values become {columns.of('value')}, of a quantity in {unit}, and the label {shown(label)}"
            self.report.add(f"{key}.unit", f"{fault} says otherwise [E1471]", f'unit = "{unit}", or no unit')

    def label(self, key: str, data: Mapping[str, Any], result: dict[str, Any], name: str) -> None:
        """Set the key ``unit`` of ``result``, in place, to the SI unit if the value ``name`` of the entry ``data`` was
        a text with a unit; otherwise the label stays. A contradictory label is reported, an unknown or unconverted one
        noted."""
        written, number = data.get(name), result.get(name)
        label = data.get("unit", "")
        if not isinstance(label, str):
            return
        factors = factors_of(label)
        if label.strip() and factors is None and label.strip() not in _WITHOUT_UNIT:
            note = f"{key}.unit: {shown(label)} is not a known unit, and is shown unchanged [W0125]"
            self.notes += [note] if note not in self.notes else []
        if isinstance(written, str) and isinstance(number, float):
            quantity = read_quantity(written)
            unit = to_si(quantity)[1]
            if not label.strip():
                result["unit"] = unit
            elif factors is None or not is_coherent(factors, quantity):
                fault = f"{shown(written)} is {number:.9g} {unit}, and the label {shown(label)} says otherwise [E1473]"
                self.report.add(f"{key}.unit", fault, f'unit = "{unit}", or no unit')
        elif isinstance(number, int | float) and factors and not all(names()[name].is_coherent for name, _ in factors):
            fault = f"its unit {label} is a label, so {number:g} is taken as it is [W0126]"
            self.notes.append(f'{key}: {fault}; "{number:g} {label}" would be converted to SI')

    def reasons(self, meaning: KeyMetadata, kind: object, data: Mapping[str, Any]) -> tuple[str, ...]:
        """Return the dotted keys below which a fault explains that a key has no unit for a kind."""
        if not isinstance(meaning.unit, Mapping) or kind in meaning.unit:
            return ()
        joint = data.get("joint")
        return (self.entry_key, key_of("joints", joint)) if isinstance(joint, str) else (self.entry_key,)

    def kind_of_joint(self, data: Mapping[str, Any]) -> object:
        joint = self.joints.get(data["joint"]) if isinstance(data.get("joint"), str) else None
        return joint.get("type") if isinstance(joint, Mapping) else None

    def inner(self, inner: Inner, key: str, value: Any, kind: object, columns: ColumnUnits | None) -> Any:
        shape, model = inner.shape, inner.model
        if shape == "list" and isinstance(value, list | tuple):
            return [self.entry(model, f"{key}[{index}]", entry, kind, columns) for index, entry in enumerate(value)]
        if shape == "entries" and isinstance(value, Mapping):
            result = {}
            for name, entry in value.items():
                item_key = f"{key}.{key_of(str(name))}"
                if "." not in key:
                    self.entry_key = item_key
                result[name] = self.entry(model, item_key, entry, kind, columns)
            return result
        return self.entry(model, key, value, kind, columns)

    def entry(self, model: type[Table], key: str, entry: Any, kind: object, columns: ColumnUnits | None) -> Any:
        if isinstance(entry, str) and is_quantity(entry) and "value" in model.model_fields:
            entry = {"value": entry}  # the short form of a parameter
        if not isinstance(entry, Mapping):
            return entry
        return self.table(model, key, entry, kind, columns)

    def value(self, unit: Units, key: str, value: Any, depth: int = 0, *, over_time: bool = False) -> Any:
        """Return a value with numbers in SI in place of unit strings, also in lists, matrices and tables up to a depth
        of 4; formulas stay, and their unit is noted by key. ``unit`` is the SI unit of the numbers, or of each
        component. ``over_time``: formulas of time could stand instead."""
        if isinstance(value, str) and isinstance(unit, str) and unit not in ("", ANY_UNIT):
            self.units[key] = unit
        if isinstance(value, FaultyText | IncludedText):  # read with the included file
            return value
        if isinstance(value, str):
            if is_quantity(value):
                return self.text(unit, key, value, over_time=over_time)
            return self.name_alone(unit, key, value.strip().removeprefix("-").strip()) or value
        if isinstance(value, list | tuple) and depth < 4:  # a matrix has two levels
            units = (unit,) * len(value) if isinstance(unit, str) else (*unit, *[""] * len(value))
            self.beside_unit(unit, key, value)
            return [
                self.value(units[index], f"{key}[{index}]", entry, depth + 1, over_time=over_time)
                for index, entry in enumerate(value)
            ]
        if isinstance(value, Mapping) and depth < 4:
            return {
                name: self.value(unit, f"{key}.{key_of(str(name))}", entry, depth + 1, over_time=over_time)
                for name, entry in value.items()
            }
        return value

    def name_alone(self, unit: Units, key: str, name: str) -> FaultyText | None:
        """Return a text in place of a parameter that stands alone as the value of ``key`` and whose unit has another
        dimension than ``unit``, after a report; None if the name fits or is not such a parameter. For inputs, and
        labels that fit by dimension only, a note is added."""
        factors = factors_of(self.labels.get(name, ""))
        if not factors or not isinstance(unit, str) or unit in ("", ANY_UNIT) or factors == factors_of(unit):
            return None
        from fractions import Fraction  # noqa: PLC0415  # scenes whose labels fit do not need it

        if name in self.parameters and (fault := misplaced_kind(self.labels[name], unit)):
            self.report.add(key, f"the parameter {name} is {fault} [E1474]", f"a parameter in {unit}")
            return FaultyText(name)
        try:
            to_unit(QuantityWithUnit(name, Fraction(1), factors), unit)
        except UnitError as error:
            self.notes.append(f"{key}: {error.what}, and a label does not convert values [W0127]")
        return None

    def beside_unit(self, unit: Units, key: str, values: Sequence[Any]) -> None:
        """Add a note for each number without a unit in a list at the dotted ``key`` of which other entries have one."""
        if not isinstance(unit, str) or unit == ANY_UNIT or not any(map(_has_unit, values)):
            return
        for index, value in enumerate(values):
            if number := _plain(value):
                note = f"{number:g} has no unit, unlike neighbouring entries, so it is {number:g} {unit} [W0128]"
                self.notes.append(f"{key}[{index}]: {note}")

    def beside_units(self, columns: ColumnUnits, names: tuple[Column, Column], key: str, rows: Sequence[Any]) -> None:
        """Add a note on numbers without a unit in the columns ``names`` of a curve's points, ``rows``, if other rows
        have units: these numbers are read in the SI unit of the first such row."""
        cells = [row for row in rows if isinstance(row, list | tuple) and len(row) == len(names)]
        for index, name in enumerate(names):
            first = next((row[index] for row in cells if _has_unit(row[index])), None)
            if first is None:
                continue
            unit = columns.learn(name, first)
            bare = [number for row in cells if (number := _plain(row[index]))]
            if bare and unit:
                more = f" ({len(bare)} such {name}s)" if len(bare) > 1 else ""
                note = f"{bare[0]:g} has no unit, as others have, so it is {bare[0]:g} {unit}{more} [W0129]"
                self.notes.append(f"{key}: the {name} {note}")

    def text(self, unit: Units, key: str, text: str, *, over_time: bool) -> float | FaultyText:
        """Return the number in SI of a text such as "250 mm"; ``FaultyText``, after a report at ``key``, if the unit
        does not fit ``unit`` or cannot be read. ``unit`` is the SI unit needed, empty for none; a tuple of units
        refuses a single text."""

        try:
            if over_time and (product := _WITH_TIME.fullmatch(text)):
                number = to_si(read_quantity(product[1], self.known))[0]
                fault = f"{shown(text)} is a formula, and formulas take numbers in SI, without units [E0322]"
                raise UnitError(fault, f'"{number:.6g} * t"')
            quantity = read_quantity(text, self.known)
            if not isinstance(unit, str):
                message = f"{shown(text)} is one value, and {len(unit)} are needed here [E0323]"
                raise UnitError(message, f"units {', '.join(unit)}")
            if unit:
                if unit != ANY_UNIT:
                    return to_unit(quantity, unit, over_time=over_time)
                number, self.units[key] = to_si(quantity)
                return number
            number, unit_in_si = to_si(quantity)
            fault = f"{shown(text)} has a unit, and a number without one is needed here [E0321]"
            hint = repr(number).removesuffix(".0")
            if measure(quantity.factors)[0] != 1:
                hint = f"{hint}, which it is in {unit_in_si}"
        except UnitError as error:
            fault, hint = error.what, error.hint
        self.report.add(key, fault, hint, self.follows)
        return FaultyText(text)


def _unit(meaning: KeyMetadata, kind: object, index: object) -> Units:
    """Return the unit of a key in an entry of a kind; the unit of one component if the units differ by component."""
    unit = meaning.unit
    if isinstance(unit, Mapping):
        unit = unit.get(kind, "") if isinstance(kind, str) else ""
    if isinstance(unit, tuple) and isinstance(index, int) and 0 <= index < len(unit):
        return unit[index]
    return unit


def _label(entry: object) -> str:
    """Return the unit of an entry as written, of the key ``unit`` or a value such as "5 N/m"; empty without a unit."""
    value, unit = (entry.get("value"), entry.get("unit", "")) if isinstance(entry, Mapping) else (entry, "")
    if isinstance(value, str) and is_quantity(value):
        number_and_unit = _NUMBER_AND_UNIT.fullmatch(value)
        return number_and_unit[1] if number_and_unit else ""
    return unit if isinstance(unit, str) else ""


def _has_unit(value: object) -> bool:
    return isinstance(value, str) and is_quantity(value)


def _plain(value: object) -> float:
    """Return a number without a unit, also as a text; 0 for anything else."""
    try:
        return float(value) if isinstance(value, str | int | float) and not isinstance(value, bool) else 0.0
    except (ValueError, OverflowError):
        return 0.0
