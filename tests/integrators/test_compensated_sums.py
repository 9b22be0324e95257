"""Increments are summed with compensation: many steps do not add up their rounding.

Single precision is the reduced problem: a million steps of 1e-4 add increments that are 1e-4 of numbers with 7 digits,
as steps of 1e-13 would with 16.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.integrators.stepper_models import PROGRAMS
from tests.integrators.test_rosenbrock import oscillator
from tests.models.c_programs import printed, program

MAIN = (PROGRAMS / "compensated_sums.c").read_text(encoding="utf-8")
#: The step, 2^-13, is exact in single precision.
END, STEPS = 128.0, 2**20


@pytest.mark.long_except("rosenbrock")
@pytest.mark.parametrize("method", ["rosenbrock", "lsrt2", "corrected_predictor"])
def test_a_million_short_steps_do_not_drift(method: str, tmp_path: Path) -> None:
    made = program(tmp_path, oscillator(1.0, 0.0), method, MAIN, flags=("-DEOMGEN_REAL_FLOAT",))
    exact = np.array([np.cos(END), -np.sin(END)])

    def error(forget: int) -> float:
        return float(np.abs(printed(made, END, STEPS, forget)[0] - exact).max())

    kept, forgotten = error(0), error(1)
    assert kept < 3e-7
    assert forgotten > 50.0 * kept
