"""Scenes that are written in other units, or stand elsewhere in the world, are built and move alike.

``test_similarity`` changes the units of a model that is built; here methods, pivots and starts are chosen anew.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.base.arrays import Array
from eomgen.scene.joint_types import JOINTS
from tests.integrators.similar_scenes import BOUND, FREE, STEPS
from tests.oracles.similarity import UnitsOf, in_units

#: km-t-h, mm-g-ms, Mm-Gt-d.
SYSTEMS = (UnitsOf(1e-3, 1e-3, 1 / 3600), UnitsOf(1e3, 1e3, 1e3), UnitsOf(1e-6, 1e-12, 1 / 86400))
METHODS = {
    "tree": ("generalized_alpha", "rattlie"),
    "slider_crank": ("generalized_alpha", "rattlie"),
    "rolling": ("generalized_alpha",),
}
STEPS_OF_RUN = 50


def scene_of(name: str) -> dict[str, Any]:
    scene = copy.deepcopy({**FREE, **BOUND}[name]())
    scene.pop("terms", None)
    return scene


def scaled(name: str, units: UnitsOf) -> dict[str, Any]:
    """Return a scene in other units, initial states included."""
    scene = scene_of(name)
    result = in_units(scene)
    for joint in result["joints"].values():
        kind, initial = JOINTS[joint["type"]], dict(joint.get("initial", {}))
        if joint["type"] == "free":
            of_q, of_v = ["m"] * 3, ["1/s"] * 3 + ["m/s"] * 3
        else:
            of_q = list(kind.units)
            of_v = ["1/s"] * 3 if joint["type"] == "spherical" else ["m/s" if x == "m" else "1/s" for x in of_q]
        for key, of_key in (("position", of_q), ("velocity", of_v)):
            if key in initial:
                initial[key] = _times(initial[key], [units.size(unit) for unit in of_key])
        if initial:
            joint["initial"] = initial
    sizes = {"unit_length": units.length, "unit_mass": units.mass, "unit_time": units.time}
    values = {key: {"value": value} for key, value in sizes.items()}
    return result | {"parameters": {**scene.get("parameters", {}), **values}}


def _times(value: Any, factors: Sequence[float]) -> Any:
    if isinstance(value, list):
        return [_times(entry, [factor]) for entry, factor in zip(value, factors, strict=True)]
    return f"{factors[0]!r} * ({value})" if isinstance(value, str) else value * factors[0]


def motions(scene: dict[str, Any], name: str, units: UnitsOf) -> list[Array]:
    """Return q of each method, in the units in which the scene is written."""
    model, step, found = eomgen.build(scene, profile="quick"), STEPS.get(name, 2e-3) * units.time, []
    for method in METHODS[name]:
        run = model.simulate(STEPS_OF_RUN * step, step, method=method)
        assert run.success, f"{method}, {units}: {run.message}"
        found.append(np.array(run.q) / np.array([units.size(unit) for unit in model.q_units]))
    return found


@pytest.mark.long_except("rolling")
@pytest.mark.slow
@pytest.mark.parametrize("name", METHODS)
def test_scenes_in_other_units_are_built_and_move_alike(name: str) -> None:
    """Differences are rounding, about 2e-15."""
    own = motions(scaled(name, UnitsOf()), name, UnitsOf())
    for units in SYSTEMS:
        for found, expected in zip(motions(scaled(name, units), name, units), own, strict=True):
            assert np.max(np.abs(found - expected)) < 1e-12
