"""Prescribed motions without a value over a part of a run: roots and logarithms of negative values."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.errors import Problem
from eomgen.formula.evaluate import evaluate_batch, values_of_parameters
from eomgen.formula.nodes import Application, Formula, Operation, Symbol
from eomgen.formula.prescribed_motion import Law

#: Times of the grid.
_GRID = 1025
_HALVINGS = 60


def undefined(laws: Iterable[Law], values: Mapping[str, float], start: float, end: float) -> list[Problem]:
    """Return a problem for each law that has no value from some time on, or until some time.

    Parameters
    ----------
    values : mapping
        All parameters.
    start, end : float
        Times to look at, s.
    """
    problems = []
    for law in laws:
        if law.smooth or _has_curves(law.formula):
            continue
        time = undefined_from(law.formula, values_of_parameters(law.formula, values), start, end)
        if time is not None:
            fault = f"the {law.quantity} has no value behind t = {time:.6g} s"
            hint = f"a run that ends before, or a formula that has one up to t = {end:.6g} s"
            problems.append(Problem(law.where, f"{fault}: a root, a logarithm or a power of a negative number", hint))
    return problems


@functools.lru_cache(maxsize=256)
def undefined_from(formula: Formula, values: tuple[tuple[str, float], ...], start: float, end: float) -> float | None:
    """Return from which time on a formula has no value for a while, s; None if it has one at all times.

    A time alone without a value, as of a division by zero, does not count.

    Parameters
    ----------
    values : tuple of (name, value)
        Of the parameters in the formula.
    start, end : float
        Times to look at, s.
    """
    known = dict(values)

    def missing(t: Array) -> NDArray[np.bool_]:
        def value_of(symbol: Symbol) -> Array | float:
            return t if symbol.kind == "time" else known[symbol.name]

        return np.broadcast_to(np.isnan(evaluate_batch(formula, value_of)), t.shape)

    times = np.linspace(start, end, _GRID)
    without = missing(times)
    lasting = np.flatnonzero(without[:-1] & without[1:])
    if not len(lasting):
        return None
    low, high = times[max(lasting[0] - 1, 0)], times[lasting[0]]
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if missing(np.array([middle]))[0] else (middle, high)
    return float(high)


def _has_curves(formula: Formula) -> bool:
    """Return whether there are curves in a formula, whose values are not known here."""
    if isinstance(formula, Application):
        return True
    return isinstance(formula, Operation) and any(map(_has_curves, formula.arguments))
