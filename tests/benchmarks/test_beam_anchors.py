"""The published bend of 45 degrees, a parabola given by frames, and a circle, by the table of anchors."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.beam_anchors import extrapolated, report, rows_of
from tests.anchors import anchor

pytestmark = pytest.mark.slow


@pytest.mark.long
def test_elements_reach_the_published_bend() -> None:
    rows = rows_of("bend, parabola", (4, 8, 16))
    assert rows[-1].error < 1e-6
    assert rows[-1].extrapolated < 2e-7  # from three meshes
    anchor("bend_of_45_degrees").check(extrapolated([np.array(row.displacement) for row in rows]))
    assert report(rows).splitlines()[4].startswith("| bend, parabola | 16 ")


@pytest.mark.long
def test_a_circle_needs_four_elements() -> None:
    (row,) = rows_of("roll-up", (2, 4))
    assert row.elements == 4 and row.error < 1e-12
