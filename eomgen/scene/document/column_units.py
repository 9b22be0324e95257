"""Units of a curve's two columns, argument and value, shared by its table, points and waves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from eomgen.base.text import shown
from eomgen.formula.units.parser import Factors, UnitError, read_quantity, read_unit
from eomgen.scene.reading.key_metadata import Column, Table


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
        try:
            return _in_si(read_unit(label)) if label.strip() else ""
        except UnitError:
            return ""

    def learn(self, column: Column, text: str) -> str:
        """Return the unit of a column; without a label, the column's first quantity determines the unit."""
        self.converted.add(column)
        if not self.of(column):
            try:
                unit = _in_si(read_quantity(text).factors)
            except UnitError:  # reported by the conversion of the quantity
                return ""
            setattr(self, column, unit)
        return self.of(column)

    def fault_of_unit(self, column: Column, text: str) -> tuple[str, str] | None:
        """Return reason and remedy if the unit of a table's column is incompatible; None if the unit fits."""
        from eomgen.formula.units.conversion import unit_fault  # noqa: PLC0415  # pint comes with it

        try:
            factors = read_unit(text)
        except UnitError as error:
            return error.what, error.hint
        self.converted.add(column)
        if not self.of(column):
            setattr(self, column, _in_si(factors))
        return unit_fault(text, factors, self.of(column))

    def fault_of_label(self, column: Column, label: object) -> tuple[str, str] | None:
        """Return reason and remedy if a column's label is wrong; None if the label is right."""
        if not isinstance(label, str) or not label.strip():
            return None
        unit, word = self.of(column), "unit" if column == "value" else "argument_unit"
        try:
            if not unit or _is_same(read_unit(label), unit):
                return None
        except UnitError:
            pass
        fault = f"its {column}s are in {unit}, and the label {shown(label)} says otherwise"
        return fault, f'{word} = "{unit}", or no {word}'


def columns_of(model: type[Table], data: Mapping[str, Any]) -> ColumnUnits | None:
    """Return the units of an entry's columns known from its kind and its label; None if the entry is no curve."""
    labels = model.column_labels(data)
    return labels and ColumnUnits(*labels)


def _in_si(factors: Factors) -> str:
    from eomgen.formula.units.conversion import coherent  # noqa: PLC0415  # pint comes with it

    return coherent(factors)


def _is_same(factors: Factors, unit: str) -> bool:
    from eomgen.formula.units.conversion import measure  # noqa: PLC0415

    return measure(factors) == measure(read_unit(unit))
