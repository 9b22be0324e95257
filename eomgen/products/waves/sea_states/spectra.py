"""Spectra of seas, their division into components, and realisations by seed."""

from __future__ import annotations

import functools
import itertools
import math
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eomgen.base.arrays import Array
from eomgen.base.calls import checked_call, checked_calls
from eomgen.base.data import dataclass
from eomgen.base.random_inputs import WAVES, standard_normals
from eomgen.errors import Problem, UsageError

STANDARD_GRAVITY = 9.81


@checked_calls("Components(vectors, amplitude, phase)")
@dataclass(frozen=True)
class Components:
    """Sinusoidal components A cos(kx x + ky y - w t + phase).

    Attributes
    ----------
    vectors : (n, 2) array
        Wave vectors in rad/m, in the direction in which the waves run.
    amplitude : (n,) array, m
    phase : (n,) array, rad
    """

    vectors: Array
    amplitude: Array
    phase: Array


def check_number(where: str, value: Any, unit: str = "", hint: str = "", *, above_zero: bool = False) -> None:
    """Raise UsageError unless a value is a finite number, and above 0 if it has to be."""
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise UsageError(Problem(where, f"a number is needed, not {type(value).__name__}", hint)) from None
    said = f"{number:.6g} {unit}".strip()
    if not math.isfinite(number):
        raise UsageError(Problem(where, f"{said} is no finite number", hint))
    if above_zero and not number > 0.0:
        raise UsageError(Problem(where, f"{said} is not above 0", hint))


def check_whole(where: str, value: Any, least: int, most: int, hint: str = "") -> None:
    """Raise UsageError unless a value is a whole number from ``least`` to ``most``."""
    if isinstance(value, bool) or not hasattr(value, "__index__") or not least <= int(value) <= most:
        said = f"{value:.6g}" if isinstance(value, float) else f"{value!r}"
        fault = (
            f"{said} is no whole number from {least} on" if most > 10**15 else f"{said} is not from {least} to {most}"
        )
        raise UsageError(Problem(where, fault, hint or f"{least}"))


#: Frequencies at which a spectrum is divided, in parts of the peak's.
BAND = (0.5, 3.0)
#: Wave lengths of the peak after which a sea of one direction repeats itself.
REPEATED_AFTER = 32.0
#: Waves that a spectrum is made of at most.
MOST_WAVES = 1_000_000
#: Exponent of a spreading from which on directions are less than a tenth of a degree apart.
MOST_EXPONENT = 1e6
#: Name of the variables of wave directions.
_DIRECTIONS = "directions of waves"
#: Gauss-Legendre's nodes in each of the pieces into which parts of a band are cut.
_NODES, _PIECES = 4, 4


class Spectrum(Protocol):
    """A spectrum of elevations: one-sided density in m^2 s/rad over angular frequency, and its peak in rad/s."""

    @property
    def peak(self) -> float: ...
    def density(self, frequency: Array) -> Array: ...


@checked_calls()
@dataclass(frozen=True)
class Jonswap:
    """The JONSWAP spectrum (Hasselmann and others 1973) of a significant height in m and a peak period in s.

    Its level is such that the whole spectrum has the variance height^2/16. ``peakedness`` 1 is Pierson and Moskowitz's
    form.
    """

    height: float
    period: float
    peakedness: float = 3.3

    def __post_init__(self) -> None:
        for name, value in (("height", self.height), ("period", self.period)):
            if not value > 0.0 or not math.isfinite(value):
                raise UsageError(Problem(f"Jonswap: {name}", f"{value:.6g} is not above 0"))
        if not 1.0 <= self.peakedness <= 20.0:
            fault = f"{self.peakedness:.6g} is not from 1 to 20"
            raise UsageError(Problem("Jonswap: peakedness", fault, "3.3, or 1 for a fully developed sea"))

    @property
    def peak(self) -> float:
        """Angular frequency of the peak in rad/s."""
        return 2.0 * math.pi / self.period

    def density(self, frequency: Array) -> Array:
        """Return the density at angular frequencies above 0."""
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
    """Return the integral of the form, over the logarithm of frequency, in which it is smooth but for the peak."""
    grid = np.linspace(math.log(0.2), math.log(40.0), 8001)
    return float(np.trapezoid(_jonswap_shape(np.exp(grid), peakedness) * np.exp(grid), grid))


@checked_calls()
@dataclass(frozen=True)
class PiersonMoskowitz:
    """The spectrum of Pierson and Moskowitz (1964) of a fully developed sea, by the wind at 19.5 m in m/s: significant
    height 0.2092 U^2/g."""

    wind: float
    gravity: float = STANDARD_GRAVITY

    def __post_init__(self) -> None:
        if not self.wind > 0.0 or not math.isfinite(self.wind):
            raise UsageError(Problem("PiersonMoskowitz: wind", f"{self.wind:.6g} m/s is not above 0"))

    @property
    def peak(self) -> float:
        """Angular frequency of the peak in rad/s."""
        return 0.8772 * self.gravity / self.wind

    def density(self, frequency: Array) -> Array:
        """Return the density at angular frequencies above 0."""
        w = np.asarray(frequency, dtype=float)
        with np.errstate(under="ignore"):
            return np.asarray(8.1e-3 * self.gravity**2 * w**-5.0 * np.exp(-1.25 * (self.peak / w) ** 4))


@checked_calls()
class SpectrumTable:
    """A spectrum between points, straight between them and 0 outside.

    Parameters
    ----------
    frequencies : increasing, in rad/s, above 0
    densities : one-sided, in m^2 s/rad, none below 0
    """

    def __init__(self, frequencies: ArrayLike, densities: ArrayLike) -> None:
        self.frequencies = np.asarray(frequencies, dtype=float)
        self.densities = np.asarray(densities, dtype=float)
        where = "SpectrumTable"
        if self.frequencies.ndim != 1 or len(self.frequencies) < 2 or self.densities.shape != self.frequencies.shape:
            fault = f"shapes {self.frequencies.shape} and {self.densities.shape}"
            raise UsageError(Problem(where, fault, "as many densities as frequencies, two at least"))
        if not np.all(np.diff(self.frequencies) > 0.0) or not self.frequencies[0] > 0.0:
            raise UsageError(Problem(f"{where}: frequencies", "they have to increase from above 0"))
        if not np.all(np.isfinite(self.densities)) or not np.all(np.isfinite(self.frequencies)):
            raise UsageError(Problem(where, "a frequency or a density is no finite number"))
        if not np.all(self.densities >= 0.0) or not np.any(self.densities > 0.0):
            fault = f"the least is {self.densities.min():.6g} m^2 s/rad, the greatest {self.densities.max():.6g}"
            raise UsageError(Problem(f"{where}: densities", fault, "none below 0, one above 0"))

    @property
    def peak(self) -> float:
        """Angular frequency of the greatest density in rad/s."""
        return float(self.frequencies[np.argmax(self.densities)])

    def density(self, frequency: Array) -> Array:
        """Return the density at angular frequencies."""
        return np.asarray(np.interp(frequency, self.frequencies, self.densities, left=0.0, right=0.0))


@checked_calls()
@dataclass(frozen=True)
class Spreading:
    """Directions about a heading in rad, with the density cos^2s of half the angle (Mitsuyasu and others 1975)."""

    exponent: float
    heading: float = 0.0
    directions: int = 9

    def __post_init__(self) -> None:
        if not self.exponent > 0.0 or not math.isfinite(self.exponent):
            raise UsageError(Problem("Spreading: exponent", f"{self.exponent:.6g} is not above 0"))
        if self.exponent > MOST_EXPONENT:
            fault = f"{self.exponent:.6g} is above {MOST_EXPONENT:.6g}"
            raise UsageError(Problem("Spreading: exponent", fault, "no spreading at all for one direction"))
        check_number("Spreading: heading", self.heading, "rad")
        if self.directions < 2:
            fault = f"{self.directions} is less than two"
            raise UsageError(Problem("Spreading: directions", fault, "no spreading at all for one direction"))
        check_whole("Spreading: directions", self.directions, 2, MOST_WAVES)

    def density(self, angle: Array) -> Array:
        """Return the density over directions in 1/rad; its integral over a turn is 1."""
        s = self.exponent
        level = math.exp(math.lgamma(s + 1.0) - math.lgamma(s + 0.5)) / (2.0 * math.sqrt(math.pi))
        return level * np.abs(np.cos(0.5 * (np.asarray(angle) - self.heading))) ** (2.0 * s)

    def shares(self) -> tuple[Array, Array]:
        """Return directions and their shares of the energy: middles of equal sectors, without those sectors whose
        density is below 1e-4 of the greatest."""
        half = 2.0 * math.acos(min(1.0, 1e-4 ** (1.0 / (2.0 * self.exponent))))
        angles = self.heading + half * (2.0 * np.arange(self.directions) + 1.0 - self.directions) / self.directions
        weights = self.density(angles)
        return angles, weights / weights.sum()


@checked_calls()
@dataclass(frozen=True)
class DiscreteSpectrum:
    """Wave vectors (n, 2) in rad/m with the variance of elevation of each, (n,) in m^2.

    ``band`` has the lowest and the highest frequency in rad/s: moments of slope and curvature grow with the latter;
    ``depth`` is the depth of the water in m. Each wave number has ``directions`` consecutive waves.
    """

    vectors: Array
    energy: Array
    band: tuple[float, float]
    depth: float = math.inf
    directions: int = 1

    def check_deep(self, where: str, hint: str) -> None:
        """Raise UsageError if the waves at the peak feel the bottom: in less water than half of their length."""
        k = float(np.hypot(*self.vectors[np.argmax(self.energy)]))
        if k * self.depth < math.pi:
            fault = f"closed forms are of deep water, and waves of {2.0 * math.pi / k:.4g} m feel the bottom at"
            raise UsageError(Problem(where, f"{fault} {self.depth:.6g} m", hint))

    @property
    def height(self) -> float:
        """Significant height, four times the standard deviation, in m."""
        return 4.0 * math.sqrt(float(self.energy.sum()))

    def realisation(self, seed: int, amplitudes: Literal["gaussian", "fixed"] = "gaussian") -> Components:
        """Return components by seed: ``gaussian`` cosine and sine amplitudes, which the tails of a sea need, or
        ``fixed`` amplitudes sqrt(2 E) with phases alone at random.

        Of fixed amplitudes each wave number has one direction, drawn by its share of the energy, and all of the energy:
        elevations at every place then have the variance of the spectrum over time, which waves of one frequency and
        several directions do not (Jefferys, Applied Ocean Research 9 (1987) 186).
        """
        if amplitudes not in ("gaussian", "fixed"):
            raise UsageError(Problem("realisation: amplitudes", f"there is no {amplitudes!r}", "gaussian, or fixed"))
        check_whole("realisation: seed", seed, 0, 2**63)
        n = len(self.energy)
        normal = standard_normals(seed, 2 * n, WAVES).reshape(n, 2)
        radius, phase = np.hypot(*normal.T), np.arctan2(normal[:, 1], normal[:, 0])
        if amplitudes == "gaussian":
            return Components(self.vectors, np.sqrt(self.energy) * radius, phase)
        energy = self.energy.reshape(-1, self.directions)
        kept = np.arange(len(energy)) * self.directions + self._drawn_directions(seed, energy)
        return Components(self.vectors[kept], np.sqrt(energy.sum(axis=1)) * math.sqrt(2.0), phase[kept])

    def _drawn_directions(self, seed: int, energy: Array) -> NDArray[np.int64]:
        """Return the place of the direction of each wave number, (n,), by seed.

        As many wave numbers take a direction as its share of the energy says: quantiles of equal parts of the
        distribution, in random order.
        """
        if self.directions == 1:
            return np.zeros(len(energy), dtype=np.int64)
        rank = np.argsort(np.argsort(standard_normals(seed, len(energy), _DIRECTIONS)))
        below = np.cumsum(energy, axis=1) / energy.sum(axis=1, keepdims=True)
        return np.asarray(np.sum(below[:, :-1] < ((rank + 0.5) / len(energy))[:, None], axis=1))


@checked_call()
def discretized(
    spectrum: Spectrum,
    *,
    depth: float = math.inf,
    gravity: float = STANDARD_GRAVITY,
    length: float | None = None,
    band: tuple[float, float] = BAND,
    spreading: Spreading | None = None,
    heading: float = 0.0,
    height: float | None = None,
) -> DiscreteSpectrum:
    """Return a spectrum as components of equally spaced wave numbers 2 pi j/length within a band.

    Parameters
    ----------
    length : float, m
        After which a sea of one direction repeats itself; 32 wave lengths of the peak by default.
    band : lowest and highest frequency in parts of the peak's
    spreading : Spreading
        Without one all waves run along ``heading`` (rad from x).
    height : float, m
        Significant height that the components are scaled to; by default the spectrum's within the band.

    Raises
    ------
    UsageError
        A band without components, or without energy.
    """
    if not 0.0 < band[0] < band[1]:
        raise UsageError(Problem("discretized: band", f"{band} does not increase from above 0", f"{BAND}"))
    if not depth > 0.0:
        fault = f"{depth:.6g} m is not above 0"
        raise UsageError(Problem("discretized: depth", fault, "math.inf for water without a bottom"))
    _check_scales("discretized", gravity, heading, height)
    if length is not None:
        check_number("discretized: length", length, "m", "500", above_zero=True)
    low, high = (wave_number(spectrum.peak * part, depth, gravity) for part in band)
    step = wave_number(spectrum.peak, depth, gravity) / REPEATED_AFTER if length is None else 2.0 * math.pi / length
    first, last = math.floor(low / step * (1.0 + 1e-12)) + 1, math.ceil(high / step * (1.0 - 1e-12)) - 1
    if last < first:
        fault = f"no wave number 2 pi j/length is from {low:.6g} to {high:.6g} rad/m"
        raise UsageError(Problem("discretized: length", fault, f"a length above {2.0 * math.pi / (high - low):.6g} m"))
    if last - first >= MOST_WAVES:
        fault = f"{last - first + 1:.4g} wave numbers 2 pi j/length are within the band, more than {MOST_WAVES}"
        raise UsageError(Problem("discretized: length", fault, "a shorter length"))
    k = step * np.arange(first, last + 1)
    w, group = frequency_and_group_velocity(np.asarray(k), depth, gravity)
    energy = spectrum.density(w) * group * step
    if not energy.sum() > 0.0:
        raise UsageError(Problem("discretized: band", f"the spectrum is zero from {w[0]:.6g} to {w[-1]:.6g} rad/s"))
    if height is not None:
        energy *= height**2 / (16.0 * energy.sum())
    angles, shares = (np.array([heading]), np.ones(1)) if spreading is None else spreading.shares()
    vectors = k[:, None, None] * np.stack((np.cos(angles), np.sin(angles)), axis=-1)
    return DiscreteSpectrum(
        vectors.reshape(-1, 2), np.outer(energy, shares).ravel(), (float(w[0]), float(w[-1])), depth, len(angles)
    )


def _check_scales(where: str, gravity: float, heading: float, height: float | None) -> None:
    check_number(f"{where}: gravity", gravity, "m/s^2", f"{STANDARD_GRAVITY}", above_zero=True)
    check_number(f"{where}: heading", heading, "rad")
    if height is not None:
        check_number(f"{where}: height", height, "m", "the significant height", above_zero=True)


def frequency_and_group_velocity(k: Array, depth: float, gravity: float = STANDARD_GRAVITY) -> tuple[Array, Array]:
    """Return sqrt(g k tanh k h) in rad/s and its derivative by k in m/s."""
    if math.isinf(depth):
        w = np.sqrt(gravity * k)
        return w, 0.5 * w / k
    t = np.tanh(k * depth)
    w = np.sqrt(gravity * k * t)
    return w, 0.5 * w / k * (1.0 + k * depth * (1.0 - t * t) / t)


@checked_call()
def wave_number(frequency: float, depth: float = math.inf, gravity: float = STANDARD_GRAVITY) -> float:
    """Return the wave number in rad/m of an angular frequency, by Newton's method."""
    check_number("wave_number: frequency", frequency, "rad/s", above_zero=True)
    check_number("wave_number: gravity", gravity, "m/s^2", f"{STANDARD_GRAVITY}", above_zero=True)
    if not depth > 0.0:
        fault = f"{depth:.6g} m is not above 0"
        raise UsageError(Problem("wave_number: depth", fault, "math.inf for water without a bottom"))
    deep = frequency**2 / gravity
    if math.isinf(depth):
        return deep
    k = deep / math.sqrt(math.tanh(deep * depth))  # within 10 % in every depth
    for _ in range(20):
        w, group = frequency_and_group_velocity(np.array([k]), depth, gravity)
        change = float((w[0] - frequency) / group[0])
        k -= change
        if abs(change) <= 1e-15 * k:
            break
    return k


@checked_call()
def divided(
    spectrum: Spectrum,
    components: int,
    *,
    depth: float = math.inf,
    gravity: float = STANDARD_GRAVITY,
    band: tuple[float, float] = BAND,
    spreading: Spreading | None = None,
    heading: float = 0.0,
    height: float | None = None,
) -> DiscreteSpectrum:
    """Return a spectrum as components whose frequencies are a constant factor apart: motion at a place does not repeat
    itself, and few components resolve the peak.

    Each stands for the energy of its part of the band, at the mean frequency of that energy. Arguments other than
    ``components`` are arguments of ``discretized``.

    Raises
    ------
    UsageError
        A band without energy.
    """
    if not 0.0 < band[0] < band[1]:
        raise UsageError(Problem("divided: band", f"{band} does not increase from above 0", f"{BAND}"))
    if not depth > 0.0:
        fault = f"{depth:.6g} m is not above 0"
        raise UsageError(Problem("divided: depth", fault, "math.inf for water without a bottom"))
    _check_scales("divided", gravity, heading, height)
    check_whole("divided: components", components, 1, MOST_WAVES)
    edges = spectrum.peak * np.geomspace(band[0], band[1], components + 1)
    # Gauss-Legendre's rule over each part, in pieces, since a spectrum may bend at its peak; a table does at its points
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    fine = np.concatenate([np.linspace(a, b, _PIECES, endpoint=False) for a, b in itertools.pairwise(edges)])
    if isinstance(spectrum, SpectrumTable):
        points = spectrum.frequencies
        fine = np.union1d(fine, points[(points > edges[0]) & (points < edges[-1])])
    widths = np.diff(np.append(fine, edges[-1]))
    w = fine[:, None] + 0.5 * widths[:, None] * (1.0 + nodes)
    pieces = spectrum.density(w) * weights * 0.5 * widths[:, None]
    starts = np.searchsorted(fine, edges[:-1])
    energy, first = (np.add.reduceat(part.sum(axis=1), starts) for part in (pieces, pieces * w))
    if not energy.sum() > 0.0:
        raise UsageError(Problem("divided: band", f"the spectrum is zero from {edges[0]:.6g} to {edges[-1]:.6g} rad/s"))
    kept = energy > 0.0
    frequencies, energy = first[kept] / energy[kept], energy[kept]
    if height is not None:
        energy *= height**2 / (16.0 * energy.sum())
    k = np.array([wave_number(float(frequency), depth, gravity) for frequency in frequencies])
    angles, shares = (np.array([heading]), np.ones(1)) if spreading is None else spreading.shares()
    vectors = k[:, None, None] * np.stack((np.cos(angles), np.sin(angles)), axis=-1)
    result = np.outer(energy, shares).ravel()
    return DiscreteSpectrum(vectors.reshape(-1, 2), result, (float(edges[0]), float(edges[-1])), depth, len(angles))
