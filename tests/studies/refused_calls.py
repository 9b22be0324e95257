"""Refused calls of studies from Python with their texts."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from eomgen.products.studies.identification import measurements
from eomgen.products.studies.tuning.result import with_settings
from eomgen.products.studies.work_precision.running import tuning_grid

REFUSED: dict[str, tuple[Callable[[], object], str]] = {
    "no times": (
        lambda: measurements.times_of("run", {"x": np.zeros(3), "y": np.zeros(3)}),
        "run: there is no column t of times in s; try: t in place of one of x, y",
    ),
    "one row": (
        lambda: measurements.times_of("run", {"t": np.zeros(1)}),
        "run: there are 1 rows, and a run has two at least; try: more data",
    ),
    "step longer than a run": (
        lambda: tuning_grid(1.0, 1.01, 0.1),
        "t_end: a step of 1.01 s does not fit into a run of 1 s; try: 10.1",
    ),
}

#: Readers of files: ending, call and exit code.
READERS: dict[str, tuple[str, Callable[[Path], object], int]] = {
    "settings": (".toml", lambda path: with_settings(path, {"method": "rk4"}, "", ""), 7),
}
