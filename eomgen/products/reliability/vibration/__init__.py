"""Random vibration: distributions of outputs of scenes with random processes, and the cost of each method."""

from __future__ import annotations

from eomgen.products.reliability.vibration.result import Distribution, RandomVibration
from eomgen.products.reliability.vibration.study import random_vibration

__all__ = ["Distribution", "RandomVibration", "random_vibration"]
