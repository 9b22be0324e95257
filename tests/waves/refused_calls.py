"""Refused calls of waves from Python with their texts, and calls at the border that are taken."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, cast

import numpy as np

from eomgen.products.waves.sea_states.components import discretized, divided, wave_number
from eomgen.products.waves.sea_states.spectra import Jonswap, PiersonMoskowitz, SpectrumTable, Spreading
from eomgen.products.waves.second_order import Sea
from eomgen.products.waves.second_order.profiles import multiples
from eomgen.products.waves.second_order.radar import Radar
from eomgen.products.waves.second_order.stepping import Ramp

RADAR = Radar(100.0, 0.4)
SEA = divided(Jonswap(1.0, 8.0), 3).realisation(1)

REFUSED: dict[str, tuple[Callable[[], object], str]] = {
    "band": (
        lambda: discretized(Jonswap(2.0, 8.0), band=(0.0, 1.0)),
        "discretized: band: (0.0, 1.0) does not increase from above 0; try: (0.5, 3.0)",
    ),
    "band of nothing": (
        lambda: divided(Jonswap(2.0, 8.0), 4, band=(1.0, 1.0)),
        "divided: band: (1.0, 1.0) does not increase from above 0; try: (0.5, 3.0)",
    ),
    "depth of a wave": (
        lambda: wave_number(1.0, 0.0),
        "wave_number: depth: 0 m is not above 0; try: math.inf for water without a bottom",
    ),
    "frequency of a wave": (lambda: wave_number(0.0), "wave_number: frequency: 0 rad/s is not above 0"),
    "height": (lambda: Jonswap(0.0, 8.0), "Jonswap: height: 0 is not above 0"),
    "period": (lambda: Jonswap(2.0, math.inf), "Jonswap: period: inf is not above 0"),
    "peakedness": (
        lambda: Jonswap(2.0, 8.0, 0.99),
        "Jonswap: peakedness: 0.99 is not from 1 to 20; try: 3.3, or 1 for a fully developed sea",
    ),
    "large peakedness": (
        lambda: Jonswap(2.0, 8.0, 20.1),
        "Jonswap: peakedness: 20.1 is not from 1 to 20; try: 3.3, or 1 for a fully developed sea",
    ),
    "wind": (lambda: PiersonMoskowitz(0.0), "PiersonMoskowitz: wind: 0 m/s is not above 0"),
    "gravity of a spectrum": (
        lambda: PiersonMoskowitz(10.0, -9.81),
        "PiersonMoskowitz: gravity: -9.81 m/s^2 is not above 0; try: 9.81",
    ),
    "spectrum of nothing": (
        lambda: SpectrumTable([1.0, 2.0], [0.0, 0.0]),
        "SpectrumTable: densities: the least is 0 m^2 s/rad, the greatest 0; try: none below 0, one above 0",
    ),
    "spectrum below zero": (
        lambda: SpectrumTable([1.0, 2.0], [1.0, -0.1]),
        "SpectrumTable: densities: the least is -0.1 m^2 s/rad, the greatest 1; try: none below 0, one above 0",
    ),
    "spectrum from zero": (
        lambda: SpectrumTable([0.0, 2.0], [1.0, 1.0]),
        "SpectrumTable: frequencies: they have to increase from above 0",
    ),
    "spreading": (lambda: Spreading(0.0), "Spreading: exponent: 0 is not above 0"),
    "order of a sea": (lambda: Sea(SEA, math.inf, order=3), "Sea: order: there is no order 3; try: 1 or 2"),
    "gravity of a sea": (
        lambda: Sea(SEA, math.inf, gravity=0.0),
        "Sea: gravity: 0 m/s^2 is not above 0; try: 9.81",
    ),
    "depth of a sea": (
        lambda: Sea(SEA, 0.0),
        "Sea: depth: 0 m is not above 0; try: math.inf for water without a bottom",
    ),
    "vorticity": (
        lambda: Sea(SEA, math.inf, vorticity=cast(Any, "some")),
        "Sea: vorticity: there is no 'some'; try: none, or gerstner",
    ),
    "pairs of a sea of order 1": (
        lambda: Sea(SEA, math.inf, order=1).bound_waves(0.0),
        "Sea.bound_waves: a sea of order 1 has no pairs; try: order = 2",
    ),
    "range to velocity": (lambda: Radar(-0.1, 0.4), "Radar: range_to_velocity: -0.1 s is below 0"),
    "incidence": (
        lambda: Radar(100.0, 0.5 * math.pi),
        "Radar: incidence: 1.5708 rad is not from 0 to below pi/2; try: the angle from the vertical, 0.4 for 23"
        " degrees",
    ),
    "gravity of a critical amplitude": (
        lambda: RADAR.critical_amplitude(0.04, gravity=-9.81),
        "Radar.critical_amplitude: gravity: -9.81 m/s^2 is not above 0; try: 9.81",
    ),
    "gravity of a cut-off": (
        lambda: RADAR.cutoff(divided(Jonswap(1.0, 8.0), 3), math.nan),
        "Radar.velocity_deviation: gravity: nan m/s^2 is not a finite number; try: 9.81",
    ),
    "gravity of folds": (
        lambda: RADAR.fold_probability(divided(Jonswap(1.0, 8.0), 3), 0.0),
        "Radar.fold_probability: gravity: 0 m/s^2 is not above 0; try: 9.81",
    ),
    "reflectivity": (
        lambda: RADAR.backscatter(0.1, -0.1),
        "Radar.backscatter: reflectivity: -0.1 is below 0",
    ),
    "labels of a profile": (
        lambda: Sea(discretized(Jonswap(2.0, 10.0)).realisation(1)).profile(cast(Any, 4096.5), 0.0),
        "Sea.profile: count: 4096.5 is not a whole number from 1 on; try: 575",
    ),
    "periods of a profile": (
        lambda: multiples(np.array([1.0, math.sqrt(2.0)])),
        "Sea.profile: the wave numbers are not multiples of one that is not far smaller than all of them; try:"
        " components by discretized(...), or surface(labels, time)",
    ),
    "ramp": (lambda: Ramp(0.0), "Ramp: time: 0 is not above 0"),
    "power of a ramp": (lambda: Ramp(1.0, 0.0), "Ramp: power: 0 is not above 0"),
}
ACCEPTED: Sequence[Callable[[], object]] = (
    lambda: Jonswap(2.0, 8.0, 1.0),
    lambda: Jonswap(2.0, 8.0, 20.0),
    lambda: Radar(0.0, 0.0),
    lambda: RADAR.backscatter(0.0, 0.0),
    lambda: SpectrumTable([1.0, 2.0], [0.0, 1.0]),
)
