"""Statistics of many realisations against the closed forms of a Gaussian sea."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm

from eomgen.base.arrays import Array
from eomgen.waves import Components, DiscreteSpectrum, Jonswap, Profile, Sea, SeaStatistics, discretized, statistics_of


def storm(height: float, length: float | None = None) -> DiscreteSpectrum:
    return discretized(Jonswap(height, 10.0), height=height, length=length)


def profiles(spectrum: DiscreteSpectrum, order: int, realisations: int, labels: int) -> Iterator[Profile]:
    """Yield profiles of realisations in pairs, the second with all waves turned upside down."""
    random, energy = np.random.default_rng(5), spectrum.energy
    sea = Sea(spectrum.realisation(1), order=order)
    for _ in range(realisations):
        normal = random.normal(size=(len(energy), 2))
        amplitude, phase = np.sqrt(energy) * np.hypot(*normal.T), np.arctan2(normal[:, 1], normal[:, 0])
        for turn in (0.0, math.pi):
            yield sea.with_waves(Components(spectrum.vectors, amplitude, phase + turn)).profile(labels, 0.0)


def elevations(height: float, realisations: int) -> tuple[SeaStatistics, Array]:
    """Return the closed forms, and mean, variance and third central moment of second order over the plane. Seas of
    eight waves of the peak have few pairs and as much water in many realisations."""
    spectrum, total = storm(height, 8.0 * 2.0 * math.pi / (0.2 * math.pi) ** 2 * 9.81), np.zeros(4)
    for profile in profiles(spectrum, 2, realisations, 512):
        total += [float(np.mean(profile.xa * profile.z**power)) for power in range(4)]
    _, mean, square, cube = total / total[0]
    known = statistics_of(spectrum)
    return known, np.array([mean, square - mean**2, cube - 3.0 * mean * square + 2.0 * mean**3])


@pytest.mark.slow
def test_elevations_have_the_skewness_of_the_closed_form_of_second_order() -> None:
    known, (mean, variance, third) = elevations(2.0, 1500)
    assert statistics_of(storm(2.0)).skewness == pytest.approx(0.06237, abs=5e-6)
    assert third / variance**1.5 == pytest.approx(known.skewness, rel=0.02)  # of 1500 pairs of seas
    assert abs(mean) < 0.005 * -known.mean


def test_moments_of_elevations_are_means_over_gaussian_labels() -> None:
    """By quadrature: z and the slope of displacements are normal with variances m0 and m2 and covariance -m1; labels
    weigh 1 + slope."""
    known = statistics_of(storm(7.0))
    m0, m1, m2 = (known.moment(power) for power in range(3))
    nodes, weights = np.polynomial.hermite_e.hermegauss(20)
    one, other = np.meshgrid(nodes, nodes)
    z, slope = math.sqrt(m0) * one, -m1 / math.sqrt(m0) * one + math.sqrt(m2 - m1**2 / m0) * other
    weight = np.outer(weights, weights) * (1.0 + slope) / (2.0 * math.pi)
    mean = np.sum(weight * z)
    assert (np.sum(weight), known.mean) == pytest.approx((1.0, mean), rel=1e-12)
    assert known.variance == pytest.approx(np.sum(weight * (z - mean) ** 2), rel=1e-12)
    assert known.third_moment == pytest.approx(np.sum(weight * (z - mean) ** 3), rel=1e-9)
    assert known.fold_probability == pytest.approx(norm.sf(1.0 / math.sqrt(m2)), rel=1e-12)


@pytest.mark.parametrize("depth", [math.inf, 15.0])
def test_labels_at_which_waves_fold_over_are_a_tail_of_their_slopes(depth: float) -> None:
    k, amplitude = np.array([0.05, 0.09]), np.array([2.0, 1.5])
    sea = Sea(Components(np.column_stack((k, 0.0 * k)), amplitude, np.zeros(2)), depth, order=1)
    slopes = k * amplitude / np.tanh(np.minimum(k * depth, 700.0))
    assert sea.mean_square_slope == pytest.approx(0.5 * slopes @ slopes, rel=1e-12)
    assert sea.fold_probability == pytest.approx(norm.sf(1.0 / math.sqrt(0.5 * slopes @ slopes)), rel=1e-12)
    assert Sea(Components(np.column_stack((k, 0.0 * k)), 0.0 * k, k), depth, order=1).fold_probability == 0.0


def test_specular_points_are_as_many_as_slopes_of_profiles_pass() -> None:
    spectrum = storm(7.0, 64.0 * 2.0 * math.pi / (0.2 * math.pi) ** 2 * 9.81)
    slopes, crossings, length = np.array([0.0, -0.15, 0.25]), np.zeros(3), 0.0
    for profile in profiles(spectrum, 1, 20, 8192):
        length += float(profile.labels[1]) * 8192
        above = profile.za - slopes[:, None] * profile.xa > 0.0
        crossings += np.count_nonzero(above != np.roll(above, 1, axis=1), axis=1)
    assert crossings / length == pytest.approx(statistics_of(spectrum).specular_points(slopes), rel=0.04)


def test_skewness_of_the_closed_form_is_its_double_sum() -> None:
    known = statistics_of(storm(7.0, 1500.0))
    k, e = known.wave_numbers, known.energy
    double = 3.0 * np.sum(np.outer(e, e) * np.minimum.outer(k, k)) / e.sum() ** 1.5
    assert known.skewness == pytest.approx(double, rel=1e-12)


def test_the_density_of_slopes_is_one() -> None:
    known = statistics_of(storm(7.0))
    total, _ = quad(lambda s: float(known.slope_density(s)), -np.inf, np.inf)
    assert total == pytest.approx(1.0, abs=1e-6)
    tail, _ = quad(lambda s: float(known.slope_density(s)), 0.5, np.inf)
    assert 2.0 * tail == pytest.approx(4.21e-4, rel=5e-3)
    assert math.log10(known.fold_probability) == pytest.approx(math.log10(4.9e-15), abs=0.02)
