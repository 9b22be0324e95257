"""The user's formulas, recorded on the tape."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from eomgen.errors import ModelError, Problem
from eomgen.mechanics.expressions.curves import curve_at
from eomgen.scene.formula.nodes import Application, Formula, Number, Symbol
from eomgen.symbolic.operations import Op
from eomgen.symbolic.scalar import Algebra, Scalar

Resolver = Callable[[Symbol], Scalar]

_CALLS = {
    "sin": Op.SIN, "cos": Op.COS, "tan": Op.TAN, "asin": Op.ASIN, "acos": Op.ACOS, "atan": Op.ATAN, "atan2": Op.ATAN2,
    "sinh": Op.SINH, "cosh": Op.COSH, "tanh": Op.TANH, "exp": Op.EXP, "log": Op.LOG, "sqrt": Op.SQRT, "abs": Op.ABS,
    "sign": Op.SIGN, "min": Op.MIN, "max": Op.MAX, "lt": Op.LT, "le": Op.LE, "pow": Op.POW,
}  # fmt: skip


def record(algebra: Algebra, formula: Formula, resolve: Resolver) -> Scalar:
    """Record a formula; ``resolve`` gives the scalar of each symbol. Depth is bounded by the reader of formulas.

    Raises
    ------
    ModelError
        An operation has no finite value whatever the state, as a division by a fixed parameter that is 0.
    """
    if isinstance(formula, Number):
        return algebra.scalar(formula.value)
    if isinstance(formula, Symbol):
        return resolve(formula)
    if isinstance(formula, Application):
        argument = record(algebra, formula.argument, resolve)
        try:
            return curve_at(algebra, formula.curve, argument, formula.derivative)
        except (ValueError, ArithmeticError):
            what = f"the curve {formula.curve.name} has no value at {algebra.tape.value(argument.ref):.6g}"
            raise ModelError(Problem("", what, "an argument within its points")) from None
    if formula.name == "select":
        condition, *branches = formula.arguments
        taken = algebra.tape.value(record(algebra, condition, resolve).ref)
        if taken is not None:  # the other branch may well divide by zero: that is what the condition is for
            return record(algebra, branches[0 if taken != 0.0 else 1], resolve)
    arguments = [record(algebra, argument, resolve) for argument in formula.arguments]
    try:
        return _operation(algebra, formula.name, arguments)
    except (ValueError, ArithmeticError):
        numbers = (algebra.tape.value(argument.ref) for argument in arguments)
        values = ", ".join("..." if number is None else f"{number:.6g}" for number in numbers)
        what = f"{formula.name}({values}) in a formula has no finite value whatever the state"
        raise ModelError(Problem("", what, "other values of the fixed parameters there, or tunable = true for them")) from None


def _operation(algebra: Algebra, name: str, arguments: Sequence[Scalar]) -> Scalar:
    match name:
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
            return algebra.call(_CALLS[name], *arguments)


def symbols(formula: Formula) -> set[Symbol]:
    """Return the symbols of a formula."""
    if isinstance(formula, Number):
        return set()
    if isinstance(formula, Symbol):
        return {formula}
    if isinstance(formula, Application):
        return symbols(formula.argument)
    found: set[Symbol] = set()
    for argument in formula.arguments:
        found |= symbols(argument)
    return found
