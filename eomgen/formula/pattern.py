"""Formulas that differ in numbers alone: their common form, with a list of numbers for each."""

from __future__ import annotations

from dataclasses import replace

from eomgen.formula.nodes import Application, Formula, Number, Operation, Symbol


def pattern(formulas: tuple[Formula, ...]) -> tuple[tuple[Formula, ...], tuple[float, ...]]:
    """Return formulas with ``Symbol("number", index=k)`` in place of their k-th number, and these numbers."""
    numbers: list[float] = []

    def without(formula: Formula) -> Formula:
        if isinstance(formula, Number):
            numbers.append(formula.value)
            return Symbol("number", index=len(numbers) - 1)
        if isinstance(formula, Operation):
            return replace(formula, arguments=tuple(without(argument) for argument in formula.arguments))
        if isinstance(formula, Application):
            return replace(formula, argument=without(formula.argument))
        return formula

    return tuple(without(formula) for formula in formulas), tuple(numbers)
