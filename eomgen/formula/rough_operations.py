"""Operations of formulas that may have a value and no derivative: roots, logarithms and powers at zero, angles."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from eomgen.formula.evaluate import symbols
from eomgen.formula.infix import infix
from eomgen.formula.nodes import Application, Formula, Number, Operation, Symbol

#: Functions that have a value but no derivative at some arguments.
_ROUGH = frozenset({"sqrt", "log", "asin", "acos", "atan2"})
#: Symbols that are constant along a motion, so that no derivative by them is taken.
_GIVEN = frozenset({"parameter", "number", "place"})
#: Formulas that are named.
_NAMED = 2


def rough_operations(formulas: Iterable[Formula]) -> str:
    """Return the first operations that may have no derivative and the number of the others; empty for none."""
    result = list(dict.fromkeys(text for formula in formulas for text in _rough(formula)))
    more = f" and {len(result) - _NAMED} more" if len(result) > _NAMED else ""
    return f"{', '.join(result[:_NAMED])}{more}"


def _rough(formula: Formula) -> Iterator[str]:
    """Yield the operations of a formula that may have a value and no derivative."""
    if isinstance(formula, Application):
        yield from _rough(formula.argument)
    elif isinstance(formula, Operation):
        moving = any(symbol.kind not in _GIVEN for symbol in symbols(formula.arguments[0]))
        if moving and (formula.name in _ROUGH or (formula.name == "pow" and _broken(formula.arguments[1]))):
            yield infix(formula, _size)
        for argument in formula.arguments:
            yield from _rough(argument)


def _size(symbol: Symbol) -> int:
    """Return the number of components of a symbol as far as its kind decides it: 3 of points."""
    return 3 if symbol.kind in ("position", "velocity", "acceleration") else 1


def _broken(exponent: Formula) -> bool:
    """Return whether a power with this exponent may have no derivative at zero."""
    return not isinstance(exponent, Number) or exponent.value < 1.0
