"""Samples fail by numbers that are not finite at the end of their run, and by no others."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from eomgen.products.ensembles import samples
from eomgen.products.ensembles.designs import Design
from eomgen.products.ensembles.samples import EXTREMES, SampleRunner
from eomgen.products.ensembles.side_by_side import CommonRunData
from eomgen.products.ensembles.variations import VariedOptions

TIMES = np.linspace(0.0, 1.0, 6)


@pytest.mark.parametrize("row", range(len(TIMES)))
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_only_the_last_row_ends_a_sample(monkeypatch: pytest.MonkeyPatch, row: int, value: float) -> None:
    first, second = np.sin(TIMES), np.cos(TIMES)
    second[row] = value
    solution = SimpleNamespace(success=True, t=TIMES, columns=lambda: {"x": first, "y": second, "z": first})
    monkeypatch.setattr(samples, "simulate", lambda *arguments, **options: solution)
    options: Any = SimpleNamespace(of=lambda values: {})
    model: Any = SimpleNamespace(library=SimpleNamespace(layout={"method": {}}))
    every = SampleRunner(
        model,
        cast(Design, None),
        cast(VariedOptions, options),
        (0.0, 1.0),
        ["x", "y"],
        TIMES,
        np.array([0, 2, 5]),
        cast(CommonRunData, None),
    )
    rows, extremes = np.full((2, 3), np.nan), np.full((2, len(EXTREMES)), np.nan)
    with np.errstate(invalid="ignore"):
        reason = every._one(0, np.zeros(1), rows, extremes)
    assert reason == ("y is not finite at the end" if row == len(TIMES) - 1 else "")
    if not reason:
        assert np.array_equal(rows, [first[[0, 2, 5]], second[[0, 2, 5]]], equal_nan=True)
