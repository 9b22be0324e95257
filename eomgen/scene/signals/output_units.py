"""Units of outputs: the units of their values, and labels that contradict them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from eomgen.formula.nodes import Formula, Symbol
from eomgen.formula.units.parser import Factors, UnitError, read_unit
from eomgen.formula.units.table import names
from eomgen.scene.reading.symbol_units import unit_of_symbol


def units_of_symbols(formulas: Sequence[Formula], joints: Mapping[str, str]) -> str:
    """Return the unit of formulas that are each one coordinate, its rate, or a component of a point's motion, all in
    the same unit; empty for others.

    ``joints``: types by name.
    """
    result = {unit_of_symbol(formula, joints) if isinstance(formula, Symbol) else "" for formula in formulas}
    return result.pop() if len(result) == 1 else ""


def doubtful_label(label: str, unit: str) -> str:
    """Return a note on the label of an output whose values are in another unit; empty for the same unit, and for a
    label that is no unit."""
    factors = _factors(label)
    if not unit or not factors or factors == _factors(unit):
        return ""
    note = f"its unit {label} is a label, and its values are in {unit}"
    if not all(names()[name].is_coherent for name, _ in factors):
        return f"{note}: labels convert nothing, a formula does"
    from eomgen.formula.units.conversion import misplaced  # noqa: PLC0415  # pint comes with it

    return note if misplaced(label, unit) else ""


def _factors(label: str) -> Factors:
    try:
        return read_unit(label) if label.strip() else ()
    except UnitError:
        return ()
