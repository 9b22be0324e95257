"""Products and sums of formulas that are numbers if all operands are numbers."""

from __future__ import annotations

import functools
import math
import operator
from fractions import Fraction

from eomgen.formula.nodes import Formula, Number
from eomgen.formula.substitution import substituted


def times(factor: Fraction, formula: Formula) -> Formula:
    """Return a formula times a number, rounded once."""
    if isinstance(formula, Number):
        return Number(float(factor * Fraction(formula.value))) if math.isfinite(formula.value) else formula
    return formula if factor == 1 else float(factor) * formula


def product(*formulas: Formula) -> Formula:
    """Return a product in which the numbers are one factor."""
    numbers = math.prod(formula.value for formula in formulas if isinstance(formula, Number))
    rest = [formula for formula in formulas if not isinstance(formula, Number)]
    if not rest or numbers == 0.0 or not math.isfinite(numbers):
        return Number(numbers)
    return times(Fraction(numbers), functools.reduce(operator.mul, rest))


def total(first: Formula, second: Formula) -> Formula:
    """Return a sum, which is a number if both summands are numbers."""
    if isinstance(first, Number) and isinstance(second, Number):
        return Number(first.value + second.value)
    return first + second


def folded(formula: Formula) -> Formula:
    """Return a formula of numbers as a number; NaN if it has no value."""
    try:
        return substituted(formula, lambda _: None)
    except ArithmeticError:
        return Number(math.nan)
