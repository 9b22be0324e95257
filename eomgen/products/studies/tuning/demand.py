"""Demands on a run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from eomgen.products.studies.work_precision.observation import ErrorSize


@dataclass(frozen=True)
class Demand:
    """An error that is to be met: relative, of a quantity, in a measure over time."""

    error: float
    quantity: str
    measure: str

    def of(self, sizes: Mapping[str, ErrorSize]) -> float:
        """Return the error that counts; infinite if it is not told or not finite."""
        size = sizes.get(self.quantity)
        value = float("inf") if size is None else float(getattr(size, self.measure))
        return value if value < float("inf") else float("inf")
