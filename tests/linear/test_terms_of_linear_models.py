"""Functions of linear models: at rest no partials of the accelerations of constraints, and no stepper."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.pipeline.pipeline import build_for_rest
from eomgen.toolchain.builder import Builder
from tests.scene.test_varying_sections import scene as tapered

EXAMPLES = Path("examples")


@pytest.fixture
def loaded(monkeypatch: pytest.MonkeyPatch) -> dict[Path, set[str]]:
    """The functions of each library that a builder makes or takes from the cache, by its folder."""
    libraries: dict[Path, set[str]] = {}
    own = Builder._load

    def noted(self: Builder, *arguments: Any) -> Any:
        library = own(self, *arguments)
        libraries[library.folder] = {function["name"] for function in library.layout["functions"]}
        return library

    monkeypatch.setattr(Builder, "_load", noted)
    return libraries


def test_partials_of_accelerations_of_constraints_vanish_at_rest(rng: np.random.Generator) -> None:
    terms = ("constraint_bias", "acceleration_partials")
    model = eomgen.build(EXAMPLES / "four_bar" / "scene.toml", terms, profile="quick")
    assert not {"t", "base"}.intersection(model.functions.inputs("constraint_bias"))
    zero = np.zeros(model.nv)
    q = model.integrate(model.initial_q, rng.normal(size=model.nv))
    assert not any(block.any() for block in model.evaluate("acceleration_partials", q, zero, zero).values())
    moved = model.evaluate("acceleration_partials", q, rng.normal(size=model.nv), zero)
    assert all(block.any() for block in moved.values())


@pytest.mark.long
def test_a_beam_at_rest_is_linear_by_the_functions_of_its_runs(loaded: dict[Path, set[str]]) -> None:
    model = eomgen.build(tapered(4, "kirchhoff"), profile="quick")
    rest = model.linearize()
    assert list(loaded) == [model.library.folder]
    assert "acceleration_partials" not in loaded[model.library.folder]
    reference = rest.reference
    with_all = model.linearize(reference.q, a=reference.a, multipliers=reference.multipliers)
    assert len(loaded) == 2
    assert with_all.K0.tobytes() == rest.K0.tobytes() and with_all.M0.tobytes() == rest.M0.tobytes()


@pytest.mark.long
def test_a_model_for_rest_has_no_stepper_and_no_second_library(loaded: dict[Path, set[str]]) -> None:
    scene = tapered(2, "kirchhoff")
    model = build_for_rest(eomgen.load(scene))
    found = model.linearize().modes().angular_frequency
    assert list(loaded) == [model.library.folder]
    assert not {"acceleration_partials", "inverse_dynamics", "energy"}.intersection(model.functions.names)
    assert not model.library.layout["method"]
    assert not list(model.library.folder.glob("*_step.c"))
    whole = eomgen.build(scene, profile="quick")
    assert whole.library.layout["method"]
    assert found == pytest.approx(whole.linearize().modes().angular_frequency, rel=1e-9)


@pytest.mark.slow
@pytest.mark.long_cases("unbalanced_shaft")
@pytest.mark.parametrize("name", ["four_bar", "unbalanced_shaft"])
def test_models_for_rest_are_linear_as_whole_models(name: str) -> None:
    file = EXAMPLES / name / "scene.toml"
    lean, whole = build_for_rest(file, "quick").linearize(), eomgen.build(file, profile="quick").linearize()
    assert lean.reference.what == whole.reference.what
    for matrix, other in zip(vars(lean.state_space()).values(), vars(whole.state_space()).values(), strict=True):
        if isinstance(matrix, np.ndarray):
            np.testing.assert_allclose(matrix, other, rtol=1e-9, atol=1e-9 * np.max(np.abs(other), initial=0.0))


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
