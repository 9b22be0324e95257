"""The pair of order 5(4) on constraints: errors follow tolerances, constraints hold to round-off, other runs agree."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.base.arrays import Array
from tests.integrators import similar_scenes
from tests.models.cache import shared_cache
from tests.oracles.placed_loops import windows
from tests.simulation.test_singular_positions import error

__all__ = ["shared_cache"]

METHOD = "rk45_partitioned"
QUIET: dict[str, Any] = {"error_estimate": False}
EXAMPLES = Path(__file__).parents[2] / "examples"
SCENES: dict[str, Any] = {
    "rods_se3": lambda: similar_scenes.rods("SE3"),
    "rolling": similar_scenes.BOUND["rolling"],
    "four_bar": lambda: EXAMPLES / "four_bar" / "scene.toml",
}


@cache
def model(name: str) -> eomgen.Model:
    return eomgen.build(SCENES[name](), method=METHOD)


@cache
def true(name: str) -> eomgen.Solution:
    """Return the motion over 0.4 s in rows of 0.02 s in fixed steps of another pair of coefficients."""
    return model(name).simulate(0.4, 0.02 / 128, method="rk4_partitioned", record_every=128, **QUIET)


def errors(found: eomgen.Solution, name: str) -> Array:
    pairs = ((getattr(found, block), getattr(true(name), block)) for block in ("q", "v", "multipliers"))
    return np.array([np.abs(ours - other).max() for ours, other in pairs])


@pytest.mark.slow
@pytest.mark.long_cases("rods_se3")
@pytest.mark.parametrize("name", SCENES)
def test_errors_follow_tolerances_to_the_power_of_five_quarters(name: str) -> None:
    tolerances = np.array([1e-5, 1e-6, 1e-7, 1e-8])
    runs = [model(name).simulate(0.4, 0.02, method=METHOD, tolerance=float(x), **QUIET) for x in tolerances]
    assert all(found.success for found in runs)
    all_errors = np.array([errors(found, name) for found in runs])
    slopes = np.polyfit(np.log(tolerances), np.log(all_errors), 1)[0]
    assert slopes == pytest.approx(1.25, abs=0.2)
    assert max(found.stats["max_constraint"] for found in runs) < 1e-12
    assert max(found.stats["max_constraint_velocity"] for found in runs) < 1e-11


@pytest.mark.long_except("1e-13")
@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [0.1, 1e-13])
def test_extreme_tolerances_hold(tolerance: float) -> None:
    found = model("rods_se3").simulate(0.4, 0.02, method=METHOD, tolerance=tolerance, **QUIET)
    assert found.success and errors(found, "rods_se3")[0] < max(tolerance, 1e-11)
    assert found.stats["rejections"] < 0.2 * found.stats["own_steps"] + 3


@pytest.mark.slow
def test_states_between_rows_lie_on_the_constraints() -> None:
    coarse = model("four_bar").simulate(0.4, 0.4, method=METHOD, tolerance=1e-8, **QUIET)
    at = coarse.at(true("four_bar").t)
    assert np.abs(at.q - true("four_bar").q).max() < 1e-7
    assert np.array_equal(at.q[0], coarse.q[0]) and np.array_equal(at.q[-1], coarse.q[-1])
    between = model("four_bar").simulate(0.4, 0.4, method=METHOD, tolerance=1e-3, **QUIET).at([0.07])
    found = model("four_bar").consistent(between.q[0], between.v[0])
    assert np.abs(found.q - between.q[0]).max() < 1e-13


@pytest.mark.slow
def test_without_constraints_it_says_what_does_the_same() -> None:
    scene = eomgen.SceneBuilder("free").body("a", 1.0).joint("x", "prismatic", "base", "a", axis=[1, 0, 0]).build()
    with pytest.raises(eomgen.ModelError, match="rk45 does the same work if there are none"):
        eomgen.build(scene).simulate(1.0, method=METHOD)


@pytest.mark.long_cases("0.0001-0.01-0")
@pytest.mark.slow
@pytest.mark.parametrize(("tolerance", "bound", "counted"), [(1e-4, 1e-2, 0), (1e-8, 1e-6, 2)])
def test_it_passes_singular_positions_along_the_velocity(tolerance: float, bound: float, counted: int) -> None:
    """Two windows of rods (IFToMM A02), against the motion of one angle; long steps lead across."""
    made = eomgen.build(windows(2), profile="quick")
    found = made.simulate(3.0, 0.01, method=METHOD, tolerance=tolerance, **QUIET)
    assert found.success and found.stats["singular_passages"] >= counted
    assert error(found) < bound
