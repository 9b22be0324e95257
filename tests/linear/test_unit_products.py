"""Products with bases that select components, and with zeros, are moves: to the same numbers as products."""

from __future__ import annotations

import numpy as np
import pytest

from eomgen.products.linear.freedom import times


@pytest.fixture
def factors(rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Square matrices: of any numbers, of single ones, with a column that is taken twice, almost of ones, zeros."""
    chosen = np.eye(4)[[2, 0, 3, 1]]
    twice = np.eye(4)[[2, 2, 3, 1]]
    nearly = chosen + 1e-16 * np.eye(4)
    return {
        "any": rng.normal(size=(4, 4)),
        "chosen": chosen,
        "twice": twice,
        "nearly": nearly,
        "scaled": 2.0 * chosen,
        "zero": np.zeros((4, 4)),
    }


@pytest.mark.parametrize("first", ["any", "chosen", "twice", "nearly", "scaled", "zero"])
@pytest.mark.parametrize("second", ["any", "chosen", "twice", "nearly", "scaled", "zero"])
def test_they_are_the_products(factors: dict[str, np.ndarray], first: str, second: str) -> None:
    left, right = factors[first], factors[second]
    assert np.array_equal(times(left, right), left @ right)
    assert np.array_equal(times(left[:3], right), left[:3] @ right)
    assert np.array_equal(times(left, right[:, :3]), left @ right[:, :3])
    assert np.array_equal(times(left, 1j * right), left @ (1j * right))


def test_empty_matrices_and_numbers_that_are_none(factors: dict[str, np.ndarray]) -> None:
    assert times(np.zeros((3, 0)), np.zeros((0, 2))).shape == (3, 2)
    assert times(np.zeros((0, 4)), factors["any"]).shape == (0, 4)
    unknown = np.full((4, 4), np.nan)
    assert np.all(np.isnan(times(factors["zero"], unknown))) and np.all(np.isnan(times(unknown, factors["zero"])))
