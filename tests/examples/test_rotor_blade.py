"""The rotor blade against exact frequencies of its coupled section at rest, and its integrated shape at speed."""

from __future__ import annotations

import runpy
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import eomgen
from tests.oracles.coupled_beams import frequencies, turning_tip

blade: Any = SimpleNamespace(**runpy.run_path(str(Path(__file__).parents[2] / "examples" / "rotor_blade" / "blade.py")))
SPEED = 1.0


@pytest.mark.long
def test_it_vibrates_and_bends_as_its_section_says() -> None:
    found, tips, turning = [], [], []
    for elements in (4, 8):
        model = eomgen.build(blade.scene(elements), profile="quick")
        found.append(blade.frequencies(model, 0.0)[:3])
        steady = model.linearize(parameters={"speed": SPEED}).reference
        assert steady.what == "steady motion"
        poses = model.evaluate("poses", steady.q)["pose"]
        tips.append(poses[list(model.bodies).index(f"blade.{elements}"), 4:])
        turning.append(blade.frequencies(model, SPEED)[0])
    exact = frequencies(blade.STIFFNESS, blade.INERTIA, blade.LENGTH, 5.0, 3)
    np.testing.assert_allclose((4.0 * found[1] - found[0]) / 3.0, exact, rtol=5e-3)
    assert abs(found[1] / exact - 1.0).max() > 5e-3  # one mesh is not enough
    tip, _ = turning_tip(blade.STIFFNESS, blade.INERTIA, blade.LENGTH, SPEED)
    np.testing.assert_allclose((4.0 * tips[1] - tips[0]) / 3.0, tip, atol=1e-3)
    assert turning[1] > 4.0 * found[1][0]  # centrifugal stiffening
