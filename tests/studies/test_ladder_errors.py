"""Errors of the cells of ``extremes``: internal states count, and motion that is rounding beside the rest does not."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

import eomgen
from eomgen.products.studies.ladders.study import difference
from eomgen.products.studies.ladders.subject import Subject


def subject(model: eomgen.Model) -> Subject:
    return cast("Subject", SimpleNamespace(model=lambda name: model, extent=1.0))


@pytest.mark.slow_cases("1e-13")
@pytest.mark.parametrize("turned", [1e-13, 1e-11, 1e-9])
def test_a_rotation_that_is_rounding_is_measured_by_what_moves(turned: float) -> None:
    builder = eomgen.SceneBuilder("bob").body("bob", 1.0, inertia=[0.1, 0.1, 0.1])
    builder.joint("root", "free", "base", "bob")
    model = eomgen.build(builder.build(), profile="quick")
    t = np.linspace(0.0, 1.0, 21)
    q, v = np.zeros((21, 7)), np.zeros((21, 6))
    q[:, 0], q[:, 2], q[:, 4], v[:, 3] = 1.0, 0.5 * turned * t, 2.0 * t, 2.0
    off = q.copy()
    off[:, 2] *= 38.0
    held: dict[str, Any] = {"t": t, "q": q, "v": v}
    found = difference(subject(model), {**held, "q": off}, held, 0.01)
    assert found.position < 1e-3
    off[:, 4] *= 1.5  # an error of what moves is seen
    assert difference(subject(model), {**held, "q": off}, held, 0.01).position == pytest.approx(0.5)
