"""Runs of beams that tests share: the flying spaghetti of the examples, runs without doubts, and orders of errors."""

from __future__ import annotations

import runpy
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

import eomgen

EXAMPLES = Path(__file__).parents[2] / "examples"
spaghetti: Any = SimpleNamespace(**runpy.run_path(str(EXAMPLES / "flying_spaghetti" / "spaghetti.py")))


def slopes(errors: Any) -> Any:
    """Return the orders between errors at halved steps."""
    return np.log2(np.asarray(errors)[:-1] / np.asarray(errors)[1:])


def flown(model: eomgen.Model, t_end: float, power: int, rows: int, **options: Any) -> eomgen.Solution:
    """Return a run of steps of 2^-power s, with a row every 2^-rows s."""
    run = model.simulate(t_end, 2.0**-power, record_every=2 ** (power - rows), error_estimate=False, **options)
    assert run.success, run.message
    return run
