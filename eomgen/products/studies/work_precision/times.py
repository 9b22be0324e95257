"""Times at which the runs of a study are compared, and the steps that lie between them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction

from eomgen.errors import Problem, UsageError
from eomgen.products.studies.work_precision.running import Grid

#: The coarsest step fits so many times into the run at least, if the scene's step allows it.
LEAST_ROWS = 50
#: The reference is known at so many times at least, and at no more than this.
LEAST_TIMES, MOST_TIMES = 4_000, 20_000
#: The coarsest step is so many doublings above the scene's at most.
MOST_DOUBLINGS = 6
#: Steps in the coarsest if none are given: 1 to this, by doubling.
FINEST = 2**12
#: How far a given step may be from a whole part of the coarsest.
_ROUNDING = 1e-9


def ladder_grid(start: float, end: float, step: float, interval: float, steps: Sequence[float]) -> Grid:
    """Return the grid of runs with a ladder of steps, all of which end together: with the last whole coarsest step
    before ``end``.

    Parameters
    ----------
    step, interval : the scene's, and between two rows that its runs record, s
    steps : those asked for, if any, s

    Raises
    ------
    UsageError
        The run is shorter than one step.
    """
    if steps:
        row = max(steps)
    else:
        doublings = math.floor(math.log2(max((end - start) / (LEAST_ROWS * step), 1.0)))
        row = step * 2.0 ** min(doublings, MOST_DOUBLINGS)
    rows = math.floor((end - start) / row * (1.0 + 1e-12) + 1e-9)
    if rows < 1:
        fault = f"the coarsest step, {row:.4g} s, does not fit into a run of {end - start:.4g} s"
        raise UsageError(Problem("steps", fault, "smaller steps, or a later end"))
    coarse = Grid(row, rows, start)
    parts = 1
    for count in per_coarsest(coarse, steps):
        both = math.lcm(parts, count)
        if both * rows > MOST_TIMES:
            continue
        if steps or parts * rows < LEAST_TIMES or row / parts > interval * (1.0 + _ROUNDING):
            parts = both
    while parts * rows < LEAST_TIMES:
        parts *= 2
    recorded = min(parts, max(1, round(interval * parts / row)))
    return Grid(row / parts, rows * parts, start, parts, recorded)


def tuning_grid(end: float, step: float, interval: float) -> Grid:
    """Return the grid of runs with any step: all rows that the scene's runs record are among its times, if these are
    not too many.

    Raises
    ------
    UsageError
        The run is shorter than one step.
    """
    if end < step * (1.0 - _ROUNDING):
        fault = f"a step of {step:.4g} s does not fit into a run of {end:.4g} s"
        raise UsageError(Problem("t_end", fault, f"{10.0 * step:.4g}"))
    row = min(interval, end)
    while end / row < LEAST_TIMES:
        row /= 2.0
    while end / row > MOST_TIMES * (1.0 + _ROUNDING):
        row *= 2.0
    rows = math.floor(end / row + 1e-9)
    coarsest = max(1, min(rows // LEAST_ROWS, math.floor(step * 2.0**MOST_DOUBLINGS / row + _ROUNDING)))
    return Grid(row, rows, 0.0, coarsest, max(1, round(min(interval, end) / row)))


def whole_steps(resolution: float, coarsest: int = 1) -> float:
    """Return the next number of steps in a row of the grid, not below ``resolution``, whose rows are all on the grid: a
    whole number, or one step in a whole number of rows."""
    if resolution > 1.0:
        return float(math.ceil(resolution * (1.0 - _ROUNDING)))
    return 1.0 / max(1, min(coarsest, math.floor(1.0 / resolution * (1.0 + _ROUNDING))))


def fraction_of(resolution: float) -> Fraction:
    """Return steps in a row of the grid, as ``Runner.run`` takes them."""
    return Fraction(round(resolution)) if resolution > 1.0 else Fraction(1, round(1.0 / resolution))


def per_coarsest(coarse: Grid, steps: Sequence[float]) -> tuple[int, ...]:
    """Return the numbers of steps in the coarsest step of this grid, coarsest first. Raises UsageError for steps
    that do not divide it."""
    if not steps:
        return tuple(2**k for k in range(int(math.log2(FINEST)) + 1))
    result = []
    for step in sorted(set(steps), reverse=True):
        count = round(coarse.row / step)
        if abs(coarse.row / step - count) > _ROUNDING * count:
            fault = f"the step {step:.6g} s is no whole part of the coarsest, {coarse.row:.6g} s"
            hint = f"{coarse.row / math.ceil(coarse.row / step):.6g}, or steps each half of the one before"
            raise UsageError(Problem("steps", fault, hint))
        result.append(count)
    return tuple(result)
