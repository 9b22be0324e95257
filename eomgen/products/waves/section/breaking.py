"""Rule that the waves at the peak of a sea do not break."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from eomgen.base.arrays import Flags, Numbers
from eomgen.base.data import dataclass
from eomgen.products.waves.sea_states.steepness import breaking_height


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
        fault = (
            f"at the peak waves of {length:.4g} m break from a height of {most:.4g} m on, and the significant height"
        )
        return f"{fault} is {numbers[0]:.4g} m", "a smaller height, or a longer period"
