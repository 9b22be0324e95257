"""The elastic pendulum against what EXUDYN's geometrically exact beams converge to, and what it loses without
stiffening."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import eomgen
from tests.anchors import anchor
from tests.models.cache import shared_cache
from tests.oracles.elastic_pendulum import MIDDLE, TIMES, TIP

__all__ = ["shared_cache"]

SCENE = Path(__file__).parents[2] / "examples" / "elastic_pendulum" / "scene.toml"
BEAM = 'length = "length"\n'


def distances(path: Path) -> tuple[float, float, eomgen.Solution]:
    """Return how far tip and middle are from the reference at most, m."""
    run = eomgen.build(path).simulate()
    assert run.success, run.message
    rows = np.rint(np.array(TIMES) / 5e-4).astype(int)
    tip, middle = run.outputs["tip"][rows] - TIP, run.outputs["middle"][rows] - MIDDLE
    return float(np.linalg.norm(tip, axis=1).max()), float(np.linalg.norm(middle, axis=1).max()), run


@pytest.mark.long
def test_it_swings_as_geometrically_exact_beams_do_and_keeps_its_energy() -> None:
    tip, middle, run = distances(SCENE)
    assert tip < 3e-4 and middle < 4e-4
    anchor("elastic_pendulum").check(run.outputs["tip"][[2000, 4000]])
    kinetic = run.energy["kinetic"].max()
    assert np.ptp(run.outputs["energy"]) < 1e-6 * kinetic


@pytest.mark.slow
@pytest.mark.long_cases("order = 2\\n-0.0-0.00015", "stiffening = false\\n-0.001-0.01")
@pytest.mark.parametrize(
    ("change", "least", "most"), [("order = 2\n", 0.0, 1.5e-4), ("stiffening = false\n", 1e-3, 1e-2)]
)
def test_what_order_and_stiffening_change(tmp_path: Path, change: str, least: float, most: float) -> None:
    """Two modes do for this, and compile faster with order 2."""
    path = tmp_path / "scene.toml"
    text = SCENE.read_text(encoding="utf-8").replace("modes = 3", "modes = 2")
    assert text.count(BEAM) == 1
    path.write_text(text.replace(BEAM, BEAM + change), encoding="utf-8")
    tip, _, _ = distances(path)
    assert least < tip < most
