"""Seas of one direction: motion by FFT if wave numbers are multiples of one, and closed forms of a Gaussian sea in
deep water.

Of first order in labels they are exact: x = a - (Hilbert transform), z = elevation of labels, both Gaussian, and a mean
over the plane is one over labels with the weight J = dx/da. Skewness is of second order.
Sources: Longuet-Higgins, JFM 17 (1963) 459 (skewness); Nouguier, Guerin and Chapron, JGR 114 (2009) C09012 (slopes of a
surface with Gaussian displacements); Longuet-Higgins, J. Opt. Soc. Am. 50 (1960) 838 (specular points).
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eomgen.base.arrays import Array
from eomgen.base.calls import checked_call, checked_calls
from eomgen.base.data import dataclass
from eomgen.base.rounding import COMPUTED, SUMMED
from eomgen.errors import Problem, UsageError
from eomgen.products.waves.sea_states.components import DiscreteSpectrum
from eomgen.products.waves.sea_states.spectra import STANDARD_GRAVITY
from eomgen.products.waves.second_order.pairs import COLUMNS, OWN

Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class Profile:
    """The surface of a sea of one direction at equally spaced labels, along the direction of the waves.

    Attributes
    ----------
    labels, x, z : (count,) arrays, m
    u, w : velocities along the direction and upwards, m/s
    xa, za, xaa, zaa : derivatives of x and z by the label
    """

    labels: Array
    x: Array
    z: Array
    u: Array
    w: Array
    xa: Array
    za: Array
    xaa: Array
    zaa: Array

    @property
    def slope(self) -> Array:
        """Slope dz/dx of the surface."""
        return self.za / self.xa

    @property
    def curvature(self) -> Array:
        """Curvature of the curve z(x), 1/m; negative at crests."""
        steep = self.xa**2 + self.za**2
        return (self.xa * self.zaa - self.za * self.xaa) / steep**1.5

    def mean(self, values: Array) -> float:
        """Return the mean of values over the plane: each label is weighted by the area around it.

        Parameters
        ----------
        values : ndarray
            Values (count,) at the labels.

        Returns
        -------
        float
            The mean, in the unit of the values.
        """
        return float(np.sum(values * self.xa) / np.sum(self.xa))


def multiples(k: Array) -> tuple[float, NDArray[np.int64]]:
    """Return the greatest common divisor of wave numbers (n,), rad/m, and the integer multiples (n,).

    Raises
    ------
    UsageError
        There is none of which all are multiples, the largest 1e5 at most.
    """
    unit = float(k.min())
    for _ in range(40):  # Euclid's algorithm, of numbers that are rounded
        rest = np.abs(k / unit - np.rint(k / unit)) * unit
        if np.all(rest <= COMPUTED * k):
            break
        unit = float(rest[rest > COMPUTED * k].min())
    number = np.rint(k / unit).astype(np.int64)
    if np.any(np.abs(number * unit - k) > COMPUTED * k) or number.max() > 100_000:
        fault = "the wave numbers are not multiples of one that is not far smaller than all of them [E1205]"
        raise UsageError(Problem("Sea.profile", fault, "components by discretized(...), or surface(labels, time)"))
    return float(np.mean(k / number)), number


def harmonics(
    number: NDArray[np.int64],
    columns: Array,
    crest: Complex,
    self_table: Array,
    table: Mapping[str, Array] | None,
    level: Array,
) -> tuple[dict[str, Complex], Array]:
    """Return the complex amplitudes of x, z, u and w by name, indexed by multiple, and the constant parts of u and z
    (2,).

    ``number`` (n,) has the multiples of the components' wave numbers, ``columns`` and ``self_table`` are their tables,
    with rows as in ``COLUMNS`` and ``OWN``; ``crest`` (n,) is A exp(i theta) at the label 0, ``table`` has the columns
    of pairs by name (None: first order), ``level`` lift, rise of the pressure, and drift along and across.
    """
    row = dict(zip(COLUMNS, columns, strict=True))
    w, Ch, Sh = row["w"], row["Ch"], row["Sh"]
    size = 2 * int(number.max()) + 1
    total = {name: np.zeros(size, dtype=complex) for name in "xzuw"}

    def add(at: NDArray[np.int64], of: Mapping[str, Complex]) -> None:
        for name, values in of.items():
            total[name].real += np.bincount(at, values.real, size)
            total[name].imag += np.bincount(at, values.imag, size)

    add(number, {"x": 1j * Ch * crest, "z": Sh * crest, "u": Ch * w * crest, "w": -1j * Sh * w * crest})
    if table is None:
        return total, np.zeros(2)
    i, j = np.tril_indices(len(number), -1)
    pairs = [(number[i] - number[j], crest[i] * np.conj(crest[j]), table["w"], table["Xm"], table["Zm"])]
    if "Xp" in table:
        pairs.append((number[i] + number[j], crest[i] * crest[j], w[i] + w[j], table["Xp"], table["Zp"]))
        pairs.append((2 * number, crest * crest, 2.0 * w, self_table[OWN.index("Xp")], self_table[OWN.index("Zp")]))
    for at, product, rate, X, Z in pairs:
        horizontal, upwards = -1j * X * product, Z * product
        add(at, {"x": horizontal, "z": upwards, "u": -1j * rate * horizontal, "w": -1j * rate * upwards})
    return total, np.array([level[2], level[0]])


@checked_calls()
@dataclass(frozen=True)
class SeaStatistics:
    """Closed forms for a Gaussian sea of one direction in deep water, by wave numbers (n,), rad/m, with the variance of
    elevation of each (``energy``), m^2."""

    wave_numbers: Array
    energy: Array

    def moment(self, power: int) -> float:
        """Return the sum of E k^power.

        Parameters
        ----------
        power : int
            Power of k.

        Returns
        -------
        float
            In m^2 (rad/m)^power.
        """
        return float(np.sum(self.energy * self.wave_numbers**power))

    @property
    def mean(self) -> float:
        """Mean elevation of first order, in m; the mean of second order is 0."""
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
        """Second-order skewness of the elevation: 3/sigma^3 times the sum over all i and j of
        E_i E_j min(k_i, k_j), with sigma = sqrt(sum of E), the first-order standard deviation in labels."""
        order = np.argsort(self.wave_numbers)
        k, e = self.wave_numbers[order], self.energy[order]
        behind = e.sum() - np.cumsum(e)  # of higher wave numbers
        return float(3.0 * np.sum(e * k * (e + 2.0 * behind)) / self.moment(0) ** 1.5)

    @property
    def fold_probability(self) -> float:
        """The part of labels of first order at which the surface is folded over."""
        return 0.5 * math.erfc(1.0 / math.sqrt(2.0 * self.moment(2)))

    def slope_density(self, slope: ArrayLike) -> Array:
        """Return the probability density of slopes dz/dx, x along the waves, of the first-order surface.

        The density is at points of the plane. At folded places each sheet of the surface counts, so the integral then
        exceeds 1.

        Parameters
        ----------
        slope : array_like
            Slopes (...).

        Returns
        -------
        (...) ndarray
            Per unit of slope.
        """
        m2 = self.moment(2)
        steep = 1.0 + np.asarray(slope, dtype=float) ** 2
        level = steep**-2.5 + m2 * steep**-1.5
        return np.asarray(level * np.exp(-(steep - 1.0) / (2.0 * m2 * steep)) / math.sqrt(2.0 * math.pi * m2))

    def specular_points(self, slope: ArrayLike) -> Array:
        """Return the mean number of points, per metre along the waves, at which the surface of first order has a slope.

        Parameters
        ----------
        slope : array_like
            Slopes dz/dx (...).

        Returns
        -------
        (...) ndarray
            In 1/m.
        """
        m2, square = self.moment(2), np.asarray(slope, dtype=float) ** 2
        rate = math.sqrt(self.moment(4) / m2) / math.pi
        return np.asarray(rate * np.exp(-square / (2.0 * m2 * (1.0 + square))))

    def drift(self, gravity: float = STANDARD_GRAVITY) -> float:
        """Return the mean velocity of the surface's particles at second order, 2 sum of E k w.

        Parameters
        ----------
        gravity : float, optional
            In m/s^2.

        Returns
        -------
        float
            In m/s.
        """
        return 2.0 * math.sqrt(gravity) * float(np.sum(self.energy * self.wave_numbers**1.5))


@checked_call()
def statistics_of(spectrum: DiscreteSpectrum) -> SeaStatistics:
    """Return the closed forms of a spectrum of one direction.

    Parameters
    ----------
    spectrum : DiscreteSpectrum
        Of one direction, in water that is at least half as deep as the wave with the most energy is long.

    Returns
    -------
    SeaStatistics
        Moments and densities.

    Raises
    ------
    UsageError
        Several directions, or water that is less deep.
    """
    k = np.hypot(*spectrum.vectors.T)
    if np.any(np.abs(spectrum.vectors @ spectrum.vectors[0] / k[0] - k) > SUMMED * k):
        fault = "there are closed forms for waves of one direction alone, and these have several [E1206]"
        raise UsageError(Problem("statistics_of", fault, "a spectrum without spreading, or realisations"))
    spectrum.check_deep("statistics_of", "realisations, and their means")
    return SeaStatistics(k, spectrum.energy)
