"""Calls of linear from Python at the border of what is taken; refused ones are in ``test_meant_calls``."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from eomgen.control import Regulator
from eomgen.products.linear.augmentation import delay, delay_line
from eomgen.products.linear.control.riccati_equation import without_cross_terms
from eomgen.products.linear.spectra import MeasuredRoad
from tests.failures.mistakes import arm

ACCEPTED: Sequence[Callable[[], object]] = (
    lambda: delay_line("u", "y", np.int64(1), 0.1),
    lambda: delay("u", "y", 0.1, np.int64(2)),
    lambda: MeasuredRoad.of_profile(np.arange(64.0), np.zeros(64), segments=np.int64(1)),
    lambda: without_cross_terms(np.eye(2), np.array([[1.0], [0.0]])),
    lambda: MeasuredRoad(frequencies=np.array([1.0, 2.0]), density=np.array([1.0, 0.0])),
)


def objects_with_names() -> list[object]:
    """Return objects whose attributes have other names elsewhere."""
    model = arm().linearize()
    space = model.state_space()
    return [model, model.modes(), space, Regulator(space, np.zeros((len(space.inputs), len(space.states))))]
