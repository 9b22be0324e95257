"""Ensembles: many runs of one model, reduced as they come."""

from __future__ import annotations

from typing import TYPE_CHECKING

from eomgen.base.products import Product, import_target
from eomgen.base.verbs import Verb

if TYPE_CHECKING:
    from eomgen.products.ensembles.designs import DESIGNS, OTHER_DESIGNS
    from eomgen.products.ensembles.distributions import (
        DISTRIBUTIONS,
        LISTS,
        Distribution,
        from_normal,
        read_distribution,
    )
    from eomgen.products.ensembles.ensemble import Ensemble
    from eomgen.products.ensembles.samples import FailedSample
    from eomgen.products.ensembles.statistics import Ranking

__all__ = [
    "DESIGNS",
    "DISTRIBUTIONS",
    "LISTS",
    "OTHER_DESIGNS",
    "Distribution",
    "Ensemble",
    "FailedSample",
    "Ranking",
    "from_normal",
    "read_distribution",
]

#: Open to the other parts of ``products`` as well.
WITHIN = ["samples", "side_by_side", "simulate_many", "statistics"]

PRODUCT = Product(
    rows={
        "eomgen.verbs": (
            Verb(
                "ensemble",
                "Run many samples of a varied scene: statistics and sensitivities.",
                "eomgen.products.ensembles.command:ensemble",
                ("eomgen.products.ensembles.simulate_many:simulate_many",),
                behind="simulate",
                heading="Studies",
            ),
        ),
    },
)
_HOMES = {
    **dict.fromkeys(("DESIGNS", "OTHER_DESIGNS"), "designs"),
    **dict.fromkeys(("DISTRIBUTIONS", "LISTS", "Distribution", "from_normal", "read_distribution"), "distributions"),
    "Ensemble": "ensemble",
    "FailedSample": "samples",
    "Ranking": "statistics",
}


def __getattr__(name: str) -> object:
    if name in _HOMES:
        return import_target(f"{__name__}.{_HOMES[name]}:{name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
