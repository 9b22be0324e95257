"""The same motion in other units: the same bits where units are powers of two, the same but for rounding in powers of
ten.

Every method has its rows here. What a method compares with a number that has a unit, or with 1, shows at once.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import pytest

from tests.integrators.similar_scenes import BOUND, FREE, STEPS, similar
from tests.oracles.similarity import BINARY, DECIMAL, Motion, UnitsOf

#: Methods, what they are told, and the scenes that they run on.
METHODS: Mapping[str, tuple[str, Mapping[str, Any], Sequence[str]]] = {
    "generalized_alpha": ("generalized_alpha", {}, (*FREE, *BOUND)),
    "index3": ("generalized_alpha_index3", {}, tuple(BOUND)),
    "f1": ("generalized_alpha_f1", {}, ("flight", "rods_r3xso3")),
    "f2": ("generalized_alpha_f2", {}, ("flight", "rods_r3xso3")),
    "spatial": ("generalized_alpha_spatial", {}, ("flight", "rods_r3xso3")),
    "index3_f1": ("generalized_alpha_index3_f1", {}, ("rods_r3xso3",)),
    "index3_spatial": ("generalized_alpha_index3_spatial", {}, ("rods_r3xso3",)),
    "hht": ("hht", {"rho_inf": 0.9}, ("tree", "slider_crank")),
    "wbz": ("wbz", {"rho_inf": 0.9}, ("tree", "slider_crank")),
    "newmark": ("newmark", {"beta": 0.3, "gamma": 0.6}, ("tree", "slider_crank")),
    "trapezoidal": ("trapezoidal", {}, ("servo", "slider_crank")),
    "rk4": ("rk4", {}, tuple(FREE)),
    "adaptive": ("generalized_alpha_adaptive", {"tolerance": 1e-6}, (*FREE, *BOUND)),
    "rk45": ("rk45", {"tolerance": 1e-8}, tuple(FREE)),
    "taylor": ("taylor", {"tolerance": 1e-12}, ("tree", "flight")),
    "rosenbrock": ("rosenbrock", {}, ("tree", "flight")),
    "lsrt2": ("lsrt2", {}, ("tree", "servo")),
    "corrected_predictor": ("corrected_predictor", {}, ("tree", "servo")),
    "rattlie": ("rattlie", {}, ("tree", "flight", "slider_crank", "rods_r3xso3")),
    "tdg2": ("tdg2", {}, ("tree", "flight", "servo")),
    "rk4_partitioned": ("rk4_partitioned", {}, tuple(BOUND)),
}
CASES = [(name, scene) for name, (_, _, scenes) in METHODS.items() for scene in scenes]
STEPS_OF_RUN = 60


def motion(name: str, scene: str, units: UnitsOf, steps: int = STEPS_OF_RUN) -> Motion:
    method, given, _ = METHODS[name]
    return similar(scene).motion(units, method, STEPS.get(scene, 2e-3), steps, **given)


@pytest.mark.long_except_every(33)
@pytest.mark.slow
@pytest.mark.long_cases(
    "adaptive-driven",
    "adaptive-rods_r3xso3",
    "adaptive-rods_se3",
    "f1-flight",
    "f1-rods_r3xso3",
    "generalized_alpha-driven",
    "generalized_alpha-flight",
    "generalized_alpha-rail",
    "generalized_alpha-rods_r3xso3",
    "generalized_alpha-rods_se3",
    "index3-driven",
    "index3-rods_r3xso3",
    "index3-rods_se3",
    "index3-slider_crank",
    "index3_f1-rods_r3xso3",
    "index3_spatial-rods_r3xso3",
    "rattlie-rods_r3xso3",
    "rk4_partitioned-driven",
    "spatial-rods_r3xso3",
)
@pytest.mark.parametrize(("name", "scene"), CASES)
def test_powers_of_two_leave_the_bits(name, scene):
    first = motion(name, scene, UnitsOf())
    assert first.status == 0
    changed = [units for units in BINARY if not motion(name, scene, units).has_the_bits_of(first)]
    assert not changed


@pytest.mark.long_except_every(18)
@pytest.mark.slow_except("index3-four_bar")
@pytest.mark.long_cases(
    "adaptive-driven",
    "generalized_alpha-driven",
    "generalized_alpha-rods_r3xso3",
    "generalized_alpha-rods_se3",
    "index3-driven",
    "index3-rods_r3xso3",
    "index3-rods_se3",
    "index3_f1-rods_r3xso3",
    "index3_spatial-rods_r3xso3",
    "spatial-rods_r3xso3",
)
@pytest.mark.parametrize(("name", "scene"), CASES)
def test_powers_of_ten_leave_all_but_rounding(name, scene):
    first = motion(name, scene, UnitsOf())
    differences = {units: motion(name, scene, units).difference(first) for units in DECIMAL}
    assert {units: size for units, size in differences.items() if not size < 1e-9} == {}
