"""The user's formulas, recorded on the tape."""

from __future__ import annotations

from collections.abc import Callable

from eomgen.scene.formula_nodes import Formula, Number, Symbol
from eomgen.symbolic.scalar import Algebra, Scalar
from eomgen.symbolic.tape import Op

Resolver = Callable[[Symbol], Scalar]

_CALLS = {
    "sin": Op.SIN, "cos": Op.COS, "tan": Op.TAN, "asin": Op.ASIN, "acos": Op.ACOS, "atan": Op.ATAN, "atan2": Op.ATAN2,
    "sinh": Op.SINH, "cosh": Op.COSH, "tanh": Op.TANH, "exp": Op.EXP, "log": Op.LOG, "sqrt": Op.SQRT, "abs": Op.ABS,
    "sign": Op.SIGN, "min": Op.MIN, "max": Op.MAX, "lt": Op.LT, "le": Op.LE, "pow": Op.POW,
}  # fmt: skip


def record(algebra: Algebra, formula: Formula, resolve: Resolver) -> Scalar:
    """Record a formula; ``resolve`` gives the scalar of each symbol. Depth is bounded by the reader of formulas."""
    if isinstance(formula, Number):
        return algebra.scalar(formula.value)
    if isinstance(formula, Symbol):
        return resolve(formula)
    arguments = [record(algebra, argument, resolve) for argument in formula.arguments]
    match formula.name:
        case "add":
            return arguments[0] + arguments[1]
        case "sub":
            return arguments[0] - arguments[1]
        case "mul":
            return arguments[0] * arguments[1]
        case "div":
            return arguments[0] / arguments[1]
        case "neg":
            return -arguments[0]
        case "select":
            return algebra.select(arguments[0], arguments[1], arguments[2])
        case _:
            return algebra.call(_CALLS[formula.name], *arguments)


def symbols(formula: Formula) -> set[Symbol]:
    """Return the symbols of a formula."""
    if isinstance(formula, Number):
        return set()
    if isinstance(formula, Symbol):
        return {formula}
    found: set[Symbol] = set()
    for argument in formula.arguments:
        found |= symbols(argument)
    return found
