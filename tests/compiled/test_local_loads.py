"""Runs under loads by formulas of the place where they act."""

from __future__ import annotations

import numpy as np
import pytest

import eomgen
from tests.models.cache import shared_cache
from tests.models.cosserat import beam_scene

__all__ = ["shared_cache"]


@pytest.mark.long
def test_a_beam_falls_through_drag_with_its_terminal_velocity_and_shape() -> None:
    """With drag of 1 + cos(2 pi s) times its mean, EI w'''' = -mg cos(kx) about the middle, ends free."""
    weight, EI, wave = 0.5, 500.0, 2.0 * np.pi / 10.0
    drag = "-0.8 * (1 + cos(2 * pi * s)) * velocity.here[{0}]"
    data = beam_scene(16, {}, {"stiffness_damping": 0.2}, type="free") | {"gravity": [0.0, 0.0, -weight]}
    data["distributed_loads"] = {"air": {"beam": "rope", "force": [drag.format(axis) for axis in range(3)]}}
    del data["forces"]
    run = eomgen.build(data, profile="quick").simulate(40.0, 0.05, error_estimate=False)
    assert run.success, run.message
    height = run.q[:, 6::7]  # of poses, quaternion first
    assert (height[-1, 0] - height[-21, 0]) / (run.t[-1] - run.t[-21]) == pytest.approx(-weight / 0.8, rel=1e-5)
    found = height[-1] - height[-1, 8]
    x = np.linspace(-5.0, 5.0, 17)
    expected = weight / (EI * wave**2) * (x**2 / 2 - np.cos(wave * x) / wave**2)
    np.testing.assert_allclose(found, expected - expected[8], atol=0.02 * np.ptp(expected))
