"""Times of jumps and kinks, found in formulas whose curves and comparisons have arguments linear in time."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from eomgen.base.data import dataclass
from eomgen.formula.curves import Curve
from eomgen.formula.nodes import Application, Formula, Number, Operation, Symbol


def applications(formula: Formula) -> Sequence[Application]:
    """Return the calls of curves in a formula, with their arguments; curves in arguments of curves included."""
    if isinstance(formula, Application):
        return [formula, *applications(formula.argument)]
    if isinstance(formula, Operation):
        return [node for argument in formula.arguments for node in applications(argument)]
    return []


def affine(formula: Formula, value_of: Callable[[Symbol], float | None]) -> tuple[float, float] | None:
    """Return a, b of a formula a t + b; ``value_of`` gives numbers of fixed parameters, None for others."""
    if isinstance(formula, Number):
        return 0.0, formula.value
    if isinstance(formula, Symbol):
        if formula.kind == "time":
            return 1.0, 0.0
        value = value_of(formula) if formula.kind == "parameter" else None
        return None if value is None else (0.0, value)
    if not isinstance(formula, Operation) or formula.name not in ("add", "sub", "mul", "div", "neg"):
        return None
    parts = [affine(argument, value_of) for argument in formula.arguments]
    if any(part is None for part in parts):
        return None
    known = [part for part in parts if part is not None]
    (a, b), (c, d) = known[0], known[-1]
    match formula.name:
        case "add":
            return a + c, b + d
        case "sub":
            return a - c, b - d
        case "neg":
            return -a, -b
        case "mul":
            return (a * d, b * d) if c == 0.0 else (b * c, b * d) if a == 0.0 else None
        case _:
            return (a / d, b / d) if c == 0.0 and d != 0.0 else None


@dataclass(frozen=True)
class Reach:
    """The times from ``start`` to ``end`` for which a curve ``name`` has points."""

    name: str
    start: float
    end: float


def reaches(formula: Formula, value_of: Callable[[Symbol], float | None]) -> Iterator[Reach]:
    """Yield how far the curves of a formula reach that are not to be left, those whose arguments are linear in time."""
    for used in applications(formula):
        linear = affine(used.argument, value_of)
        if isinstance(used.curve, Curve) and used.curve.outside == "error" and linear is not None and linear[0] != 0.0:
            a, b = linear
            start, end = sorted(((used.curve.start - b) / a, (used.curve.end - b) / a))
            yield Reach(used.curve.name, start, end)


@dataclass(frozen=True)
class Breakpoint:
    """A time at which something is not smooth: from ``time`` on every ``period`` if that is not 0.

    ``order`` is the lowest derivative of forces that jumps, 0 for forces themselves. ``blur`` is the uncertainty of
    the time in s, in units of the precision of its numbers.
    """

    time: float
    period: float
    order: int
    blur: float


def breakpoints(
    formula: Formula, value_of: Callable[[Symbol], float | None], derivatives: int = 0
) -> Iterator[Breakpoint]:
    """Yield the breakpoints of a formula: of curves and comparisons with arguments linear in time.

    Parameters
    ----------
    derivatives : int
        How many time derivatives of the formula forces depend on: 2 for the position of the base.
    """
    if isinstance(formula, Application):
        linear = affine(formula.argument, value_of)
        if linear is not None and linear[0] != 0.0:
            a, b = linear
            for kink, order in formula.curve.kinks():
                period = getattr(formula.curve, "period", 0.0) / abs(a)
                lowest, blur = order - formula.derivative - derivatives, (abs(kink) + abs(b)) / abs(a)
                yield Breakpoint((kink - b) / a, period, lowest, blur)
        yield from breakpoints(formula.argument, value_of, derivatives)
    elif isinstance(formula, Operation):
        if formula.name in _NON_SMOOTH:
            pair = [affine(argument, value_of) for argument in (*formula.arguments, Number(0.0))[:2]]
            yield from _crossing(pair, _NON_SMOOTH[formula.name] - derivatives)
        for argument in formula.arguments:
            yield from breakpoints(argument, value_of, derivatives)


#: Functions that are not smooth at an argument of 0, or at two equal arguments, and the order of their jump.
_NON_SMOOTH = {"lt": 0, "le": 0, "sign": 0, "abs": 1, "min": 1, "max": 1}


def _crossing(pair: Sequence[tuple[float, float] | None], order: int) -> Iterator[Breakpoint]:
    first, second = pair
    if first is not None and second is not None and first[0] != second[0]:
        slope = first[0] - second[0]
        yield Breakpoint((second[1] - first[1]) / slope, 0.0, order, (abs(first[1]) + abs(second[1])) / abs(slope))
