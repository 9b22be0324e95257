"""Closed forms of a Gaussian sea of one direction in deep water, at points of the plane.

Of first order in labels they are exact: x = a - (Hilbert transform), z = elevation of labels, both Gaussian, and a mean
over the plane is one over labels with the weight J = dx/da. Skewness is of second order.
Sources: Longuet-Higgins, JFM 17 (1963) 459 (skewness); Nouguier, Guerin and Chapron, JGR 114 (2009) C09012 (slopes of a
surface with Gaussian displacements); Longuet-Higgins, J. Opt. Soc. Am. 50 (1960) 838 (specular points).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.base.calls import checked_call, checked_calls
from eomgen.base.data import dataclass
from eomgen.errors import Problem, UsageError
from eomgen.products.waves.sea_states.components import STANDARD_GRAVITY
from eomgen.products.waves.sea_states.spectra import DiscreteSpectrum


@checked_calls()
@dataclass(frozen=True)
class SeaStatistics:
    """Of wave numbers (n,) in rad/m and the variance of elevation of each in m^2, one direction, deep water."""

    wave_numbers: Array
    energy: Array

    def moment(self, power: int) -> float:
        """Return the sum of E k^power."""
        return float(np.sum(self.energy * self.wave_numbers**power))

    @property
    def mean(self) -> float:
        """Of the elevation of first order, in m; of second order it is 0."""
        return -self.moment(1)

    @property
    def variance(self) -> float:
        """Of the elevation of first order, in m^2."""
        return self.moment(0) - self.moment(1) ** 2

    @property
    def third_moment(self) -> float:
        """Third central moment of the elevation of first order, in m^3."""
        return -2.0 * self.moment(1) ** 3

    @property
    def skewness(self) -> float:
        """Of the elevation of second order: 3/sigma^3 sum of E_i E_j min(k_i, k_j)."""
        order = np.argsort(self.wave_numbers)
        k, e = self.wave_numbers[order], self.energy[order]
        behind = e.sum() - np.cumsum(e)  # of higher wave numbers
        return float(3.0 * np.sum(e * k * (e + 2.0 * behind)) / self.moment(0) ** 1.5)

    @property
    def fold_probability(self) -> float:
        """The part of labels of first order at which the surface is folded over."""
        return 0.5 * math.erfc(1.0 / math.sqrt(2.0 * self.moment(2)))

    def slope_density(self, slope: ArrayLike) -> Array:
        """Return the density of slopes of first order at points of the plane."""
        m2 = self.moment(2)
        steep = 1.0 + np.asarray(slope, dtype=float) ** 2
        level = steep**-2.5 + m2 * steep**-1.5
        return np.asarray(level * np.exp(-(steep - 1.0) / (2.0 * m2 * steep)) / math.sqrt(2.0 * math.pi * m2))

    def specular_points(self, slope: ArrayLike) -> Array:
        """Return the density of points of the surface of first order that have a slope, in 1/m."""
        m2, square = self.moment(2), np.asarray(slope, dtype=float) ** 2
        rate = math.sqrt(self.moment(4) / m2) / math.pi
        return np.asarray(rate * np.exp(-square / (2.0 * m2 * (1.0 + square))))

    def drift(self, gravity: float = STANDARD_GRAVITY) -> float:
        """Return the mean velocity of the surface's particles at second order, 2 sum of E k w, in m/s."""
        return 2.0 * math.sqrt(gravity) * float(np.sum(self.energy * self.wave_numbers**1.5))


@checked_call()
def statistics_of(spectrum: DiscreteSpectrum) -> SeaStatistics:
    """Return the closed forms of a spectrum of one direction.

    Raises
    ------
    UsageError
        Several directions, or water in which the waves feel the bottom.
    """
    k = np.hypot(*spectrum.vectors.T)
    along = spectrum.vectors @ spectrum.vectors[0] / k[0]
    if np.any(np.abs(along - k) > 1e-12 * k):
        fault = "there are closed forms for waves of one direction alone, and these have several"
        raise UsageError(Problem("statistics_of", fault, "a spectrum without spreading, or realisations"))
    spectrum.check_deep("statistics_of", "realisations, and their means")
    return SeaStatistics(k, spectrum.energy)
