"""Parts of steps: steps of any size end at jumps of forces and at samples.

A part of length h adds an error as h^(p + 1), p the order of the method. The sum of these over the parts of two runs
shows by how much their errors differ; if both take the same parts they are the same run, and give no estimate.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from eomgen.base.arrays import Array

#: Parts that sums are made of at most; of longer runs the beginning stands for all.
_MOST = 1_000_000
#: Ratio of errors from which on two runs are different ones: 2 for a method of first order at half the step.
_TOLD = 1.5
#: Windows of a run in each of which it has to be so, but for those before which hardly any error arises.
_WINDOWS, _HARDLY = 32, 0.01


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

    def ratio(self, step: float, other: float, times: Array) -> Array:
        """Return the ratio of the errors up to times (n,) of a run in steps of ``other`` to the errors of a run in
        steps of ``step``, all in s; as a ratio of steps, 1 if both take the same parts."""
        if not len(self.ends):
            return np.full(len(times), other / step)
        last = min(self.end, self.start + _MOST * min(step, other))
        places = np.clip(times, min(self.start + step, last), last)
        own, others = (np.interp(places, *self._errors(one, last)) for one in (step, other))
        result: Array = (others / own) ** (1.0 / self.order)
        return result

    def tell(self, step: float, other: float) -> bool:
        """Return whether runs in steps of ``step`` and of ``other``, the longer one, tell an error all over the run."""
        if not len(self.ends):
            return True
        last = min(self.end, self.start + _MOST * min(step, other))
        windows = np.linspace(self.start, last, _WINDOWS + 1)[1:]
        own = np.interp(windows, *self._errors(step, last))
        there = own > _HARDLY * own[-1]
        return bool(np.all(self.ratio(step, other, windows)[there] ** self.order >= _TOLD))

    def longest(self, step: float) -> float:
        """Return the longest part of steps of a length, s."""
        if not len(self.ends):
            return step
        return min(step, float(np.diff(self.ends, prepend=self.start, append=self.end).max()))

    def count(self, step: float) -> float:
        """Return the number of parts in steps of a length."""
        return (self.end - self.start) / step + len(self.ends)

    def _errors(self, step: float, last: float) -> tuple[Array, Array]:
        """Return the ends of parts up to a time, and there the sum of the (p + 1)-th powers of their lengths in
        steps."""
        grid = self.start + step * np.arange(math.ceil((last - self.start) / step * (1.0 - 1e-12)) + 1)
        edges = np.unique(np.concatenate([grid, self.ends[self.ends < last]]))
        lengths = np.diff(edges) / (self.end - self.start)
        return edges, np.append(0.0, np.cumsum(lengths ** (self.order + 1.0)))


def step_parts(method: Mapping[str, Any], start: float, end: float, order: float, changes: Array) -> StepParts:
    """Return the parts of steps from start to end, s.

    Parameters
    ----------
    method : layout of the method
    changes : (n,) s, times of events that change the motion
    """
    jumps, clocks = method.get("jumps", {}), method.get("samples", {}).get("clocks", ())
    waves = [(float(time), float(period)) for time, period in jumps.get("periodic", ())]
    waves += [(float(offset), float(period)) for period, offset in clocks]
    last = min(end, start + _MOST * min((period for _, period in waves), default=math.inf))
    times = [np.array(jumps.get("once", ()), dtype=float), changes]
    if not waves and not any(map(len, times)):
        return StepParts(np.zeros(0), start, last, order)
    for time, period in waves:
        times.append(time + period * np.arange(math.ceil((start - time) / period), (last - time) / period))
    ends = np.unique(np.concatenate(times))
    near = 1e-9 * (end - start)
    return StepParts(ends[(ends > start + near) & (ends < last - near)], start, last, order)
