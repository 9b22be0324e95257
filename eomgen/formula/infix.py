"""Formulas as text in the way that a user writes them."""

from __future__ import annotations

from collections.abc import Callable

from eomgen.formula.nodes import Application, Formula, Number, Operation, Quantity, Symbol

#: Operator, precedence of the whole, least precedence of the left and of the right operand without brackets.
_BINARY = {
    "lt": ("<", 1, 2, 2), "le": ("<=", 1, 2, 2),
    "add": ("+", 2, 2, 2), "sub": ("-", 2, 2, 3),
    "mul": ("*", 3, 3, 3), "div": ("/", 3, 3, 4),
    "pow": ("**", 5, 6, 5),
}  # fmt: skip  # a table
_NEGATION, _CHOICE, _ATOM = 4, 0, 9
#: Kinds of symbols that a formula names without a prefix.
_PLAIN = ("parameter", "input", "state", "controller")


def infix(formula: Formula, sizes: Callable[[Symbol], int] = lambda symbol: 1) -> str:
    """Return a formula as text; ``sizes`` tells how many components a symbol has, so that one alone has no index."""
    return _text(formula, sizes)[0]


def _text(formula: Formula, sizes: Callable[[Symbol], int]) -> tuple[str, int]:
    """Return the text and the precedence of its outermost operation."""
    if isinstance(formula, Number):
        return f"{formula.value:.9g}", _ATOM if formula.value >= 0.0 else _NEGATION
    if isinstance(formula, Symbol):
        return _name(formula, sizes), _ATOM
    if isinstance(formula, Application):
        prefix = "derivative." * formula.derivative
        return f"{prefix}{formula.curve.name}({_text(formula.argument, sizes)[0]})", _ATOM
    return _operation(formula, sizes)


def _name(symbol: Symbol, sizes: Callable[[Symbol], int]) -> str:
    if symbol.kind == "time":
        return "t"
    if symbol.kind == "local":  # of the place at which a load acts, with three components
        return f"{symbol.name}.here[{symbol.index}]"
    name = symbol.name if symbol.kind in _PLAIN else f"{symbol.kind}.{symbol.name}"
    if symbol.kind == "local":
        return f"{symbol.name}.here[{symbol.index}]"
    return f"{name}[{symbol.index}]" if sizes(symbol) > 1 or symbol.index else name


def _operation(formula: Operation, sizes: Callable[[Symbol], int]) -> tuple[str, int]:
    parts = [_text(argument, sizes) for argument in formula.arguments]
    if isinstance(formula, Quantity):
        index = f"[{formula.component}]" if formula.word.components > 1 else ""
        given = ", ".join(text for text, _ in parts[: len(formula.word.arguments)])
        return f"{formula.name}.{formula.item.name}({given}){index}", _ATOM

    def at_least(part: tuple[str, int], precedence: int) -> str:
        return part[0] if part[1] >= precedence else f"({part[0]})"

    if formula.name in _BINARY:
        sign, own, left, right = _BINARY[formula.name]
        return f"{at_least(parts[0], left)} {sign} {at_least(parts[1], right)}", own
    if formula.name == "neg":
        return f"-{at_least(parts[0], _NEGATION)}", _NEGATION
    if formula.name == "select":
        condition, then, otherwise = (at_least(part, _CHOICE + 1) for part in parts)
        return f"{then} if {condition} else {otherwise}", _CHOICE
    return f"{formula.name}({', '.join(text for text, _ in parts)})", _ATOM
