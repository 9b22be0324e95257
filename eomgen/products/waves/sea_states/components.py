"""Division of a sea's spectrum into sinusoidal components, realisations by seed, and the dispersion of water waves."""

from __future__ import annotations

import itertools
import math
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.calls import checked_call, checked_calls
from eomgen.base.data import dataclass
from eomgen.base.random_inputs import WAVES, standard_normals
from eomgen.errors import Problem, UsageError
from eomgen.products.waves.sea_states.spectra import (
    MOST_WAVES,
    STANDARD_GRAVITY,
    Spectrum,
    SpectrumTable,
    Spreading,
    check_depth,
    check_number,
    check_whole,
)


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


#: Frequencies at which a spectrum is divided, in parts of the peak's.
BAND = (0.5, 3.0)
#: Name of the variables of wave directions.
_DIRECTIONS = "directions of waves"


@checked_calls()
@dataclass(frozen=True)
class DiscreteSpectrum:
    """Wave vectors (n, 2) in rad/m with the variance of elevation of each (``energy``), (n,) in m^2. ``band`` has the
    lowest and the highest frequency in rad/s: moments of slope and curvature grow with the latter; ``depth`` is the
    depth of the water in m. Each wave number has ``directions`` consecutive waves."""

    vectors: Array
    energy: Array
    band: tuple[float, float]
    depth: float = math.inf
    directions: int = 1

    def check_deep(self, where: str, hint: str) -> None:
        """Raise an error if the water is shallower than half of the length of the wave with the most energy.

        Parameters
        ----------
        where : str
            Name of the call, for the message.
        hint : str
            Remedy, for the message.

        Raises
        ------
        UsageError
            This wave feels the bottom; longer waves are not checked.
        """
        k = float(np.hypot(*self.vectors[np.argmax(self.energy)]))
        if k * self.depth < math.pi:
            fault = f"closed forms are of deep water, and waves of {2.0 * math.pi / k:.4g} m feel the bottom at"
            raise UsageError(Problem(where, f"{fault} {self.depth:.6g} m [E1167]", hint))

    @property
    def height(self) -> float:
        """Significant height, four times the standard deviation, in m."""
        return 4.0 * math.sqrt(float(self.energy.sum()))

    def realisation(self, seed: int, amplitudes: Literal["gaussian", "fixed"] = "gaussian") -> Components:
        """Return components with random amplitudes and phases by seed.

        Of fixed amplitudes each wave number has one direction, drawn by its share of the energy, and the whole energy
        of this wave number: elevations at every place then have the variance of the spectrum over time, which waves of
        one frequency and several directions do not (Jefferys, Applied Ocean Research 9 (1987) 186).

        Parameters
        ----------
        seed : int
            Of the random numbers, a whole number from 0 on.
        amplitudes : str, optional
            ``gaussian``: cosine and sine amplitudes, which the tails of a sea need; ``fixed``: amplitudes sqrt(2 E)
            with phases alone at random.

        Returns
        -------
        Components
            With the wave vectors of the spectrum; for fixed amplitudes with a single direction of each wave number.

        Raises
        ------
        UsageError
            Unknown ``amplitudes``, or a seed that is not a whole number from 0 on.
        """
        if amplitudes not in ("gaussian", "fixed"):
            fault = f"there is no {amplitudes!r} [E1168]"
            raise UsageError(Problem("realisation: amplitudes", fault, "gaussian, or fixed"))
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
        """Return the index of the direction of each wave number, (n,), by seed; ``energy`` has the shape (n,
        directions). The number of wave numbers of a direction is given by the direction's share of the energy:
        quantiles of equal parts of the distribution, in random order."""
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
    spectrum : Spectrum
        Density over angular frequency.
    depth : float, optional
        Of the water, m; infinite by default.
    gravity : float, optional
        In m/s^2.
    length : float, m
        After which a sea of one direction repeats itself; 32 wave lengths of the peak by default.
    band : tuple of float, optional
        Lowest and highest frequency in parts of the peak's, (0.5, 3) by default.
    spreading : Spreading
        Directions, all for each wave number, about the heading of the spreading. None: all waves run along ``heading``.
    heading : float, optional
        Direction of all waves without ``spreading``, rad from x.
    height : float, m
        Significant height that the components are scaled to; by default the spectrum's within the band.

    Returns
    -------
    DiscreteSpectrum
        Wave vectors with the variance of each.

    Raises
    ------
    UsageError
        A band without components, without energy, or that does not increase from above 0; more than a million wave
        numbers; a depth, gravity, length or height that is not above 0.

    Examples
    --------
    >>> from eomgen.waves import Jonswap, discretized
    >>> spectrum = discretized(Jonswap(height=2.0, period=8.0))
    >>> round(4 * float(np.sqrt(spectrum.energy.sum())), 2)       # the significant height within the band, m
    1.99
    """
    _check_division("discretized", band, depth, gravity, heading, height)
    if length is not None:
        check_number("discretized: length", length, "m", "500", above_zero=True)
    low, high = (wave_number(spectrum.peak * part, depth, gravity) for part in band)
    step = wave_number(spectrum.peak, depth, gravity) / 32.0 if length is None else 2.0 * math.pi / length
    first, last = math.floor(low / step * (1.0 + 1e-12)) + 1, math.ceil(high / step * (1.0 - 1e-12)) - 1
    if last < first:
        fault = f"no wave number 2 pi j/length is from {low:.6g} to {high:.6g} rad/m [E1171]"
        raise UsageError(Problem("discretized: length", fault, f"a length above {2.0 * math.pi / (high - low):.6g} m"))
    if last - first >= MOST_WAVES:
        fault = f"{last - first + 1:.4g} wave numbers 2 pi j/length are within the band, more than {MOST_WAVES} [E1172]"
        raise UsageError(Problem("discretized: length", fault, "a shorter length"))
    k = np.asarray(step * np.arange(first, last + 1))
    w, group = frequency_and_group_velocity(k, depth, gravity)
    energy = spectrum.density(w) * group * step
    ends = float(w[0]), float(w[-1])
    return _with_directions("discretized", k, energy, ends, depth, spreading, heading, height)


def _with_directions(
    where: str,
    k: Array,
    energy: Array,
    band: tuple[float, float],
    depth: float,
    spreading: Spreading | None,
    heading: float,
    height: float | None,
) -> DiscreteSpectrum:
    """Return a spectrum of wave numbers k (n,) with energies (n,), m^2, divided over the directions of ``spreading``,
    or all along ``heading``; energies are scaled in place to a significant height, if given. Raises UsageError if the
    band has no energy."""
    if not energy.sum() > 0.0:
        fault = f"the spectrum is zero from {band[0]:.6g} to {band[1]:.6g} rad/s [E1173]"
        raise UsageError(Problem(f"{where}: band", fault, "a band in which the spectrum has energy"))
    if height is not None:
        energy *= height**2 / (16.0 * energy.sum())
    angles, shares = (np.array([heading]), np.ones(1)) if spreading is None else spreading.shares()
    vectors = k[:, None, None] * np.stack((np.cos(angles), np.sin(angles)), axis=-1)
    return DiscreteSpectrum(vectors.reshape(-1, 2), np.outer(energy, shares).ravel(), band, depth, len(angles))


def _check_division(
    where: str, band: tuple[float, float], depth: float, gravity: float, heading: float, height: float | None
) -> None:
    if not 0.0 < band[0] < band[1]:
        fault = f"{band[0]:.6g} to {band[1]:.6g} does not increase from above 0 [E1169]"
        raise UsageError(Problem(f"{where}: band", fault, f"band = [{BAND[0]}, {BAND[1]}]"))
    check_depth(where, depth)
    check_number(f"{where}: gravity", gravity, "m/s^2", f"{STANDARD_GRAVITY}", above_zero=True)
    check_number(f"{where}: heading", heading, "rad")
    if height is not None:
        check_number(f"{where}: height", height, "m", "the significant height", above_zero=True)


def frequency_and_group_velocity(k: Array, depth: float, gravity: float = STANDARD_GRAVITY) -> tuple[Array, Array]:
    """Return w = sqrt(g k tanh k h), rad/s, and the group velocity dw/dk, m/s, of wave numbers k, rad/m, each of the
    shape of k."""
    if math.isinf(depth):
        w = np.sqrt(gravity * k)
        return w, 0.5 * w / k
    t = np.tanh(k * depth)
    w = np.sqrt(gravity * k * t)
    return w, 0.5 * w / k * (1.0 + k * depth * (1.0 - t * t) / t)


@checked_call()
def wave_number(frequency: float, depth: float = math.inf, gravity: float = STANDARD_GRAVITY) -> float:
    """Return the wave number k of an angular frequency w, from w^2 = g k tanh(k depth), by Newton's method.

    Parameters
    ----------
    frequency : float
        Angular frequency, rad/s.
    depth : float, optional
        Of the water, m; infinite by default.
    gravity : float, optional
        In m/s^2.

    Returns
    -------
    float
        In rad/m.

    Raises
    ------
    UsageError
        A frequency, depth or gravity that is not above 0.

    Examples
    --------
    >>> from eomgen.waves import wave_number
    >>> round(wave_number(1.0), 6)                     # in deep water w^2 / g
    0.101937
    """
    check_number("wave_number: frequency", frequency, "rad/s", above_zero=True)
    check_number("wave_number: gravity", gravity, "m/s^2", f"{STANDARD_GRAVITY}", above_zero=True)
    check_depth("wave_number", depth)
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
    """Return a spectrum as components of parts of a band; the limits of the parts have a constant ratio.

    Motion at a place does not repeat itself, and few components resolve the peak. Each component has the energy of its
    part of the band, at the mean frequency of this energy; parts without energy have none.

    Parameters
    ----------
    spectrum : Spectrum
        Density over angular frequency.
    components : int
        Number of parts, and of frequencies at most; with ``spreading`` each frequency has several directions.
    depth, gravity : float, optional
        Depth of the water, m, infinite by default, and gravity, m/s^2.
    band : tuple of float, optional
        Lowest and highest frequency in parts of the peak's, (0.5, 3) by default.
    spreading : Spreading, optional
        Directions, all for each frequency, about the heading of the spreading. None: all waves run along ``heading``.
    heading, height : float, optional
        Direction of all waves without ``spreading``, rad from x; significant height that the components are scaled to,
        m, by default the spectrum's within the band.

    Returns
    -------
    DiscreteSpectrum
        Wave vectors with the variance of each.

    Raises
    ------
    UsageError
        A band without energy or that does not increase from above 0, ``components`` that are not a whole number from 1
        to a million, or a depth, gravity or height that is not above 0.
    """
    _check_division("divided", band, depth, gravity, heading, height)
    check_whole("divided: components", components, 1, MOST_WAVES)
    edges = spectrum.peak * np.geomspace(band[0], band[1], components + 1)
    # Gauss-Legendre rule over each part, in four pieces, since a spectrum may have kinks: at the peak, or at the points
    # of a table
    nodes, weights = np.polynomial.legendre.leggauss(4)
    fine = np.concatenate([np.linspace(a, b, 4, endpoint=False) for a, b in itertools.pairwise(edges)])
    if isinstance(spectrum, SpectrumTable):
        points = spectrum.frequencies
        fine = np.union1d(fine, points[(points > edges[0]) & (points < edges[-1])])
    widths = np.diff(np.append(fine, edges[-1]))
    w = fine[:, None] + 0.5 * widths[:, None] * (1.0 + nodes)
    pieces = spectrum.density(w) * weights * 0.5 * widths[:, None]
    starts = np.searchsorted(fine, edges[:-1])
    energy, first = (np.add.reduceat(part.sum(axis=1), starts) for part in (pieces, pieces * w))
    ends = float(edges[0]), float(edges[-1])
    kept = energy > 0.0
    frequencies, energy = first[kept] / energy[kept], energy[kept]
    k = np.array([wave_number(float(frequency), depth, gravity) for frequency in frequencies])
    return _with_directions("divided", k, energy, ends, depth, spreading, heading, height)
