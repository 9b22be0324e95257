"""Ocean waves of second order in Lagrangian form: particles, their surface, and the motion at fixed points."""

from __future__ import annotations

from eomgen.sea_states.components import Components
from eomgen.sea_states.spectra import (
    DiscreteSpectrum,
    Jonswap,
    PiersonMoskowitz,
    Spectrum,
    SpectrumTable,
    Spreading,
    discretized,
    divided,
    wave_number,
)
from eomgen.waves.motion import BoundWaves, Motion, Surface
from eomgen.waves.pairs import WaveNumber, gravity_waves
from eomgen.waves.profiles import Profile
from eomgen.waves.radar import Radar, SpecularPoints, specular_points
from eomgen.waves.sea import Sea
from eomgen.waves.statistics import SeaStatistics, statistics_of
from eomgen.waves.stepping import Ramp, SteppedSea

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
