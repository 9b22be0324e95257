"""Spectra, their components, and realisations by seed."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad

from eomgen.errors import UsageError
from eomgen.waves import (
    Jonswap,
    PiersonMoskowitz,
    Sea,
    Spectrum,
    SpectrumTable,
    Spreading,
    discretized,
    divided,
    statistics_of,
    wave_number,
)


def variance(spectrum: Spectrum) -> float:
    total, _ = quad(
        lambda w: float(spectrum.density(np.array([w]))[0]), 0.3 * spectrum.peak, 30.0 * spectrum.peak, limit=400,
        points=[spectrum.peak], epsrel=1e-10,
    )  # fmt: skip
    return total


@pytest.mark.parametrize("peakedness", [1.0, 3.3, 7.0])
def test_jonswap_has_the_height_that_it_is_given(peakedness: float) -> None:
    spectrum = Jonswap(7.0, 10.0, peakedness)
    assert 4.0 * math.sqrt(variance(spectrum)) == pytest.approx(7.0, rel=1e-5)
    parts = divided(spectrum, 60, band=(0.4, 8.0))
    assert 4.0 * math.sqrt(parts.energy.sum()) == pytest.approx(7.0, rel=1e-2)
    fine = spectrum.peak * np.linspace(0.9, 1.1, 2001)
    assert fine[np.argmax(spectrum.density(fine))] == pytest.approx(2.0 * math.pi / 10.0, rel=1e-3)
    if peakedness > 1.0:
        broad = Jonswap(7.0, 10.0, 1.0)
        ratios = spectrum.density(np.array([spectrum.peak, 2.0])) / broad.density(np.array([spectrum.peak, 2.0]))
        assert ratios[0] / ratios[1] == pytest.approx(peakedness, rel=1e-6)


def test_pierson_moskowitz_has_the_height_of_its_wind() -> None:
    spectrum = PiersonMoskowitz(15.0)
    assert 4.0 * math.sqrt(variance(spectrum)) == pytest.approx(0.2092 * 15.0**2 / 9.81, rel=1e-3)
    same = Jonswap(4.0 * math.sqrt(variance(spectrum)), 2.0 * math.pi / spectrum.peak, 1.0)
    w = np.array([0.5, 0.8, 1.7])
    assert spectrum.density(w) == pytest.approx(same.density(w), rel=1e-4)


@pytest.mark.parametrize("components", [1, 5, 40])
@pytest.mark.parametrize("width", [0.2, 0.005, 1e-4])
def test_parts_of_a_table_have_its_energy_however_narrow_it_is(width: float, components: int) -> None:
    """A triangle of one square metre, and what is below half its peak's frequency is cut off."""
    peaked = SpectrumTable([0.4 - width, 0.4, 0.4 + width], [0.0, 1.0 / width, 0.0])
    parts = divided(peaked, components)
    assert parts.energy.sum() == pytest.approx(1.0, rel=1e-12)
    frequencies = np.sqrt(9.81 * np.hypot(*parts.vectors.T))
    assert parts.energy @ frequencies == pytest.approx(0.4, rel=1e-12)
    step = divided(SpectrumTable([0.1, 0.4], [1.0, 1.0]), components)
    assert step.energy.sum() == pytest.approx(0.2, rel=1e-12)


def test_the_storm_of_the_benchmark_has_its_moments() -> None:
    storm = discretized(Jonswap(7.0, 10.0), height=7.0)
    known = statistics_of(storm)
    assert len(storm.energy) == 279
    assert [known.moment(1), known.moment(2), known.moment(4)] == pytest.approx([0.18340, 0.016679, 5.022e-4], rel=1e-4)
    assert known.drift() == pytest.approx(0.3259, abs=1e-4)
    assert storm.band == pytest.approx((0.5 * 0.2 * math.pi * math.sqrt(9 / 8), 3.0 * 0.2 * math.pi), rel=0.02)


@pytest.mark.parametrize("depth", [math.inf, 300.0, 20.0, 0.5])
def test_wave_numbers_hold_the_dispersion_relation(depth: float) -> None:
    for w in (0.05, 0.7, 9.0):
        k = wave_number(w, depth)
        assert 9.81 * k * math.tanh(min(k * depth, 700.0)) == pytest.approx(w * w, rel=1e-13)
    sea = discretized(Jonswap(0.1, 10.0), depth=depth, length=500.0)
    assert sea.height == pytest.approx(0.1, rel=0.15)


def test_directions_share_the_energy() -> None:
    spreading = Spreading(8.0, heading=0.5, directions=15)
    total, _ = quad(lambda angle: float(spreading.density(np.array(angle))), 0.5 - math.pi, 0.5 + math.pi)
    assert total == pytest.approx(1.0, rel=1e-9)
    spread, along = (discretized(Jonswap(2.0, 8.0), length=400.0, spreading=x) for x in (spreading, None))
    assert spread.energy.sum() == pytest.approx(along.energy.sum(), rel=1e-12)
    mean = spread.energy @ (spread.vectors / np.hypot(*spread.vectors.T)[:, None])
    assert math.atan2(mean[1], mean[0]) == pytest.approx(0.5, abs=1e-12)
    # of cos^2s(theta/2) the first harmonic is s/(s + 1)
    assert np.hypot(*mean) / spread.energy.sum() == pytest.approx(8.0 / 9.0, abs=2e-3)


def test_realisations_are_those_of_their_seed() -> None:
    storm = discretized(Jonswap(7.0, 10.0))
    first, again, other = (storm.realisation(seed) for seed in (1, 1, 2))
    assert np.array_equal(first.amplitude, again.amplitude)
    assert np.array_equal(first.phase, again.phase)
    assert not np.any(first.amplitude == other.amplitude)
    fixed = storm.realisation(1, "fixed")
    assert fixed.amplitude == pytest.approx(np.sqrt(2.0 * storm.energy), rel=1e-15)
    many = np.array([storm.realisation(seed).amplitude ** 2 for seed in range(200)])
    assert (many / (2.0 * storm.energy)).mean() == pytest.approx(1.0, abs=0.02)
    assert (many / (2.0 * storm.energy)).var() == pytest.approx(1.0, abs=0.06)


@pytest.mark.parametrize("depth", [np.inf, 30.0])
def test_profiles_by_fourier_transforms_are_sums_over_pairs(depth: float) -> None:
    sea = Sea(discretized(Jonswap(3.0, 8.0), depth=depth, length=600.0, heading=0.3).realisation(3), depth)
    profile = sea.profile(512, 5.0)
    direction = np.array([math.cos(0.3), math.sin(0.3)])
    labels = profile.labels[::7, None] * direction
    motion, (first, second) = sea.motion(labels, 5.0), sea.derivatives(labels, 5.0)
    along = np.einsum("nxa,x,a->n", first[:, :2], direction, direction)
    for found, expected in (
        (profile.x, motion.position[:, :2] @ direction),
        (profile.z, motion.position[:, 2]),
        (profile.u, motion.velocity[:, :2] @ direction),
        (profile.w, motion.velocity[:, 2]),
        (profile.xa, along),
        (profile.za, first[:, 2] @ direction),
    ):
        assert found[::7] == pytest.approx(expected, abs=1e-11)
    surface = sea.surface(labels, 5.0)
    assert profile.slope[::7] == pytest.approx(surface.slope @ direction, abs=1e-11)
    assert 0.5 * profile.curvature[::7] == pytest.approx(surface.curvature, abs=1e-11)
    assert np.all(np.isfinite(second))


def test_tables_serve_other_amplitudes() -> None:
    storm = discretized(Jonswap(7.0, 10.0), length=1000.0)
    one, other = Sea(storm.realisation(1)), Sea(storm.realisation(2))
    found, expected = one.with_waves(storm.realisation(2)).profile(256, 3.0), other.profile(256, 3.0)
    assert np.array_equal(found.z, expected.z)
    assert np.array_equal(found.u, expected.u)
    with pytest.raises(UsageError, match=r"the wave vectors are others; try: a Sea of its own"):
        one.with_waves(discretized(Jonswap(7.0, 10.0), length=900.0).realisation(1))
