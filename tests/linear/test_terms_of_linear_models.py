"""Functions of linear models: at rest no partials of the accelerations of constraints, and no stepper."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.pipeline.pipeline import build_for_rest

EXAMPLES = Path("examples")


def test_partials_of_accelerations_of_constraints_vanish_at_rest(rng: np.random.Generator) -> None:
    terms = ("constraint_bias", "acceleration_partials")
    model = eomgen.build(EXAMPLES / "four_bar" / "scene.toml", terms, profile="instant")
    assert not {"t", "base"}.intersection(model.functions.inputs("constraint_bias"))
    zero = np.zeros(model.nv)
    q = model.integrate(model.initial_q, rng.normal(size=model.nv))
    assert not any(block.any() for block in model.evaluate("acceleration_partials", q, zero, zero).values())
    moved = model.evaluate("acceleration_partials", q, rng.normal(size=model.nv), zero)
    assert all(block.any() for block in moved.values())


@pytest.mark.slow
@pytest.mark.long_cases("unbalanced_shaft")
@pytest.mark.parametrize("name", ["four_bar", "unbalanced_shaft"])
def test_models_for_rest_are_linear_as_whole_models(name: str) -> None:
    file = EXAMPLES / name / "scene.toml"
    lean, whole = build_for_rest(file, "instant").linearize(), eomgen.build(file, profile="instant").linearize()
    assert lean.reference.what == whole.reference.what
    for matrix, other in zip(vars(lean.state_space()).values(), vars(whole.state_space()).values(), strict=True):
        if isinstance(matrix, np.ndarray):
            np.testing.assert_allclose(matrix, other, rtol=1e-9, atol=1e-9 * np.max(np.abs(other), initial=0.0))


@pytest.mark.slow
def test_a_driven_scene_that_does_not_rest_is_linear_by_the_functions_of_its_motion() -> None:
    """Models of large scenes have no inertia matrix, which rest does not need: `iteration` alone makes such a model."""
    scene: dict[str, Any] = {
        "format": 1,
        "name": "whirled",
        "gravity": [0, 0, -9.81],
        "bodies": {
            "arm": {"mass": 1, "inertia": [0.1, 0.1, 0.1]},
            "rod": {"mass": 1, "center_of_mass": [0.5, 0, 0], "inertia": [0.1, 0.1, 0.1]},
        },
        "joints": {
            "spin": {"type": "revolute", "parent": "base", "child": "arm", "axis": [0, 1, 0], "drive": "2 * t"},
            "rod": {"type": "free", "parent": "arm", "child": "rod", "initial": {"position": [1, 0, 0]}},
        },
        "constraints": {
            "pin": {"type": "spherical", "first": {"body": "arm", "position": [1, 0, 0]}, "second": {"body": "rod"}}
        },
    }
    frequencies = []
    for terms in (None, ["iteration"]):
        with pytest.warns(RuntimeWarning, match="linear about the initial state, which does not last"):
            frequencies.append(eomgen.build(scene, terms, profile="quick").linearize().modes().frequency)
    np.testing.assert_allclose(frequencies[1], frequencies[0], rtol=1e-6, atol=1e-9)
