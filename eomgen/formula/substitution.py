"""Formulas with numbers in place of some symbols; sums and products with all operands known as numbers; sums of numbers
times powers; and the common form of formulas that differ in numbers alone.

As numbers times powers the mean of ``EI * (1 - 0.5 * s)`` over several places is one number times ``EI``, and the mean
of the reciprocal is one number by ``EI``.
"""

from __future__ import annotations

import functools
import math
import operator
from collections.abc import Callable, Iterable, Mapping, Sequence
from fractions import Fraction

from eomgen.base.data import replace
from eomgen.formula.curves import Curve
from eomgen.formula.evaluate import apply, quantity_at
from eomgen.formula.nodes import ONE, ZERO, Application, EntryQuantity, Formula, Number, Operation, Symbol, infix


def substitute(formula: Formula, value_of: Callable[[Symbol], float | None]) -> Formula:
    """Return a formula in which symbols with known values are numbers.

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
        return _curve_at(formula, substitute(formula.argument, value_of))
    if not isinstance(formula, Operation):
        return formula
    if formula.name == "select":
        condition = substitute(formula.arguments[0], value_of)
        if isinstance(condition, Number):  # the branch that is not taken may have no value
            return substitute(formula.arguments[1 if condition.value != 0.0 else 2], value_of)
    arguments = tuple(substitute(argument, value_of) for argument in formula.arguments)
    numbers = [argument.value for argument in arguments if isinstance(argument, Number)]
    if len(numbers) == len(arguments):
        if isinstance(formula, EntryQuantity):
            return Number(quantity_at(formula, numbers))
        return Number(apply(formula.name, numbers))
    return replace(formula, arguments=arguments)


def map_symbols(
    formula: Formula,
    symbol_for: Callable[[Symbol], Formula],
    number_for: Callable[[Number], Formula] | None = None,
    *,
    added: bool = True,
) -> Formula:
    """Return a formula with ``symbol_for`` of each symbol in place of the symbol, and ``number_for`` of each number;
    curves are referred to as objects, not by name. ``added``: whether symbols are replaced in arguments that the words
    of the register added, too."""
    if isinstance(formula, Symbol):
        return symbol_for(formula)
    if isinstance(formula, Number):
        return formula if number_for is None else number_for(formula)
    if isinstance(formula, Application):
        return replace(formula, argument=map_symbols(formula.argument, symbol_for, number_for, added=added))
    arguments = formula.arguments
    unchanged_count = len(formula.word.added(formula.item)) if isinstance(formula, EntryQuantity) and not added else 0
    changed = arguments[: len(arguments) - unchanged_count]
    new_arguments = (map_symbols(argument, symbol_for, number_for, added=added) for argument in changed)
    return replace(formula, arguments=(*new_arguments, *arguments[len(changed) :]))


def _curve_at(formula: Application, argument: Formula) -> Formula:
    curve = formula.curve
    if not isinstance(argument, Number):
        return replace(formula, argument=argument)
    if not isinstance(curve, Curve):
        raise ArithmeticError(f"{curve.name} is a road, whose height is of a motion along it")
    value = float(curve(argument.value, formula.derivative))
    if not math.isfinite(value):
        raise ArithmeticError(f"the curve {curve.name} has no value at {argument.value:.6g} [E0302]")
    return Number(value)


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


def fold(formula: Formula) -> Formula:
    """Return a formula of numbers as a number; NaN if the formula has no value."""
    try:
        return substitute(formula, lambda _: None)
    except ArithmeticError:
        return Number(math.nan)


def pattern(formulas: tuple[Formula, ...]) -> tuple[tuple[Formula, ...], tuple[float, ...]]:
    """Return formulas with ``Symbol("number", index=k)`` in place of the k-th number of the formulas, and these
    numbers."""
    numbers: list[float] = []

    def symbol_of(number: Number) -> Symbol:
        numbers.append(number.value)
        return Symbol("number", index=len(numbers) - 1)

    return tuple(map_symbols(formula, lambda symbol: symbol, symbol_of) for formula in formulas), tuple(numbers)


#: Powers of formulas, each an exponent.
_Powers = frozenset[tuple[Formula, int]]
#: Numbers by the powers that they multiply, without zeros.
Combination = Mapping[_Powers, float]
_NONE: _Powers = frozenset()


def combination(formula: Formula) -> Combination:
    """Return a formula as a sum of numbers times powers of formulas: the number by each set of pairs (formula,
    exponent). A product of two sums is not multiplied out."""
    if isinstance(formula, Number):
        return {_NONE: formula.value} if formula.value != 0.0 else {}
    if isinstance(formula, Operation) and formula.name in ("add", "sub", "neg", "mul", "div"):
        first, *rest = (combination(argument) for argument in formula.arguments)
        match formula.name:
            case "add":
                return _sum([(1.0, first), (1.0, rest[0])])
            case "sub":
                return _sum([(1.0, first), (-1.0, rest[0])])
            case "neg":
                return _sum([(-1.0, first)])
            case "mul" if len(first) <= 1 or len(rest[0]) <= 1:
                return _product(first, rest[0])
            case "mul":
                return _product(_single(formula.arguments[0], first), _single(formula.arguments[1], rest[0]))
            case "div" if rest[0]:
                return _product(first, _inverse(_single(formula.arguments[1], rest[0])))
    return {frozenset([(formula, 1)]): 1.0}


def _single(formula: Formula, terms: Combination) -> Combination:
    return terms if len(terms) <= 1 else {frozenset([(formula, 1)]): 1.0}


def _inverse(term: Combination) -> Combination:
    return {frozenset((base, -power) for base, power in powers): 1.0 / number for powers, number in term.items()}


def _product(first: Combination, second: Combination) -> Combination:
    result: dict[_Powers, float] = {}
    for left, a in first.items():
        for right, b in second.items():
            powers = dict(left)
            for base, power in right:
                powers[base] = powers.get(base, 0) + power
            result[frozenset((base, power) for base, power in powers.items() if power)] = a * b
    return result


def _sum(parts: Iterable[tuple[float, Combination]]) -> Combination:
    result: dict[_Powers, float] = {}
    for weight, terms in parts:
        for powers, number in terms.items():
            result[powers] = result.get(powers, 0.0) + weight * number
    return {powers: number for powers, number in result.items() if number != 0.0}


def collect(formula: Formula) -> Formula:
    """Return a formula with equal products of powers collected, a number if all of it is numbers."""
    return _formula(combination(formula))


def weighted_sum(weights: Sequence[float], formulas: Sequence[Formula]) -> Formula:
    """Return a sum of formulas by weights, with equal products of powers collected."""
    return _formula(_sum(zip(weights, map(combination, formulas), strict=True)))


def mean(weights: Sequence[float], formulas: Sequence[Formula]) -> Formula:
    """Return the mean of formulas by weights whose sum is 1: of equal formulas the formula."""
    return formulas[0] if all(formula == formulas[0] for formula in formulas) else weighted_sum(weights, formulas)


def _formula(terms: Combination) -> Formula:
    return functools.reduce(total, [_term(powers, number) for powers, number in terms.items()]) if terms else ZERO


def _term(powers: _Powers, number: float) -> Formula:
    ordered = sorted(powers, key=lambda item: infix(item[0]))  # sets have no order of their own
    over = product(*(base for base, power in ordered for _ in range(power)), Number(number))
    under = product(*(base for base, power in ordered for _ in range(-power)))
    return over if under == ONE else over / under
