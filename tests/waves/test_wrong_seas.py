"""Seas that cannot be, each with one message."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from eomgen.errors import UsageError
from eomgen.products.waves.second_order.profiles import multiples
from eomgen.waves import (
    Components,
    Jonswap,
    PiersonMoskowitz,
    Profile,
    Radar,
    Ramp,
    Sea,
    SpectrumTable,
    Spreading,
    SteppedSea,
    discretized,
    divided,
    specular_points,
    statistics_of,
    wave_number,
)

VECTORS, ONE = np.array([[0.05, 0.0], [0.06, 0.0]]), np.ones(2)
SWELL = discretized(Jonswap(2.0, 10.0), length=600.0)
RADAR = Radar(30.0, 0.4)
EDGES = np.linspace(0.0, 100.0, 11)


def _sea(vectors: Any = VECTORS, amplitude: Any = ONE, phase: Any = ONE, depth: float = 20.0, **options: Any) -> Sea:
    return Sea(Components(vectors, amplitude, phase), depth, **options)


def _long_crested(**options: Any) -> Any:
    return discretized(Jonswap(2.0, 10.0), **options)


def _profile() -> Profile:
    return Sea(SWELL.realisation(0), order=1).profile(512, 0.0)


def _stepped(length: float = 600.0, labels: tuple[int, int] = (64, 1), across: float = 1.0, **options: Any) -> Any:
    vectors = 2.0 * math.pi / 600.0 * np.array([[5.0, 0.0], [11.0, 0.0]])
    return SteppedSea(_sea(vectors, 0.3 * ONE, depth=30.0, **options), (length, across), labels)


OF_SEAS: list[tuple[Callable[[], Any], str]] = [
    (
        lambda: _sea(amplitude=ONE * 30.0, depth=math.inf),
        "component 1 has k A coth(k h) = 1.8; from 1 on a wave crosses itself",
    ),
    (lambda: _sea(depth=0.0), "Sea: depth: 0 m is not above 0; try: math.inf for water without a bottom"),
    (lambda: _sea(VECTORS * [[0.0], [1.0]]), "component 0 has the wave vector (0, 0): the water's level"),
    (lambda: _sea(VECTORS[[0, 0]]), "two components have the same wave vector; try: one with the sum of both"),
    (lambda: _sea(amplitude=-ONE), "the amplitude -1 m is negative; try: the phase + pi"),
    (lambda: _sea(amplitude=ONE[:1]), "amplitudes and phases have the shapes (2, 2), (1,) and (2,); try: (n, 2), (n,)"),
    (lambda: _sea(amplitude=ONE * np.inf), "a wave vector, an amplitude or a phase is not a finite number"),
    (lambda: _sea(order=3), "Sea: order: there is no order 3; try: 1 or 2"),
    (lambda: _sea(gravity=0.0), "Sea: gravity: 0 m/s^2 is not above 0; try: 9.81"),
    (lambda: _sea(vorticity="some"), "Sea: vorticity: there is no 'some'; try: none, or gerstner"),
    (lambda: _sea(order=1).bound_waves(0.0), "Sea.bound_waves: a sea of order 1 has no pairs; try: order = 2"),
    (lambda: _sea().motion([1.0, 2.0], 0.0), "Sea: labels: an array of shape (2,); try: finite numbers of shape"),
    (lambda: _sea().motion([[1.0, 2.0]], 0.0, 3.0), "at c = 3 m are outside of the water, which is from -20 m to 0"),
    (lambda: _sea().motion([[0.0, 0.0]], math.nan), "Sea: time: nan s is not a finite number"),
    (lambda: _sea().elevation(np.zeros(3), np.zeros(2), 0.0), "Sea: x and y: shapes (3,) and (2,) do not go together"),
    (
        lambda: _sea(VECTORS * [[1.0, 1.0], [0.0, 1.0]] + [[0.0, 0.02], [0.06, 0.0]]).profile(64, 0.0),
        "several directions",
    ),
    (lambda: Sea(SWELL.realisation(0)).profile(16, 0.0), "Sea.profile: count: 16 labels are too few; try:"),
    (lambda: Sea(SWELL.realisation(0)).profile(4096.5, 0.0), "count: 4096.5 is not a whole number from 1 on; try: 69"),  # type: ignore[arg-type]
    (
        lambda: multiples(np.array([1.0, 2.0**0.5])),
        "Sea.profile: the wave numbers are not multiples of one that is not",
    ),
    (lambda: Ramp(0.0), "Ramp: time: 0 is not above 0"),
    (lambda: Ramp(1.0, 0.0), "Ramp: power: 0 is not above 0"),
    (lambda: _stepped(labels=(64, 0)), "lengths (600.0, 1.0) m and (64, 0) labels are not above 0; try: along x"),
    (lambda: _stepped(610.0), ") times 2 pi/length; try: lengths that all components"),
    (lambda: _stepped(labels=(40, 1)), "40 labels along x take sums of waves for others; try: 45 or more"),
    (lambda: _stepped(order=1), "a sea of order 1 has no pairs; try: order = 2"),
    (lambda: _stepped(vorticity="gerstner"), "do not drift, and stepped ones do; try: vor"),
    (lambda: SteppedSea(_sea(VECTORS[:, ::-1]), (100.0, 100.0), (9, 1)), "component 0 is (0, nan) times 2 pi/length"),
]
OF_SPECTRA: list[tuple[Callable[[], Any], str]] = [
    (lambda: Jonswap(0.0, 10.0), "Jonswap: height: 0 is not above 0; try: a number above 0"),
    (lambda: Jonswap(2.0, math.inf), "Jonswap: period: inf is not a finite number; try: a finite number"),
    (lambda: Jonswap(1.0, 10.0, 0.99), "Jonswap: peakedness: 0.99 is not from 1 to 20; try: 3.3, or 1 for a fully"),
    (lambda: PiersonMoskowitz(0.0), "PiersonMoskowitz: wind: 0 m/s is not above 0"),
    (lambda: PiersonMoskowitz(10.0, -9.81), "PiersonMoskowitz: gravity: -9.81 m/s^2 is not above 0; try: 9.81"),
    (lambda: SpectrumTable([1.0, 0.5], [1.0, 1.0]), "frequencies: they have to increase from above 0"),
    (
        lambda: SpectrumTable([0.5, 1.0], [1.0, -0.1]),
        "densities: the least is -0.1 m^2 s/rad, the greatest 1; try: none",
    ),
    (lambda: SpectrumTable([0.5], [1.0]), "shapes (1,) and (1,); try: as many densities as frequencies"),
    (lambda: Spreading(0.0), "Spreading: exponent: 0 is not above 0"),
    (
        lambda: Spreading(4.0, directions=1),
        "Spreading: directions: 1 is not from 2 to 1000000; try: no spreading at all",
    ),
    (
        lambda: _long_crested(band=(2.0, 1.0)),
        "band: 2 to 1 does not increase from above 0; try: band = [0.5, 3.0]",
    ),
    (lambda: _long_crested(depth=0.0), "discretized: depth: 0 m is not above 0; try: math.inf"),
    (lambda: _long_crested(gravity=0.0), "discretized: gravity: 0 m/s^2 is not above 0; try: 9.81"),
    (lambda: _long_crested(length=-2.0), "discretized: length: -2 m is not above 0; try: 500"),
    (lambda: _long_crested(length=5.0), "no wave number 2 pi j/length is from"),
    (lambda: _long_crested(length=1e12), "wave numbers 2 pi j/length are within the band, more than 1000000; try: a"),
    (lambda: discretized(SpectrumTable([0.5, 0.6], ONE), band=(2.0, 3.0)), "band: the spectrum is zero from"),
    (lambda: wave_number(0.0), "wave_number: frequency: 0 rad/s is not above 0"),
    (lambda: divided(Jonswap(2.0, 10.0), 0), "divided: components: 0 is not from 1 to 1000000"),
    (lambda: divided(Jonswap(2.0, 10.0), 5, height=-2.0), "divided: height: -2 m is not above 0; try: the significant"),
    (lambda: SWELL.realisation(1, "none"), "there is no 'none'; try: gaussian, or fixed"),  # type: ignore[arg-type]
    (lambda: SWELL.realisation(-1), "realisation: seed: -1 is not a whole number from 0 on"),
    (lambda: statistics_of(_long_crested(spreading=Spreading(4.0))), "waves of one direction alone, and these have"),
    (lambda: statistics_of(divided(Jonswap(2.0, 10.0), 9, depth=15.0)), "statistics_of: closed forms are of deep"),
]
OF_RADARS: list[tuple[Callable[[], Any], str]] = [
    (lambda: Radar(-0.1, 0.4), "Radar: range_to_velocity: -0.1 s is below 0"),
    (
        lambda: Radar(30.0, 0.5 * math.pi),
        "Radar: incidence: 1.5708 rad is not from 0 to below pi/2; try: the angle from",
    ),
    (lambda: RADAR.image(_sea(), math.nan, EDGES, EDGES), "Radar.image: time: nan s is not a finite number"),
    (lambda: RADAR.image(_sea(), 0.0, EDGES, EDGES, 0), "Radar.image: labels_per_cell: 0 is not from 1 to 1000"),
    (
        lambda: RADAR.image(_sea(), 0.0, EDGES**2, EDGES),
        "Radar.image: columns: cells are 100 to 1900 m wide; try: edges",
    ),
    (
        lambda: Radar(1e9, 0.4).image(_sea(), 0.0, EDGES, EDGES),
        "more than 3e+07: facets move by up to 3.286e+09 m; try",
    ),
    (lambda: RADAR.line(_profile(), -3.0, 10), "Radar.line: length: -3 m is not above 0; try: that after which"),
    (lambda: RADAR.line(_profile(), 600.0, 0), "Radar.line: cells: 0 is not from 1 to 10000000; try: 400"),
    (lambda: RADAR.line(_profile(), 600.0, 10, 2), "Radar.line: direction: 2 is none; try: 1 with the flight"),  # type: ignore[arg-type]
    (lambda: RADAR.critical_amplitude(-1.0), "Radar.critical_amplitude: wave_number: -1 rad/m is not above 0"),
    (lambda: RADAR.backscatter(-1.0), "Radar.backscatter: slope_density: -1 is below 0"),
    (lambda: RADAR.intensity_spectrum(SWELL, 0.0, 10), "intensity_spectrum: length: 0 m is not above 0"),
    (lambda: RADAR.intensity_spectrum(SWELL, 600.0, 0), "intensity_spectrum: count: 0 is not from 1 to"),
    (lambda: RADAR.intensity_spectrum(SWELL, 600.0, 10**6), "1000000 wave numbers need"),
    (lambda: RADAR.intensity_spectrum(SWELL, 700.0, 10), "length: the waves do not repeat themselves after 700 m"),
    (lambda: RADAR.intensity_spectrum(_long_crested(heading=1.0), 500.0, 10), "waves run across the flight"),
    (
        lambda: RADAR.cutoff(_long_crested(depth=15.0)),
        "velocity_deviation: closed forms are of deep water, and waves of",
    ),
    (lambda: RADAR.fold_probability(_long_crested(depth=15.0)), "Radar.fold_probability: closed"),
    (lambda: RADAR.fold_probability(_long_crested(heading=0.3)), "try: bunching(sea, labels, time)"),
    (lambda: specular_points(_profile(), math.nan), "specular_points: slope: nan is not a finite number"),
]


@pytest.mark.parametrize(("call", "text"), [*OF_SEAS, *OF_SPECTRA, *OF_RADARS])
def test_what_cannot_be_is_named(call: Callable[[], Any], text: str) -> None:
    with pytest.raises(UsageError, match=re.escape(text)):
        call()


def test_water_deeper_than_half_a_wave_has_the_closed_forms() -> None:
    deep, shelf = (_long_crested(height=2.0, depth=depth) for depth in (math.inf, 90.0))
    assert RADAR.cutoff(shelf) == pytest.approx(RADAR.cutoff(deep), rel=0.01)


def test_pairs_that_do_not_fit_memory_are_refused_before_they_are_made() -> None:
    k = np.linspace(0.01, 1.0, 20_000)
    many = Components(np.column_stack((k, np.zeros_like(k))), np.full(len(k), 1e-4), np.zeros(len(k)))
    with pytest.raises(UsageError, match=r"20000 components have 199990000 pairs, whose table takes 17.6 GB; try: .*"):
        Sea(many)


def test_shallow_water_is_warned_of() -> None:
    with pytest.warns(RuntimeWarning, match=r"A / \(k\^2 h\^3\) = 0.4 for the largest wave, k = 0.05 rad/m; an"):
        Sea.of_one_wave(0.05, 1.0, 10.0)
