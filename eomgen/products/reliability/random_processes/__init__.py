"""Stationary random processes: covariances with their spectra, and their expansions in standard normal variables."""

from eomgen.products.reliability.random_processes.coherence import (
    Coherence,
    CoherenceTable,
    CrossCovariance,
    ExponentialCoherence,
    least_eigenvalue,
    nearest_correlation,
)
from eomgen.products.reliability.random_processes.covariance import (
    BEYOND,
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
    quantile_map,
    translated_correlation,
    underlying,
)
from eomgen.products.reliability.random_processes.karhunen_loeve import MOST_MODES, Expansion, expand, expand_jointly

__all__ = [
    "BEYOND",
    "MOST_MODES",
    "Band",
    "Coherence",
    "CoherenceTable",
    "Covariance",
    "CovarianceTable",
    "CrossCovariance",
    "DampedCosine",
    "Expansion",
    "Exponential",
    "ExponentialCoherence",
    "KanaiTajimi",
    "Oscillator",
    "RoadProfile",
    "SpectrumTable",
    "SquaredExponential",
    "expand",
    "expand_jointly",
    "least_eigenvalue",
    "nearest_correlation",
    "quantile_map",
    "translated_correlation",
    "underlying",
]
