"""Designs: each sample by its number, and the structure that each design is for."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from eomgen.errors import UsageError
from eomgen.products.ensembles import DESIGNS, OTHER_DESIGNS, read_distribution
from eomgen.products.ensembles.designs import grid_design, note_on_balance, random_design

UNIT = read_distribution("vary x", "uniform(0, 1)")


@pytest.mark.parametrize("name", DESIGNS)
def test_a_sample_does_not_depend_on_those_that_are_made_with_it(name: str) -> None:
    design = random_design(name, [UNIT] * 5, 16, seed=5)  # more than the four numbers of a block of Philox
    whole = design.values(0, design.samples)
    parts = [design.values(first, min(7, design.samples - first)) for first in range(0, design.samples, 7)]
    np.testing.assert_array_equal(np.concatenate(parts), whole)
    assert np.all((whole > 0.0) & (whole < 1.0))
    assert not np.array_equal(random_design(name, [UNIT] * 5, 16, seed=6).values(0, design.samples), whole)


@pytest.mark.parametrize("name", ["monte_carlo", "sobol", "halton"])
def test_a_larger_ensemble_begins_with_the_smaller_one(name: str) -> None:
    small, large = (random_design(name, [UNIT] * 5, samples, seed=1) for samples in (8, 64))
    np.testing.assert_array_equal(large.values(0, 8), small.values(0, 8))


def test_each_slice_of_a_latin_hypercube_has_one_sample() -> None:
    found = random_design("latin_hypercube", [UNIT] * 4, 50, seed=2).values(0, 50)
    for column in found.T:
        assert sorted((column * 50).astype(int).tolist()) == list(range(50))


def test_saltelli_mixes_the_columns_of_two_samples() -> None:
    design = random_design("saltelli", [UNIT] * 3, 8, seed=4)
    assert design.samples == 40
    first, second, *mixed = np.split(design.values(0, 40), 5)
    for k, block in enumerate(mixed):
        expected = first.copy()
        expected[:, k] = second[:, k]
        np.testing.assert_array_equal(block, expected)


def test_a_grid_has_all_combinations() -> None:
    lists = [read_distribution("vary x", text) for text in ("values(1, 2)", "linspace(0, 1, 3)")]
    design = grid_design(["a", "b"], lists)
    expected = list(itertools.product((1.0, 2.0), (0.0, 0.5, 1.0)))
    assert [tuple(row) for row in design.values(0, design.samples).tolist()] == expected
    assert "grid" in OTHER_DESIGNS
    with pytest.raises(UsageError, match=r"vary b: a grid needs lists of values, and uniform\(0, 1\) is not a list"):
        grid_design(["a", "b"], [lists[0], UNIT])


def test_numbers_of_samples_that_a_sequence_is_not_made_for() -> None:
    assert note_on_balance("sobol", 500) == "sobol is balanced for a power of two: 256 or 512"
    assert note_on_balance("sobol", 512) == note_on_balance("monte_carlo", 500) == ""
