"""Times of jumps and kinks in formulas whose curves and comparisons have arguments linear in time, and transitions
that replace them, twice continuously differentiable.

From a jump at t_j on, the law goes from its old values, L(t), to its new ones, R(t), within a duration T:
L + (R - L) w((t - t_j)/T), w(s) = 10 s^3 - 15 s^4 + 6 s^5, whose first and second derivatives vanish at s = 0 and 1.
Between two constants that is the quintic with zero velocity and acceleration at both ends (the motion of least jerk:
Flash and Hogan, The coordination of arm movements, Journal of Neuroscience 5 (1985), 1688-1703, eq. 2).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, replace
from eomgen.base.rounding import COMPUTED
from eomgen.errors import DescriptionError
from eomgen.formula.curves import Curve, Interpolation, Outside, Pieces
from eomgen.formula.nodes import (
    NON_SMOOTH,
    ONE,
    Application,
    EntryQuantity,
    Formula,
    Number,
    Operation,
    Symbol,
    distinct_nodes,
)
from eomgen.formula.prescribed_motion import constant
from eomgen.formula.substitution import map_symbols

#: From a symbol to its number; None for a symbol that has none while a formula is looked at.
ValueOf = Callable[[Symbol], float | None]


def applications(formula: Formula) -> Sequence[Application]:
    """Return the calls of curves in a formula, with the arguments of the calls; curves in arguments of curves
    included."""
    result: list[Application] = []
    for node in distinct_nodes(formula):
        if isinstance(node, Application):
            result.append(node)
        elif isinstance(node, EntryQuantity):
            result += node.curves()
    return result


def rough_curves(formula: Formula, derivatives: int) -> dict[str, str]:
    """Return the curves in a formula with fewer continuous derivatives than ``derivatives``, by name, each with a
    clause on the first such place: "jumps at 1.5", "bends at 2". The curves of a map along an axis count as one."""
    result: dict[str, str] = {}
    for used in applications(formula):
        name = used.curve.name.partition(", line ")[0]
        name = name if not used.derivative else f"a derivative of {name}"
        for at, order in used.curve.kinks():
            if order - used.derivative < derivatives:
                result.setdefault(name, f"{'jumps' if order <= used.derivative else 'bends'} at {at:.6g}")
                break
    return result


#: Operations on two functions a t + b and c t + d of time: coefficients of the result, None if that is not linear.
_LINEAR: dict[str, Callable[[float, float, float, float], tuple[float, float] | None]] = {
    "add": lambda a, b, c, d: (a + c, b + d),
    "sub": lambda a, b, c, d: (a - c, b - d),
    "neg": lambda a, b, c, d: (-a, -b),
    "mul": lambda a, b, c, d: (a * d, b * d) if c == 0.0 else (b * c, b * d) if a == 0.0 else None,
    "div": lambda a, b, c, d: (a / d, b / d) if c == 0.0 and d != 0.0 else None,
}


def affine(formula: Formula, value_of: ValueOf) -> tuple[float, float] | None:
    """Return a and b of a formula that is a t + b; None for any other formula. ``value_of`` gives numbers of fixed
    parameters, None for other symbols, which have no numbers here."""
    if isinstance(formula, Number):
        return 0.0, formula.value
    if isinstance(formula, Symbol):
        if formula.kind == "time":
            return 1.0, 0.0
        value = value_of(formula) if formula.kind == "parameter" else None
        return None if value is None else (0.0, value)
    if not isinstance(formula, Operation) or formula.name not in _LINEAR:
        return None
    parts = [affine(argument, value_of) for argument in formula.arguments]
    known = [part for part in parts if part is not None]
    return _LINEAR[formula.name](*known[0], *known[-1]) if len(known) == len(parts) else None


@dataclass(frozen=True)
class CurveSpan:
    """The times from ``start`` to ``end`` for which a curve ``name`` has points."""

    name: str
    start: float
    end: float


def reaches(formula: Formula, value_of: ValueOf) -> Iterator[CurveSpan]:
    """Yield the time span for which each curve in a formula has points, for curves that may not be left and whose
    arguments are linear in time. ``value_of`` as of ``affine``."""
    for used in applications(formula):
        linear = affine(used.argument, value_of)
        if isinstance(used.curve, Curve) and used.curve.outside == "error" and linear is not None and linear[0] != 0.0:
            a, b = linear
            start, end = sorted(((used.curve.start - b) / a, (used.curve.end - b) / a))
            yield CurveSpan(used.curve.name, start, end)


@dataclass(frozen=True)
class Breakpoint:
    """A time at which a formula is not smooth: from ``time`` on every ``period`` if that is not 0. ``order`` is the
    lowest derivative of forces that jumps, 0 for the forces. ``blur`` is the uncertainty of the time in s, in units of
    the precision of the numbers from which the time is computed."""

    time: float
    period: float
    order: int
    blur: float


def breakpoints(formula: Formula, value_of: ValueOf, derivatives: int = 0) -> Iterator[Breakpoint]:
    """Yield the breakpoints of a formula: of curves and comparisons with arguments linear in time.

    Parameters
    ----------
    value_of : callable
        Gives numbers of fixed parameters, None for other symbols.
    derivatives : int
        How many time derivatives of the formula forces depend on: 2 for the position of the base.
    """
    for node in distinct_nodes(formula):
        if isinstance(node, Application):
            linear = affine(node.argument, value_of)
            a, b = linear or (0.0, 0.0)
            for kink, order in node.curve.kinks() if a != 0.0 else ():
                period = getattr(node.curve, "period", 0.0) / abs(a)
                lowest, blur = order - node.derivative - derivatives, (abs(kink) + abs(b)) / abs(a)
                yield Breakpoint((kink - b) / a, period, lowest, blur)
        elif isinstance(node, Operation) and node.name in NON_SMOOTH:
            first, second = (affine(argument, value_of) for argument in (*node.arguments, Number(0.0))[:2])
            if first is not None and second is not None and first[0] != second[0]:
                slope, blur = first[0] - second[0], abs(first[1]) + abs(second[1])
                order = NON_SMOOTH[node.name] - derivatives
                yield Breakpoint((second[1] - first[1]) / slope, 0.0, order, blur / abs(slope))
        elif isinstance(node, EntryQuantity):
            for used in node.curves():
                yield from breakpoints(used, value_of, derivatives)


def knots_along_a_beam(formulas: Iterable[Formula], value_of: ValueOf) -> tuple[float, ...]:
    """Return the places s between 0 and 1, in order, at which formulas of s jump or bend; ``value_of`` gives numbers of
    fixed parameters, None for other symbols."""

    def as_time(symbol: Symbol) -> Symbol:
        return Symbol("time") if symbol.kind == "place" else symbol

    places: set[float] = set()
    for formula in formulas:
        for at in breakpoints(map_symbols(formula, as_time), value_of):
            count = math.floor((1.0 - at.time) / at.period) + 1 if at.period else 1
            first = math.ceil(-at.time / at.period) if at.period else 0
            places.update(at.time + number * at.period for number in range(first, max(count, first)))
    return tuple(sorted(position for position in places if 0.0 < position < 1.0))


#: Coefficients of w, lowest power first.
_W = (0.0, 0.0, 0.0, 10.0, -15.0, 6.0)


class SmoothingError(DescriptionError):
    """A jump that cannot be smoothed."""


@cache
def _smooth_step() -> Pieces:
    ends = np.array([0.0, 1.0])
    return _transitions("smooth step", ends, ends, "quintic", "hold", np.array([_W]))


def _transitions(
    name: str, x: Array, y: Array, interpolation: Interpolation, outside: Outside, polynomials: Array
) -> Pieces:
    """Return a curve by polynomials whose third derivative jumps at the breaks."""
    corners = tuple((float(knot), 3) for knot in (x[:-1] if outside == "periodic" else x))
    return Pieces(name, x, y, interpolation, outside, polynomials=polynomials, corners=corners)


def smooth_law(formula: Formula, duration: float, value_of: ValueOf) -> Formula:
    """Return a formula of time in which neither value nor rate jumps: each jump and kink is replaced by a transition
    that is twice continuously differentiable.

    Parameters
    ----------
    duration : of every transition, s
    value_of : gives numbers of fixed parameters, None for other symbols

    Raises
    ------
    SmoothingError
        A jump at a time that is not known beforehand, or points of a curve that are nearer than the duration.
    """
    if not isinstance(formula, Operation | Application):
        return formula
    if isinstance(formula, Application):
        return _curve(formula, duration, value_of)
    if formula.name in NON_SMOOTH and not (formula.name == "max" and is_condition(formula)):
        return _switch(formula, duration, value_of)
    parts = [smooth_law(argument, duration, value_of) for argument in formula.arguments]
    if formula.name == "max":  # one condition or another
        return ONE - (ONE - parts[0]) * (ONE - parts[1])
    if formula.name == "select":
        condition, then, otherwise = parts
        return otherwise + (then - otherwise) * condition
    return replace(formula, arguments=tuple(parts))


def is_condition(formula: Formula) -> bool:
    """Return whether a formula is 1 or 0: comparisons joined by ``and``, ``or`` and ``not``."""
    if not isinstance(formula, Operation):
        return formula == ONE
    joined = formula.name in ("mul", "max", "sub") and all(map(is_condition, formula.arguments))
    return joined or formula.name in ("lt", "le")


def _switch(formula: Operation, duration: float, value_of: ValueOf) -> Formula:
    """Return an operation such as abs, min or a comparison with a transition in place of the jump or kink; the
    operation unchanged if constant over time. The operation is decided by the sign of the argument, or of the
    difference of both arguments, which has to be linear in time; else SmoothingError is raised."""
    if constant(formula):
        return formula
    first, second = (*formula.arguments, Number(0.0))[:2]
    lines = affine(first, value_of), affine(second, value_of)
    if lines[0] is None or lines[1] is None:
        name = "a comparison" if formula.name in ("lt", "le") else f"{formula.name}()"
        raise _unknown_times(f"{name} of something else than a straight line in t")
    slope, offset = (a - b for a, b in zip(lines[0], lines[1], strict=True))
    if slope == 0.0:
        return formula
    # for positive x: after the crossing, or before the crossing
    step: Formula = Application(_smooth_step(), (Symbol("time") - -offset / slope) / Number(duration))
    positive = step if slope > 0.0 else ONE - step
    match formula.name:
        case "lt" | "le":
            return ONE - positive
        case "sign":
            return positive * 2.0 - 1.0
        case "abs":
            return first * (positive * 2.0 - 1.0)
        case "min":
            return first + (second - first) * positive
        case _:
            return second + (first - second) * positive


def _unknown_times(jumping: str) -> SmoothingError:
    fault = f"the times are not known beforehand at which {jumping} jumps [E0289]"
    remedy = 'a curve of t with interpolation = "linear", or comparisons, sign, abs, min and max of a t + b'
    return SmoothingError(fault, remedy)


def _curve(used: Application, duration: float, value_of: ValueOf) -> Formula:
    """Return a curve at an argument, with transitions of ``duration``, s, in place of jumps and kinks of the curve.
    Raises SmoothingError for a rough curve whose argument is not linear in time, and for derivatives of such curves."""
    curve = used.curve
    rough = [position for position, order in curve.kinks() if order - used.derivative < 2]
    if not rough or not isinstance(curve, Curve) or isinstance(curve, Pieces):
        return Application(curve, smooth_law(used.argument, duration, value_of), used.derivative)
    line = affine(used.argument, value_of)
    if line is None or line[0] == 0.0:
        raise _unknown_times(curve.name)
    if used.derivative:
        fault = f"a derivative of {curve.name} jumps, which cannot be smoothed by itself [E0290]"
        raise SmoothingError(fault, f'interpolation = "quintic" of {curve.name}')
    length = abs(line[0]) * duration
    return Application(_with_transitions(curve, rough, length, line[0] > 0.0), used.argument)


def _with_transitions(curve: Curve, rough: list[float], length: float, forward: bool) -> Curve:
    """Return a curve of steps or lines with transitions after each place x in ``rough``, or before each place if not
    ``forward``, as for a curve that is run backwards. ``length`` is the length of a transition in x. Raises
    SmoothingError for places that are nearer."""
    places = np.array(rough)
    periodic, held = curve.outside == "periodic", curve.outside == "hold"
    gaps = np.diff(np.append(places, places[0] + curve.period) if periodic else places)
    last = math.inf if held else (curve.end - places[-1] if forward else places[0] - curve.start)
    nearest = min(gaps.min(initial=math.inf), math.inf if periodic else last)
    if length > nearest * (1.0 + COMPUTED):
        fault = (
            f"corners of {curve.name} have a distance of {nearest:.6g}, less than a transition, {length:.6g} [E0291]"
        )
        raise SmoothingError(fault, "a shorter duration, or other points")
    begins = places if forward else places - length
    ends = begins + length
    if periodic:  # one period from a transition on, so that none reaches into the next
        low, high = begins[0], begins[0] + curve.period
        inner = low + np.remainder(np.concatenate([curve.breaks, begins, ends]) - low, curve.period)
    else:
        low, high = (min(curve.start, begins[0]), max(curve.end, ends[-1])) if held else (curve.start, curve.end)
        inner = np.concatenate([curve.breaks, begins, ends])
    breaks = np.unique(np.concatenate([[low, high], inner[(inner > low) & (inner < high)]]))
    narrow = COMPUTED * length
    kept = np.append(True, np.diff(breaks) > narrow)
    kept[-1] = True
    kept[:-1] &= np.append(True, breaks[-1] - breaks[1:-1] > narrow)
    breaks = breaks[kept]
    edges = [] if periodic or held else [places[0] - curve.start, curve.end - places[-1]]
    aside = 0.25 * min(length, gaps.min(initial=math.inf), *edges)
    rows: list[Array] = []
    for start, end in itertools.pairwise(breaks.tolist()):
        middle = 0.5 * (start + end)
        inside = np.flatnonzero((begins < middle) & (middle < ends))
        if not len(inside):
            rows.append(_line(curve, middle, start))
            continue
        begin, kink = begins[inside[0]], places[inside[0]]
        before, after = (kink - aside, kink + aside)
        left, right = _line(curve, before, start), _line(curve, after, start)
        w = _shifted_step((start - begin) / length, length)
        change = np.convolve(right - left, w)
        rows.append(np.append(left, np.zeros(len(change) - 2)) + change)
    size = max(map(len, rows))
    pieces = np.array([np.append(row, np.zeros(size - len(row))) for row in rows])
    values = np.append(pieces[:, 0], np.polynomial.polynomial.polyval(breaks[-1] - breaks[-2], pieces[-1]))
    return _transitions(f"{curve.name} smoothed", breaks, values, curve.interpolation, curve.outside, pieces)


def _line(curve: Curve, at: float, start: float) -> Array:
    """Return the line that a curve follows at a place, as coefficients (2,) in powers of x - start."""
    slope = float(curve(at, 1))
    return np.array([float(curve(at)) + slope * (start - at), slope])


def _shifted_step(share: float, length: float) -> Array:
    """Return the coefficients of w(share + x/length) in powers of x."""
    moved = np.polynomial.Polynomial(_W)(np.polynomial.Polynomial([share, 1.0 / length]))
    return np.asarray(moved.coef, dtype=float)
