"""Times of the recorded rows of a run that comes to its end, known before it is made."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.simulation.stepping.time_grid import time_grid


def row_times(data: Mapping[str, Any], real: str) -> Array:
    """Return the times (rows,) in s of a run.

    Parameters
    ----------
    data : the metadata of a solution of such a run
    real : its type of numbers
    """
    start, every = float(data["t_start"]), int(data["record_every"])
    grid = time_grid(start, float(data["t_end"]), float(data["settings"]["step"]), real)
    steps = np.arange(0, grid.whole + 1, every)
    if grid.whole % every and not grid.rest:
        steps = np.append(steps, grid.whole)
    times = np.asarray(start + grid.step * steps)
    return np.append(times, grid.end) if grid.rest else times
