"""The value of a formula in floating point: a small interpreter over the closed set of nodes.

It serves checks at the default parameters, and is the reference that generated code is held against.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eomgen.formula.nodes import (
    NON_SMOOTH,
    Application,
    EntryQuantity,
    Formula,
    Number,
    Operation,
    Symbol,
    distinct_nodes,
)
from eomgen.symbolic.operations import ELEMENTARY, NAMES

#: Remedy for a formula of parameters without a value.
OTHER_VALUES = "other values of the parameters"
#: Operations of formulas on numbers, and on arrays.
_FUNCTIONS: Mapping[str, tuple[Callable[..., float], Callable[..., NDArray[np.float64]]]] = {
    "add": (operator.add, np.add),
    "sub": (operator.sub, np.subtract),
    "mul": (operator.mul, np.multiply),
    "div": (operator.truediv, np.divide),
    "pow": (math.pow, np.float_power),
    "neg": (operator.neg, np.negative),
    "lt": (lambda a, b: float(a < b), lambda a, b: np.less(a, b).astype(np.float64)),
    "le": (lambda a, b: float(a <= b), lambda a, b: np.less_equal(a, b).astype(np.float64)),
    "select": (lambda condition, then, otherwise: then if condition != 0.0 else otherwise, np.where),
    **{name: (getattr(math, name), getattr(np, ELEMENTARY[op].numpy or name)) for op, name in NAMES.items()},
    "atan2": (math.atan2, np.arctan2),
    "abs": (abs, np.abs),
    "sign": (lambda a: math.copysign(1.0, a) if a != 0.0 else 0.0, np.sign),
    "min": (min, np.minimum),
    "max": (max, np.maximum),
}


#: Numbers by kind, name and index of a symbol.
SymbolValues = Mapping[tuple[str, str, int], float]


def value_in(values: SymbolValues, symbol: Symbol) -> float:
    """Return the value of a symbol. Raises ArithmeticError for a symbol without a value."""
    try:
        return values[symbol.kind, symbol.name, symbol.index]
    except KeyError:
        raise ArithmeticError(f"{symbol.kind} {symbol.name}") from None


def apply(name: str, arguments: Sequence[float]) -> float:
    """Return the value of one operation.

    Raises
    ------
    ArithmeticError
        If the operation has no finite value; the text says which one.
    """
    try:
        value = float(_FUNCTIONS[name][0](*arguments))
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
        If an operation has no finite value, or the formula contains a curve, which has no value here.
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
    arguments = [evaluate(argument, value_of) for argument in formula.arguments]
    return quantity_at(formula, arguments) if isinstance(formula, EntryQuantity) else apply(formula.name, arguments)


def quantity_at(formula: EntryQuantity, arguments: Sequence[float]) -> float:
    """Return the value of a quantity of an entry at numbers as arguments."""
    return float(formula.word.values(formula.item, formula.name, formula.component, *arguments))


def evaluate_batch(
    formula: Formula, value_of: Callable[[Symbol], ArrayLike], *, along_motion: bool = False
) -> NDArray[np.float64]:
    """Return the values of a formula for batches of symbol values, in the broadcast shape of these batches.

    Operations that make ``evaluate`` raise give NaN; so of a ``select`` only the branch that is taken counts here, too.

    Parameters
    ----------
    value_of : callable
        Gives an array, or a number, for a symbol.
    along_motion : bool
        Whether curves have values, because the values belong to a motion; else curves give NaN.
    """
    with np.errstate(all="ignore"):
        return _values(formula, value_of, along_motion=along_motion)


def _values(formula: Formula, value_of: Callable[[Symbol], ArrayLike], *, along_motion: bool) -> NDArray[np.float64]:
    """Return the values of a formula as ``evaluate_batch`` does, NaN for operations without a value; floating-point
    warnings are left to the caller."""
    if isinstance(formula, Number):
        return np.asarray(formula.value, dtype=np.float64)
    if isinstance(formula, Symbol):
        return np.asarray(value_of(formula), dtype=np.float64)
    if isinstance(formula, Application):
        if not along_motion:
            return np.asarray(np.nan)
        argument = _values(formula.argument, value_of, along_motion=True)
        return np.asarray(formula.curve(argument, formula.derivative), dtype=np.float64)
    arguments = [_values(argument, value_of, along_motion=along_motion) for argument in formula.arguments]
    if formula.name == "select":
        condition, then, otherwise = arguments
        return np.where(np.isnan(condition), np.nan, np.where(condition != 0.0, then, otherwise))
    if isinstance(formula, EntryQuantity):
        value = formula.word.values(formula.item, formula.name, formula.component, *arguments)
    else:
        value = _FUNCTIONS[formula.name][1](*arguments)
    unknown = ~np.isfinite(value)
    for argument in arguments:  # comparisons and powers make a number of NaN
        unknown = unknown | np.isnan(argument)
    return np.where(unknown, np.nan, value)


def curves(formula: Formula) -> frozenset[str]:
    """Return the names of all curves in a formula."""
    return frozenset(node.curve.name for node in distinct_nodes(formula) if isinstance(node, Application))


def quantities(formula: Formula) -> Iterator[EntryQuantity]:
    """Yield the quantities of entries in a formula, also within arguments."""
    return (node for node in distinct_nodes(formula) if isinstance(node, EntryQuantity))


def entries(formula: Formula) -> frozenset[tuple[str, str]]:
    """Return (section, name) of laws, maps, waves and other entries with a word of their own in a formula."""
    return frozenset((item.word.section, item.item.name) for item in quantities(formula))


def symbols(formula: Formula) -> frozenset[Symbol]:
    """Return every symbol that occurs in a formula."""
    return frozenset(node for node in distinct_nodes(formula) if isinstance(node, Symbol))


def comparisons(formula: Formula) -> Iterator[Formula]:
    """Yield the comparisons and signs in a formula, which jump from one value to another."""
    for node in distinct_nodes(formula):
        if isinstance(node, Operation) and NON_SMOOTH.get(node.name) == 0:
            yield node


def values_of_parameters(formula: Formula, values: Mapping[str, float]) -> tuple[tuple[str, float], ...]:
    """Return names and values of the parameters that occur in a formula, by name: the key of cached results."""
    names = sorted({symbol.name for symbol in symbols(formula) if symbol.kind == "parameter"})
    return tuple((name, values[name]) for name in names)
