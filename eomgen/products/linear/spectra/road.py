"""One-sided displacement spectra of a road's elevation: Road by its class over spatial frequency, MeasuredRoad from a
profile by Welch's method over distance.

G_d(n) = G_d(n0) (n / n0)^-w with n0 = 0.1 cycle/m; ISO 8608:2016, equation 8 and table C.1 (w = 2). With two exponents,
one on each side of n0: Dodds and Robson (1973), J. Sound Vib. 31(2), 175-183.
"""

from __future__ import annotations

import math
import warnings
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array, count_of
from eomgen.base.data import dataclass, field
from eomgen.base.messages import shown
from eomgen.base.random_inputs import FREQUENCY_RANGE, REFERENCE_FREQUENCY, ROUGHNESS
from eomgen.errors import Problem, UsageError


@dataclass(frozen=True)
class Road:
    """A random road, the same at all places.

    Parameters
    ----------
    road_class : str
        ``A`` to ``H`` of ISO 8608; or ``roughness`` instead.
    roughness : float
        G_d(n0) at n0 = 0.1 cycle/m, m^3.
    exponent : float, optional
        Exponent w of waves shorter than 10 m; and of longer waves without ``long_exponent``.
    long_exponent : float, optional
        Exponent w of waves longer than 10 m.
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
            fault = "a road needs either a class or a roughness [E0473]"
            raise UsageError(Problem("Road", fault, 'Road("C"), or Road(roughness=256e-6)'))
        if self.road_class is not None and self.road_class not in ROUGHNESS:
            fault = f"there is no road class {ascii(self.road_class)[:32]} [E0172]"
            raise UsageError(Problem("Road", fault, f"one of {', '.join(ROUGHNESS)}"))
        if self.roughness is not None:
            check_positive("Road: roughness", self.roughness, "m^3, above 0")
        check_positive("Road: exponent", self.exponent, "above 0; 2 for the classes")
        if self.long_exponent is not None:
            check_positive("Road: long_exponent", self.long_exponent, "above 0")
        if not (len(self.band) == 2 and 0.0 < self.band[0] < self.band[1] < math.inf):
            fault = f"the band {self.band} is not a pair of spatial frequencies, the lower first [E0474]"
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
    def label(self) -> str:
        """The road in a column of road classes: ``C``, ``roughness 0.0001 m^3``, ``measured``."""
        return self.road_class or self.name.partition(",")[0]

    @property
    def bends(self) -> Array:
        """Spatial frequencies at which the density bends, cycle/m."""
        return np.array([REFERENCE_FREQUENCY] if self.long_exponent not in (None, self.exponent) else [])

    def of_class(self, road_class: str) -> Road:
        """Return a road of a class with the exponents and the band of this road.

        Parameters
        ----------
        road_class : str
            ``A`` to ``H`` of ISO 8608.

        Returns
        -------
        Road
            Of that class.

        Raises
        ------
        UsageError
            There is no class of that name.

        Examples
        --------
        >>> from eomgen.spectra import Road
        >>> float(Road("A").of_class("C").over_distance(0.1))
        0.000256
        """
        return Road(road_class, None, self.exponent, self.long_exponent, self.band)

    def over_distance(self, n: ArrayLike) -> Array:
        """Return the spectrum of the elevation over the distance.

        Parameters
        ----------
        n : array_like
            Spatial frequencies (...), cycle/m.

        Returns
        -------
        (...) ndarray
            One-sided density G_d(n), m^3; zero outside the band.

        Examples
        --------
        >>> from eomgen.spectra import Road
        >>> float(Road("C").over_distance(0.1))            # of ISO 8608, class C at 0.1 cycle/m
        0.000256
        """
        frequencies = np.asarray(n, dtype=float)
        inside = (frequencies >= self.band[0]) & (frequencies <= self.band[1])
        ratio = np.where(inside, frequencies, REFERENCE_FREQUENCY) / REFERENCE_FREQUENCY
        long = self.exponent if self.long_exponent is None else self.long_exponent
        exponent = np.where(ratio < 1.0, long, self.exponent)
        return np.where(inside, self.reference_roughness * ratio**-exponent, 0.0)

    def over_time(self, frequencies: ArrayLike, speed: float) -> Array:
        """Return the spectrum of the elevation under a wheel, G(f) = G_d(f / V) / V.

        Parameters
        ----------
        frequencies : array_like
            Frequencies (...), Hz.
        speed : float
            Speed V of the wheel, m/s.

        Returns
        -------
        (...) ndarray
            In m^2/Hz.

        Examples
        --------
        >>> from eomgen.spectra import Road
        >>> round(float(Road("C").over_time(2.0, 20.0)) / float(Road("C").over_distance(0.1)), 6)     # 1 / speed
        0.05
        """
        return self.over_distance(np.asarray(frequencies, dtype=float) / speed) / speed

    def velocity_intensity(self, speed: float) -> float:
        """Return the intensity of the white noise that is the vertical velocity of a road of exponent 2.

        Parameters
        ----------
        speed : float
            Of the vehicle, m/s.

        Returns
        -------
        float
            Half of the one-sided spectral density over Hz, m^2/s.

        Examples
        --------
        >>> from eomgen.spectra import Road
        >>> round(Road("C").velocity_intensity(20.0), 6)
        0.001011
        """
        return 2.0 * math.pi**2 * REFERENCE_FREQUENCY**2 * self.reference_roughness * speed


def check_frequencies(where: str, f: Array, example: str, density: Array | None = None) -> None:
    """Raise UsageError unless an array is two or more positive frequencies that increase, each with a density of zero
    or above if there is an array of densities."""
    if f.ndim != 1 or len(f) < 2 or not np.all(np.isfinite(f)) or f[0] <= 0.0 or np.any(np.diff(f) <= 0.0):
        fault = "frequencies have to be two or more positive numbers that increase [E0440]"
        raise UsageError(Problem(where, fault, example))
    if density is not None and not (density.shape == f.shape and np.all((density >= 0.0) & (density < np.inf))):
        fault = f"the density has the shape {density.shape}, or entries that are negative or not finite [E0464]"
        raise UsageError(Problem(where, fault, f"{len(f)} numbers of zero and above"))


def check_positive(where: str, value: object, example: str) -> None:
    """Raise UsageError unless a value is a finite number above zero."""
    if not (isinstance(value, int | float) and 0.0 < value < math.inf):
        raise UsageError(Problem(where, f"{shown(value)} is not a positive number [E1279]", example))


#: Samples of a segment at least.
_FEWEST = 32


@dataclass(frozen=True, eq=False)
class MeasuredRoad(Road):
    """A road with the spectrum of a measured profile; ``of_profile`` makes one.

    Parameters
    ----------
    road_class, roughness, exponent, long_exponent, band : optional
        As of ``Road``; a measured spectrum replaces class, roughness and exponents.
    frequencies, density : ndarray
        Spatial frequencies (n,) in cycle/m, increasing, and G_d (n,) in m^3; linear between frequencies, zero outside.
    source : str
        Name of the measured road, for titles.
    """

    frequencies: Array = field(default_factory=lambda: np.zeros(0))
    density: Array = field(default_factory=lambda: np.zeros(0))
    source: str = "measured"

    def __post_init__(self) -> None:
        n, density = (np.asarray(array, dtype=float) for array in (self.frequencies, self.density))
        check_frequencies("MeasuredRoad", n, "MeasuredRoad.of_profile(distance, elevation)", density)
        object.__setattr__(self, "band", (float(n[0]), float(n[-1])))
        object.__setattr__(self, "exponent", float("nan"))  # undefined; refused if needed

    def __repr__(self) -> str:
        low, high = self.band
        return f"<MeasuredRoad {self.source}: {len(self.frequencies)} frequencies, {low:.3g} to {high:.3g} cycle/m>"

    @classmethod
    def of_profile(
        cls,
        distance: ArrayLike,
        elevation: ArrayLike,
        segments: int = 8,
        *,
        widest: float = 0.0,
        source: str = "measured",
    ) -> Self:
        """Return the road of a profile, by Welch's method: Hann windows with an overlap of one half, without trends.

        Elevations are interpolated linearly at even distances. Warns if the density at 0.1 cycle/m is above 4 times
        the density of class H.

        Parameters
        ----------
        distance : array_like
            Distances (n,) along the road, m, increasing.
        elevation : array_like
            Elevations (n,), m.
        segments : int
            More segments: less scatter, coarser frequencies; short profiles have fewer, of 32 samples at the least.
        widest : float
            Largest distance of measured points, m, if different from ``distance``: a bound of the frequencies, too.
        source : str
            For titles; length, segments and resolution are added.

        Returns
        -------
        MeasuredRoad
            With the spectrum of the profile without the two lowest frequencies of a segment and the highest, and up to
            half a cycle in the widest gap between points.

        Raises
        ------
        UsageError
            Arrays that are not a profile, fewer than 32 samples, segments that are not a whole number from 1 on, or a
            gap that leaves fewer than two frequencies.
        """
        x, y = (np.asarray(array, dtype=float) for array in (distance, elevation))
        if x.ndim != 1 or x.shape != y.shape or not (np.all(np.isfinite(x)) and np.all(np.isfinite(y))):
            fault = f"the profile has the shapes {x.shape} and {y.shape}, or entries that are not finite [E0477]"
            raise UsageError(Problem("MeasuredRoad", fault, "distances and as many elevations, m"))
        if len(x) < _FEWEST or not np.all(np.diff(x) > 0.0):
            fault = f"the profile has {len(x)} points, and needs {_FEWEST} at distances that increase [E0478]"
            raise UsageError(Problem("MeasuredRoad", fault, "a longer profile"))
        segments = count_of("segments", segments)
        from scipy.signal import detrend, welch  # noqa: PLC0415  # slow to import

        spacing = float(x[-1] - x[0]) / (len(x) - 1)
        even = np.linspace(x[0], x[-1], len(x))
        used = min(segments, max(1, 2 * len(x) // _FEWEST - 1))
        length = 2 * len(x) // (used + 1)
        n, density = welch(np.interp(even, x, y), 1.0 / spacing, "hann", nperseg=length, detrend=detrend)
        # Frequencies that the widest gap resolves; the last frequency is half the sampling rate.
        gap = max(float(np.diff(x).max()), widest)
        # the two lowest ones are distorted by the window and the removal of the trend
        inside = (np.arange(len(n)) >= 2) & (n <= 0.5 / gap) & (np.arange(len(n)) < len(n) - 1)
        if np.count_nonzero(inside) < 2:
            fault = f"the widest gap of the profile, {gap:.4g} m, leaves no frequencies [E0479]"
            raise UsageError(Problem("MeasuredRoad", fault, "points that are spread more evenly"))
        ratio = float(np.interp(REFERENCE_FREQUENCY, n[inside], density[inside], 0.0, 0.0)) / ROUGHNESS["H"]
        if ratio > 4.0:
            text = f"MeasuredRoad: the road is {ratio:.3g} times as rough as class H, by the density at"
            hint = "elevations in m"
            warnings.warn(f"{text} {REFERENCE_FREQUENCY:g} cycle/m; try: {hint} [W0043]", RuntimeWarning, stacklevel=2)
        words = f"{x[-1] - x[0]:.6g} m in {used} segments, {n[1]:.3g} cycle/m apart"
        return cls(frequencies=n[inside], density=density[inside], source=f"{source}, {words}")

    @property
    def name(self) -> str:
        """Name of the measured road."""
        return self.source

    @property
    def reference_roughness(self) -> float:
        """Raise an error: a measured road has no roughness valid at all frequencies."""
        raise self._no_class_error()

    def of_class(self, road_class: str) -> Road:
        """Raise an error: a measured spectrum has no road class.

        Parameters
        ----------
        road_class : str
            Class of ISO 8608.

        Raises
        ------
        UsageError
            Always.
        """
        raise self._no_class_error()

    @staticmethod
    def _no_class_error() -> UsageError:
        fault = "a measured road has a spectrum of its own, and no class [E0481]"
        return UsageError(Problem("MeasuredRoad", fault, 'excitation.at(road=eomgen.spectra.Road("C"))'))

    def over_distance(self, n: ArrayLike) -> Array:
        """Return the spectrum of the elevation over the distance.

        Parameters
        ----------
        n : array_like
            Spatial frequencies (...), cycle/m.

        Returns
        -------
        (...) ndarray
            One-sided density G_d(n), m^3; zero outside the band.

        Examples
        --------
        >>> from eomgen.spectra import MeasuredRoad
        >>> x = np.linspace(0.0, 1000.0, 4001)
        >>> road = MeasuredRoad.of_profile(x, 0.01 * np.sin(2 * np.pi * 0.1 * x))
        >>> bool(road.over_distance(0.1) > 100 * road.over_distance(0.5))
        True
        """
        result: Array = np.interp(np.asarray(n, dtype=float), self.frequencies, self.density, left=0.0, right=0.0)
        return result

    @property
    def bends(self) -> Array:
        """Spatial frequencies at which the density bends, cycle/m."""
        return self.frequencies
