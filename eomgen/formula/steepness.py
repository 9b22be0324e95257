"""Prescribed motions steeper than the step of a run: drives and motions of the base that steppers cannot follow.

A law is bisected if it is not linear, down to intervals of one step. There the trapezoidal rule for the rate is
compared with the change of the law.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from eomgen.base.arrays import Array
from eomgen.errors import Problem
from eomgen.formula.evaluate import values_of_parameters
from eomgen.formula.law_values import law_and_rate
from eomgen.formula.nodes import Formula
from eomgen.formula.prescribed_motion import Law

#: Times of the grid.
_GRID = 1025
#: Intervals that are examined more closely: the most bent ones.
_INTERVALS = 64
_HALVINGS = 80
_EPSILON = float(np.finfo(float).eps)
#: Error of the trapezoidal rule over one step, as a share of the law's range beside its linear trend: reported above
#: the first, refused above the second.
REPORTED, REFUSED = 0.01, 0.05
#: How many steps a law is measured over at least: in a few, everything is straight or steep.
_LEAST_STEPS = 256
#: The same share at steps that resolve the law.
_RESOLVED = 0.003


class Steepness(NamedTuple):
    """Place of the largest error over one step: time, error, its share of the range, and a step that resolves it."""

    time: float
    missed: float
    part: float
    enough: float


def steep(
    laws: Iterable[Law], values: Mapping[str, float], start: float, end: float, step: float
) -> tuple[list[Problem], list[str]]:
    """Return a problem for each law that a step cannot follow, and a sentence for each that it follows badly.

    Parameters
    ----------
    values : mapping
        All parameters.
    start, end, step : float
        Of the run, s.
    """
    refused, reported = [], []
    for law in laws:
        known = values_of_parameters(law.formula, values)
        worst = steepest(law.formula, known, start, end, step, law.unit == "rad")
        if worst is None:
            continue
        fault = (
            f"the {law.quantity} is too steep for a step of {step:.3g} s near t = {worst.time:.6g} s: over one step it "
            f"changes by {worst.missed:.3g} {law.unit} more or less than its rates tell, "
            f"{100.0 * worst.part:.2g} % of its range"
        )
        hint = f"a step of {worst.enough:.2g} s"
        if worst.part > REFUSED:
            refused.append(Problem(law.where, fault, hint))
        else:
            reported.append(f"{law.where}: {fault}; try: {hint}")
    return refused, reported


@functools.lru_cache(maxsize=256)
def steepest(
    formula: Formula, values: tuple[tuple[str, float], ...], start: float, end: float, step: float, angle: bool
) -> Steepness | None:
    """Return the place at which a step misses most of a law, None if all steps follow it.

    Steppers take positions of a law at the ends of steps, and its rates and accelerations there; a law that moves
    between otherwise than they say is not followed. Measured is the trapezoidal rule for the rate against the change of
    the law.

    Parameters
    ----------
    values : tuple of (name, value)
        Of the parameters in the formula.
    start, end, step : float
        Of the run, s.
    angle : bool
        Whether whole turns make no difference to the law.
    """
    law = law_and_rate(formula, dict(values))
    times = np.linspace(start, end, _GRID)
    if end <= start or not np.all(np.isfinite(law(times)[0])):
        return None
    x = law(np.linspace(start, max(end, start + _LEAST_STEPS * step), _GRID))[0]
    size = float(np.ptp(x - np.linspace(x[0], x[-1], _GRID)))
    if not size > 64.0 * _EPSILON * np.max(np.abs(x)):
        return None

    def missed(middle: Array, width: float) -> Array:
        low, high = np.clip(middle - 0.5 * width, start, end), np.clip(middle + 0.5 * width, start, end)
        (x0, v0), (x1, v1) = law(low), law(high)
        lost = np.abs(x1 - x0 - 0.5 * (high - low) * (v0 + v1))
        return np.abs(np.remainder(lost + np.pi, 2.0 * np.pi) - np.pi) if angle else lost

    low, width = times[:-1], (end - start) / (_GRID - 1)
    while width > step:
        middle = low + 0.5 * width
        deviation = np.abs(law(middle)[0] - 0.5 * (law(low)[0] + law(low + width)[0]))
        curved = np.flatnonzero(deviation > _RESOLVED * size)
        low, middle = low[curved], middle[curved]
        if len(curved) > _INTERVALS:
            most = np.sort(np.argsort(deviation[curved])[-_INTERVALS:])
            low, middle = low[most], middle[most]
        low, width = np.stack([low, middle], 1).ravel(), 0.5 * width
        if not len(low):
            return None
    middle = np.unique(np.add.outer(low + 0.5 * width, step * np.arange(-0.5, 0.75, 0.25)).ravel())
    lost = missed(middle, step)
    worst = int(np.argmax(lost))
    if not lost[worst] > REPORTED * size:
        return None
    time, enough = middle[worst], step
    for _ in range(_HALVINGS):
        enough *= 0.5
        around = time + enough * np.arange(-2.0, 2.5, 0.5)
        left = missed(around, enough)
        time = around[int(np.argmax(left))]
        if not np.max(left) > _RESOLVED * size:
            break
    return Steepness(float(time), float(lost[worst]), float(lost[worst]) / size, enough)
