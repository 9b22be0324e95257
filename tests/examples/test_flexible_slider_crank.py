"""The flexible slider-crank beside bars of Euler and Bernoulli whose frames float along with them: another formulation,
with modes in place of elements, without rotary inertia of bending and to second order in deflections."""

from __future__ import annotations

import runpy
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import eomgen

crank: Any = SimpleNamespace(
    **runpy.run_path(str(Path(__file__).parents[2] / "examples" / "flexible_slider_crank" / "crank.py"))
)


def floating() -> dict[str, Any]:
    """Return the scene with bars of four modes each."""
    scene = crank.scene(1)
    modulus = 2.1e11
    bending = crank.STIFFNESS["bending_z"] / modulus
    area = crank.STIFFNESS["stretch"] / modulus
    section = {"elastic_modulus": modulus, "density": crank.MASS / area, "area": area, "second_moments": [bending] * 2}
    shapes = {"crank": (crank.CRANK, "clamped_free"), "rod": (crank.ROD, "pinned_pinned")}
    scene["beams"] = {
        name: {"length": length, "section": section, "bending_y": {"shapes": kind, "modes": 4}}
        for name, (length, kind) in shapes.items()
    }
    del scene["outputs"]["root"]
    return scene  # type: ignore[no-any-return]  # of a program that is run


@pytest.mark.long
def test_it_bends_as_bars_with_floating_frames_do() -> None:
    runs = []
    for scene in (crank.scene(6), floating()):
        run = eomgen.build(scene, profile="fast").simulate(7.0, 0.005, error_estimate=False)
        assert run.success, run.message
        runs.append(run)
    off, other = (crank.deflection(run) for run in runs)
    assert 0.33 < np.abs(other).max() < 0.36  # at 5.9 s
    assert np.abs(off - other)[runs[0].t <= 5.0].max() < 3e-3
    assert np.abs(off - other).max() < 0.02
    efforts = [run.outputs["motor"] for run in runs]
    assert np.abs(efforts[0] - efforts[1]).max() < 0.04 * np.abs(efforts[1]).max()
    np.testing.assert_allclose(runs[0].outputs["slider"][:, 1:], 0.0, atol=1e-9)
