"""What heights of waves must be: below that from which on they break."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from eomgen.arrays import Flags, Numbers
from eomgen.formula.wave_fields import WaveComponent

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


def too_steep_together(components: Sequence[WaveComponent], depth: float, *, alone: bool, unit: bool) -> list[str]:
    """Return a note on waves each of which stands, and which break together: that are told one by one, by the sum of
    their slopes; of a spectrum by their significant slope, the mean of the highest third.

    Parameters
    ----------
    alone : whether the waves are told one by one
    unit : whether amplitudes are those of variables of 1, whose squares have the mean 2
    """
    kx, ky, _, amplitude, _, _ = np.array(components).T
    k = np.hypot(kx, ky)
    slopes = k * amplitude / np.tanh(np.minimum(k * depth, 700.0))
    slope = float(np.sum(slopes) if alone else 2.0 * math.sqrt((1.0 if unit else 0.5) * np.sum(slopes**2)))
    most = _STEEPEST * math.pi
    if (alone and len(components) < 2) or not slope > most:
        return []
    what = f"where crests meet the slope comes to {slope:.3g}" if alone else f"the significant slope is {slope:.3g}"
    what += f", and waves break from {most:.3g} on: forces there are those of no water"
    return [what if alone else f"{what}. A lower sea, or a band that ends before its shortest waves"]
