"""Functions of linear models: at rest no partials of the accelerations of constraints, and no stepper."""

from __future__ import annotations

from pathlib import Path

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


@pytest.mark.long_cases("unbalanced_shaft")
@pytest.mark.parametrize("name", ["four_bar", "unbalanced_shaft"])
def test_models_for_rest_are_linear_as_whole_models(name: str) -> None:
    file = EXAMPLES / name / "scene.toml"
    lean, whole = build_for_rest(file, "instant").linearize(), eomgen.build(file, profile="instant").linearize()
    assert lean.reference.what == whole.reference.what
    for matrix, other in zip(vars(lean.state_space()).values(), vars(whole.state_space()).values(), strict=True):
        if isinstance(matrix, np.ndarray):
            np.testing.assert_allclose(matrix, other, rtol=1e-9, atol=1e-9 * np.max(np.abs(other), initial=0.0))
