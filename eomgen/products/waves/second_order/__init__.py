"""Ocean waves of second order in Lagrangian form: particles, their surface, and the motion at fixed points."""

from __future__ import annotations

from eomgen.products.waves.sea_states.components import Components, DiscreteSpectrum, discretized, divided, wave_number
from eomgen.products.waves.sea_states.spectra import Jonswap, PiersonMoskowitz, Spectrum, SpectrumTable, Spreading
from eomgen.products.waves.second_order.motion import BoundWaves, Motion, Surface
from eomgen.products.waves.second_order.pairs import WaveNumber, gravity_waves
from eomgen.products.waves.second_order.profiles import Profile, SeaStatistics, statistics_of
from eomgen.products.waves.second_order.radar import Radar, SpecularPoints, specular_points
from eomgen.products.waves.second_order.sea import Sea
from eomgen.products.waves.second_order.stepping import Ramp, SteppedSea

__all__ = [
    "BoundWaves",
    "Components",
    "DiscreteSpectrum",
    "Jonswap",
    "Motion",
    "PiersonMoskowitz",
    "Profile",
    "Radar",
    "Ramp",
    "Sea",
    "SeaStatistics",
    "Spectrum",
    "SpectrumTable",
    "SpecularPoints",
    "Spreading",
    "SteppedSea",
    "Surface",
    "WaveNumber",
    "discretized",
    "divided",
    "gravity_waves",
    "specular_points",
    "statistics_of",
    "wave_number",
]
