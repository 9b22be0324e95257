"""What a radar sees of a sea: folds, caustics, where the intensity goes, and specular points."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
import pytest

from eomgen.waves import (
    Components,
    DiscreteSpectrum,
    Jonswap,
    Radar,
    Sea,
    Spreading,
    discretized,
    divided,
    specular_points,
    statistics_of,
)

INCIDENCE = math.radians(23.0)


@pytest.mark.parametrize(
    ("over_velocity", "heading", "table"),
    [
        (30.0, 0.0, 0.1996), (60.0, 0.0, 0.3389), (120.0, 0.0, 0.4183),
        (30.0, math.pi, 0.2130), (60.0, math.pi, 0.3432), (120.0, math.pi, 0.4195),
    ],
)  # fmt: skip  # a table
def test_shares_of_folded_images_are_those_of_the_table(over_velocity: float, heading: float, table: float) -> None:
    swell = discretized(Jonswap(2.0, 10.0), height=2.0, heading=heading)
    assert Radar(over_velocity, INCIDENCE).fold_probability(swell) == pytest.approx(table, abs=1e-4)


def test_the_velocity_and_the_cut_off_are_those_of_the_benchmark() -> None:
    swell = discretized(Jonswap(2.0, 10.0), height=2.0)
    assert Radar(120.0, INCIDENCE).velocity_deviation(swell) == pytest.approx(0.353, abs=5e-4)
    assert Radar(120.0, INCIDENCE).cutoff(swell) == pytest.approx(133.0, abs=0.5)


@pytest.mark.parametrize(("direction", "expected"), [(1, 0.363), (-1, 0.353)])
def test_caustics_begin_at_the_critical_amplitude(direction: Literal[1, -1], expected: float) -> None:
    k, radar = (0.2 * math.pi) ** 2 / 9.81, Radar(120.0, INCIDENCE)
    critical = radar.critical_amplitude(k, direction)
    assert critical == pytest.approx(expected, abs=5e-4)
    for part, caustics in ((1.0 - 1e-6, False), (1.0 + 1e-6, True)):
        wave = Components(np.array([[direction * k, 0.0]]), np.array([part * critical]), np.zeros(1))
        sea = Sea(wave, order=1)
        # the image stands still at a crest or at a trough first
        near = np.linspace(-0.1, 0.1, 401)
        images = []
        for place in (0.0, math.pi / k):
            image, intensity = radar.bunching(sea, np.column_stack((place + near, 0.0 * near)), 0.0)
            images.append((np.any(np.diff(image[:, 0]) < 0.0), intensity.max()))
        assert any(turned for turned, _ in images) == caustics
        assert max(brightest for _, brightest in images) > 1e4


def test_an_image_without_any_caustics() -> None:
    """R/V w = 1: velocities and displacements cancel in the image."""
    assert Radar(2.0, 0.0).critical_amplitude(0.25 / 9.81) == math.inf


def test_the_intensity_of_a_line_is_that_of_the_water() -> None:
    swell = discretized(Jonswap(2.0, 10.0), height=2.0)
    length = 2.0 * math.pi / (np.hypot(*swell.vectors.T)[0] / 9.0)
    profile = Sea(swell.realisation(4)).profile(8192, 20.0)
    for over_velocity in (0.0, 30.0, 120.0):
        line = Radar(over_velocity, INCIDENCE).line(profile, length, 400)
        assert line.mean() == pytest.approx(1.0, abs=1e-3)
    # without motion of facets water lies where it is, and 20 labels to a cell are 20 labels
    assert np.abs(Radar(0.0, INCIDENCE).line(profile, length, 400) - 1.0).max() < 0.12


@pytest.mark.parametrize("direction", [1, -1])
def test_the_spectrum_of_images_of_one_wave_is_a_mean_over_its_amplitudes(direction: int) -> None:
    """A wave of random height, by quadrature: u = (A/2)^2/E is exponential, facets cover 1 - k A cos(psi) of the
    plane, and are seen at a + A (direction R/V w cos(incidence) - 1) sin(psi). Over two lengths odd ones have none."""
    k, energy, radar = 0.05, 0.04, Radar(30.0, INCIDENCE)
    swell = DiscreteSpectrum(np.array([[direction * k, 0.0]]), np.array([energy]), (0.7, 0.7))
    found = radar.intensity_spectrum(swell, 2 * 2.0 * math.pi / k, 12)
    u, weights = np.polynomial.laguerre.laggauss(60)
    A, psi = np.sqrt(2.0 * energy * u)[:, None], 2.0 * math.pi * np.arange(512) / 512
    moved = A * (direction * 30.0 * math.sqrt(9.81 * k) * math.cos(INCIDENCE) - 1.0) * np.sin(psi)
    for n in range(1, 7):
        mean = np.mean((1.0 - k * A * np.cos(psi)) * np.exp(-1j * n * (psi + k * moved)), axis=1)
        assert found[2 * n - 1] == pytest.approx(weights @ np.abs(mean) ** 2, rel=1e-9)
    assert np.abs(found[::2]).max() < 1e-12


def test_an_image_follows_particles_that_drift() -> None:
    sea = Sea(divided(Jonswap(3.0, 8.0), 6).realisation(2))
    image = Radar(20.0, 0.4).image(sea, 36000.0, np.linspace(0.0, 400.0, 21), np.linspace(0.0, 100.0, 6), 2)
    assert image.mean() == pytest.approx(1.0, abs=0.03)


def test_bunching_is_the_jacobian_of_the_image() -> None:
    swell = discretized(Jonswap(1.0, 9.0), length=500.0, band=(0.8, 1.4), spreading=Spreading(20.0, 0.3, 5))
    sea, radar = Sea(swell.realisation(2), 50.0), Radar(20.0, INCIDENCE)
    labels, d = np.random.default_rng(1).uniform(0.0, 500.0, (20, 2)), 1e-3
    place, intensity = radar.bunching(sea, labels, 3.0)
    motion = sea.motion(labels, 3.0)
    sight = np.array([0.0, -math.sin(INCIDENCE), math.cos(INCIDENCE)])
    assert place[:, 1] == pytest.approx(motion.position[:, 1], abs=1e-12)
    assert place[:, 0] == pytest.approx(motion.position[:, 0] + 20.0 * motion.velocity @ sight, abs=1e-12)
    columns = [
        (radar.bunching(sea, labels + move, 3.0)[0] - radar.bunching(sea, labels - move, 3.0)[0]) / (2.0 * d)
        for move in d * np.eye(2)
    ]
    expected = np.abs(sea.surface(labels, 3.0).jacobian / np.linalg.det(np.stack(columns, axis=-1)))
    assert intensity == pytest.approx(expected, rel=1e-5)


def test_specular_points_have_the_slope_and_the_backscatter_of_their_density() -> None:
    storm = discretized(Jonswap(7.0, 10.0), height=7.0)
    profile = Sea(storm.realisation(3)).profile(8192, 0.0)
    found = specular_points(profile, 0.2)
    slope = np.interp(found.labels, profile.labels, profile.slope)
    assert slope == pytest.approx(0.2, abs=2e-3)
    assert found.z == pytest.approx(np.interp(found.labels, profile.labels, profile.z), abs=5e-3)
    assert np.all(np.abs(found.curvature) > 0.0)
    across = 1.0 / math.sqrt(2.0 * math.pi * 0.01)  # of slopes of 0, whose variance is 0.01
    density = across * float(statistics_of(storm).slope_density(math.tan(0.2)))
    expected = math.pi * 0.6 * density / math.cos(0.2) ** 4
    assert Radar(0.0, 0.2).backscatter(density, 0.6) == pytest.approx(expected, rel=1e-12)
