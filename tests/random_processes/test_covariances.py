"""Covariances and their spectra: Fourier pairs by quadrature, and what they are known to be."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad

from eomgen.formula.curves import Curve
from eomgen.products.reliability.random_processes.covariance import (
    Covariance,
    CovarianceTable,
    DampedCosine,
    DensityTable,
    RoadProfile,
    SquaredExponential,
    band,
    exponential,
    kanai_tajimi,
    oscillator,
)

LAGS = np.linspace(0.0, 6.0, 41)
#: Each covariance with the range of frequencies outside of which there is none, or hardly any.
PAIRS: dict[str, tuple[Covariance, float, float]] = {
    "squared exponential": (SquaredExponential(1.7, 0.8), 0.0, 3.0),
    "exponential": (exponential(0.6, 1.3), 0.0, math.inf),
    "damped cosine": (DampedCosine(2.0, 0.4, 3.0), 0.0, math.inf),
    "oscillator": (oscillator(1.3, 4.0, 0.15), 0.0, math.inf),
    "Kanai-Tajimi": (kanai_tajimi(0.9, 5.0, 0.6), 0.0, math.inf),
    "band": (band(1.5, 0.3, 2.2), 0.3, 2.2),
    "road": (RoadProfile("C"), 0.011, 2.83),
    "table of a spectrum": (
        DensityTable(np.array([0.1, 0.5, 1.0, 2.5]), np.array([0.0, 2.0, 0.5, 1.0])), 0.1, 2.5,
    ),
}  # fmt: skip  # a table


def _from_density(covariance: Covariance, low: float, high: float, lag: float) -> float:
    """Return int G cos(2 pi f lag) df by adaptive quadrature."""

    def density(f: float) -> float:
        return float(covariance.density(np.array([f]))[0])

    wave = 2.0 * math.pi * lag
    breaks = [f for f in (0.5, 1.0) if low < f < high and math.isfinite(high)]
    if math.isinf(high):
        if lag == 0.0:
            return quad(density, low, math.inf, epsabs=1e-12, limit=400)[0]
        return quad(density, low, math.inf, weight="cos", wvar=wave, epsabs=1e-11, limlst=400, limit=400)[0]
    return quad(lambda f: density(f) * math.cos(wave * f), low, high, epsabs=1e-13, limit=800, points=breaks or None)[0]


@pytest.mark.parametrize("name", PAIRS)
def test_covariance_and_density_are_a_fourier_pair(name: str) -> None:
    covariance, low, high = PAIRS[name]
    variance = float(covariance.at(np.zeros(1))[0])
    found = [_from_density(covariance, low, high, float(lag)) for lag in LAGS[::4]]
    np.testing.assert_allclose(covariance.at(LAGS[::4]), found, rtol=0, atol=2e-9 * variance)
    np.testing.assert_array_equal(covariance.at(-LAGS), covariance.at(LAGS))
    assert np.all(covariance.density(np.linspace(0.0, 5.0, 101)) >= -1e-9 * variance)


def test_a_table_of_a_covariance_has_the_density_of_what_it_was_sampled_from() -> None:
    lags, frequencies = np.linspace(0.0, 8.0, 161), np.linspace(0.0, 1.5, 31)
    exact = SquaredExponential(1.0, 1.0)
    table = CovarianceTable(Curve("", lags, exact.at(lags)))
    np.testing.assert_allclose(table.density(frequencies), exact.density(frequencies), rtol=0, atol=1e-7)
    between = np.linspace(-9.0, 9.0, 97)
    np.testing.assert_allclose(table.at(between), exact.at(between), rtol=0, atol=2e-8)


def test_the_oscillator_is_that_of_the_benchmark() -> None:
    # R = exp(-0.2 tau) (cos 1.2 tau + sin(1.2 tau) / 6)
    frequency = math.hypot(0.2, 1.2)
    expected = np.exp(-0.2 * LAGS) * (np.cos(1.2 * LAGS) + np.sin(1.2 * LAGS) / 6.0)
    np.testing.assert_allclose(oscillator(1.0, frequency, 0.2 / frequency).at(LAGS), expected, rtol=0, atol=1e-15)


def test_the_oscillator_has_a_rate_and_the_soil_has_none() -> None:
    small = np.array([0.0, 1e-6])
    for covariance in (oscillator(1.0, 4.0, 0.15), kanai_tajimi(1.0, 5.0, 0.6)):
        value = covariance.at(small)
        # a density that falls off as C / f^2 is that of a covariance with the slope -pi^2 C at lag 0
        slope = -(math.pi**2) * 1e12 * float(covariance.density(np.array([1e6]))[0])
        assert (value[1] - value[0]) / small[1] == pytest.approx(slope, abs=2e-5)
    assert slope == pytest.approx(-3.541, abs=1e-3)


def test_a_road_has_the_variance_of_its_class() -> None:
    expected = 256e-6 * 0.1**2 * (1.0 / 0.011 - 1.0 / 2.83)
    assert RoadProfile("C").at(np.zeros(1))[0] == pytest.approx(expected, rel=1e-14)
