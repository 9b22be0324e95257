"""Formulas with numbers in place of some symbols: subformulas without symbols become numbers."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from eomgen.formula.curves import Curve
from eomgen.formula.evaluate import apply, quantity_at
from eomgen.formula.nodes import Application, Formula, Number, Operation, Quantity, Symbol


def substituted(formula: Formula, value_of: Callable[[Symbol], float | None]) -> Formula:
    """Return a formula with the numbers that are known of its symbols.

    Parameters
    ----------
    value_of : callable
        Gives the number for a symbol, None for one that stays.

    Raises
    ------
    ArithmeticError
        If an operation on numbers, or a curve, has no finite value.
    """
    if isinstance(formula, Symbol):
        known = value_of(formula)
        return formula if known is None else Number(known)
    if isinstance(formula, Application):
        return _curve_at(formula, substituted(formula.argument, value_of))
    if not isinstance(formula, Operation):
        return formula
    if formula.name == "select":
        condition = substituted(formula.arguments[0], value_of)
        if isinstance(condition, Number):  # the other branch may have no value
            return substituted(formula.arguments[1 if condition.value != 0.0 else 2], value_of)
    arguments = tuple(substituted(argument, value_of) for argument in formula.arguments)
    numbers = [argument.value for argument in arguments if isinstance(argument, Number)]
    if len(numbers) == len(arguments):
        if isinstance(formula, Quantity):
            return Number(quantity_at(formula, numbers))
        return Number(apply(formula.name, numbers))
    return replace(formula, arguments=arguments)


def renamed(formula: Formula, symbol_for: Callable[[Symbol], Symbol]) -> Formula:
    """Return a formula with other symbols in place of its own."""
    if isinstance(formula, Symbol):
        return symbol_for(formula)
    if isinstance(formula, Application):
        return replace(formula, argument=renamed(formula.argument, symbol_for))
    if isinstance(formula, Operation):
        return replace(formula, arguments=tuple(renamed(argument, symbol_for) for argument in formula.arguments))
    return formula


def _curve_at(formula: Application, argument: Formula) -> Formula:
    curve = formula.curve
    if not isinstance(argument, Number):
        return replace(formula, argument=argument)
    if not isinstance(curve, Curve):
        raise ArithmeticError(f"{curve.name} is a road, whose height is of a motion along it")
    value = float(curve(argument.value, formula.derivative))
    if not math.isfinite(value):
        raise ArithmeticError(f"the curve {curve.name} has no value at {argument.value:.6g}")
    return Number(value)
