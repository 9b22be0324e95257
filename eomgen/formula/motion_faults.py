"""Prescribed motions that no run can follow: without a value, with jumps of positions or rates, or steeper than a
step.

To find jumps, a law is evaluated with its rate (complex step) on a grid of times, and on both sides of its known
breakpoints. If the law is not linear between two times the interval is divided: the deviation from the chord falls to
less than a half for a smooth law, and stays at a jump. A narrow pulse between two times of the grid is found if its
breakpoints are comparisons of t, or points of curves. Angles are compared modulo full revolutions, as in the equations.

To find steep motions, a law is bisected if it is not linear, down to intervals of one step. There the trapezoidal rule
for the rate is compared with the change of the law.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.rounding import SUMMED
from eomgen.errors import Problem
from eomgen.formula.discontinuities import breakpoints
from eomgen.formula.evaluate import curves, evaluate_batch, values_of_parameters
from eomgen.formula.nodes import Formula, Symbol
from eomgen.formula.prescribed_motion import PrescribedLaw
from eomgen.formula.recording import law_and_rate

#: Times of the grid.
_GRID = 1025
_EPSILON = float(np.finfo(float).eps)


def undefined_laws(
    laws: Iterable[PrescribedLaw], values: Mapping[str, float], start: float, end: float
) -> list[Problem]:
    """Return a problem for each law that has no value over an interval of time: a root, a logarithm or a power of a
    negative number.

    A single time without a value does not count. Laws with curves are left out, since curves have no value here.

    Parameters
    ----------
    values : mapping
        All parameters.
    start, end : float
        Times to look at, s.
    """
    problems = []
    for law in laws:
        if law.smooth or curves(law.formula):  # whose values are not known here
            continue
        time = undefined_from(law.formula, values_of_parameters(law.formula, values), start, end)
        if time is not None:
            fault = f"the {law.quantity} has no value after t = {time:.6g} s"
            hint = f"a run that ends before, or a formula that has one up to t = {end:.6g} s"
            problems.append(
                Problem(law.where, f"{fault}: a root, a logarithm or a power of a negative number [E0298]", hint)
            )
    return problems


@functools.lru_cache(maxsize=256)
def undefined_from(formula: Formula, values: tuple[tuple[str, float], ...], start: float, end: float) -> float | None:
    """Return the time, s, from which on a formula has no value for a while; None if the formula has a value at all
    times.

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
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if missing(np.array([middle]))[0] else (middle, high)
    return float(high)


def _most_bent(deviation: Array, least: float) -> NDArray[np.intp]:
    """Return the indices of intervals with a larger deviation than ``least``, at most 64 with the largest ones: there
    are more next to an infinity."""
    bent = np.flatnonzero(deviation > least)
    return bent if len(bent) <= 64 else np.sort(bent[np.argsort(deviation[bent])[-64:]])


class Jump(NamedTuple):
    """Time at which a law (order 0) or its rate (order 1) jumps, and the values before and after the jump."""

    time: float
    order: int
    before: float
    after: float


def jumps(laws: Iterable[PrescribedLaw], values: Mapping[str, float], start: float, end: float) -> list[Problem]:
    """Return a problem for each law whose value or rate jumps between the times ``start`` and ``end``, s: the jump, or
    that the law has no value over an interval. Smooth laws are passed over. ``values`` are all parameters."""
    problems = []
    for law in laws:
        if law.smooth:
            continue
        known = values_of_parameters(law.formula, values)
        jump = first_jump(law.formula, known, start, end, law.unit == "rad")
        if jump is not None:
            without = undefined_laws([law], values, start, end)
            problems += without or [Problem(law.where, *_describe(law, jump))]
    return problems


@functools.lru_cache(maxsize=256)
def first_jump(
    formula: Formula, values: tuple[tuple[str, float], ...], start: float, end: float, angle: bool
) -> Jump | None:
    """Return the first jump of a law from start to end, a jump of the law itself before a jump of the rate; None
    without.

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
        times = point.time + point.period * (first + np.arange(64 if point.period else 1))
        margin = 64.0 * _EPSILON * np.maximum(np.abs(times), point.blur)
        beside += [times - margin, times, times + margin]
    known_times = np.unique(np.concatenate(beside))
    known_times = known_times[(known_times >= start) & (known_times <= end)]
    for order in (0, 1):
        time = _lasting_change(law, known_times, order, turns=angle and order == 0)
        if time is not None:
            aside = SUMMED * (end - start)
            sides = np.clip(np.array([time - aside, time + aside]), start, end)
            before, after = law(sides)[order]
            return Jump(time, order, float(before), float(after))
    return None


def _lasting_change(
    law: Callable[[Array], tuple[Array, Array]], times: Array, order: int, *, turns: bool
) -> float | None:
    """Return the first time, s, at which a law, or its rate, changes much however short the interval of time is; None
    if there is none.

    Parameters
    ----------
    law : from times (n,) to values and rates, (n,) each
    times : (n,) grid; the search is between these times
    order : 0 for the law, 1 for the rate of the law
    turns : whether changes count up to whole turns
    """
    values = law(times)[order]
    finite = values[np.isfinite(values)]
    if not len(finite):
        return None
    scale = np.ptp(finite) if order == 0 else np.max(np.abs(finite))
    narrowest = 8.0 * _EPSILON * max(abs(times[0]), abs(times[-1]))
    # constants are typed with a few digits
    least = max(1e-5 * scale, SUMMED * np.max(np.abs(finite)), 64.0 * _rounding(law, times[0], times[-1], order))
    low, high, at_low, at_high = times[:-1], times[1:], values[:-1], values[1:]
    part = 0.375  # in the middle of an interval the rate 0 of |x| at x = 0 would lie on the chord
    for _ in range(120):
        middle = low + part * (high - low)
        between = law(middle)[order]
        with np.errstate(invalid="ignore"):
            curved = _most_bent(np.abs(between - at_low - part * (at_high - at_low)), 0.25 * least)
        low, middle, high = low[curved], middle[curved], high[curved]
        at_low, between, at_high = at_low[curved], between[curved], at_high[curved]
        if not len(low) or np.all(high - low <= narrowest):
            break
        low, high = np.stack([low, middle], 1).ravel(), np.stack([middle, high], 1).ravel()
        at_low, at_high = np.stack([at_low, between], 1).ravel(), np.stack([between, at_high], 1).ravel()
    size = np.abs(at_high - at_low)
    if turns:  # larger changes are infinities that are passed
        size = np.where(size < 1e4, np.abs(np.remainder(size + np.pi, 2.0 * np.pi) - np.pi), size)
    lasting = low[size > max(least, 0.1 * np.max(size, initial=0.0))]  # other jumps next to infinities are noise
    return float(lasting[0]) if len(lasting) else None


def _rounding(law: Callable[[Array], tuple[Array, Array]], start: float, end: float, order: int) -> float:
    """Return an estimate of the rounding error of a law (``order`` 0) or its rate (1) between two times, from second
    differences: summands may be much larger than the law, as at a start from rest."""
    times = np.linspace(start, end, 259)[1:-1]
    aside = 1e-5 * (end - start)
    before, here, after = (law(times + shift)[order] for shift in (-aside, 0.0, aside))
    with np.errstate(invalid="ignore"):
        noise = np.abs(before - 2.0 * here + after)
    noise = noise[np.isfinite(noise)]
    return float(np.quantile(noise, 0.75)) if len(noise) else 0.0


def _describe(law: PrescribedLaw, jump: Jump) -> tuple[str, str]:
    """Return the fault that a law jumps, with values and time, and a remedy, for a message."""
    unit = law.unit if jump.order == 0 else f"{law.unit}/s"
    of = f"the {law.quantity}" if jump.order == 0 else f"the rate of the {law.quantity}"
    why = "and no motion can follow that" if jump.order == 0 else "which takes an impulse that no step gives"
    fault = f"{of} jumps from {jump.before:.6g} to {jump.after:.6g} {unit} at t = {jump.time:.9g} s, {why} [E0299]"
    beside = 'smooth = "10 ms" with the law, or ' if law.quantity.startswith("driven") else ""
    return (
        fault,
        f'{beside}a law that is smooth there, such as a curve with interpolation = "quintic", or a force or an effort'
        " instead",
    )


#: Error of the trapezoidal rule over one step, as a share of the law's range without its linear trend: reported above
#: the first, refused above the second; and the same share at steps that resolve the law.
REPORTED, REFUSED, _RESOLVED = 0.01, 0.05, 0.003


class Steepness(NamedTuple):
    """Largest error of the trapezoidal rule over one step: time, s, the error in the unit of the law, the error's share
    of the law's range, and a step, s, that resolves the law."""

    time: float
    missed: float
    part: float
    enough: float


def steep(
    laws: Iterable[PrescribedLaw], values: Mapping[str, float], start: float, end: float, step: float
) -> tuple[list[Problem], list[str]]:
    """Return a problem for each law that a step cannot follow, with an error above 5 % of the law's range, and a
    sentence for each law that a step follows badly, above 1 %. ``values`` are all parameters; ``start``, ``end`` and
    ``step`` are in s."""
    refused, reported = [], []
    for law in laws:
        known = values_of_parameters(law.formula, values)
        worst = steepest(law.formula, known, start, end, step, law.unit == "rad")
        if worst is None:
            continue
        fault = (
            f"the {law.quantity} is too steep for a step of {step:.3g} s near t = {worst.time:.6g} s: over one step it "
            f"changes by {worst.missed:.3g} {law.unit} more or less than the integral of its rates, "
            f"{100.0 * worst.part:.2g} % of its range [E0300]"
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
    """Return the place at which a step misses most of a law, None if all steps follow the law.

    Steppers take positions of a law at the ends of steps, and rates and accelerations of the law there; a law that
    moves between the ends otherwise than these values say is not followed. Measured is the trapezoidal rule for the
    rate against the change of the law.

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
    # over a few steps, everything is straight or steep
    x = law(np.linspace(start, max(end, start + 256 * step), _GRID))[0]
    size = float(np.ptp(x - np.linspace(x[0], x[-1], _GRID)))
    if not size > 64.0 * _EPSILON * np.max(np.abs(x)):
        return None

    def trapezoid_error(middle: Array, width: float) -> Array:
        low, high = np.clip(middle - 0.5 * width, start, end), np.clip(middle + 0.5 * width, start, end)
        (x0, v0), (x1, v1) = law(low), law(high)
        lost = np.abs(x1 - x0 - 0.5 * (high - low) * (v0 + v1))
        return np.abs(np.remainder(lost + np.pi, 2.0 * np.pi) - np.pi) if angle else lost

    low, width = times[:-1], (end - start) / (_GRID - 1)
    while width > step:
        middle = low + 0.5 * width
        deviation = np.abs(law(middle)[0] - 0.5 * (law(low)[0] + law(low + width)[0]))
        curved = _most_bent(deviation, _RESOLVED * size)
        low, middle = low[curved], middle[curved]
        low, width = np.stack([low, middle], 1).ravel(), 0.5 * width
        if not len(low):
            return None
    middle = np.unique(np.add.outer(low + 0.5 * width, step * np.arange(-0.5, 0.75, 0.25)).ravel())
    lost = trapezoid_error(middle, step)
    worst = int(np.argmax(lost))
    if not lost[worst] > REPORTED * size:
        return None
    time, enough = middle[worst], step
    for _ in range(80):
        enough *= 0.5
        around = time + enough * np.arange(-2.0, 2.5, 0.5)
        left = trapezoid_error(around, enough)
        time = around[int(np.argmax(left))]
        if not np.max(left) > _RESOLVED * size:
            break
    return Steepness(float(time), float(lost[worst]), float(lost[worst]) / size, enough)
