"""Statistics of blocks against those of all samples at once."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from eomgen.products.ensembles.statistics import Reduction

RNG = np.random.default_rng(7)
#: Samples, columns, times; large means beside small deviations.
DATA = RNG.normal(size=(1000, 2, 3)) * np.array([1.0, 1e-3])[:, None] + np.array([1e6, 5.0])[:, None]


def reduced(data: np.ndarray, sizes: tuple[int, ...]) -> Reduction:
    found = Reduction(*data.shape[1:])
    for block in np.split(data, np.cumsum(sizes)):
        found.add(block)
    return found


def test_moments_are_those_of_all_samples() -> None:
    found = reduced(DATA, (1, 0, 300, 7))
    np.testing.assert_allclose(found.mean, DATA.mean(axis=0), rtol=1e-14)
    np.testing.assert_allclose(found.deviation, DATA.std(axis=0, ddof=1), rtol=1e-9)
    np.testing.assert_array_equal(found.minimum, DATA.min(axis=0))
    np.testing.assert_array_equal(found.maximum, DATA.max(axis=0))
    for time in range(3):
        np.testing.assert_allclose(found.covariance[time], np.cov(DATA[:, :, time].T), rtol=1e-6, atol=1e-12)


def test_samples_without_a_number_do_not_count() -> None:
    data = DATA.copy()
    data[::3, :, 2] = np.nan
    data[5, 0, 0] = np.nan
    data[:, :, 1] = np.nan
    found = reduced(data, (400, 4))
    assert found.count[0].tolist() == [999.0, 0.0, 666.0]
    there = data[:, :, [0, 2]]
    np.testing.assert_allclose(found.mean[:, [0, 2]], np.nanmean(there, axis=0), rtol=1e-14)
    np.testing.assert_allclose(found.deviation[:, [0, 2]], np.nanstd(there, axis=0, ddof=1), rtol=1e-9)
    assert np.all(np.isnan(found.deviation[:, 1])) and np.all(np.isnan(found.covariance[1]))
    both = np.delete(data[:, :, 0], 5, axis=0)
    np.testing.assert_allclose(found.covariance[0], np.cov(both.T), rtol=1e-6, atol=1e-12)
    assert np.isnan(found.quantiles(0, np.array([0.5]))[0, 1])


def test_quantiles_have_the_ranks_that_they_are_of() -> None:
    probabilities = np.array([0.001, 0.05, 0.5, 0.95, 0.999])
    data = RNG.normal(size=(20000, 1, 1))
    found = reduced(data, (3000, 5000)).quantiles(0, probabilities)[:, 0]
    ranks = np.mean(data[:, 0] <= found, axis=0)
    np.testing.assert_allclose(ranks, probabilities, atol=6e-3)
    np.testing.assert_allclose(ranks[[0, -1]], probabilities[[0, -1]], atol=3e-4)


def test_a_histogram_has_the_probabilities_of_its_bins() -> None:
    edges = np.linspace(-4, 4, 9)
    data = RNG.normal(size=(20000, 1, 1))
    expected = np.histogram(data, edges)[0] / 20000
    np.testing.assert_allclose(reduced(data, (999,)).histogram(0, 0, edges), expected, atol=6e-3)


@pytest.mark.parametrize("blocks", [2, 6, 7, 9])  # before and behind the samples that are sketched together
def test_what_was_written_goes_on_with_the_same_bits(blocks: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("eomgen.products.ensembles.statistics._WAITING", 2048)
    data = np.concatenate([DATA, 2.0 * DATA, 3.0 * DATA])
    straight = reduced(data, (300,) * 10)
    stopped = Reduction.of_arrays(reduced(data[: 300 * blocks], (300,) * blocks).arrays())
    for block in np.split(data[300 * blocks :], 10 - blocks):
        stopped.add(block)
    for name, array in straight.arrays().items():
        np.testing.assert_array_equal(stopped.arrays()[name], array, err_msg=name)
    assert straight.arrays()["waiting"].shape[1] == 3000 - 2100


def test_samples_of_small_ensembles_wait_until_a_quantile_is_asked_for() -> None:
    small = reduced(DATA, (500, 500))
    assert small.arrays()["waiting"].shape[1] == len(DATA)
    small.quantiles(0, np.array([0.5]))
    assert small.arrays()["waiting"].shape[1] == 0


def test_statistics_over_time_do_without_the_package_of_sketches(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "datasketches", None)
    found = reduced(DATA, (10,))
    assert not found.has_quantiles
    np.testing.assert_allclose(found.mean, DATA.mean(axis=0))
    with pytest.raises(Exception, match=r"which is not installed; try: pip install 'eomgen\[ensembles\]'"):
        found.quantiles(0, np.array([0.5]))
