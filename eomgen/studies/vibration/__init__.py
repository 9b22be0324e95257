"""Random vibration: distributions of outputs of scenes with random processes, and the cost of each method."""

from __future__ import annotations

from eomgen.studies.vibration.findings import Distribution
from eomgen.studies.vibration.result import RandomVibration
from eomgen.studies.vibration.study import random_vibration

__all__ = ["Distribution", "RandomVibration", "random_vibration"]
