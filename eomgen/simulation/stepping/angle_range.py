"""Sines and cosines beyond the argument range of the compiled code, for which they are NaN: in formulas and joint
angles."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping

from eomgen.base.arrays import Array
from eomgen.codegen.metadata import LARGEST_ANGLE
from eomgen.errors import Problem, UsageError
from eomgen.formula.evaluate import evaluate
from eomgen.formula.nodes import Application, Formula, Operation, Symbol
from eomgen.system.description import Description

Values = Mapping[tuple[str, str, int], float]
#: Why there is no value, and a remedy.
REASON = (
    f"sines and cosines are computed up to {LARGEST_ANGLE:g} rad, beyond which numbers are 2e-06 rad and more apart"
)
HINT = "an origin of time near the run, with the phase there in the formula"


def large_angles(description: Description, values: Values, given: Collection[str] = ()) -> str:
    """Return the sines and cosines in formulas whose arguments are too large, in words; empty if there are none.

    Parameters
    ----------
    values : numbers by kind, name and index of a symbol; arguments that need others are left out
    given : inputs whose formulas are replaced
    """

    def value_of(symbol: Symbol) -> float:
        try:
            return values[symbol.kind, symbol.name, symbol.index]
        except KeyError:
            raise ArithmeticError(f"{symbol.kind} {symbol.name}") from None

    t = values["time", "", 0]
    result: dict[str, None] = {}
    for item in description.inputs:
        if item.name in given:
            continue
        beyond = [w * t for _, w, _ in item.harmonics if abs(w * t) > LARGEST_ANGLE]
        result |= dict.fromkeys(f"cos({angle:.6g}) in the input {item.name}" for angle in beyond[:1])
        if item.formula is not None:
            result |= dict.fromkeys(f"{taken} in the input {item.name}" for taken in _too_large(item.formula, value_of))
    for formula in (*description.formulas, *(part for item in description.outputs for part in item.values)):
        result |= dict.fromkeys(_too_large(formula, value_of))
    return " and ".join(list(result)[:3])


def _too_large(formula: Formula, value_of: Callable[[Symbol], float]) -> Iterator[str]:
    """Yield the sines and cosines of too large arguments in a formula, except in unused branches of a
    ``select``."""
    if isinstance(formula, Application):
        yield from _too_large(formula.argument, value_of)
    if not isinstance(formula, Operation):
        return
    parts = formula.arguments
    try:
        if formula.name == "select":
            condition, then, otherwise = parts
            parts = (condition, then if evaluate(condition, value_of) != 0.0 else otherwise)
        elif formula.name in ("sin", "cos") and abs(angle := evaluate(parts[0], value_of)) > LARGEST_ANGLE:
            yield f"{formula.name}({angle:.6g})"
    except ArithmeticError:
        pass
    for part in parts:
        yield from _too_large(part, value_of)


def large_joint_angles(names: list[str], units: list[str], q: Array) -> str:
    """Return the joint angles that are too large for their sines, in words; empty if there are none."""
    result = [
        f"{name} is {value:.6g} rad"
        for name, unit, value in zip(names, units, q, strict=True)
        if unit == "rad" and abs(value) > LARGEST_ANGLE
    ]
    return " and ".join(result[:3])


def check_angles(
    description: Description, parameters: Mapping[str, float], given: Collection[str], start: float, end: float
) -> None:
    """Raise UsageError if formulas of time take sines of too large arguments at the start or at the end (s) of a
    run."""
    fixed = {("parameter", name, 0): value for name, value in description.values(parameters).items()}
    for key, t in (("t_start", start), ("t_end", end)):
        if too_large := large_angles(description, {**fixed, ("time", "", 0): t}, given):
            raise UsageError(Problem(key, f"{too_large} would be taken at t = {t:.9g} s; {REASON}", HINT))
