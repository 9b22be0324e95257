"""Spectra of seas (JONSWAP, Pierson-Moskowitz, tables) and the spreading of directions; checks of their numbers."""

from __future__ import annotations

import functools
import math
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.base.calls import checked_calls
from eomgen.base.data import dataclass
from eomgen.errors import Problem, UsageError

STANDARD_GRAVITY = 9.81


def check_number(where: str, value: Any, unit: str = "", hint: str = "", *, above_zero: bool = False) -> None:
    """Raise UsageError unless a value is a finite number, and above 0 if ``above_zero``. ``unit`` and ``hint`` are for
    the message."""
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise UsageError(Problem(where, f"a number is needed, not {type(value).__name__} [E0852]", hint)) from None
    said = f"{number:.6g} {unit}".strip()
    if not math.isfinite(number):
        raise UsageError(Problem(where, f"{said} is not a finite number [E1040]", hint or "a finite number"))
    if above_zero and not number > 0.0:
        raise UsageError(Problem(where, f"{said} is not above 0 [E1174]", hint or "a number above 0"))


def check_whole(where: str, value: Any, least: int, most: int, hint: str = "") -> None:
    """Raise UsageError unless a value is a whole number from ``least`` to ``most``."""
    if isinstance(value, bool) or not hasattr(value, "__index__") or not least <= int(value) <= most:
        said = f"{value:.6g}" if isinstance(value, float) else f"{value!r}"
        fault = f"{said} is not from {least} to {most} [E1176]"
        fault = f"{said} is not a whole number from {least} on [E1175]" if most > 10**15 else fault
        raise UsageError(Problem(where, fault, hint or f"{least}"))


def check_depth(where: str, depth: float) -> None:
    """Raise UsageError for a depth of water that is not above 0."""
    if not depth > 0.0:
        fault = f"{depth:.6g} m is not above 0 [E1170]"
        raise UsageError(Problem(f"{where}: depth", fault, "math.inf for water without a bottom"))


#: Waves that a spectrum is made of at most.
MOST_WAVES = 1_000_000
#: Exponent of a spreading from which on directions differ by less than a tenth of a degree.
MOST_EXPONENT = 1e6


class Spectrum(Protocol):
    """A spectrum of elevations: one-sided density in m^2 s/rad over angular frequency, and the peak in rad/s."""

    @property
    def peak(self) -> float: ...
    def density(self, frequency: Array) -> Array: ...


@checked_calls()
@dataclass(frozen=True)
class Jonswap:
    """The JONSWAP spectrum (Hasselmann and others 1973) of a significant height in m and a peak period in s.

    The level is such that the whole spectrum has the variance height^2/16. ``peakedness`` 1 is Pierson and Moskowitz's
    form.
    """

    height: float
    period: float
    peakedness: float = 3.3

    def __post_init__(self) -> None:
        for name in ("height", "period"):
            check_number(f"Jonswap: {name}", getattr(self, name), above_zero=True)
        if not 1.0 <= self.peakedness <= 20.0:
            fault = f"{self.peakedness:.6g} is not from 1 to 20 [E1177]"
            raise UsageError(Problem("Jonswap: peakedness", fault, "3.3, or 1 for a fully developed sea"))

    @property
    def peak(self) -> float:
        """Angular frequency of the peak in rad/s."""
        return 2.0 * math.pi / self.period

    def density(self, frequency: Array) -> Array:
        """Return the density at angular frequencies above 0.

        Parameters
        ----------
        frequency : ndarray
            Angular frequencies (...), rad/s.

        Returns
        -------
        (...) ndarray
            One-sided, m^2 s/rad, with the integral ``height**2 / 16``; NaN at 0, and meaningless below 0.

        Examples
        --------
        >>> from eomgen.waves import Jonswap
        >>> sea = Jonswap(height=2.0, period=8.0)
        >>> bool(np.argmax(sea.density(np.linspace(0.4, 2.0, 17))) > 0)
        True
        """
        ratio, total = np.asarray(frequency, dtype=float) / self.peak, _jonswap_total(self.peakedness) * self.peak
        return _jonswap_shape(ratio, self.peakedness) * self.height**2 / (16.0 * total)


def _jonswap_shape(ratio: Array, peakedness: float) -> Array:
    """Return the form of the spectrum over frequency in parts of the peak frequency."""
    width = np.where(ratio <= 1.0, 0.07, 0.09)
    with np.errstate(under="ignore"):
        power = np.exp(-0.5 * ((ratio - 1.0) / width) ** 2)
        return np.asarray(ratio**-5.0 * np.exp(-1.25 * ratio**-4.0) * peakedness**power)


@functools.cache
def _jonswap_total(peakedness: float) -> float:
    """Return the integral of the form, over the logarithm of frequency, in which the form is smooth except at the
    peak."""
    grid = np.linspace(math.log(0.2), math.log(40.0), 8001)
    return float(np.trapezoid(_jonswap_shape(np.exp(grid), peakedness) * np.exp(grid), grid))


@checked_calls()
@dataclass(frozen=True)
class PiersonMoskowitz:
    """The spectrum of Pierson and Moskowitz (1964) of a fully developed sea, by the wind in m/s, 19.5 m above the
    water. ``gravity`` is in m/s^2; the significant height is 0.2092 U^2/g."""

    wind: float
    gravity: float = STANDARD_GRAVITY

    def __post_init__(self) -> None:
        check_number("PiersonMoskowitz: wind", self.wind, "m/s", above_zero=True)
        check_number("PiersonMoskowitz: gravity", self.gravity, "m/s^2", f"{STANDARD_GRAVITY}", above_zero=True)

    @property
    def peak(self) -> float:
        """Angular frequency of the peak in rad/s."""
        return 0.8772 * self.gravity / self.wind

    def density(self, frequency: Array) -> Array:
        """Return the density at angular frequencies above 0.

        Parameters
        ----------
        frequency : ndarray
            Angular frequencies (...), rad/s.

        Returns
        -------
        (...) ndarray
            One-sided, m^2 s/rad, whose integral is the variance of elevation; NaN at 0, and meaningless below 0.
        """
        w = np.asarray(frequency, dtype=float)
        with np.errstate(under="ignore"):
            return np.asarray(8.1e-3 * self.gravity**2 * w**-5.0 * np.exp(-1.25 * (self.peak / w) ** 4))


@checked_calls()
class SpectrumTable:
    """A spectrum interpolated linearly between points, 0 outside.

    Parameters
    ----------
    frequencies : array_like
        Angular frequencies (n,), rad/s, increasing, above 0.
    densities : array_like
        One-sided densities (n,), m^2 s/rad, none below 0.
    """

    def __init__(self, frequencies: ArrayLike, densities: ArrayLike) -> None:
        self.frequencies = np.asarray(frequencies, dtype=float)
        self.densities = np.asarray(densities, dtype=float)
        w, s = self.frequencies, self.densities
        if w.ndim != 1 or len(w) < 2 or s.shape != w.shape:
            fault = f"shapes {w.shape} and {s.shape} [E1179]"
            raise UsageError(Problem("SpectrumTable", fault, "as many densities as frequencies, two at least"))
        if not (np.all(np.diff(w) > 0.0) and w[0] > 0.0 and w[-1] < math.inf):
            fault = "they have to increase from above 0 to a finite number [E1183]"
            raise UsageError(Problem("SpectrumTable: frequencies", fault, "0.4, 0.7, 1.5"))
        if not (np.all(s >= 0.0) and 0.0 < s.max() < math.inf):
            fault = f"the least is {s.min():.6g} m^2 s/rad, the greatest {s.max():.6g} [E1182]"
            raise UsageError(Problem("SpectrumTable: densities", fault, "none below 0, one above 0, all finite"))

    @property
    def peak(self) -> float:
        """Angular frequency of the greatest density in rad/s."""
        return float(self.frequencies[np.argmax(self.densities)])

    def density(self, frequency: Array) -> Array:
        """Return the density at angular frequencies.

        Parameters
        ----------
        frequency : ndarray
            Angular frequencies (...), rad/s.

        Returns
        -------
        (...) ndarray
            One-sided, m^2 s/rad.
        """
        return np.asarray(np.interp(frequency, self.frequencies, self.densities, left=0.0, right=0.0))


@checked_calls()
@dataclass(frozen=True)
class Spreading:
    """Directions about a heading in rad, with the density cos^2s of half the angle (Mitsuyasu and others 1975).
    ``exponent`` is s, ``directions`` the number of equal sectors into which ``shares`` divides them."""

    exponent: float
    heading: float = 0.0
    directions: int = 9

    def __post_init__(self) -> None:
        check_number("Spreading: exponent", self.exponent, above_zero=True)
        if self.exponent > MOST_EXPONENT:
            fault = f"{self.exponent:.6g} is above {MOST_EXPONENT:.6g} [E1185]"
            raise UsageError(Problem("Spreading: exponent", fault, "no spreading at all for one direction"))
        check_number("Spreading: heading", self.heading, "rad")
        check_whole("Spreading: directions", self.directions, 2, MOST_WAVES, "no spreading at all for one direction")

    def density(self, angle: Array) -> Array:
        """Return the density over directions in 1/rad; the integral over a turn is 1.

        Parameters
        ----------
        angle : ndarray
            Directions (...), rad from x.

        Returns
        -------
        (...) ndarray
            In 1/rad.
        """
        s = self.exponent
        level = math.exp(math.lgamma(s + 1.0) - math.lgamma(s + 0.5)) / (2.0 * math.sqrt(math.pi))
        return level * np.abs(np.cos(0.5 * (np.asarray(angle) - self.heading))) ** (2.0 * s)

    def shares(self) -> tuple[Array, Array]:
        """Return directions and shares of the energy, of the middles of equal sectors.

        The sectors divide the angles about the heading at which the density is at least 1e-4 of the largest.

        Returns
        -------
        directions : (n,) ndarray
            In rad from x, n = ``directions``.
        shares : (n,) ndarray
            In proportion to the densities at the middles, with the sum 1.
        """
        half = 2.0 * math.acos(min(1.0, 1e-4 ** (1.0 / (2.0 * self.exponent))))
        angles = self.heading + half * (2.0 * np.arange(self.directions) + 1.0 - self.directions) / self.directions
        weights = self.density(angles)
        return angles, weights / weights.sum()
