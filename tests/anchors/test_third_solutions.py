"""Where a third solution shows another program off, the equations of that program give its figures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tests.anchors.runs import runs
from tests.anchors.thirds.modelica_models import bevel_gear

Array = NDArray[np.float64]


def _apart(carried: float) -> float:
    run = runs()["modelica_bevel_gear"]
    motion = bevel_gear(carried)(np.asarray(run.at))
    figures = {name: np.reshape(signal.digits, (len(run.at), -1)) for name, signal in run.signals.items()}
    return max(float(np.abs(figures[name] - motion[name]).max() / np.abs(figures[name]).max()) for name in figures)


def test_dymolas_bevel_gear_is_the_one_whose_rotors_do_not_turn_with_their_carrier() -> None:
    assert _apart(carried=0.0) < 2e-5
    assert _apart(carried=1.0) > 0.5
