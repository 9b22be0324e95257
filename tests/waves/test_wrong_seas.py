"""Seas that cannot be, each with one message."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from eomgen.errors import UsageError
from eomgen.waves import (
    Components,
    Jonswap,
    Profile,
    Radar,
    Sea,
    SpectrumTable,
    Spreading,
    discretized,
    divided,
    specular_points,
    statistics_of,
    wave_number,
)

VECTORS, ONE = np.array([[0.05, 0.0], [0.06, 0.0]]), np.ones(2)


@pytest.mark.parametrize(
    ("components", "options", "text"),
    [
        (
            (VECTORS, ONE * 30.0, ONE),
            {},
            "component 1 has k A coth(k h) = 1.8; from 1 on a wave crosses itself",
        ),
        (
            (VECTORS, ONE, ONE),
            {"depth": 0.0},
            "Sea: depth: 0 m is not above 0; try: math.inf for water without a bottom",
        ),
        ((VECTORS, ONE, ONE), {"depth": math.nan}, "Sea: depth: nan m is not above 0"),
        ((VECTORS * [[0.0], [1.0]], ONE, ONE), {}, "component 0 has the wave vector (0, 0), which is a change of the"),
        ((VECTORS[[0, 0]], ONE, ONE), {}, "two components have the same wave vector; try: one with the sum of both"),
        ((VECTORS, -ONE, ONE), {}, "the amplitude -1 m is negative; try: the phase + pi"),
        ((VECTORS, ONE[:1], ONE), {}, "2 wave vectors have amplitudes of shape (1,) and phases of (2,)"),
        ((VECTORS[0], ONE, ONE), {}, "wave vectors have the shape (2,); try: (n, 2), at least one"),
        ((VECTORS, ONE * np.inf, ONE), {}, "a wave vector, an amplitude or a phase is not a finite number"),
        ((VECTORS, ONE, ONE), {"order": 3}, "Sea: order: there is no order 3; try: 1 or 2"),
        ((VECTORS, ONE, ONE), {"gravity": -9.81}, "Sea: gravity: -9.81 m/s^2 is not above 0"),
    ],
)
def test_what_cannot_be_is_named(components: tuple[Any, ...], options: dict[str, Any], text: str) -> None:
    with pytest.raises(UsageError) as refused:
        Sea(Components(*components), **options)
    assert text in str(refused.value)


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda sea: sea.motion([1.0, 2.0], 0.0), "Sea: labels: an array of shape (2,); try: finite numbers of shape"),
        (
            lambda sea: sea.at([[1.0, np.nan]], 0.0),
            "an array of shape (1, 2), with numbers that are not finite",
        ),
        (
            lambda sea: sea.motion([[1.0, 2.0]], 0.0, 3.0),
            "at c = 3 m are outside of the water, which is from -20 m to 0",
        ),
        (lambda sea: sea.motion([[1.0, 2.0]], 0.0, -21.0), "labels at c = -21 m are outside of the water"),
        (lambda sea: sea.motion([[1.0, 2.0]]), "time"),
        (lambda sea: Sea(Components(VECTORS, ONE, ONE), dept=3.0), "depth"),
    ],
)
def test_calls_that_cannot_be_taken(call: Callable[[Sea], Any], text: str) -> None:
    with pytest.raises(UsageError) as refused:
        call(Sea(Components(VECTORS, ONE, ONE), 20.0))
    assert text in str(refused.value)


SWELL = discretized(Jonswap(2.0, 10.0), length=600.0)
RADAR = Radar(30.0, 0.4)
EDGES = np.linspace(0.0, 100.0, 11)


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: _sea().motion([[0.0, 0.0]], math.nan), "Sea: time: nan s is not a finite number"),
        (lambda: _sea().motion([[0.0, 0.0]], "now"), "Sea: time: a number is needed, not str"),
        (lambda: _sea().elevation(np.zeros(3), 0.0, math.inf), "Sea: time: inf s is not a finite number"),
        (
            lambda: _sea().elevation(np.zeros(3), np.zeros(2), 0.0),
            "Sea: x and y: shapes (3,) and (2,) do not go together",
        ),
        (lambda: _swell().profile(512, math.nan), "Sea: time: nan s is not a finite number"),
        (lambda: RADAR.image(_sea(), math.nan, EDGES, EDGES), "Radar.image: time: nan s is not a finite number"),
        (lambda: RADAR.image(_sea(), 0.0, EDGES, EDGES, 0), "Radar.image: labels_per_cell: 0 is not from 1 to 1000"),
        (
            lambda: RADAR.image(_sea(), 0.0, EDGES**2, EDGES),
            "Radar.image: columns: cells are 100 to 1900 m wide; try: edges that are equally spaced",
        ),
        (
            lambda: Radar(1e9, 0.4).image(_sea(), 0.0, EDGES, EDGES),
            "labels are needed, more than 3e+07: facets move by up to 3.286e+09 m; try: larger cells",
        ),
        (lambda: RADAR.line(_profile(), -3.0, 10), "Radar.line: length: -3 m is not above 0; try: that after which"),
        (lambda: RADAR.line(_profile(), 600.0, 0), "Radar.line: cells: 0 is not from 1 to 10000000; try: 400"),
        (lambda: RADAR.line(_profile(), 600.0, 10, 2), "Radar.line: direction: 2 is none; try: 1 with the flight"),
        (lambda: RADAR.critical_amplitude(-1.0), "Radar.critical_amplitude: wave_number: -1 rad/m is not above 0"),
        (lambda: RADAR.critical_amplitude(0.04, 0), "Radar.critical_amplitude: direction: 0 is none"),
        (lambda: RADAR.backscatter(-1.0), "Radar.backscatter: slope_density: -1 is below 0"),
        (lambda: RADAR.intensity_spectrum(SWELL, 0.0, 10), "intensity_spectrum: length: 0 m is not above 0"),
        (lambda: RADAR.intensity_spectrum(SWELL, 600.0, 0), "intensity_spectrum: count: 0 is not from 1 to"),
        (lambda: RADAR.intensity_spectrum(SWELL, 600.0, 10**6), "1000000 wave numbers need"),
        (
            lambda: RADAR.cutoff(discretized(Jonswap(2.0, 10.0), depth=15.0)),
            "Radar.velocity_deviation: closed forms are of deep water, and waves of 109 m feel the bottom at 15 m",
        ),
        (lambda: RADAR.fold_probability(discretized(Jonswap(2.0, 10.0), depth=15.0)), "Radar.fold_probability: closed"),
        (lambda: statistics_of(divided(Jonswap(2.0, 10.0), 9, depth=15.0)), "statistics_of: closed forms are of deep"),
        (lambda: specular_points(_profile(), math.nan), "specular_points: slope: nan is not a finite number"),
        (lambda: wave_number(0.0), "wave_number: frequency: 0 rad/s is not above 0"),
        (lambda: wave_number(1.0, -3.0), "wave_number: depth: -3 m is not above 0; try: math.inf for water without"),
        (lambda: divided(Jonswap(2.0, 10.0), 0), "divided: components: 0 is not from 1 to 1000000"),
        (
            lambda: divided(Jonswap(2.0, 10.0), 5, height=-2.0),
            "divided: height: -2 m is not above 0; try: the significant",
        ),
        (
            lambda: discretized(Jonswap(2.0, 10.0), gravity=0.0),
            "discretized: gravity: 0 m/s^2 is not above 0; try: 9.81",
        ),
        (lambda: discretized(Jonswap(2.0, 10.0), length=-2.0), "discretized: length: -2 m is not above 0; try: 500"),
        (
            lambda: discretized(Jonswap(2.0, 10.0), length=1e12),
            "5.604e+10 wave numbers 2 pi j/length are within the band, more than 1000000; try: a shorter length",
        ),
        (
            lambda: discretized(Jonswap(2.0, 10.0), heading=math.nan),
            "discretized: heading: nan rad is not a finite number",
        ),
        (lambda: SWELL.realisation(-1), "realisation: seed: -1 is not a whole number from 0 on"),
        (lambda: SWELL.realisation(1.5), "realisation: seed: 1.5 is not a whole number from 0 on"),  # type: ignore[arg-type]
        (lambda: SpectrumTable([0.1, 0.2], [1.0, math.inf]), "a frequency or a density is not a finite number"),
        (lambda: Spreading(10.0, directions=2.5), "Spreading: directions: 2.5 is not from 2 to"),  # type: ignore[arg-type]
        (lambda: Spreading(10.0, math.nan), "Spreading: heading: nan rad is not a finite number"),
    ],
)
def test_numbers_that_cannot_be_are_named(call: Callable[[], Any], text: str) -> None:
    with pytest.raises(UsageError) as refused:
        call()
    assert text in str(refused.value)


def _sea() -> Sea:
    return Sea(Components(VECTORS, ONE, ONE), 20.0)


def _swell() -> Sea:
    return Sea(SWELL.realisation(0), order=1)


def _profile() -> Profile:
    return _swell().profile(512, 0.0)


def test_water_deeper_than_half_a_wave_has_the_closed_forms() -> None:
    deep, shelf = (discretized(Jonswap(2.0, 10.0), height=2.0, depth=depth) for depth in (math.inf, 90.0))
    assert RADAR.cutoff(shelf) == pytest.approx(RADAR.cutoff(deep), rel=0.01)


def test_pairs_that_do_not_fit_memory_are_refused_before_they_are_made() -> None:
    k = np.linspace(0.01, 1.0, 20_000)
    many = Components(np.column_stack((k, np.zeros_like(k))), np.full(len(k), 1e-4), np.zeros(len(k)))
    with pytest.raises(
        UsageError, match=r"20000 components have 199990000 pairs, whose table takes 17.6 GB; try: .* or a SteppedSea"
    ):
        Sea(many)


def test_shallow_water_is_warned_of() -> None:
    with pytest.warns(RuntimeWarning, match=r"A / \(k\^2 h\^3\) = 0.4 for the largest wave, k = 0.05 rad/m; an"):
        Sea.of_one_wave(0.05, 1.0, 10.0)
