"""Changes of tangents against complex steps, and within complex numbers against differences."""

from __future__ import annotations

import numpy as np
import pytest

from eomgen.lie import numeric
from eomgen.lie.groups import group_named
from eomgen.lie.kernels import tangent_along

STEP = 1e-100


@pytest.mark.parametrize("size", [1e-3, 0.3, 2.5])
@pytest.mark.parametrize(("name", "count"), [("R", 2), ("SO3", 3), ("SE3", 6)])
def test_tangents_change_as_complex_steps_say(name: str, count: int, size: float) -> None:
    group, rng = group_named(name, count), np.random.default_rng(3)
    theta, direction = size * rng.normal(size=(4, count)), rng.normal(size=(4, count))
    for inverse, function in ((False, numeric.tangent), (True, numeric.tangent_inverse)):
        expected = function(group, theta + 1j * STEP * direction).imag / STEP
        found = tangent_along(group, theta, direction, inverse=inverse)
        np.testing.assert_allclose(found, expected, rtol=1e-13, atol=1e-14)
        other = rng.normal(size=(4, count))
        second = tangent_along(group, theta + 1j * STEP * other, direction, inverse=inverse).imag / STEP
        ends = [tangent_along(group, theta + h * other, direction, inverse=inverse) for h in (1e-5, -1e-5)]
        np.testing.assert_allclose(second, (ends[0] - ends[1]) / 2e-5, rtol=1e-7, atol=1e-8)
