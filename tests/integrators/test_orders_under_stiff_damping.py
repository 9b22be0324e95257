"""Orders of the methods ``tdg2`` and ``tdg2s`` under a damper that is stiff for the step: x(t) = sin t is known."""

from __future__ import annotations

import numpy as np
import pytest

import eomgen

DAMPED = (
    eomgen.SceneBuilder("stiffly_damped", gravity=[0, 0, 0]).parameter("c", 1.0, tunable=True).body("mass", 1.0)
    .joint("x", "prismatic", "base", "mass", axis=[1, 0, 0], initial={"velocity": 1.0})
    .effort("f", "x", "-c * (v.x - cos(t)) - 3 * (q.x - sin(t)) - sin(t)").build()
)  # fmt: skip  # a chain of calls


@pytest.mark.slow
@pytest.mark.parametrize(("method", "soft", "stiff"), [("tdg2", 5.0, 2.8), ("tdg2s", 4.0, 2.0)])
def test_velocities_lose_orders_under_stiff_damping(method: str, soft: float, stiff: float) -> None:
    """Orders of velocities between steps of 1/8 s and 1/32 s, at c = 1/s and at c = 1e7/s; positions keep theirs."""
    model = eomgen.build(DAMPED, profile="quick")
    for damping, order in ((1.0, soft), (1e7, stiff)):
        errors = []
        for step in (1 / 8, 1 / 16, 1 / 32):
            run = model.simulate(2.0, step, method=method, parameters={"c": damping}, error_estimate=False)
            errors.append([abs(run.q[-1, 0] - np.sin(2.0)), abs(run.v[-1, 0] - np.cos(2.0))])
        orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
        if damping > 1.0:
            assert np.all(np.abs(orders[:, 1] - order) < 0.15), orders
        assert np.all(orders[:, 0] > soft - 0.2), orders
