"""The elastic pendulum against what EXUDYN's geometrically exact beams converge to, and what it loses without
stiffening."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from tests.anchors import anchor
from tests.models.library import scene
from tests.oracles.elastic_pendulum import MIDDLE, TIMES, TIP

SCENE = Path(__file__).parents[2] / "examples" / "elastic_pendulum" / "scene.toml"


def distances(of: Any) -> tuple[float, float, eomgen.Solution]:
    """Return how far tip and middle are from the reference at most, m."""
    run = eomgen.build(of).simulate()
    assert run.success, run.message
    rows = np.rint(np.array(TIMES) / 5e-4).astype(int)
    tip, middle = run.outputs["tip"][rows] - TIP, run.outputs["middle"][rows] - MIDDLE
    return float(np.linalg.norm(tip, axis=1).max()), float(np.linalg.norm(middle, axis=1).max()), run


@pytest.mark.slow
def test_it_swings_as_geometrically_exact_beams_do_and_keeps_its_energy() -> None:
    tip, middle, run = distances(SCENE)
    assert tip < 3e-4 and middle < 4e-4
    anchor("elastic_pendulum").check(run.outputs["tip"][[2000, 4000]])
    kinetic = run.energy["kinetic"].max()
    assert np.ptp(run.outputs["energy"]) < 1e-6 * kinetic


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "least", "most"),
    [({"beams__rod__order": 2}, 0.0, 1.5e-4), ({"beams__rod__stiffening": False}, 1e-3, 1e-2)],
)
def test_what_order_and_stiffening_change(change: dict[str, Any], least: float, most: float) -> None:
    """Two modes do for this, and compile faster with order 2."""
    modes = {"beams__rod__bending_y__modes": 2, "beams__rod__bending_z__modes": 2}
    tip, _, _ = distances(scene("elastic_pendulum/scene", **modes, **change))
    assert least < tip < most
