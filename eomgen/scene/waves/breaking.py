"""What heights of waves must be: below that from which on they break."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from eomgen.arrays import Flags, Numbers

#: Height over wave length from which on a wave breaks, in deep water (Miche 1944): over a bottom tanh k h of it.
_STEEPEST = 0.142


def breaking_height(k: float, depth: float) -> float:
    """Return the height in m from which on a wave of the wave number k, rad/m, breaks."""
    return _STEEPEST * 2.0 * math.pi / k * math.tanh(min(k * depth, 700.0))


@dataclass(frozen=True)
class UnbrokenSea:
    """Rule for the significant height of a sea, m, whose waves at the peak have a wave number, rad/m, at a depth, m."""

    k: float
    depth: float
    stage: ClassVar[int] = 1

    def broken(self, numbers: Sequence[Numbers]) -> Flags:
        return np.greater(numbers[0], breaking_height(self.k, self.depth))

    def fault(self, numbers: Sequence[float]) -> tuple[str, str]:
        length, most = 2.0 * math.pi / self.k, breaking_height(self.k, self.depth)
        what = f"at the peak waves of {length:.4g} m break from a height of {most:.4g} m on, and the significant height"
        return f"{what} is {numbers[0]:.4g} m", "a smaller height, or a longer period"
