"""Where signals jump or bend: the times, found in formulas whose curves have arguments that are linear in time."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from eomgen.scene.formula_nodes import Application, Formula, Number, Operation, Symbol


def applications(formula: Formula) -> Sequence[Application]:
    """Return where a formula takes the value of a curve, arguments of curves included."""
    if isinstance(formula, Application):
        return [formula, *applications(formula.argument)]
    if isinstance(formula, Operation):
        return [found for argument in formula.arguments for found in applications(argument)]
    return []


def affine(formula: Formula, value_of: Callable[[Symbol], float | None]) -> tuple[float, float] | None:
    """Return a and b where a formula is a t + b; ``value_of`` gives the number of a fixed parameter, None for others."""
    if isinstance(formula, Number):
        return 0.0, formula.value
    if isinstance(formula, Symbol):
        if formula.kind == "time":
            return 1.0, 0.0
        value = value_of(formula) if formula.kind == "parameter" else None
        return None if value is None else (0.0, value)
    if not isinstance(formula, Operation) or formula.name not in ("add", "sub", "mul", "div", "neg"):
        return None
    parts = [affine(argument, value_of) for argument in formula.arguments]
    if any(part is None for part in parts):
        return None
    known = [part for part in parts if part is not None]
    (a, b), (c, d) = known[0], known[-1]
    match formula.name:
        case "add":
            return a + c, b + d
        case "sub":
            return a - c, b - d
        case "neg":
            return -a, -b
        case "mul":
            return (a * d, b * d) if c == 0.0 else (b * c, b * d) if a == 0.0 else None
        case _:
            return (a / d, b / d) if c == 0.0 and d != 0.0 else None
