"""Balanced matrices against T^-1 A T, also where scales are beyond whole numbers of a machine."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from eomgen.products.linear.eigenvalues import balance, unbalance
from eomgen.products.linear.modes import modes


@pytest.mark.parametrize("permute", [False, True])
def test_it_is_the_matrix_in_other_units(permute: bool, rng: np.random.Generator) -> None:
    A = rng.normal(size=(6, 6)) * np.outer(10.0 ** rng.uniform(-8, 8, 6), 10.0 ** rng.uniform(-8, 8, 6))
    A[3, :3] = A[4, :4] = 0.0
    B, T = balance(A, permute=permute)
    np.testing.assert_allclose(T @ B, A @ T, rtol=1e-12, atol=1e-12 * np.abs(A @ T).max())
    vectors = rng.normal(size=(6, 4)) + 1j * rng.normal(size=(6, 4))
    assert np.array_equal(unbalance(T, vectors), T @ vectors)


def test_scales_beyond_whole_numbers_are_no_warning() -> None:
    A = np.array([[0.0, 1.0], [-1e-60, 0.0]])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        B, T = balance(A, permute=False)
        found = modes(A, np.eye(1, 2), ["x"], np.ones(1))
    assert T[0, 0] / T[1, 1] > 2.0**63
    np.testing.assert_allclose(B[0, 1] * B[1, 0], -1e-60, rtol=1e-15)
    np.testing.assert_allclose(found.angular_frequency, 1e-30, rtol=1e-9)
