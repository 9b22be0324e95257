"""Ensembles: many runs of one model, reduced as they come."""

from __future__ import annotations

from eomgen.ensembles.designs import DESIGNS, OTHER_DESIGNS
from eomgen.ensembles.distributions import DISTRIBUTIONS, LISTS, Distribution, read_distribution
from eomgen.ensembles.ensemble import Ensemble
from eomgen.ensembles.samples import Failed
from eomgen.ensembles.sensitivity import Ranking
from eomgen.ensembles.simulate_many import simulate_many

__all__ = [
    "DESIGNS",
    "DISTRIBUTIONS",
    "LISTS",
    "OTHER_DESIGNS",
    "Distribution",
    "Ensemble",
    "Failed",
    "Ranking",
    "read_distribution",
    "simulate_many",
]
