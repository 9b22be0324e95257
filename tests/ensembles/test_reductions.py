"""Statistics of blocks against those of all samples at once."""

from __future__ import annotations

import numpy as np
import pytest

from eomgen.errors import UsageError
from eomgen.products.ensembles.statistics import Reduction, ranking

RNG = np.random.default_rng(7)
#: Samples, columns, times; large means beside small deviations.
DATA = RNG.normal(size=(1000, 2, 3)) * np.array([1.0, 1e-3])[:, None] + np.array([1e6, 5.0])[:, None]


def reduced(data: np.ndarray, sizes: tuple[int, ...]) -> Reduction:
    return added(data, sizes).whole()


def added(data: np.ndarray, sizes: tuple[int, ...]) -> Reduction:
    found = Reduction(*data.shape[1:], 256)
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


@pytest.mark.parametrize("missing", [0, 3])
def test_quantiles_of_kept_numbers_are_exact(missing: int) -> None:
    data = RNG.normal(size=(777, 2, 3))
    if missing:
        data[::missing, 1, 2] = np.nan
    probabilities = [0.0, 0.001, 0.25, 0.5, 0.999, 1.0]
    found = reduced(data, (1, 300))
    for column in range(2):
        expected = np.nanquantile(data[:, column], probabilities, axis=0)
        np.testing.assert_allclose(found.quantiles(column, np.array(probabilities)), expected, rtol=1e-13, atol=1e-15)


@pytest.mark.parametrize("law", ["normal", "lognormal", "two values"])
def test_quantiles_of_centroids_have_the_ranks_that_they_are_of(law: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("eomgen.products.ensembles.statistics._KEPT", 2**13)
    probabilities = np.array([0.001, 0.05, 0.5, 0.95, 0.999])
    data = RNG.normal(size=(50000, 2, 2))
    data = {"normal": data, "lognormal": 1e6 + np.exp(2.0 * data), "two values": np.where(data > 1.0, 7.0, 3.0)}[law]
    data[::5, 0, 0] = np.nan
    reduction = reduced(data, (3000, 5000))
    assert reduction.arrays()["kept"].size < 2**13 + 256 * 4
    for column in range(2):
        found = reduction.quantiles(column, probabilities)
        for time in range(2):
            values = data[:, column, time][np.isfinite(data[:, column, time])]
            low, high = np.mean(values[:, None] < found[:, time], axis=0), np.mean(values[:, None] <= found[:, time], 0)
            off = np.maximum(np.maximum(low - probabilities, probabilities - high), 0.0)
            assert np.all(off < [1e-4, 1e-3, 2e-3, 1e-3, 1e-4]), off


def test_a_histogram_has_the_probabilities_of_its_bins(monkeypatch: pytest.MonkeyPatch) -> None:
    edges = np.linspace(-4, 4, 9)
    data = np.random.default_rng(7).normal(size=(20000, 1, 1))
    expected = np.histogram(data, edges)[0] / 20000
    np.testing.assert_allclose(reduced(data, (999,)).histogram(0, 0, edges), expected, atol=1e-12)
    unknown = reduced(np.full((3, 1, 1), np.nan), (1,)).histogram(0, 0, edges)
    assert unknown.shape == (8,) and np.isnan(unknown).all()
    monkeypatch.setattr("eomgen.products.ensembles.statistics._KEPT", 2**10)
    np.testing.assert_allclose(reduced(data, (999,)).histogram(0, 0, edges), expected, atol=2e-3)


@pytest.mark.parametrize("blocks", [2, 6, 7, 9])
def test_what_was_written_goes_on_with_the_same_bits(blocks: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("eomgen.products.ensembles.statistics._KEPT", 2**12)
    data = np.concatenate([DATA, 2.0 * DATA, 3.0 * DATA])
    straight = added(data, (300,) * 10)
    before = added(data[: 300 * blocks], (300,) * blocks)
    before.whole().quantiles(0, np.array([0.5]))  # results in between change nothing
    stopped = Reduction.from_arrays(before.arrays())
    stopped.add(data[300 * blocks :])  # in one block, in place of several
    for name, array in straight.arrays().items():
        np.testing.assert_array_equal(stopped.arrays()[name], array, err_msg=name)
        np.testing.assert_array_equal(stopped.whole().arrays()[name], straight.whole().arrays()[name], err_msg=name)


def test_a_ranking_takes_eight_samples_for_each_number_that_varies() -> None:
    values = {"mass": np.arange(4.0), "length": np.ones(4)}
    with pytest.raises(UsageError, match="too few samples for 1 number that varies: 4; try: 8 samples or more"):
        ranking("random", 4, values, "tip.max", np.arange(4.0))
