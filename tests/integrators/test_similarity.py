"""The same motion in other units: the same bits where units are powers of two, the same but for rounding in powers of
ten.

Every method has its rows here. What a method compares with a number that has a unit, or with 1, shows at once.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import pytest

from tests.integrators.similar_scenes import STEPS, similar
from tests.oracles.similarity import BINARY, DECIMAL, Motion, UnitsOf

#: Methods, what they are told, and the scenes that they run on.
METHODS: Mapping[str, tuple[str, Mapping[str, Any], Sequence[str]]] = {
    "generalized_alpha": ("generalized_alpha", {}, ("servo", "rail", "rods_se3")),
    "index3": ("generalized_alpha_index3", {}, ("four_bar", "driven", "rods_r3xso3")),
    "f1": ("generalized_alpha_f1", {}, ("flight",)),
    "f2": ("generalized_alpha_f2", {}, ("flight",)),
    "spatial": ("generalized_alpha_spatial", {}, ("flight",)),
    "index3_f1": ("generalized_alpha_index3_f1", {}, ("rods_r3xso3",)),
    "index3_spatial": ("generalized_alpha_index3_spatial", {}, ("rods_r3xso3",)),
    "hht": ("hht", {"rho_inf": 0.9}, ("slider_crank",)),
    "wbz": ("wbz", {"rho_inf": 0.9}, ("slider_crank",)),
    "newmark": ("newmark", {"beta": 0.3, "gamma": 0.6}, ("tree",)),
    "trapezoidal": ("trapezoidal", {}, ("servo",)),
    "rk4": ("rk4", {}, ("tree", "servo")),
    "adaptive": ("generalized_alpha_adaptive", {"tolerance": 1e-6}, ("servo", "four_bar", "rolling", "rods_se3")),
    "rk45": ("rk45", {"tolerance": 1e-8}, ("tree", "flight")),
    "taylor": ("taylor", {"tolerance": 1e-12}, ("tree",)),
    "rosenbrock": ("rosenbrock", {}, ("tree", "flight")),
    "lsrt2": ("lsrt2", {}, ("servo",)),
    "corrected_predictor": ("corrected_predictor", {}, ("servo",)),
    "rattlie": ("rattlie", {}, ("flight", "slider_crank", "rods_r3xso3")),
    "tdg2": ("tdg2", {}, ("servo",)),
    "rk4_partitioned": ("rk4_partitioned", {}, ("driven", "rolling")),
}
CASES = [(name, scene) for name, (_, _, scenes) in METHODS.items() for scene in scenes]
STEPS_OF_RUN = 60


def motion(name: str, scene: str, units: UnitsOf, steps: int = STEPS_OF_RUN) -> Motion:
    method, given, _ = METHODS[name]
    return similar(scene).motion(units, method, STEPS.get(scene, 2e-3), steps, **given)


@pytest.mark.slow_except("index3-four_bar")
@pytest.mark.long_except("index3-four_bar", "rk4-tree", "rosenbrock-tree", "adaptive-four_bar", "rattlie-slider_crank")
@pytest.mark.parametrize(("name", "scene"), CASES)
def test_motions_are_the_same_in_other_units(name: str, scene: str) -> None:
    first = motion(name, scene, UnitsOf())
    assert first.status == 0
    assert [units for units in BINARY if not motion(name, scene, units).has_the_bits_of(first)] == []
    differences = {units: motion(name, scene, units).difference(first) for units in DECIMAL}
    assert {units: size for units, size in differences.items() if not size < 1e-9} == {}
