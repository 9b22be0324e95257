"""Jumps of prescribed motions, which no finite force can follow: of positions and of their rates.

A law is evaluated with its rate (complex step) on a grid of times, and on both sides of its known breakpoints. Where it
is not linear between two times the interval is bisected: the deviation from the chord falls to a quarter for a smooth
law, and stays at a jump. A narrow pulse between two times of the grid is found where its breakpoints are comparisons of
t, or points of curves. Angles are compared modulo full revolutions, as in the equations.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from eomgen.arrays import Array
from eomgen.errors import Problem
from eomgen.formula.discontinuities import breakpoints
from eomgen.formula.evaluate import symbols
from eomgen.formula.nodes import Formula, Symbol
from eomgen.formula.prescribed_motion import Law, smooth
from eomgen.formula.recording import record
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.scalar import Algebra, Scalar
from eomgen.symbolic.tape import Tape

#: Times of the grid.
_GRID = 1025
#: Jumps that count, as a part of the range of a law, or of its largest rate: constants are typed with a few digits.
_TOLERANCE = 1e-5
#: Larger changes of an angle are no turns left out, but infinities that are passed.
_FARTHEST = 1e4
#: Times evaluated on each side of periodic breakpoints.
_PERIODS = 64
_HALVINGS = 80
#: Intervals that are looked at more closely: those that bend most.
_INTERVALS = 64
_STEP = 1e-30  # of the complex step
_EPSILON = float(np.finfo(float).eps)


#: What a step may leave out of a law, in parts of how far the law leaves a straight line: from here on it is said, and
#: refused.
REPORTED, REFUSED = 0.01, 0.05
#: How many steps a law is measured over at least: in a few, everything is straight or steep.
_LEAST_STEPS = 256
#: What is left out of a law at steps that resolve it.
_RESOLVED = 0.003


class Steepness(NamedTuple):
    """Where a law is steepest for a step: time, by how much a step misses it, in parts of its range, and a step that
    does not."""

    time: float
    missed: float
    part: float
    enough: float


class Jump(NamedTuple):
    """Where a law (order 0) or its rate (order 1) jumps, and its values there."""

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
        if smooth(law.formula):
            continue
        names = sorted({symbol.name for symbol in symbols(law.formula) if symbol.kind == "parameter"})
        jump = first_jump(law.formula, tuple((name, values[name]) for name in names), start, end, law.unit == "rad")
        if jump is not None:
            problems.append(Problem(law.where, *_described(law, jump)))
    return problems


@functools.lru_cache(maxsize=256)
def first_jump(
    formula: Formula, values: tuple[tuple[str, float], ...], start: float, end: float, angle: bool
) -> Jump | None:
    """Return the first jump of a law from start to end, of the law itself before one of its rate; None where there is
    none.

    Parameters
    ----------
    values : tuple of (name, value)
        Of the parameters in the formula.
    angle : bool
        Whether whole turns make no difference to the law.
    """
    known = dict(values)
    law = _evaluated(formula, known)
    beside: list[Any] = [np.linspace(start, end, _GRID if end > start else 1)]
    for point in breakpoints(formula, lambda symbol: known.get(symbol.name)):
        first = np.ceil((start - point.time) / point.period) if point.period else 0.0
        places = point.time + point.period * (first + np.arange(_PERIODS if point.period else 1))
        margin = 64.0 * _EPSILON * np.maximum(np.abs(places), point.blur)
        beside += [places - margin, places, places + margin]
    known_times = np.unique(np.concatenate(beside))
    known_times = known_times[(known_times >= start) & (known_times <= end)]
    for order in (0, 1):
        found = _lasting_change(law, known_times, order, turns=angle and order == 0)
        if found is not None:
            sides = np.clip(np.array([found - 1e-12 * (end - start), found + 1e-12 * (end - start)]), start, end)
            before, after = law(sides)[order]
            return Jump(found, order, float(before), float(after))
    return None


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
        names = sorted({symbol.name for symbol in symbols(law.formula) if symbol.kind == "parameter"})
        known = tuple((name, values[name]) for name in names)
        found = steepest(law.formula, known, start, end, step, law.unit == "rad")
        if found is None:
            continue
        what = (
            f"the {law.what} is too steep for a step of {step:.3g} s near t = {found.time:.6g} s: over one step it"
            " changes by "
        )
        what += (
            f"{found.missed:.3g} {law.unit} more or less than its rates tell, {100.0 * found.part:.2g} % of its range"
        )
        hint = f"a step of {found.enough:.2g} s"
        if found.part > REFUSED:
            refused.append(Problem(law.where, what, hint))
        else:
            reported.append(f"{law.where}: {what}; try: {hint}")
    return refused, reported


@functools.lru_cache(maxsize=256)
def steepest(
    formula: Formula, values: tuple[tuple[str, float], ...], start: float, end: float, step: float, angle: bool
) -> Steepness | None:
    """Return where a step misses most of a law, None where all steps follow it.

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
    law = _evaluated(formula, dict(values))
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
    place, enough = middle[worst], step
    for _ in range(_HALVINGS):
        enough *= 0.5
        around = place + enough * np.arange(-2.0, 2.5, 0.5)
        left = missed(around, enough)
        place = around[int(np.argmax(left))]
        if not np.max(left) > _RESOLVED * size:
            break
    return Steepness(float(place), float(lost[worst]), float(lost[worst]) / size, enough)


def _lasting_change(
    law: Callable[[Array], tuple[Array, Array]], times: Array, order: int, *, turns: bool
) -> float | None:
    """Return the first time at which a law changes much however closely it is looked at; None where there is none.

    Parameters
    ----------
    law : callable
        From times (n,) to values and rates, (n,) each.
    times : (n,)
        Where to look between.
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
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        between = law(middle)[order]
        with np.errstate(invalid="ignore"):
            deviation = np.abs(between - 0.5 * (at_low + at_high))
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
    lasting = low[size > max(least, 0.1 * np.max(size, initial=0.0))]  # what is left beside infinities is noise
    return float(lasting[0]) if len(lasting) else None


def _rounding(law: Callable[[Array], tuple[Array, Array]], start: float, end: float, order: int) -> float:
    """Return what rounding changes a law by: its summands may be much larger than itself, as at a start from rest."""
    times = np.linspace(start, end, 259)[1:-1]
    aside = 1e-5 * (end - start)
    before, here, after = (law(times + shift)[order] for shift in (-aside, 0.0, aside))
    with np.errstate(invalid="ignore"):
        noise = np.abs(before - 2.0 * here + after)
    noise = noise[np.isfinite(noise)]
    return float(np.quantile(noise, 0.75)) if len(noise) else 0.0


def _evaluated(formula: Formula, known: Mapping[str, float]) -> Callable[[Array], tuple[Array, Array]]:
    """Return a function that gives a law and its rate at times."""
    tape = Tape()
    algebra = Algebra(tape)
    time = Scalar(tape, tape.input("t", 0))

    def resolved(symbol: Symbol) -> Scalar:
        return time if symbol.kind == "time" else algebra.scalar(known[symbol.name])

    law = record(algebra, formula, resolved)

    def values(t: Array) -> tuple[Array, Array]:
        with np.errstate(all="ignore"):
            result = evaluate(tape, [law.ref], {"t": t[:, np.newaxis] + 1j * _STEP})[:, 0]
        return result.real, result.imag / _STEP

    return values


def _described(law: Law, jump: Jump) -> tuple[str, str]:
    """Return what a jump means, and what to try."""
    unit = law.unit if jump.order == 0 else f"{law.unit}/s"
    of = f"the {law.what}" if jump.order == 0 else f"the rate of the {law.what}"
    what = f"{of} jumps from {jump.before:.6g} to {jump.after:.6g} {unit} at t = {jump.time:.9g} s"
    what += ", and no motion can follow that" if jump.order == 0 else ", which takes an impulse that no step gives"
    return (
        what,
        'a law that is smooth there, such as a curve with interpolation = "quintic", or a force or an effort instead',
    )
