"""Places at which a formula may change faster than the numbers that it is made of: jumps, kinks, points, centres,
and operations that may have a value and no derivative.

An expression tree shows more than samples: zeros of the argument of a comparison, or of the base of a square (the
centre of a Gaussian), locate a feature of any width.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.formula.curves import Bump, Curve, Waves
from eomgen.formula.evaluate import symbols
from eomgen.formula.nodes import (
    NON_SMOOTH,
    VECTORS,
    Application,
    EntryQuantity,
    Formula,
    Number,
    Operation,
    distinct_nodes,
    infix,
)
from eomgen.symbolic.operations import ELEMENTARY, NAMES

#: Functions of one number with an unbounded slope at the edge of the domain.
WITH_EDGE = frozenset(NAMES[op] for op, row in ELEMENTARY.items() if row.rough)
#: Functions that have a value but no derivative at some arguments.
_ROUGH = WITH_EDGE | {"atan2"}
#: Kinds of symbols that do not change within a run.
_HELD = frozenset({"parameter", "number", "place"})


def rough_operations(formulas: Iterable[Formula], *, quotients: bool = False) -> str:
    """Return the first operations with a value but an unbounded slope somewhere, as text, and the number of further
    operations.

    Such operations are square roots, logarithms, asin, acos, atan2, and powers other than numbers of at least 1, but
    not abs, min and max. The text is empty without such operations.

    Parameters
    ----------
    quotients : whether quotients by numbers that change count as well
    """
    result = list(dict.fromkeys(text for formula in formulas for text in _rough(formula, quotients=quotients)))
    return f"{', '.join(result[:2])}{f' and {len(result) - 2} more' if len(result) > 2 else ''}"


def _rough(formula: Formula, *, quotients: bool) -> Iterator[str]:
    """Yield as text the operations of a formula that may have a value and no derivative, if their argument changes
    along a motion; ``quotients``: also quotients by such arguments."""
    for node in distinct_nodes(formula):
        if not isinstance(node, Operation):
            continue
        by_zero = quotients and node.name == "div"
        exponent = node.arguments[-1]  # a power with this exponent may have no derivative at zero
        whole = isinstance(exponent, Number) and exponent.value >= 1.0
        broken = node.name in _ROUGH or (node.name == "pow" and not whole)
        if (by_zero or broken) and changes(node.arguments[1 if by_zero else 0]):
            yield infix(node, lambda symbol: 3 if symbol.kind in VECTORS else 1)


#: Operations by which a formula changes about as fast as the arguments; whole powers up to the fourth, too.
_PLAIN = ("add", "sub", "mul", "neg")
#: Operations that change fast at an argument of 0, or at two equal arguments.
_FAST = (*NON_SMOOTH, "tanh", "atan", "cosh")


@dataclass(frozen=True)
class Feature:
    """An argument of a formula, and the values ``places`` (n,) of the argument at which the formula may change fast;
    again after every ``period`` unless the period is 0. ``curve``: the places are points of a curve; a part of the
    curve is passed over only if a step passes two points."""

    argument: Formula
    places: Array
    period: float = 0.0
    curve: bool = False

    @property
    def least(self) -> int:
        """Least number of places passed in one step for a possible miss."""
        return 2 if self.curve else 1

    def sides(self, argument: Array) -> Array:
        """Return the number of places at or below each value of the argument, an array of the same shape; with a
        period, counted from the first place over all periods."""
        if not self.period:
            return np.searchsorted(self.places, argument, side="right").astype(float)
        turns = np.floor((argument - self.places[0]) / self.period)
        within = np.searchsorted(self.places, argument - turns * self.period, side="right")
        result: Array = turns * len(self.places) + within
        return result

    def between(self, low: float, high: float, most: int) -> Array:
        """Return the places from the argument ``low`` to ``high``, also in later periods, at most ``most`` of them."""
        if not self.period:
            inside: Array = self.places[(self.places >= low) & (self.places <= high)]
            return inside[:most]
        first = np.floor((low - self.places[-1]) / self.period)
        turns = first + np.arange(min(most, int((high - low) / self.period) + 3))
        every = (self.places + self.period * turns[:, np.newaxis]).ravel()
        passed: Array = every[(every >= low) & (every <= high)]
        return passed[:most]


def changes(formula: Formula) -> bool:
    """Return whether the value of a formula changes within a run."""
    return any(symbol.kind not in _HELD for symbol in symbols(formula))


def may_be_fast(formula: Formula) -> bool:
    """Return whether a formula may change much faster than its symbols; False for polynomials of low degree."""
    if isinstance(formula, Application):
        return may_be_fast(formula.argument) or (changes(formula) and not isinstance(formula.curve, Waves))
    if isinstance(formula, EntryQuantity) and not formula.word.fast:
        return any(may_be_fast(argument) for argument in formula.arguments)
    if not isinstance(formula, Operation) or not changes(formula):
        return False
    if any(may_be_fast(argument) for argument in formula.arguments):
        return True
    if formula.name in _PLAIN:
        return False
    *_, last = formula.arguments
    if formula.name == "div":
        return changes(last)
    if formula.name == "pow" and isinstance(last, Number):
        return not (last.value == round(last.value) and 0.0 <= last.value <= 4.0)
    return True


def summands(formula: Formula) -> Iterator[Formula]:
    """Yield the summands of a formula without signs; a small summand may be fast though a large summand is slow."""
    if isinstance(formula, Operation) and formula.name in ("add", "sub", "neg"):
        for argument in formula.arguments:
            yield from summands(argument)
    else:
        yield formula


def features(formula: Formula) -> Iterator[Feature]:
    """Yield the features of a formula and its parts: points of curves, zeros in arguments such as abs has, equal
    arguments in comparisons, and zeros of squared terms."""
    zero = np.zeros(1)
    for node in distinct_nodes(formula):
        if isinstance(node, Application) and changes(node.argument):
            yield from _curve_features(node)
        elif isinstance(node, Operation) and node.name in _FAST and changes(node):
            yield Feature(_deciding(node), zero)
        elif isinstance(node, Operation) and _is_square(node) and changes(node.arguments[0]):
            yield Feature(node.arguments[0], zero)


def jumps(formula: Formula) -> Iterator[Formula]:
    """Yield expressions at whose zeros the formula may have a step, except inside curves."""
    for node in distinct_nodes(formula):
        if isinstance(node, Operation) and NON_SMOOTH.get(node.name, math.inf) <= 0 and changes(node):
            yield _deciding(node)


def _deciding(node: Operation) -> Formula:
    """Return the argument of an operation, or the difference of its two arguments."""
    first, *second = node.arguments
    return first - second[0] if second else first


def _is_square(formula: Operation) -> bool:
    first, last = formula.arguments[0], formula.arguments[-1]
    if formula.name == "pow" and isinstance(last, Number):
        return last.value != 0.0 and last.value % 2.0 == 0.0
    return formula.name == "mul" and first == last and not isinstance(first, Number)


def _curve_features(formula: Application) -> Iterator[Feature]:
    curve = formula.curve
    if isinstance(curve, Curve):
        places = curve.breaks
        yield Feature(formula.argument, places[:-1] if curve.period else places, curve.period, curve=True)
    elif isinstance(curve, Bump):
        yield Feature(formula.argument, curve.position + curve.length * np.array([0.0, 0.5, 1.0]), curve=True)
