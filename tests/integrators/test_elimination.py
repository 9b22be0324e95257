"""What is said of matrices that cannot be eliminated."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import eomgen
from benchmarks import chains
from eomgen.errors import ModelError
from eomgen.integrators.families.register import method_named
from eomgen.integrators.newton import elimination, sample_matrices, signs
from eomgen.integrators.newton.elimination import eliminate
from eomgen.integrators.newton.sample_matrices import samples_of
from eomgen.integrators.stepper_data import method_data


@pytest.mark.parametrize(
    ("constrained", "expected"),
    [
        (True, "constraints repeat each other, or a mass is missing; try: remove constraints that say the same twice"),
        (
            False,
            (
                "a mass is missing, or masses and stiffnesses differ by more orders of magnitude than numbers have"
                " digits (entries from 1e-12 to 1e+30); try: give every moving part a mass, and stiffnesses and lengths"
                " that differ less"
            ),
        ),
    ],
)
def test_a_singular_matrix_is_explained_by_what_it_can_have(constrained: bool, expected: str) -> None:
    samples = {(0, 0): np.array([1e30]), (0, 1): np.array([0.0]), (1, 0): np.array([1e-12]), (1, 1): np.array([0.0])}
    with pytest.raises(ModelError) as caught:
        eliminate(2, samples, constrained=constrained)
    assert f"it is singular at the initial state: {expected}" in str(caught.value)


def test_samples_of_a_linkage_are_the_same_by_sparse_rows(monkeypatch: pytest.MonkeyPatch) -> None:
    system = method_named("generalized_alpha").prepared(eomgen.derive("examples/four_bar/scene.toml"))
    dense = samples_of(system)
    monkeypatch.setattr(sample_matrices, "_DENSE", 0)
    sparse = samples_of(system)
    assert len(dense.numbers) > 1  # states off the initial one
    np.testing.assert_allclose(dense.numbers, sparse.numbers, rtol=1e-9, atol=1e-9)


def cantilever(model: str) -> dict[str, Any]:
    stiffness = {"torsion": 270.0, "bending_y": 350.0, "bending_z": 350.0}
    stretch = {} if model == "inextensible" else {"stretch": 4.2e7}
    shear = {"shear_y": 1.6e7, "shear_z": 1.6e7} if model == "cosserat" else {}
    blade = {"model": model, "length": 2.0, "elements": 4, "mass_per_length": 1.57}
    blade |= {"rotary_inertia": [2e-5, 1e-5, 1e-5], "stiffness": {**stiffness, **stretch, **shear}}
    clamp = {"clamp": {"type": "fixed", "parent": "base", "child": "blade"}}
    gravity = [0, 0, -9.81]
    return {"format": 1, "name": "cantilever", "gravity": gravity, "beams": {"blade": blade}, "joints": clamp}


@pytest.mark.long_cases("kirchhoff")
@pytest.mark.parametrize("model", ["cosserat", pytest.param("kirchhoff", marks=pytest.mark.slow)])
def test_pivots_of_beams_serve_at_steps_of_any_length(model: str) -> None:
    """Stiffness times the squared step is 1e13 times the inertia if the step is 1e-3 h."""
    method = method_named("generalized_alpha")
    system = method.prepared(eomgen.derive(cantilever(model)))
    for step in (1e-5, 1e-3, 3.6, 86.0):
        assert method_data(method, system, step)


@pytest.mark.parametrize(("stages", "most"), [(150, 10**9), (300, 40)])
def test_stages_that_leave_a_column_serve_as_examples_in_long_chains(
    stages: int, most: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each stage's own pivot is too small, so its column waits for the row of the next stage."""
    entries = {(k, k): np.full(2, 1e-8) for k in range(stages)} | {(k + 1, k): np.ones(2) for k in range(stages - 1)}
    entries[0, stages - 1] = np.ones(2)
    searched = 0
    pivot = elimination._ActiveSubmatrix.pivot

    def counted(*arguments: Any) -> Any:
        nonlocal searched
        searched += 1
        return pivot(*arguments)

    monkeypatch.setattr(elimination._ActiveSubmatrix, "pivot", counted)
    made = elimination.eliminate(stages, entries, [([k], [k]) for k in range(stages)])
    assert sorted(made.rows) == sorted(made.columns) == list(range(stages))
    chosen = list(zip(made.rows, made.columns, strict=True))
    assert chosen[:2] == [(1, 0), (2, 1)]
    assert (0, stages - 1) in chosen
    assert searched <= most
    assert (searched >= stages) is (most > stages)


def test_signs_of_a_long_chain_are_those_of_its_determinant(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a matrix with unknowns of the recursion, at a step so short that its part of v is the mass matrix."""
    small, plain = [], signs._small_matrix
    monkeypatch.setattr(signs, "_small_matrix", lambda *given: small.append(plain(*given)) or small[-1])
    method = method_named("rosenbrock")
    pivots = method_data(method, method.prepared(eomgen.derive(chains.scene("joint", "hinge", 40))), 1e-3)["pivots"]
    [(values, places)] = small
    dense = np.zeros((315, 315))
    dense[tuple(places)] = values
    assert not pivots["each"] and pivots["signs"] == [1] * 315
    assert pivots["whole"] == np.linalg.slogdet(dense)[0]
    inner = np.linalg.solve(dense[40:, 40:], dense[40:, :40])
    M = dense[:40, :40] - dense[:40, 40:] @ inner
    np.testing.assert_allclose(M, M.T, atol=1e-6 * np.abs(M).max())
    assert np.linalg.eigvalsh(0.5 * (M + M.T)).min() > 0.0
