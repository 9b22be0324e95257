"""Operations of formulas that have no value at a state: quotients by zero, roots and logarithms of negative numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

from eomgen.formula.evaluate import apply, evaluate
from eomgen.formula.nodes import Application, Formula, Operation, Symbol
from eomgen.system.description import Description

Values = Mapping[tuple[str, str, int], float]
#: Remedy for operations without a value.
OTHER_FORMULA = "another start, or a formula that has a value there, such as max(x, 1e-3) in place of x"
_SAID = {"sqrt": "sqrt({0})", "log": "log({0})", "asin": "asin({0})", "acos": "acos({0})", "pow": "({0}) ** ({1})"}
#: Arguments beyond this size come from a motion that has grown without end.
_GROWN = 1e12


def operations_without_value(description: Description, values: Values) -> str:
    """Return a description of the operations of formulas that have no value; empty if none is known.

    Parameters
    ----------
    values : numbers by kind, name and index of a symbol; operations that need others are left out
    """

    def value_of(symbol: Symbol) -> float:
        try:
            return values[symbol.kind, symbol.name, symbol.index]
        except KeyError:
            raise ArithmeticError(f"{symbol.kind} {symbol.name}") from None

    result: dict[str, None] = {}
    formulas = (item.formula for item in description.inputs if item.formula is not None)
    for formula in (*formulas, *description.formulas):
        result |= dict.fromkeys(_without_value(formula, value_of))
    return " and ".join(list(result)[:3])


def _without_value(formula: Formula, value_of: Callable[[Symbol], float]) -> Iterator[str]:
    if isinstance(formula, Application):
        yield from _without_value(formula.argument, value_of)
    if not isinstance(formula, Operation):
        return
    parts = formula.arguments
    try:
        if formula.name == "select":
            condition, then, otherwise = parts
            parts = (condition, then if evaluate(condition, value_of) != 0.0 else otherwise)
        elif formula.name == "div" or formula.name in _SAID:
            numbers = [evaluate(part, value_of) for part in parts]
            if max(map(abs, numbers)) < _GROWN:
                try:
                    apply(formula.name, numbers)
                except ArithmeticError:
                    texts = [f"{number:.6g}" for number in numbers]
                    said = f"{texts[0]} / {texts[1]}" if formula.name == "div" else _SAID[formula.name].format(*texts)
                    of = parts[-1:] if formula.name == "div" else parts
                    named = (symbol for part in of for symbol in _symbols(part))
                    names = dict.fromkeys(_named(symbol, value_of) for symbol in named)
                    yield f"{said} has no value{' at ' if names else ''}{', '.join(list(names)[:3])}"
    except ArithmeticError:  # of something that is not known here
        pass
    for part in parts:
        yield from _without_value(part, value_of)


def _symbols(formula: Formula) -> Iterator[Symbol]:
    if isinstance(formula, Symbol):
        yield formula
    elif isinstance(formula, Operation):
        for part in formula.arguments:
            yield from _symbols(part)


def _named(symbol: Symbol, value_of: Callable[[Symbol], float]) -> str:
    name = {"time": "t", "q": f"q.{symbol.name}", "v": f"v.{symbol.name}"}.get(symbol.kind, symbol.name)
    return f"{name} = {value_of(symbol):.6g}"
