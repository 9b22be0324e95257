"""Jumps of prescribed motions, which no finite force can follow: of positions and of their rates.

A law is evaluated with its rate (complex step) on a grid of times, and on both sides of its known breakpoints. If it
is not linear between two times the interval is divided: the deviation from the chord falls to less than a half for a
smooth law, and stays at a jump. A narrow pulse between two times of the grid is found if its breakpoints are
comparisons of t, or points of curves. Angles are compared modulo full revolutions, as in the equations.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from eomgen.base.arrays import Array
from eomgen.errors import Problem
from eomgen.formula.discontinuities import breakpoints
from eomgen.formula.evaluate import values_of_parameters
from eomgen.formula.law_values import law_and_rate
from eomgen.formula.nodes import Formula
from eomgen.formula.prescribed_motion import Law
from eomgen.formula.undefined_laws import undefined

#: Times of the grid.
_GRID = 1025
#: Jumps that count, as a part of the range of a law, or of its largest rate: constants are typed with a few digits.
_TOLERANCE = 1e-5
#: Larger changes of an angle are no turns left out, but infinities that are passed.
_FARTHEST = 1e4
#: Times evaluated on each side of periodic breakpoints.
_PERIODS = 64
_DIVISIONS = 120
#: Position in an interval at which it is divided: in its middle the rate 0 of |x| at x = 0 would lie on the chord.
_PART = 0.375
#: Intervals that are examined more closely: the most bent ones.
_INTERVALS = 64
_EPSILON = float(np.finfo(float).eps)


class Jump(NamedTuple):
    """Time at which a law (order 0) or its rate (order 1) jumps, and its values there."""

    time: float
    order: int
    before: float
    after: float


def jumps(laws: Iterable[Law], values: Mapping[str, float], start: float, end: float) -> list[Problem]:
    """Return a problem for each law that jumps.

    Parameters
    ----------
    values : mapping
        All parameters.
    start, end : float
        Times to look at, s.
    """
    problems = []
    for law in laws:
        if law.smooth:
            continue
        known = values_of_parameters(law.formula, values)
        jump = first_jump(law.formula, known, start, end, law.unit == "rad")
        if jump is not None:
            without = undefined([law], values, start, end)
            problems += without or [Problem(law.where, *_described(law, jump))]
    return problems


@functools.lru_cache(maxsize=256)
def first_jump(
    formula: Formula, values: tuple[tuple[str, float], ...], start: float, end: float, angle: bool
) -> Jump | None:
    """Return the first jump of a law from start to end, its own before one of its rate; None without.

    Parameters
    ----------
    values : tuple of (name, value)
        Of the parameters in the formula.
    angle : bool
        Whether whole turns make no difference to the law.
    """
    known = dict(values)
    law = law_and_rate(formula, known)
    beside: list[Any] = [np.linspace(start, end, _GRID if end > start else 1)]
    for point in breakpoints(formula, lambda symbol: known.get(symbol.name)):
        first = np.ceil((start - point.time) / point.period) if point.period else 0.0
        times = point.time + point.period * (first + np.arange(_PERIODS if point.period else 1))
        margin = 64.0 * _EPSILON * np.maximum(np.abs(times), point.blur)
        beside += [times - margin, times, times + margin]
    known_times = np.unique(np.concatenate(beside))
    known_times = known_times[(known_times >= start) & (known_times <= end)]
    for order in (0, 1):
        time = _lasting_change(law, known_times, order, turns=angle and order == 0)
        if time is not None:
            sides = np.clip(np.array([time - 1e-12 * (end - start), time + 1e-12 * (end - start)]), start, end)
            before, after = law(sides)[order]
            return Jump(time, order, float(before), float(after))
    return None


def _lasting_change(
    law: Callable[[Array], tuple[Array, Array]], times: Array, order: int, *, turns: bool
) -> float | None:
    """Return the first time at which a law changes much however closely it is looked at; None if there is none.

    Parameters
    ----------
    law : callable
        From times (n,) to values and rates, (n,) each.
    times : (n,)
        Grid; the search is between its times.
    order : int
        0 for the law, 1 for its rate.
    turns : bool
        Whether changes count up to whole turns.
    """
    values = law(times)[order]
    finite = values[np.isfinite(values)]
    if not len(finite):
        return None
    scale = np.ptp(finite) if order == 0 else np.max(np.abs(finite))
    narrowest = 8.0 * _EPSILON * max(abs(times[0]), abs(times[-1]))
    least = max(_TOLERANCE * scale, 1e-12 * np.max(np.abs(finite)), 64.0 * _rounding(law, times[0], times[-1], order))
    low, high, at_low, at_high = times[:-1], times[1:], values[:-1], values[1:]
    for _ in range(_DIVISIONS):
        middle = low + _PART * (high - low)
        between = law(middle)[order]
        with np.errstate(invalid="ignore"):
            deviation = np.abs(between - at_low - _PART * (at_high - at_low))
            curved = np.flatnonzero(deviation > 0.25 * least)
        if len(curved) > _INTERVALS:  # beside an infinity
            curved = np.sort(curved[np.argsort(deviation[curved])[-_INTERVALS:]])
        low, middle, high = low[curved], middle[curved], high[curved]
        at_low, between, at_high = at_low[curved], between[curved], at_high[curved]
        if not len(low) or np.all(high - low <= narrowest):
            break
        low, high = np.stack([low, middle], 1).ravel(), np.stack([middle, high], 1).ravel()
        at_low, at_high = np.stack([at_low, between], 1).ravel(), np.stack([between, at_high], 1).ravel()
    size = np.abs(at_high - at_low)
    if turns:
        size = np.where(size < _FARTHEST, np.abs(np.remainder(size + np.pi, 2.0 * np.pi) - np.pi), size)
    lasting = low[size > max(least, 0.1 * np.max(size, initial=0.0))]  # other jumps beside infinities are noise
    return float(lasting[0]) if len(lasting) else None


def _rounding(law: Callable[[Array], tuple[Array, Array]], start: float, end: float, order: int) -> float:
    """Return the rounding of a law: its summands may be much larger than itself, as at a start from rest."""
    times = np.linspace(start, end, 259)[1:-1]
    aside = 1e-5 * (end - start)
    before, here, after = (law(times + shift)[order] for shift in (-aside, 0.0, aside))
    with np.errstate(invalid="ignore"):
        noise = np.abs(before - 2.0 * here + after)
    noise = noise[np.isfinite(noise)]
    return float(np.quantile(noise, 0.75)) if len(noise) else 0.0


def _described(law: Law, jump: Jump) -> tuple[str, str]:
    """Return the meaning of a jump, and a remedy."""
    unit = law.unit if jump.order == 0 else f"{law.unit}/s"
    of = f"the {law.quantity}" if jump.order == 0 else f"the rate of the {law.quantity}"
    fault = f"{of} jumps from {jump.before:.6g} to {jump.after:.6g} {unit} at t = {jump.time:.9g} s"
    fault += ", and no motion can follow that" if jump.order == 0 else ", which takes an impulse that no step gives"
    beside = 'smooth = "10 ms" beside the law, or ' if law.quantity.startswith("driven") else ""
    return (
        fault,
        f'{beside}a law that is smooth there, such as a curve with interpolation = "quintic", or a force or an effort'
        " instead",
    )
