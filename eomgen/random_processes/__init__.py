"""Stationary random processes: covariances with their spectra, and their expansions in standard normal variables."""

from eomgen.random_processes.covariance import (
    Band,
    Covariance,
    CovarianceTable,
    DampedCosine,
    Exponential,
    KanaiTajimi,
    Oscillator,
    RoadProfile,
    SpectrumTable,
    SquaredExponential,
)
from eomgen.random_processes.draws import standard_normals
from eomgen.random_processes.karhunen_loeve import MOST_MODES, Expansion, expand
from eomgen.random_processes.translation import translated_correlation, underlying

__all__ = [
    "MOST_MODES",
    "Band",
    "Covariance",
    "CovarianceTable",
    "DampedCosine",
    "Expansion",
    "Exponential",
    "KanaiTajimi",
    "Oscillator",
    "RoadProfile",
    "SpectrumTable",
    "SquaredExponential",
    "expand",
    "standard_normals",
    "translated_correlation",
    "underlying",
]
