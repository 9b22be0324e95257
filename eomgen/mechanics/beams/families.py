"""What a family of shape functions is: n functions of s = 0 .. 1 along a beam, with derivatives, smooth between breaks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Family(Protocol):
    """Shape functions f_0 .. f_(n-1) of s.

    Attributes
    ----------
    size : n
    breaks : where functions or derivatives are not smooth, within 0 < s < 1, in order
    wave_number : largest of a wave in the functions between breaks, rad; of polynomials, their degree
    """

    @property
    def size(self) -> int: ...
    @property
    def breaks(self) -> tuple[float, ...]: ...
    @property
    def wave_number(self) -> float: ...

    def values(self, s: Array, derivative: int = 0) -> Array:
        """Return (n, m) values of a derivative by s at m places."""
        ...


@dataclass(frozen=True)
class Scaled:
    """A family whose functions are multiplied by factors (n,)."""

    family: Family
    factors: Array

    @property
    def size(self) -> int:
        """Number of functions."""
        return self.family.size

    @property
    def breaks(self) -> tuple[float, ...]:
        """Places where functions are not smooth."""
        return self.family.breaks

    @property
    def wave_number(self) -> float:
        """Largest wave number."""
        return self.family.wave_number

    def values(self, s: Array, derivative: int = 0) -> Array:
        """Return (n, m) values of a derivative by s at m places."""
        return self.factors[:, None] * self.family.values(s, derivative)
