"""Ensembles: many runs of one model, reduced as they come."""

from __future__ import annotations

from eomgen.products.ensembles.designs import DESIGNS, OTHER_DESIGNS
from eomgen.products.ensembles.distributions import DISTRIBUTIONS, LISTS, Distribution, read_distribution
from eomgen.products.ensembles.ensemble import Ensemble
from eomgen.products.ensembles.samples import Failed
from eomgen.products.ensembles.sensitivity import Ranking
from eomgen.products.ensembles.simulate_many import simulate_many

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
