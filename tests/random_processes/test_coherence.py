"""Processes that are coherent over frequencies: their cross covariances, their modes, and coherences of samples."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import integrate, signal

from eomgen.base.arrays import Array
from eomgen.errors import UsageError
from eomgen.products.reliability.random_processes.coherence import (
    CoherenceTable,
    CrossCovariance,
    ExponentialCoherence,
    least_eigenvalue,
)
from eomgen.products.reliability.random_processes.covariance import (
    Covariance,
    RoadProfile,
    SquaredExponential,
    band,
    exponential,
    oscillator,
)
from eomgen.products.reliability.random_processes.karhunen_loeve import expand, expand_jointly

TABLE = CoherenceTable(np.array([0.0, 0.3, 1.2]), np.array([1.0, 0.8, -0.2]))


@pytest.mark.slow_cases("kink")
@pytest.mark.parametrize(
    ("covariance", "coherence", "last"),
    [
        (SquaredExponential(1.3, 0.7), ExponentialCoherence(0.4), 3.0),
        (exponential(0.8, 0.5), ExponentialCoherence(0.6), 40.0),
        (oscillator(1.0, 4.0, 0.02), TABLE, 1.2),
        (band(2.0, 0.2, 1.5), ExponentialCoherence(1.0), 1.5),
    ],
    ids=["smooth", "kink", "peak", "band"],
)
def test_cross_covariances_are_integrals_of_cross_spectra(
    covariance: Covariance, coherence: object, last: float
) -> None:
    cross = CrossCovariance(covariance, coherence, 8.0)  # type: ignore[arg-type]
    variance = float(covariance.at(np.zeros(1))[0])
    for lag in (0.0, 0.6, -3.1, 8.0):
        whole = integrate.quad(
            lambda f, lag=lag: float(cross.density(np.array([f]))[0]) * np.cos(2.0 * np.pi * f * lag),
            0.0, last, limit=4000, epsabs=1e-12, points=[0.2, 0.3, 0.6366, 1.2],
        )[0]  # fmt: skip
        assert cross.at(np.array([lag]))[0] == pytest.approx(whole, abs=3e-9 * variance)


def test_joint_modes_have_the_covariances_of_all_pairs() -> None:
    base = SquaredExponential(1.5, 0.8)
    crosses = [CrossCovariance(base, ExponentialCoherence(decay), 6.0) for decay in (0.5, 1.0, 0.5)]
    table = [[base, crosses[0], crosses[1]], [crosses[0], base, crosses[2]], [crosses[1], crosses[2], base]]
    found = expand_jointly(table, 6.0, share=1.0 - 1e-9)
    t = np.linspace(0.0, 6.0, 31)
    shape = [one.modes(t) for one in found]
    for i, row in enumerate(table):
        for j, covariance in enumerate(row):
            np.testing.assert_allclose(shape[i].T @ shape[j], covariance.at(t[:, None] - t), rtol=0, atol=3e-6)
    shares = np.array([one.shares for one in found])
    np.testing.assert_allclose(shares.sum(axis=0), 1.0, rtol=1e-10)
    assert found[0].total == pytest.approx(3 * 1.5**2 * 6.0)


def test_one_process_and_processes_of_no_coherence_have_the_modes_of_one_alone() -> None:
    base = SquaredExponential(1.0, 1.0)
    alone = expand(base, 5.0, modes=6)
    (one,) = expand_jointly([[base]], 5.0, modes=6)
    np.testing.assert_array_equal(one.eigenvalues, alone.eigenvalues)
    none = CrossCovariance(base, CoherenceTable(np.array([0.0, 1.0]), np.zeros(2)), 5.0)
    pair = expand_jointly([[base, none], [none, base]], 5.0, modes=12)
    np.testing.assert_allclose(pair[0].eigenvalues, np.repeat(alone.eigenvalues, 2), rtol=1e-9)


def _samples(pair: list[Array], count: int) -> list[Array]:
    z = np.random.default_rng(3).standard_normal((count, len(pair[0])))
    return [z @ modes for modes in pair]


@pytest.mark.slow_except("gusts by a table")
@pytest.mark.parametrize(
    ("covariance", "coherence", "window", "limit"),
    [(RoadProfile("C"), ExponentialCoherence(2.0), 60.0, 0.7), (exponential(1.0, 0.3), TABLE, 16.0, 1.1)],
    ids=["two tracks of a road", "gusts by a table"],
)
def test_samples_have_the_coherence_that_is_asked_for(
    covariance: Covariance, coherence: ExponentialCoherence | CoherenceTable, window: float, limit: float
) -> None:
    """SciPy's estimate over 1500 samples, each one segment: its error is about (1 - c^2) sqrt(2 / 1500) = 0.04."""
    cross = CrossCovariance(covariance, coherence, window)
    found = expand_jointly([[covariance, cross], [cross, covariance]], window, modes=200)
    t = np.linspace(0.0, window, 257)[:-1]
    left, right = _samples([one.modes(t) for one in found], 1500)
    frequency, squared = signal.coherence(left.ravel(), right.ravel(), fs=256 / window, nperseg=256, noverlap=0)
    chosen = (frequency > 2.5 / window) & (frequency < limit)
    assert np.count_nonzero(chosen) > 8
    expected = coherence.at(frequency[chosen]) ** 2
    np.testing.assert_allclose(squared[chosen], expected, rtol=0, atol=0.1)
    assert expected.max() - expected.min() > 0.4


def test_matrices_of_coherences_that_no_processes_have() -> None:
    near, far = ExponentialCoherence(0.1), ExponentialCoherence(2.0)
    least, frequency = least_eigenvalue([[None, near, far], [near, None, near], [far, near, None]])
    assert least < -0.1 and 0.1 < frequency < 3.0
    fine = ExponentialCoherence(0.2)
    assert least_eigenvalue([[None, near, fine], [near, None, near], [fine, near, None]])[0] > -1e-12


def test_a_coherence_that_does_not_fall_is_refused() -> None:
    cross = CrossCovariance(exponential(1.0, 1.0), ExponentialCoherence(1e-5), 10.0)
    with pytest.raises(UsageError, match="the coherence falls too slowly: at high frequencies the processes are one"):
        cross.at(np.zeros(1))
