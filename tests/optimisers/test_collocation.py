"""Direct collocation of a closed loop with the multipliers as unknowns, which needs no tree of equations."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np
import pytest

import eomgen

SCENE = Path(__file__).parents[2] / "examples" / "four_bar" / "scene.toml"


@pytest.mark.slow
def test_a_crank_is_turned_with_the_torque_that_casadis_symbols_have() -> None:
    """The linkage ends as it began, so the work of the torque vanishes to the order of the method."""
    own_demo = runpy.run_path(str(SCENE.parents[1] / "turned_four_bar" / "demo.py"))
    functions = eomgen.casadi(SCENE, ["residual", "constraint"], profile="quick")
    assert functions["residual"].name_in() == ["q", "v", "a", "lam"]
    start, works = eomgen.build(SCENE, profile="quick").initial_q, []
    for intervals in (20, 40):
        best, native = (own_demo["turned"](given, start, intervals) for given in (functions, own_demo["native"]()))
        assert best.success and best.iterations == native.iterations < 20
        assert best.cost == pytest.approx(native.cost, rel=1e-9)
        assert best.q == pytest.approx(native.q, abs=1e-7) and best.torque == pytest.approx(native.torque, abs=1e-6)
        assert best.q[-1, 0] - start[0] == pytest.approx(2.0 * np.pi, abs=1e-9)
        pin = np.linalg.norm(best.multipliers, axis=1)
        assert pin == pytest.approx(np.linalg.norm(native.multipliers, axis=1), rel=1e-5)
        works.append(abs(best.torque @ np.diff(best.q[:, 0])))
    assert works[1] < 0.25 * works[0] < 0.02
