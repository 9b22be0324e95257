"""The time grid of a run: equal steps, a shorter last one if needed, and its limits in floating point."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from eomgen.compiled.prescribed import jumps_per_second
from eomgen.errors import Problem, UsageError

#: Steps have to be so many times as long as neighbouring numbers at their times are apart: rounding of time stays small
#: in them.
FINEST = 16.0
#: A span that is so many parts of its steps off a whole number of steps is taken for whole.
WHOLE = 1e-9
#: Jumps of forces within one step at most: each ends a part of the step, and a call of compiled code hears no Ctrl-C.
MOST_JUMPS = 10_000


@dataclass(frozen=True)
class TimeGrid:
    """Steps of equal size, and a shorter one if they do not lead to the end.

    Attributes
    ----------
    start, end, step : float
        In s. The end is the one that was asked for.
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


def time_grid(start: float, end: float, step: float, real: str = "double") -> TimeGrid:
    """Return the grid of a run from start to end in steps, all in s.

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
        raise UsageError(Problem("t_end", f"the end {end:.9g} s lies before the start {start:.9g} s", "a later t_end"))
    count = (end - start) / step
    if count > 1e15:
        raise UsageError(
            Problem("step", f"{end - start:.3g} s in steps of {step:.3g} s are {count:.3g} steps", "a larger step")
        )
    latest = start if abs(start) > abs(end) else end
    apart = float(np.spacing(np.float32(abs(latest)))) if real == "float" else math.ulp(latest)
    shortest = min(step, end - start)
    if 0.0 < shortest < FINEST * apart:
        fault = (
            f"at t = {latest:.9g} s neighbouring numbers are {apart:.3g} s apart, too far for a step of"
            f" {shortest:.3g} s"
        )
        hint = (
            f"a step of {FINEST * apart:.2g} s or more, or times nearer to 0, with formulas of time shifted by as much"
        )
        raise UsageError(Problem("step", fault, hint))
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
    waves = [(float(time), float(period)) for time, period in method.get("jumps", {}).get("periodic", ())]
    waves += [(float(offset), float(period)) for period, offset in method.get("samples", {}).get("clocks", ())]
    count = step * jumps_per_second(waves)
    if count > MOST_JUMPS:
        fault = (
            f"forces jump {count:.3g} times within a step of {step:.3g} s, in waves of {min(p for _, p in waves):.3g} s"
        )
        hint = (
            f"a step of {step * MOST_JUMPS / count:.2g} s or less with a larger record_every, or a longer period of the"
            " wave"
        )
        raise UsageError(Problem("step", fault, hint))
