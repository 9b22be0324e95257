"""The rolled strip is a circle, and its sections bear one moment."""

from __future__ import annotations

import math
import runpy
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import eomgen
from tests.anchors import anchor

strip: Any = SimpleNamespace(**runpy.run_path(str(Path(__file__).parents[2] / "examples" / "roll_up" / "roll_up.py")))


@pytest.mark.slow
@pytest.mark.long_cases("5-1.0", "8-2.0")
@pytest.mark.parametrize(("elements", "turns"), [(5, 1.0), (8, 2.0)])
def test_ends_of_circles_meet(elements: int, turns: float) -> None:
    model = eomgen.build(strip.scene(elements), profile="quick")
    q = strip.at_rest(model, turns)
    assert np.linalg.norm(strip.end_of(model, q)) < 1e-9 * strip.LENGTH
    anchor("roll_up").check(strip.end_of(model, q)[0] - strip.LENGTH)
    loads = model.section_loads(q)["strip"]
    curvature = -2.0 * math.pi * turns / strip.LENGTH
    np.testing.assert_allclose(loads.curvature, np.tile([0.0, curvature, 0.0], (elements, 1)), atol=1e-9)
    expected = np.tile([0.0, strip.BENDING * curvature, 0.0], (elements, 2, 1))
    np.testing.assert_allclose(loads.moment_at_ends, expected, atol=1e-6)
    np.testing.assert_allclose(loads.force_at_ends, 0.0, atol=1e-6)
    pose = model.evaluate("poses", q)["pose"]
    places = pose[[list(model.bodies).index(name) for name in model.description.exact_beams[0]]][:, [4, 6]]
    np.testing.assert_allclose(places, strip.circle(turns, loads.nodes), atol=1e-8)
