"""Road: the one-sided displacement spectrum of a road's elevation over spatial frequency.

G_d(n) = G_d(n0) (n / n0)^-w with n0 = 0.1 cycle/m; ISO 8608:2016, equation 8 and table C.1 (w = 2). With two exponents,
one on each side of n0: Dodds and Robson (1973), J. Sound Vib. 31(2), 175-183.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.base.road_classes import FREQUENCY_RANGE, REFERENCE_FREQUENCY, ROUGHNESS
from eomgen.errors import Problem, UsageError


@dataclass(frozen=True)
class Road:
    """A random road, the same at all places.

    Parameters
    ----------
    road_class : str
        ``A`` to ``H`` of ISO 8608; or ``roughness`` in its place.
    roughness : float
        G_d(n0) at n0 = 0.1 cycle/m, m^3.
    exponent : float
        w, of waves shorter than 10 m; and of longer ones without ``long_exponent``.
    long_exponent : float
        w of waves longer than 10 m.
    band : (float, float)
        Spatial frequencies in cycle/m beyond which there are no waves; by default the standard's.

    Raises
    ------
    UsageError
        No class of that name; class and roughness together or neither; numbers that no road has.
    """

    road_class: str | None = None
    roughness: float | None = None
    exponent: float = 2.0
    long_exponent: float | None = None
    band: tuple[float, float] = FREQUENCY_RANGE

    def __post_init__(self) -> None:
        if (self.road_class is None) == (self.roughness is None):
            fault = "a road needs either a class or a roughness"
            raise UsageError(Problem("Road", fault, 'Road("C"), or Road(roughness=256e-6)'))
        if self.road_class is not None and self.road_class not in ROUGHNESS:
            fault = f"there is no road class {ascii(self.road_class)[:32]}"
            raise UsageError(Problem("Road", fault, f"one of {', '.join(ROUGHNESS)}"))
        if self.roughness is not None:
            _check("roughness", self.roughness, "m^3, above 0")
        _check("exponent", self.exponent, "above 0; 2 for the classes")
        if self.long_exponent is not None:
            _check("long_exponent", self.long_exponent, "above 0")
        if not (len(self.band) == 2 and 0.0 < self.band[0] < self.band[1] < math.inf):
            fault = f"the band {self.band} is no pair of spatial frequencies, the lower first"
            raise UsageError(Problem("Road: band", fault, f"{FREQUENCY_RANGE}, cycle/m"))

    @property
    def reference_roughness(self) -> float:
        """G_d(n0), m^3."""
        return ROUGHNESS[str(self.road_class)] if self.roughness is None else self.roughness

    @property
    def name(self) -> str:
        """Class or roughness in words."""
        return f"class {self.road_class}" if self.road_class else f"roughness {self.roughness:.4g} m^3"

    @property
    def bends(self) -> Array:
        """Spatial frequencies at which the density bends, cycle/m."""
        return np.array([REFERENCE_FREQUENCY] if self.long_exponent not in (None, self.exponent) else [])

    def of_class(self, road_class: str) -> Road:
        """Return a road of a class with the exponents and the band of this one."""
        return Road(road_class, None, self.exponent, self.long_exponent, self.band)

    def over_distance(self, n: ArrayLike) -> Array:
        """Return G_d(n), m^3, at spatial frequencies n (...) in cycle/m; zero outside the band."""
        given = np.asarray(n, dtype=float)
        inside = (given >= self.band[0]) & (given <= self.band[1])
        ratio = np.where(inside, given, REFERENCE_FREQUENCY) / REFERENCE_FREQUENCY
        long = self.exponent if self.long_exponent is None else self.long_exponent
        exponent = np.where(ratio < 1.0, long, self.exponent)
        return np.where(inside, self.reference_roughness * ratio**-exponent, 0.0)

    def over_time(self, frequencies: ArrayLike, speed: float) -> Array:
        """Return G(f) = G_d(f / V) / V of the elevation under a wheel, m^2/Hz, at frequencies (...) in Hz."""
        return self.over_distance(np.asarray(frequencies, dtype=float) / speed) / speed


def _check(name: str, value: float, needed: str) -> None:
    if not (isinstance(value, int | float) and 0.0 < value < math.inf):
        raise UsageError(Problem(f"Road: {name}", f"{ascii(value)[:32]} is no number that a road has", needed))
