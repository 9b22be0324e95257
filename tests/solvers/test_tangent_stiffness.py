"""Inertias, determinants and eigenvalues of stiffnesses under constraints, against dense linear algebra."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
import scipy.linalg
from scipy.sparse import csc_array

from eomgen.solvers.bordered_newton import Tangents
from eomgen.solvers.tangent_stiffness import (
    TangentStiffness,
    _determinant,
    _independent,
    _negative_pivots,
    _ritz,
    compliance,
)
from tests.oracles.evaluation import Array


def on_free(K: Array, B: Array) -> Array:
    """Return a stiffness on what the constraints leave free."""
    free = scipy.linalg.null_space(B) if len(B) else np.eye(len(K))
    return np.asarray(free.T @ K @ free)


def banded(rng: np.random.Generator, n: int) -> Array:
    K = np.triu(np.tril(rng.normal(size=(n, n)), 2), -2)
    return np.asarray(K + K.T)


@pytest.mark.parametrize("rows", [0, 3])
def test_pivots_without_exchanges_have_the_signs_of_eigenvalues(rows: int, rng: np.random.Generator) -> None:
    sizes = np.geomspace(1.0, 1e-3, 30)
    for shift in (-2.0, 0.0, 5.0):
        K, B = banded(rng, 30) + shift * np.eye(30), rng.normal(size=(rows, 30))
        stiffness = TangentStiffness(csc_array(K / np.outer(sizes, sizes)), csc_array(B / sizes), sizes)
        expected = np.sum(np.linalg.eigvalsh(on_free(K, B)) < 0.0)
        assert stiffness._sparse_negative() == expected == stiffness.below(0.0)
    one, none = csc_array(np.array([[0.0, 1.0], [1.0, 0.0]])), csc_array((0, 2))
    assert TangentStiffness(one, none, np.ones(2))._sparse_negative() is None  # these pivots need an exchange
    assert TangentStiffness(0.0 * one, none, np.ones(2))._sparse_negative() is None
    held = TangentStiffness(0.0 * one, csc_array(np.array([[1.0, 0.0], [1.0, 1.0]])), np.ones(2))
    assert held._sparse_negative() == 0  # by constraints alone


def test_numbers_below_a_value_count_in_the_measure_of_the_sizes(rng: np.random.Generator) -> None:
    sizes = rng.uniform(0.5, 2.0, 12)
    K, B = banded(rng, 12), rng.normal(size=(2, 12))
    for form in (np.asarray, csc_array):
        stiffness = TangentStiffness(form(K / np.outer(sizes, sizes)), form(B / sizes), sizes)
        values = np.linalg.eigvalsh(on_free(K, B))
        assert [stiffness.below(value) for value in (-1.5, 0.0, 1.5)] == [
            np.sum(values < value) for value in (-1.5, 0.0, 1.5)
        ]
        assert (stiffness.negative, stiffness.neutral) == (np.sum(values < 0.0), 0)


def test_negative_pivots_and_determinants_are_those_of_dense_matrices(rng: np.random.Generator) -> None:
    assert _negative_pivots(np.zeros((0, 0))) == 0
    assert _negative_pivots(np.array([[0.0, 1.0], [1.0, 0.0]])) == 1
    assert _determinant(csc_array(np.ones((2, 2)))) == (0, -np.inf)
    for size in (1, 2, 5, 8, 9):
        A = rng.normal(size=(size, size))
        assert _negative_pivots(A + A.T) == np.sum(np.linalg.eigvalsh(A + A.T) < 0.0)
        np.testing.assert_allclose(_determinant(csc_array(A)), np.linalg.slogdet(A), rtol=1e-9, atol=1e-12)


def test_determinants_are_by_groups_of_coupled_components() -> None:
    """Three groups: a follower force, a held component with its row, and a component that is pushed away."""
    K = scipy.linalg.block_diag([[1.0, 3.0], [2.0, 1.0]], [[-4.0]], [[-2.0]])
    stiffness = TangentStiffness(csc_array(K), csc_array(np.array([[0.0, 0.0, 5.0, 0.0]])), np.ones(4))
    groups = stiffness.groups()
    assert groups[0] == groups[1] and groups[2] == groups[4] and len(set(groups.tolist())) == 3
    signs = [sign for sign, _ in stiffness.determinants(groups)]
    assert [signs[groups[k]] for k in (0, 2, 3)] == [-1, 1, -1]
    assert not stiffness.symmetric and stiffness.negative == 2
    joined = TangentStiffness(csc_array(np.ones((4, 4))), stiffness.B, np.ones(4))
    assert set(stiffness.groups(joined).tolist()) == {0}


def test_rows_that_follow_from_others_are_left_out(rng: np.random.Generator) -> None:
    sizes = np.array([1.0, 1e-3, 1.0, 10.0])
    rows = rng.normal(size=(2, 4)) / sizes
    B = np.stack([rows[0], 3.0 * rows[0], rows[1], rows[0] - rows[1]])
    kept = np.asarray(_independent(B, sizes))
    assert len(kept) == 2 and all(any(np.array_equal(row, other) for other in B) for row in kept)
    np.testing.assert_allclose(kept.T @ np.linalg.lstsq(kept.T, B.T, rcond=None)[0], B.T, rtol=1e-9)
    assert _independent(rows, sizes) is rows
    wide = np.ones((601, 600))
    assert _independent(wide, np.ones(600)) is wide  # too large for a dense factorization


def test_a_free_direction_is_neutral_and_comes_first() -> None:
    K = csc_array(np.array([[1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 7.0]]))
    stiffness = TangentStiffness(K, csc_array((0, 3)), np.ones(3))
    assert compliance(K, stiffness.B) is None
    assert (stiffness.neutral, stiffness.negative) == (1, 0)
    values, directions = stiffness.next_to_zero(2)
    assert abs(values[0]) < 1e-12
    assert values[1] == pytest.approx(2.0, rel=0.1)  # digits are lost beside a compliance of 1e14
    np.testing.assert_allclose(np.abs(directions[:, 0]), [0.5**0.5, 0.5**0.5, 0.0], atol=1e-9)
    held = TangentStiffness(K, csc_array(np.eye(3)), np.ones(3))
    assert held.next_to_zero(2)[1].shape == (3, 0)


def test_the_compliance_maps_forces_to_displacements_under_constraints(rng: np.random.Generator) -> None:
    K, B = banded(rng, 6) + 9.0 * np.eye(6), rng.normal(size=(2, 6))
    free, forces = scipy.linalg.null_space(B), rng.normal(size=(6, 3))
    for form in (np.asarray, csc_array):
        solve = compliance(form(K), form(B))
        assert solve is not None
        np.testing.assert_allclose(solve(forces), free @ np.linalg.solve(free.T @ K @ free, free.T @ forces), rtol=1e-9)


def test_the_nearest_eigenvalues_without_a_potential_are_the_real_ones() -> None:
    """A turning pair has complex eigenvalues, which are no stiffnesses."""
    basis = np.array([[1.0, 0.2, 0.1, 0.0], [0.0, 1.0, 0.3, 0.2], [0.1, 0.0, 1.0, 0.4], [0.2, 0.1, 0.0, 1.0]])
    inverse = basis @ scipy.linalg.block_diag([[0.5]], [[-2.0]], [[0.1, 3.0], [-3.0, 0.1]]) @ np.linalg.inv(basis)
    values, turn = _ritz(inverse, symmetric=False)
    np.testing.assert_allclose(values, [-0.5, 2.0], rtol=1e-12)
    np.testing.assert_allclose(inverse @ turn, turn / values, atol=1e-12)
    values, turn = _ritz(np.array([[2.0, 0.0], [0.0, 0.0]]), symmetric=True)
    assert values.tolist() == [0.5, np.inf] and np.abs(turn).tolist() == [[1.0, 0.0], [0.0, 1.0]]


def test_internal_states_that_follow_at_once_soften_the_stiffness(rng: np.random.Generator) -> None:
    """K - Rz Fz^-1 Fq, and K alone if rates do not depend on the states."""
    K, Rz, Fq, Fz = (rng.normal(size=shape) for shape in ((3, 3), (3, 2), (2, 3), (2, 2)))
    statics = cast("Any", SimpleNamespace(sizes=np.ones(3)))
    for form in (np.asarray, csc_array):
        for inner, expected in ((Fz, K - Rz @ np.linalg.solve(Fz, Fq)), (0.0 * Fz, K)):
            parts = [form(part) for part in (K, np.zeros((0, 3)), Rz, Fq, inner)]
            statics.tangents = lambda rest, parts=parts: Tangents(*parts)
            found = TangentStiffness.at(statics, cast("Any", None)).K
            np.testing.assert_allclose(found if form is np.asarray else found.toarray(), expected, rtol=1e-9)
