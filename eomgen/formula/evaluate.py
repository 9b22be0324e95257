"""The value of a formula in floating point: a small interpreter over the closed set of nodes.

It serves checks at the default parameters, and is the reference that generated code is held against.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eomgen.formula.nodes import Application, Formula, Number, Operation, Symbol

#: What to try where a formula of parameters has no value.
OTHER_VALUES = "other values of the parameters"

_FUNCTIONS: Mapping[str, Callable[..., float]] = {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "div": lambda a, b: a / b,
    "pow": math.pow,
    "neg": lambda a: -a,
    "lt": lambda a, b: float(a < b),
    "le": lambda a, b: float(a <= b),
    "select": lambda condition, then, otherwise: then if condition != 0.0 else otherwise,
    "sin": math.sin,
    "cos": math.cos,
    "tan": math.tan,
    "asin": math.asin,
    "acos": math.acos,
    "atan": math.atan,
    "atan2": math.atan2,
    "sinh": math.sinh,
    "cosh": math.cosh,
    "tanh": math.tanh,
    "exp": math.exp,
    "log": math.log,
    "sqrt": math.sqrt,
    "abs": abs,
    "sign": lambda a: math.copysign(1.0, a) if a != 0.0 else 0.0,
    "min": min,
    "max": max,
}

#: The same functions on arrays.
_ARRAY_FUNCTIONS: Mapping[str, Callable[..., NDArray[np.float64]]] = {
    "add": np.add,
    "sub": np.subtract,
    "mul": np.multiply,
    "div": np.divide,
    "pow": np.float_power,
    "neg": np.negative,
    "lt": lambda a, b: np.less(a, b).astype(np.float64),
    "le": lambda a, b: np.less_equal(a, b).astype(np.float64),
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "asin": np.arcsin,
    "acos": np.arccos,
    "atan": np.arctan,
    "atan2": np.arctan2,
    "sinh": np.sinh,
    "cosh": np.cosh,
    "tanh": np.tanh,
    "exp": np.exp,
    "log": np.log,
    "sqrt": np.sqrt,
    "abs": np.abs,
    "sign": np.sign,
    "min": np.minimum,
    "max": np.maximum,
}


def apply(name: str, arguments: Sequence[float]) -> float:
    """Return the value of one operation.

    Raises
    ------
    ArithmeticError
        Where the operation has no finite value; the text says which one.
    """
    try:
        value = float(_FUNCTIONS[name](*arguments))
    except (ValueError, ArithmeticError):
        value = math.nan
    if not math.isfinite(value):
        values = ", ".join(f"{argument:.6g}" for argument in arguments)
        raise ArithmeticError(f"{name}({values}) has no finite value")
    return value


def evaluate(formula: Formula, value_of: Callable[[Symbol], float]) -> float:
    """Return the value of a formula; of a ``select``, only the branch taken is evaluated.

    Parameters
    ----------
    formula : Formula
    value_of : callable
        Gives the number for a symbol.

    Raises
    ------
    ArithmeticError
        Where an operation has no finite value.
    """
    if isinstance(formula, Number):
        return formula.value
    if isinstance(formula, Symbol):
        return value_of(formula)
    if isinstance(formula, Application):
        raise ArithmeticError(f"the curve {formula.curve.name} has no value without a motion")
    if formula.name == "select":
        condition, then, otherwise = formula.arguments
        return evaluate(then if evaluate(condition, value_of) != 0.0 else otherwise, value_of)
    return apply(formula.name, [evaluate(argument, value_of) for argument in formula.arguments])


def evaluate_batch(formula: Formula, value_of: Callable[[Symbol], ArrayLike]) -> NDArray[np.float64]:
    """Return the values of a formula for a batch of values of its symbols, of their broadcast shape.

    NaN stands where ``evaluate`` raises; so of a ``select`` only the branch that is taken counts here, too.

    Parameters
    ----------
    value_of : callable
        Gives an array, or a number, for a symbol.
    """
    with np.errstate(all="ignore"):
        return _values(formula, value_of)


def _values(formula: Formula, value_of: Callable[[Symbol], ArrayLike]) -> NDArray[np.float64]:
    if isinstance(formula, Number):
        return np.asarray(formula.value, dtype=np.float64)
    if isinstance(formula, Symbol):
        return np.asarray(value_of(formula), dtype=np.float64)
    if isinstance(formula, Application):
        return np.asarray(np.nan)
    arguments = [_values(argument, value_of) for argument in formula.arguments]
    if formula.name == "select":
        condition, then, otherwise = arguments
        return np.where(np.isnan(condition), np.nan, np.where(condition != 0.0, then, otherwise))
    value = _ARRAY_FUNCTIONS[formula.name](*arguments)
    unknown = ~np.isfinite(value)
    for argument in arguments:  # comparisons and powers make a number of NaN
        unknown = unknown | np.isnan(argument)
    return np.where(unknown, np.nan, value)


def symbols(formula: Formula) -> frozenset[Symbol]:
    """Return every symbol that occurs in a formula."""
    if isinstance(formula, Symbol):
        return frozenset({formula})
    if isinstance(formula, Application):
        return symbols(formula.argument)
    if isinstance(formula, Operation):
        return frozenset().union(*(symbols(argument) for argument in formula.arguments))
    return frozenset()
