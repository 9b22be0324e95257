"""Statics of scenes with many parts that are not coupled: blocks of inertia and stiffness, and searches that are
interrupted."""

from __future__ import annotations

import math
from typing import Any, cast

import numpy as np
import pytest
from scipy.linalg import block_diag
from scipy.sparse import csc_array, csr_array, issparse

from eomgen.lie import numeric
from eomgen.lie.groups import SO3
from eomgen.lie.product import Factor, difference, update
from eomgen.solvers.blocks import SOFT, Blocks, congruent, inverse_root, least_solution
from eomgen.solvers.bordered_newton import whole
from eomgen.solvers.equilibrium_search import _LinearMotion
from eomgen.solvers.phi_functions import SymmetricPhi, phi_of_matrix
from tests.oracles.evaluation import Array


def coupled_in_blocks(rng: np.random.Generator, sizes: list[int]) -> Array:
    """Return a symmetric positive definite matrix of blocks, with rows and columns in another order."""
    blocks = [rng.normal(size=(size, size)) for size in sizes]
    matrix = block_diag(*(block @ block.T + np.eye(len(block)) for block in blocks))
    order = rng.permutation(len(matrix))
    return np.asarray(matrix[np.ix_(order, order)])


@pytest.mark.parametrize("sizes", [[1] * 100, [6] * 20, [3, 1, 6, 2] * 10])
def test_the_inverse_root_of_uncoupled_blocks_is_sparse(sizes: list[int], rng: np.random.Generator) -> None:
    M = coupled_in_blocks(rng, sizes)
    inverse = inverse_root(M)
    assert issparse(inverse)
    assert inverse.nnz == sum(size**2 for size in sizes)
    np.testing.assert_allclose(whole(inverse), np.linalg.inv(np.linalg.cholesky(M)), rtol=1e-12, atol=1e-14)
    np.testing.assert_array_equal(whole(inverse_root(csc_array(M))), whole(inverse))
    M[7] = M[:, 7] = 0.0
    with pytest.raises(np.linalg.LinAlgError):
        inverse_root(M)


@pytest.mark.parametrize("sizes", [[5], [6] * 20, [3, 1, 6, 2] * 10], ids=["whole", "equal blocks", "blocks"])
@pytest.mark.parametrize("lost", [0, 3], ids=["regular", "singular"])
def test_the_least_solution_is_as_of_singular_values(sizes: list[int], lost: int, rng: np.random.Generator) -> None:
    """Rows of zeros count, too: a free part has neither stiffness nor load."""
    matrix = coupled_in_blocks(rng, sizes)
    for row in range(lost):
        matrix[row] = matrix[:, row] = 0.0
    right = rng.normal(size=len(matrix))
    expected = np.linalg.lstsq(matrix, right, rcond=SOFT)[0]
    assert np.all(expected[:lost] == 0.0)
    np.testing.assert_allclose(least_solution(Blocks.of(matrix), right), expected, rtol=1e-9, atol=1e-12)
    stiff = matrix.copy()
    stiff[-1, -1] *= 1e13  # beside which all others are soft
    np.testing.assert_allclose(
        least_solution(Blocks.of(stiff), right), np.linalg.lstsq(stiff, right, rcond=SOFT)[0], rtol=1e-9, atol=1e-12
    )


def test_coupled_and_small_matrices_have_no_blocks(rng: np.random.Generator) -> None:
    chain = np.diag(np.full(100, 2.0)) + np.diag(np.full(99, -1.0), 1) + np.diag(np.full(99, -1.0), -1)
    for matrix in (chain, np.eye(6), coupled_in_blocks(rng, [50, 50])):  # the last one is half full
        assert Blocks.of(matrix).single
    assert isinstance(inverse_root(np.eye(6)), np.ndarray)


def test_damped_motions_of_uncoupled_parts_are_those_of_the_whole(
    rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    J, f = -coupled_in_blocks(rng, [1] * 60 + [4] * 10), rng.normal(size=100)
    motion = _LinearMotion(cast("Any", None), Blocks.of(J), f, np.ones(100), 1.0)
    sizes: list[tuple[int, ...]] = []
    eigh = np.linalg.eigh

    def counted(matrix: Array) -> Any:
        sizes.append(matrix.shape)
        return eigh(matrix)

    monkeypatch.setattr(np.linalg, "eigh", counted)
    for order in (1, 3):
        expected = phi_of_matrix(J, f, 0.3, order)
        np.testing.assert_allclose(motion._phi(f, 0.3, order), expected, rtol=1e-9, atol=1e-12)
    assert sizes == [(60, 1, 1), (10, 4, 4)]


@pytest.mark.parametrize("time", [1e-4, 0.3, 1e6])
@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("unstable", [False, True], ids=["stable", "unstable"])
def test_functions_of_narrow_matrices_take_no_eigenvalues(
    time: float, order: int, unstable: bool, rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Against all eigenvalues of a chain of 150 springs in any order, which may stand on springs that push."""
    n = 150
    springs = rng.uniform(1.0, 1e4, n + 1)
    J = -np.diag(springs[:-1] + springs[1:]) + np.diag(springs[1:-1], 1) + np.diag(springs[1:-1], -1)
    if unstable:
        J += (3.0 - np.linalg.eigvalsh(J)[-1]) * np.eye(n)
    values, vectors = np.linalg.eigh(J)
    assert (values[-1] > 0.0) == unstable
    if unstable:
        time = min(time, 5.0 / values[-1])
    x = time * values
    phi = {1: np.expm1(x) / x, 2: (np.expm1(x) - x) / x**2, 3: (np.expm1(x) - x - 0.5 * x**2) / x**3}
    series = sum(x**k / math.factorial(k + order) for k in range(12))
    f = rng.normal(size=n)
    expected = time * (vectors @ (np.where(np.abs(x) < 0.1, series, phi[order]) * (vectors.T @ f)))
    order_of_rows = rng.permutation(n)
    mixed = csc_array(J[np.ix_(order_of_rows, order_of_rows)])
    blocks = Blocks.of(mixed, narrow=True)
    assert not blocks.single
    np.testing.assert_array_equal(blocks.whole, mixed.toarray())
    assert [places.shape for places, _ in blocks.stacks] == [(1, n)]
    whole_sizes = []
    eigh = np.linalg.eigh

    def counted(matrix: Array) -> Any:
        whole_sizes.append(len(matrix))
        return eigh(matrix)

    monkeypatch.setattr(np.linalg, "eigh", counted)
    found = SymmetricPhi(blocks)(f[order_of_rows], time, order)
    error = np.linalg.norm(found - expected[order_of_rows])
    assert error <= 1e-9 * np.linalg.norm(expected)
    assert max(whole_sizes, default=0) <= 60


def test_unstable_parts_that_grow_far_take_all_eigenvalues(rng: np.random.Generator) -> None:
    n = 130
    J = -np.diag(np.full(n, 2.0)) + np.diag(np.ones(n - 1), 1) + np.diag(np.ones(n - 1), -1) + 3.0 * np.eye(n)
    f, time = rng.normal(size=n), 20.0
    values, vectors = np.linalg.eigh(J)
    expected = vectors @ (np.expm1(time * values) / values * (vectors.T @ f))
    np.testing.assert_allclose(SymmetricPhi(Blocks.of(csc_array(J), narrow=True))(f, time, 1), expected, rtol=1e-10)


@pytest.mark.parametrize("by_rows", [False, True])
def test_blocks_of_sparse_matrices_are_those_of_whole_ones(by_rows: bool, rng: np.random.Generator) -> None:
    M = coupled_in_blocks(rng, [1] * 60 + [4] * 10 + [30])
    x, rows = rng.normal(size=len(M)), rng.uniform(1.0, 2.0, len(M))
    A = M.copy()
    A[M != 0.0] *= rng.uniform(0.5, 1.0, np.count_nonzero(M))
    sparse = Blocks.of(cast("Any", csr_array(A)) if by_rows else csc_array(A), narrow=by_rows)
    dense = Blocks.of(A)
    for blocks in (sparse, dense):
        assert sorted(places.shape for places, _ in blocks.stacks) == [(1, 30), (10, 4), (60, 1)]
        assert np.array_equal(blocks.whole, A)
        assert np.array_equal(blocks.symmetric.whole, 0.5 * (A + A.T))
        assert np.array_equal(blocks.negative.whole, -A)
        assert np.array_equal(blocks.divide_rows(rows).whole, A / rows[:, np.newaxis])
        assert np.array_equal(blocks.largest_of_rows, np.abs(A).max(axis=1))
        assert blocks.largest == np.abs(A).max()
        assert blocks.skew == np.abs(A - A.T).max()
        np.testing.assert_allclose(blocks.times(x), A @ x, rtol=1e-12, atol=1e-12)
        values, vectors = blocks.symmetric.spectrum()
        np.testing.assert_allclose(values, np.linalg.eigvalsh(0.5 * (A + A.T)), rtol=1e-10, atol=1e-10)
        np.testing.assert_allclose(vectors @ np.diag(values) @ vectors.T, 0.5 * (A + A.T), atol=1e-10)
        lowest = float(values[0])
        assert blocks.symmetric.above(lowest - 1e-6)
        assert not blocks.symmetric.above(lowest + 1e-6)


def test_eigenvectors_up_to_a_limit_are_those_of_all_eigenvalues(rng: np.random.Generator) -> None:
    """Of blocks that are large and stiff, large with two soft directions, and small and equal."""
    firm, soft = coupled_in_blocks(rng, [80]) + 10.0 * np.eye(80), coupled_in_blocks(rng, [90])
    values, vectors = np.linalg.eigh(soft)
    soft = vectors @ np.diag([-2.0, 1e-3, *(values[2:] + 10.0)]) @ vectors.T
    matrix = block_diag(firm, 0.5 * (soft + soft.T), *[np.array([[3.0, 2.9], [2.9, 3.0]])] * 40)
    order = rng.permutation(len(matrix))
    matrix = matrix[np.ix_(order, order)]
    found, directions = Blocks.of(csc_array(matrix)).lowest(1.0)
    np.testing.assert_allclose(found, np.linalg.eigvalsh(matrix), rtol=1e-10, atol=1e-10)
    assert directions.shape == (250, 42)
    np.testing.assert_allclose(matrix @ directions, directions * found[:42], atol=1e-10)
    np.testing.assert_allclose(directions.T @ directions, np.eye(42), atol=1e-10)


def test_a_system_without_free_directions_has_no_blocks_to_decompose() -> None:
    nothing = Blocks.of(np.zeros((0, 0)))
    assert (nothing.size, nothing.largest, nothing.skew) == (0, 0.0, 0.0)
    assert [part.shape for part in nothing.spectrum()] == [(0,), (0, 0)]
    assert [part.shape for part in nothing.lowest(1.0)] == [(0,), (0, 0)]
    assert nothing.above(1.0)
    assert least_solution(nothing, np.zeros(0)).shape == (0,)
    assert SymmetricPhi(nothing)(np.zeros(0), 1.0, 1).shape == (0,)


@pytest.mark.parametrize("narrow", [False, True])
def test_functions_of_no_force_and_of_forces_that_are_not_numbers(narrow: bool) -> None:
    n = 150 if narrow else 8
    J = -2.0 * np.eye(n) + np.eye(n, k=1) + np.eye(n, k=-1)
    blocks = Blocks.of(csc_array(J) if narrow else J, narrow=narrow)
    assert np.array_equal(SymmetricPhi(blocks)(np.zeros(n), 3.0, 1), np.zeros(n))
    motion = _LinearMotion(cast("Any", None), blocks, np.zeros(n), np.ones(n), 1.0)
    assert np.all(np.isnan(motion._phi(np.full(n, np.nan), 3.0, 1)))
    at_rest = Blocks.of(csc_array((n, n)) if narrow else np.zeros((n, n)), narrow=narrow)
    np.testing.assert_allclose(SymmetricPhi(at_rest)(np.ones(n), 3.0, 3), np.full(n, 0.5), rtol=1e-14)


@pytest.mark.parametrize("diagonal", [True, False])
def test_stiffness_along_a_sparse_basis_is_the_product(diagonal: bool, rng: np.random.Generator) -> None:
    K = csc_array(coupled_in_blocks(rng, [3] * 40))
    basis = csc_array(np.diag(rng.uniform(1.0, 2.0, 120)) if diagonal else coupled_in_blocks(rng, [2] * 60))
    expected = basis.toarray().T @ K.toarray() @ basis.toarray()
    np.testing.assert_allclose(whole(congruent(basis, K)), expected, rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(congruent(basis.toarray(), K), expected, rtol=1e-13, atol=1e-13)


def test_steps_of_mixed_factors_are_taken_group_by_group(rng: np.random.Generator) -> None:
    """Bodies with orientation and position apart: each group is one call."""
    factors = []
    for k in range(3):
        factors.append(Factor("R", f"{k}.position", 7 * k + 4, 3, 6 * k + 3, 3))
        factors.append(Factor("SO3", f"{k}.orientation", 7 * k, 4, 6 * k, 3))
    q, theta = rng.normal(size=(5, 21)), 0.5 * rng.normal(size=(5, 18))
    for factor in factors[1::2]:
        q[:, factor.q] = numeric.unit(q[:, factor.q])
    moved = update(factors, q, theta)
    for position, orientation in zip(factors[::2], factors[1::2], strict=True):
        assert np.array_equal(moved[:, position.q], q[:, position.q] + theta[:, position.v])
        alone = numeric.update(SO3, q[:, orientation.q], theta[:, orientation.v])
        np.testing.assert_allclose(moved[:, orientation.q], alone, rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(difference(factors, q, moved), theta, atol=1e-12)
