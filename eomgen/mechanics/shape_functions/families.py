"""Families of shape functions: n functions of s in [0, 1] with two derivatives, smooth between breaks."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Protocol

from eomgen.mechanics.shape_functions.fixed_point import Fixed, times


class Family(Protocol):
    """Shape functions f_0 .. f_(n-1) of s.

    Attributes
    ----------
    size : n
    breaks : places at which functions or derivatives are not smooth, within 0 < s < 1, in order
    wave_number : largest of a wave in the functions between breaks, rad; of polynomials, a quarter of their degree
    """

    @property
    def size(self) -> int: ...
    @property
    def breaks(self) -> tuple[Fraction, ...]: ...
    @property
    def wave_number(self) -> float: ...

    def values(self, s: Fixed) -> tuple[Fixed, Fixed, Fixed]:
        """Return values, first and second derivatives by s at m positions, (n, m) each."""
        ...


@dataclass(frozen=True)
class Scaled:
    """A family with functions multiplied by factors (n,)."""

    family: Family
    factors: Fixed

    @property
    def size(self) -> int:
        """Number of functions."""
        return self.family.size

    @property
    def breaks(self) -> tuple[Fraction, ...]:
        """Positions at which functions are not smooth."""
        return self.family.breaks

    @property
    def wave_number(self) -> float:
        """Largest wave number."""
        return self.family.wave_number

    def values(self, s: Fixed) -> tuple[Fixed, Fixed, Fixed]:
        """Return (n, m) values, first and second derivatives by s."""
        f, slope, curvature = (times(self.factors[:, None], part) for part in self.family.values(s))
        return f, slope, curvature
