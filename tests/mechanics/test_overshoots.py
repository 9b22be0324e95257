"""Notes on splines that overshoot their points, held to SciPy's spline on a dense grid."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

from eomgen.formula.curves import Curve, Outside
from eomgen.mechanics.discontinuities import overshoots

NATURAL = ([(3, 0.0), (4, 0.0)], [(3, 0.0), (4, 0.0)])
RESTING = ([(1, 0.0), (2, 0.0)], [(1, 0.0), (2, 0.0)])


@pytest.mark.parametrize("outside", ["error", "hold"])
def test_splines_are_noted_if_they_leave_the_range_by_more_than_a_tenth(outside: Outside) -> None:
    rng, noted = np.random.default_rng(3), 0
    for _ in range(60):
        x = np.cumsum(rng.uniform(0.2, 1.0, rng.integers(6, 15)))
        y = np.cumsum(rng.normal(size=len(x))) * 10.0 ** rng.integers(-4, 5)
        spline = make_interp_spline(x, y, k=5, bc_type=NATURAL if outside == "error" else RESTING)
        dense = spline(np.linspace(x[0], x[-1], 20001))
        share = max(dense.max() - y.max(), y.min() - dense.min()) / np.ptp(y)
        if abs(share - 0.1) < 0.01:  # pieces are sampled
            continue
        found = list(overshoots([Curve("c", x, y, outside=outside)]))
        assert bool(found) == (share > 0.1)
        noted += bool(found)
    assert 10 < noted < 50


def test_a_step_through_a_spline_is_noted_with_place_and_size_and_other_curves_are_not() -> None:
    step = np.array([0.0, 1.0, 1.1, 2.0]), np.array([0.0, 0.0, 1.0, 1.0])
    (note,) = overshoots([Curve("step", *step), Curve("bent", *step, interpolation="linear")])
    assert note.startswith("step: the spline is -3.287 at 0.4444, 3.3e+02 % of the range of its points, 0 to 1, beyond")
    assert note.endswith('them; more points where they turn, or interpolation = "linear", keep it within [W0273]')
    t = np.linspace(0.0, 1.0, 9)
    smooth = [Curve("sine", t, np.sin(2.0 * np.pi * t), outside="periodic"), Curve("flat", t, np.ones(9))]
    assert not list(overshoots([*smooth, Curve("two", t[:2], t[:2])]))
