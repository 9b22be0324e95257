"""The coupled FMUs of the example: errors of order 1 with held inputs and of order 2 with linear ones."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

DEMO = Path(__file__).parents[2] / "examples" / "coupled_fmus" / "demo.py"


def demo() -> ModuleType:
    spec = importlib.util.spec_from_file_location("coupled_fmus_demo", DEMO)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.long
@pytest.mark.slow
def test_coupling_errors_have_the_orders_of_the_inputs() -> None:
    rows = np.array(demo().errors())
    slopes = np.diff(np.log(rows[:, 1:]), axis=0) / np.diff(np.log(rows[:, :1]), axis=0)
    assert np.all(np.abs(slopes[-2:] - [1.0, 2.0]) < 0.1)
    assert rows[-1, 1] < 3e-3 and rows[-1, 2] < 4e-5
