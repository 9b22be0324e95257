"""The time grid of a run: equal steps and a shorter last step if needed, limits in floating point, times of recorded
rows, and cuts of steps at jumps and samples."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.compiled.prescribed import jumps_per_second
from eomgen.errors import Problem, UsageError

#: Least ratio of a step to the spacing of floating-point numbers at the times of the run, so that rounding of time
#: stays small.
FINEST = 16.0
#: A span counts as a whole number of steps if the difference is at most this part of a step.
WHOLE = 1e-9
#: Jumps of forces within one step at most: each ends a part of the step, and a call of compiled code hears no Ctrl-C.
MOST_JUMPS = 10_000


@dataclass(frozen=True)
class TimeGrid:
    """Steps of equal size, and a shorter last step if the span is not a multiple of the step.

    Attributes
    ----------
    start, end, step : float
        In s. ``end`` is the requested end.
    whole : int
        Steps of full size.
    rest : float
        Size of a shorter last step in s; 0.0 if there is none.
    """

    start: float
    end: float
    step: float
    whole: int
    rest: float

    @property
    def steps(self) -> int:
        """How many steps there are."""
        return self.whole + (self.rest > 0.0)

    @property
    def reached(self) -> float:
        """Time of the last state, s: the end, but for rounding of a sum of whole steps."""
        return self.end if self.rest else self.start + self.step * self.whole


def check_resolution(step: float, t: float, real: str) -> float:
    """Return the distance, s, between the time t and the next floating-point number; `real` is ``double`` or ``float``.
    Raises UsageError if a step > 0 is shorter than 16 times that distance."""
    distance = float(np.spacing(np.float32(abs(t)))) if real == "float" else math.ulp(t)
    if 0.0 < step < FINEST * distance:
        apart = f"at t = {t:.9g} s neighbouring numbers differ by {distance:.3g} s"
        fault = f"{apart}, too much for a step of {step:.3g} s [E2052]"
        shifted = "times nearer to 0, with formulas of time shifted by as much"
        raise UsageError(Problem("step", fault, f"a step of {FINEST * distance:.2g} s or more, or {shifted}"))
    return distance


def time_grid(start: float, end: float, step: float, real: str = "double") -> TimeGrid:
    """Return the grid of a run from start to end in equal steps, all in s, with a shorter last step if needed.

    Parameters
    ----------
    real : str
        Number type of the stepper, ``double`` or ``float``.

    Raises
    ------
    UsageError
        An end before the start; too many steps; steps too short for time to move on evenly.
    """
    if end < start:
        fault = f"the end {end:.9g} s lies before the start {start:.9g} s [E0274]"
        raise UsageError(Problem("t_end", fault, "a later t_end"))
    count = (end - start) / step
    if count > 1e15:
        fault = f"{end - start:.3g} s in steps of {step:.3g} s are {count:.3g} steps [E2078]"
        raise UsageError(Problem("step", fault, "a larger step"))
    latest = start if abs(start) > abs(end) else end
    apart = check_resolution(min(step, end - start), latest, real)
    whole = round(count)
    rest = end - (start + step * whole)
    if whole and abs(rest) <= max(WHOLE * max(1.0, count) * step, 2.0 * apart):
        return TimeGrid(start, end, step, whole, 0.0)
    if rest < 0.0:
        whole -= 1
        rest = end - (start + step * whole)
    return TimeGrid(start, end, step, whole, rest)


def check_jumps(method: Mapping[str, Any], step: float) -> None:
    """Raise UsageError if forces jump too often within a step of a run, for a stepper that ends parts of steps
    there.

    Parameters
    ----------
    method : layout of the method
    step : s
    """
    waves = _waves(method)
    count = step * jumps_per_second(waves)
    if count > MOST_JUMPS:
        shortest, rarer = min(period for _, period in waves), "a larger record_every, or a longer period of the wave"
        fault = f"forces jump {count:.3g} times within a step of {step:.3g} s, in waves of {shortest:.3g} s [E2079]"
        hint = f"a step of {step * MOST_JUMPS / count:.2g} s or less with {rarer}"
        raise UsageError(Problem("step", fault, hint))


def _waves(method: Mapping[str, Any]) -> list[tuple[float, float]]:
    """Return first time and period, s, of the jumps of forces and of samples that repeat."""
    jumps, clocks = method.get("jumps", {}).get("periodic", ()), method.get("samples", {}).get("clocks", ())
    return [
        *((float(time), float(period)) for time, period in jumps),
        *((float(offset), float(period)) for period, offset in clocks),
    ]


#: Parts that sums are made of at most; of longer runs the beginning stands for all.
_MOST = 1_000_000


@dataclass(frozen=True)
class StepParts:
    """Parts of the steps of a run and of its comparison runs.

    Parameters
    ----------
    ends : (n,) s, times in order at which steps of any size end
    start, end : s, of the compared part of the run
    order : of the method
    """

    ends: Array
    start: float
    end: float
    order: float

    def ratio(self, step: float, larger: float, times: Array) -> Array:
        """Return at times (n,), s, the effective ratio of steps, (error with steps ``larger`` / error with steps
        ``step``)^(1/order); other/step without jumps, 1 if both runs have the same parts."""
        if not len(self.ends):
            return np.full(len(times), larger / step)
        last = min(self.end, self.start + _MOST * min(step, larger))
        places = np.clip(times, min(self.start + step, last), last)
        errors, others = (np.interp(places, *self._errors(h, last)) for h in (step, larger))
        result: Array = (others / errors) ** (1.0 / self.order)
        return result

    def tell(self, step: float, larger: float) -> bool:
        """Return whether a run in steps of ``step`` and one in longer steps ``larger``, s, differ enough for an error
        estimate. The ratio of their errors has to be clear in all windows of the run with a considerable error."""
        if not len(self.ends):
            return True
        last = min(self.end, self.start + _MOST * min(step, larger))
        windows = np.linspace(self.start, last, 32 + 1)[1:]
        errors = np.interp(windows, *self._errors(step, last))
        # before there is a considerable error, windows need not differ
        there = errors > 0.01 * errors[-1]
        return bool(np.all(self.ratio(step, larger, windows)[there] ** self.order >= 1.5))

    def longest(self, step: float) -> float:
        """Return the longest part of steps of a length, s."""
        if not len(self.ends):
            return step
        return min(step, float(np.diff(self.ends, prepend=self.start, append=self.end).max()))

    def count(self, step: float) -> float:
        """Return the number of parts in steps of a length."""
        return (self.end - self.start) / step + len(self.ends)

    def _errors(self, step: float, last: float) -> tuple[Array, Array]:
        """Return the ends, s, of the parts into which jumps cut steps of a size up to a time, and at each end the
        cumulative sum of the parts' lengths to the power p + 1, relative to the compared time end - start."""
        grid = self.start + step * np.arange(math.ceil((last - self.start) / step * (1.0 - 1e-12)) + 1)
        edges = np.unique(np.concatenate([grid, self.ends[self.ends < last]]))
        lengths = np.diff(edges) / (self.end - self.start)
        return edges, np.append(0.0, np.cumsum(lengths ** (self.order + 1.0)))


def step_parts(method: Mapping[str, Any], start: float, end: float, order: float, changes: Array) -> StepParts:
    """Return the parts of steps from start to end, s: steps end at jumps of forces, samples and events.

    Parameters
    ----------
    method : layout of the method, with the times and periods of jumps and samples
    order : of the method
    changes : (n,) s, times of events that change the motion
    """
    waves = _waves(method)
    last = min(end, start + _MOST * min((period for _, period in waves), default=math.inf))
    times = [np.array(method.get("jumps", {}).get("once", ()), dtype=float), changes]
    if not waves and not any(map(len, times)):
        return StepParts(np.zeros(0), start, last, order)
    for time, period in waves:
        times.append(time + period * np.arange(math.ceil((start - time) / period), (last - time) / period))
    ends = np.unique(np.concatenate(times))
    near = 1e-9 * (end - start)
    return StepParts(ends[(ends > start + near) & (ends < last - near)], start, last, order)


def row_times(data: Mapping[str, Any], real: str) -> Array:
    """Return the times (rows,) in s of all rows that a complete run records.

    Parameters
    ----------
    data : the metadata of a solution of such a run
    real : number type of the run, ``double`` or ``float``
    """
    start, every = float(data["t_start"]), int(data["record_every"])
    grid = time_grid(start, float(data["t_end"]), float(data["settings"]["step"]), real)
    steps = np.arange(0, grid.whole + 1, every)
    if grid.whole % every and not grid.rest:
        steps = np.append(steps, grid.whole)
    times = np.asarray(start + grid.step * steps)
    return np.append(times, grid.end) if grid.rest else times
