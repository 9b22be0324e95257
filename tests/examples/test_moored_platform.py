"""The platform of examples/moored_platform: heave by linear theory and by a run, and its figure."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np
import pytest

import eomgen

DEMO = Path(__file__).parents[2] / "examples" / "moored_platform" / "demo.py"


@pytest.mark.long
def test_heave_is_that_of_linear_theory() -> None:
    periods, linear, found = runpy.run_path(str(DEMO))["heave"]()
    np.testing.assert_allclose(found, linear, rtol=0, atol=3e-3 * linear.max())
    long = periods >= 20.0
    np.testing.assert_allclose(found[long], linear[long], rtol=3e-3)
    assert linear[0] == pytest.approx(1.06, abs=0.01), "the surface carries it in long waves"
    assert linear.argmax() == int(np.argmin(np.abs(periods - 13.33)))
    assert linear[periods < 9.0].max() < 0.03


@pytest.mark.long
def test_the_scene_file_is_what_the_demo_builds() -> None:
    built = eomgen.build(runpy.run_path(str(DEMO))["scene"]())
    read = eomgen.build(DEMO.parent / "system" / "platform.toml")
    q = built.equilibrium().q
    np.testing.assert_allclose(read.equilibrium().q, q, rtol=0, atol=1e-9)
    v = 0.1 * np.random.default_rng(0).normal(size=built.nv)
    forces = built.inverse_dynamics(q, v, v, 33.0)
    np.testing.assert_allclose(read.inverse_dynamics(q, v, v, 33.0), forces, rtol=1e-9)
    kinds = [[item.name for item in model.description.outputs] for model in (read, built)]
    assert kinds[0] == kinds[1]
