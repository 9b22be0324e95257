"""Statics of scenes with many parts that are not coupled: blocks of inertia and stiffness, and searches that are
interrupted."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import pytest
from scipy.linalg import block_diag
from scipy.sparse import issparse

from eomgen.lie import numeric
from eomgen.lie.groups import SO3
from eomgen.lie.product import Factor, difference, update
from eomgen.solvers import equilibrium_search
from eomgen.solvers.bordered_newton import whole
from eomgen.solvers.equilibrium_search import _LinearMotion
from eomgen.solvers.statics import SOFT, inverse_root, least_solution, uncoupled_blocks
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
    np.testing.assert_allclose(least_solution(matrix, right), expected, rtol=1e-9, atol=1e-12)
    stiff = matrix.copy()
    stiff[-1, -1] *= 1e13  # beside which all others are soft
    np.testing.assert_allclose(
        least_solution(stiff, right), np.linalg.lstsq(stiff, right, rcond=SOFT)[0], rtol=1e-9, atol=1e-12
    )


def test_coupled_and_small_matrices_have_no_blocks(rng: np.random.Generator) -> None:
    chain = np.diag(np.full(100, 2.0)) + np.diag(np.full(99, -1.0), 1) + np.diag(np.full(99, -1.0), -1)
    assert uncoupled_blocks(chain) == []
    assert uncoupled_blocks(np.eye(6)) == []
    assert uncoupled_blocks(coupled_in_blocks(rng, [50, 50])) == []  # half full
    assert isinstance(inverse_root(np.eye(6)), np.ndarray)


def test_damped_motions_of_uncoupled_parts_are_those_of_the_whole(
    rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    J, f = -coupled_in_blocks(rng, [1] * 60 + [4] * 10), rng.normal(size=100)
    motion = _LinearMotion(cast("Any", None), J, f, np.ones(100), 1.0)
    sizes: list[tuple[int, ...]] = []
    eigh = np.linalg.eigh

    def counted(matrix: Array) -> Any:
        sizes.append(matrix.shape)
        return eigh(matrix)

    monkeypatch.setattr(np.linalg, "eigh", counted)
    for order in (1, 3):
        expected = equilibrium_search._phi(J, f, 0.3, order)
        np.testing.assert_allclose(motion._phi(f, 0.3, order), expected, rtol=1e-9, atol=1e-12)
    assert sizes == [(60, 1, 1), (10, 4, 4)]


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
