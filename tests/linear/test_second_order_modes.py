"""Modes of models of many coordinates, part by part, against all eigenvalues of the first-order matrix."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.linalg
from scipy.optimize import linear_sum_assignment

from eomgen.products.linear.eigenvalues import EPSILON
from eomgen.products.linear.modes import Modes
from eomgen.products.linear.second_order_modes import second_order_modes
from tests.oracles.evaluation import Array


def chain(n: int, held: bool = True) -> Array:
    """Return the stiffness of a chain of unit springs."""
    K = np.diag(np.full(n, 2.0)) + np.diag(np.full(n - 1, -1.0), 1) + np.diag(np.full(n - 1, -1.0), -1)
    if not held:
        K[0, 0] = K[-1, -1] = 1.0
    return K


def checked(M: Array, C: Array, K: Array) -> Modes:
    """Return the modes, after checks of eigenvalues, shapes and order against ``scipy.linalg.eig``."""
    n = len(M)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    modes = second_order_modes(M, C, K, [f"x[{k}]" for k in range(n)])
    expected = scipy.linalg.eigvals(A)
    expected = expected[expected.imag >= 0.0]
    assert len(modes) == len(expected)
    apart = np.abs(modes.eigenvalues[:, np.newaxis] - expected)
    rows, columns = linear_sum_assignment(apart)
    assert np.all(apart[rows, columns] <= modes.uncertainty[rows] + 1e-9 * np.abs(expected[columns]))
    residual = A @ modes.state_shapes - modes.state_shapes * modes.eigenvalues
    assert np.max(np.abs(residual)) <= 1e-10 * np.linalg.norm(A, 2) * np.max(np.abs(modes.state_shapes))
    np.testing.assert_allclose(np.max(np.abs(modes.shapes), axis=0), 1.0, rtol=1e-12)
    np.testing.assert_array_equal(modes.shapes, modes.state_shapes[:n])
    size = np.where(np.abs(modes.eigenvalues) <= modes.uncertainty, 0.0, np.abs(modes.eigenvalues))
    assert np.all(np.diff(size) >= -1e-11 * np.max(size))
    np.testing.assert_allclose(modes.weights, np.sqrt(np.abs(np.diagonal(M))))
    return modes


@pytest.fixture
def decomposed(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Return the sizes of the matrices whose eigenvectors are asked for."""
    sizes: list[int] = []
    eig = scipy.linalg.eig

    def counted(A: Array, **options: Any) -> Any:
        sizes.append(len(A))
        return eig(A, **options)

    monkeypatch.setattr(scipy.linalg, "eig", counted)
    return sizes


@pytest.mark.parametrize("light", [True, False], ids=["light", "overdamped"])
@pytest.mark.parametrize("diagonal", [True, False], ids=["point masses", "coupled inertias"])
def test_proportional_damping_takes_symmetric_matrices_alone(
    light: bool, diagonal: bool, rng: np.random.Generator, decomposed: list[int]
) -> None:
    n = 60
    mixed = rng.normal(size=(n, n))
    M = np.diag(rng.uniform(1.0, 3.0, n)) if diagonal else np.eye(n) + 0.1 * mixed @ mixed.T / n
    K = 1e4 * chain(n)
    C = 0.1 * M + (1e-5 if light else 0.1) * K
    modes = checked(M, C, K)
    assert decomposed == []
    squares = scipy.linalg.eigh(K, M, eigvals_only=True)
    roots = np.concatenate([np.roots([1.0, 0.1 + (1e-5 if light else 0.1) * square, square]) for square in squares])
    roots = np.sort_complex(roots[roots.imag >= 0.0])
    np.testing.assert_allclose(np.sort_complex(modes.eigenvalues), roots, rtol=1e-7)


@pytest.mark.parametrize(("dampers", "parts"), [([10, 39], [50, 50]), ([3], [100])], ids=["one symmetry", "all"])
def test_damping_is_decomposed_with_the_modes_that_it_couples(
    dampers: list[int], parts: list[int], decomposed: list[int]
) -> None:
    """A chain between walls, whose modes are even and odd about its middle, as are two equal dampers."""
    n = 50
    C = np.diag(np.where(np.isin(np.arange(n), dampers), 0.7, 0.0))
    checked(np.eye(n), C, chain(n))
    assert sorted(decomposed) == parts


def test_unstable_modes_have_real_eigenvalues_of_both_signs() -> None:
    n = 40
    modes = checked(np.eye(n), np.zeros((n, n)), chain(n) - 0.1 * np.eye(n))
    squares = np.linalg.eigvalsh(chain(n) - 0.1 * np.eye(n))
    below = int(np.sum(squares < 0.0))
    assert below
    assert int(np.sum(modes.eigenvalues.real > 0.01)) == below
    assert int(np.sum(modes.eigenvalues.real < -0.01)) == below
    assert modes.stability == "unstable"


def test_equal_parts_and_free_ones_are_decomposed_once(rng: np.random.Generator, decomposed: list[int]) -> None:
    """Twenty equal bodies on springs, thirty that nothing holds, and one chain, in any order."""
    M = scipy.linalg.block_diag(*[np.array([[2.0, 0.3], [0.3, 1.0]])] * 20, np.eye(30), np.eye(25))
    K = scipy.linalg.block_diag(*[np.array([[5.0, -1.0], [-1.0, 3.0]])] * 20, np.zeros((30, 30)), chain(25))
    C = 0.02 * K
    order = rng.permutation(len(M))
    M, C, K = (matrix[np.ix_(order, order)] for matrix in (M, C, K))
    modes = second_order_modes(M, C, K, [str(k) for k in range(len(M))])
    assert sorted(set(decomposed)) == [2, 4]
    assert len(decomposed) <= 3  # pairs in two orders
    zero = np.abs(modes.eigenvalues) <= modes.uncertainty
    assert int(np.sum(zero)) == 60
    A = np.block([[np.zeros_like(M), np.eye(len(M))], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    residual = A @ modes.state_shapes - modes.state_shapes * modes.eigenvalues
    assert np.max(np.abs(residual)) <= 1e-12 * np.max(np.abs(modes.state_shapes))


def _edges() -> dict[str, tuple[Array, Array, Array]]:
    """Return M, C and K of models at the limits of the method."""
    one, n = np.ones((1, 1)), 30
    unit, damper = np.eye(n), np.zeros((n, n))
    damper[4, 4] = 0.3
    root = np.asarray(scipy.linalg.sqrtm(chain(n)).real)
    signs = np.diag(np.where(np.arange(n) < 3, -1.0, 1.0))
    skew = 0.1 * (np.tri(n) - np.tri(n).T) * np.cos(np.add.outer(np.arange(n), np.arange(n)))
    return {
        "one coordinate": (2.0 * one, 0.1 * one, 3.0 * one),
        "one free coordinate": (one, 0.0 * one, 0.0 * one),
        "equal frequencies, one damper across": (unit, np.full((n, n), 0.01), 5.0 * unit),
        "free chain with one damper": (unit, damper, chain(n, held=False)),
        "nearly critical damping": (unit, 2.001 * root, chain(n)),
        "damping without stiffness": (unit, chain(n), np.zeros((n, n))),
        "follower forces": (unit, np.zeros((n, n)), chain(n) + 0.01 * skew),
        "gyroscopic terms": (unit, skew + 0.01 * unit, chain(n)),
        "inertia of both signs": (signs, 0.1 * unit, chain(n)),
    }


@pytest.mark.parametrize("name", _edges())
def test_models_at_the_limits_of_the_method(name: str) -> None:
    checked(*_edges()[name])


def test_double_eigenvalues_of_critical_damping_are_met_to_their_uncertainty() -> None:
    n = 30
    damping = 2.0 * np.asarray(scipy.linalg.sqrtm(chain(n)).real)
    modes = second_order_modes(np.eye(n), damping, chain(n), [str(k) for k in range(n)])
    expected = -np.sqrt(np.linalg.eigvalsh(chain(n)))
    nearest = np.min(np.abs(modes.eigenvalues[:, np.newaxis] - expected), axis=1)
    assert np.all(nearest <= modes.uncertainty)
    assert np.all(modes.uncertainty < 1e-5)
    assert modes.stability == "stable"


def test_uncertainties_bound_the_effect_of_rounding(rng: np.random.Generator) -> None:
    """Of a change of the matrices by rounding, beyond which there is a tenth of the bound at least."""
    n = 60
    K, M = 1e6 * chain(n), np.diag(rng.uniform(1.0, 3.0, n))
    modes = second_order_modes(M, 1e-5 * K, K, [str(k) for k in range(n)])
    noise = rng.normal(size=(n, n))
    noise = EPSILON * np.linalg.norm(K, 2) * (noise + noise.T) / np.linalg.norm(noise + noise.T, 2)
    changed = second_order_modes(M, 1e-5 * K, K + noise, [str(k) for k in range(n)])
    assert np.all(np.abs(changed.eigenvalues - modes.eigenvalues) <= modes.uncertainty)
    assert np.all(modes.uncertainty <= 1e-7 * np.abs(modes.eigenvalues))
