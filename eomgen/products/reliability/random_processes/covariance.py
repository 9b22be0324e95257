"""Covariances of stationary random processes, each with its exact power spectral density; of translated processes X =
T(g), and the Gaussian covariance of g that gives X a wanted covariance.

R(tau) is the covariance at the lag tau, G(f) the one-sided density over the frequency f in cycles per unit of the lag:
R(tau) = int_0^inf G(f) cos(2 pi f tau) df, so R(0), the variance, is the area under G. The lag is a time in s, or a
distance in m.

With the Hermite coefficients c_k of T of a standard normal argument, the covariance of X at a lag at which g has the
correlation r is sum over k from 1 on of c_k^2 k! r^k: smaller in size than r says, by the distortion of T.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.random_inputs import FREQUENCY_RANGE, REFERENCE_FREQUENCY, ROUGHNESS
from eomgen.base.rounding import COMPUTED
from eomgen.errors import Problem, UsageError
from eomgen.formula.curves import Curve
from eomgen.solvers.quadrature import gauss_legendre


class Covariance(Protocol):
    """A covariance and its power spectral density.

    Attributes
    ----------
    smooth : whether R has all derivatives at lag 0; if not, samples of the process have a kink everywhere
    """

    @property
    def smooth(self) -> bool: ...

    def at(self, lag: Array) -> Array:
        """Return R at lags of any sign and shape, in the square of the process's unit."""
        ...

    def density(self, frequency: Array) -> Array:
        """Return the one-sided density G at frequencies from 0 on, in cycles per unit of the lag; unit of the process
        squared per cycle."""
        ...


@dataclass(frozen=True)
class Constant:
    """R = s^2, s ``standard_deviation``: a random variable, the same at all times."""

    standard_deviation: float
    smooth = True

    def at(self, lag: Array) -> Array:
        return np.full(np.shape(lag), self.standard_deviation**2)

    def density(self, frequency: Array) -> Array:
        return np.zeros(np.shape(frequency))  # all of it is at the frequency 0


@dataclass(frozen=True)
class SquaredExponential:
    """R = s^2 exp(-tau^2 / (2 l^2)), s ``standard_deviation``, l ``scale``."""

    standard_deviation: float
    scale: float
    smooth = True

    def at(self, lag: Array) -> Array:
        return np.asarray(self.standard_deviation**2 * np.exp(-0.5 * (lag / self.scale) ** 2))

    def density(self, frequency: Array) -> Array:
        size = 2.0 * math.sqrt(2.0 * math.pi) * self.scale * self.standard_deviation**2
        return np.asarray(size * np.exp(-2.0 * (math.pi * self.scale * frequency) ** 2))


@dataclass(frozen=True)
class DampedCosine:
    """R = s^2 exp(-d abs(tau)) (cos w tau + c sin w abs(tau)), d ``decay``, w ``frequency`` in rad, both per
    unit of the lag, c ``sine``: with c above 0 white noise through a filter of second order."""

    standard_deviation: float
    decay: float
    frequency: float
    sine: float = 0.0
    smooth = False

    def at(self, lag: Array) -> Array:
        lag = np.abs(lag)
        phase, damped = self.frequency * lag, self.standard_deviation**2 * np.exp(-self.decay * lag)
        return np.asarray(damped * (np.cos(phase) + self.sine * np.sin(phase)))

    def density(self, frequency: Array) -> Array:
        square, d = (2.0 * math.pi * frequency) ** 2, self.decay
        natural, turned = d**2 + self.frequency**2, self.sine * self.frequency
        size = 4.0 * self.standard_deviation**2 * ((d + turned) * natural + (d - turned) * square)
        return np.asarray(size / ((natural - square) ** 2 + 4.0 * d**2 * square))


def exponential(standard_deviation: float, scale: float) -> DampedCosine:
    """Return R = s^2 exp(-abs(tau) / l), s the standard deviation, l the scale: white noise through a filter of first
    order, the Ornstein-Uhlenbeck process."""
    return DampedCosine(standard_deviation, 1.0 / scale, 0.0)


def oscillator(standard_deviation: float, frequency: float, damping: float) -> DampedCosine:
    """Return the covariance of the deflection of an oscillator under white noise, whose samples have a rate: natural
    frequency in rad per unit of the lag, damping ratio."""
    root = math.sqrt(1.0 - damping**2)
    return DampedCosine(standard_deviation, damping * frequency, frequency * root, damping / root)


def kanai_tajimi(standard_deviation: float, frequency: float, damping: float) -> DampedCosine:
    """Return the covariance of the acceleration of soil over shaken rock (Kanai 1957, Tajimi 1960), with frequency w0
    and damping ratio z: G ~ (1 + 4 z^2 r^2) / ((1 - r^2)^2 + 4 z^2 r^2) with r = w / w0."""
    root, square = math.sqrt(1.0 - damping**2), 4.0 * damping**2
    sine = damping * (1.0 - square) / ((1.0 + square) * root)
    return DampedCosine(standard_deviation, damping * frequency, frequency * root, sine)


@dataclass(frozen=True)
class RoadProfile:
    """The elevation of a road of a class of ISO 8608:2016 over distance, between 0.011 and 2.83 cycles/m: G(n) = G(n0)
    (n / n0)^-2."""

    road_class: str
    smooth, edges = True, FREQUENCY_RANGE

    def at(self, lag: Array) -> Array:
        from scipy.special import sici  # noqa: PLC0415 - most processes need none

        scale = ROUGHNESS[self.road_class] * REFERENCE_FREQUENCY**2
        wave = 2.0 * math.pi * np.abs(lag)

        def below(n: float) -> Array:  # int cos(wave n) / n^2 dn
            return np.asarray(-np.cos(wave * n) / n - wave * sici(wave * n)[0])

        low, high = FREQUENCY_RANGE
        return np.asarray(scale * (below(high) - below(low)))

    def density(self, frequency: Array) -> Array:
        low, high = FREQUENCY_RANGE
        inside = (frequency >= low) & (frequency <= high)
        n = np.where(inside, frequency, 1.0)
        return np.where(inside, ROUGHNESS[self.road_class] * (REFERENCE_FREQUENCY / n) ** 2, 0.0)


@dataclass(frozen=True)
class CovarianceTable:
    """R through points, a spline over lags from 0 on; 0 after the last point."""

    curve: Curve
    smooth = False

    def at(self, lag: Array) -> Array:
        inside = np.abs(lag) <= self.curve.end
        return np.where(inside, self.curve(np.where(inside, np.abs(lag), 0.0)), 0.0)

    def density(self, frequency: Array) -> Array:
        """Return 4 int_0^L R cos(2 pi f tau) d tau, L the last lag, by Gauss's rule on each piece."""
        breaks = self.curve.breaks
        waves = float(np.max(frequency, initial=0.0)) * float(np.max(np.diff(breaks)))
        lag, weight = gauss_legendre(np.asarray(breaks), 8 + math.ceil(4.0 * waves))
        share = np.asarray(4.0 * weight * self.at(lag)).ravel()
        return np.asarray(np.cos(2.0 * math.pi * np.multiply.outer(frequency, lag.ravel())) @ share)


@dataclass(frozen=True, eq=False)
class DensityTable:
    """G through points (n,), linear between frequencies, 0 outside."""

    frequencies: Array
    densities: Array
    smooth = True

    @property
    def edges(self) -> list[float]:
        """Rising frequencies that bound the smooth pieces of the spectrum, which is 0 outside."""
        return [float(f) for f in self.frequencies]

    def at(self, lag: Array) -> Array:
        """Return the exact integral of each linear piece."""
        f, G = self.frequencies, self.densities
        middle, half = 0.5 * (f[1:] + f[:-1]), 0.5 * np.diff(f)
        mean, rise = 0.5 * (G[1:] + G[:-1]), 0.5 * np.diff(G)
        wave = 2.0 * math.pi * np.abs(np.asarray(lag))[..., np.newaxis]
        x = wave * half
        # int_-1^1 u sin(x u) du / 2, by a series for small x, since the closed form cancels there
        small = np.abs(x) < 0.1
        safe = np.where(small, 1.0, x)
        odd = np.where(small, x / 3.0 - x**3 / 30.0 + x**5 / 840.0, (np.sin(safe) - safe * np.cos(safe)) / safe**2)
        parts = 2.0 * half * (mean * np.sinc(x / math.pi) * np.cos(wave * middle) - rise * odd * np.sin(wave * middle))
        return np.asarray(parts.sum(axis=-1))

    def density(self, frequency: Array) -> Array:
        return np.interp(frequency, self.frequencies, self.densities, left=0.0, right=0.0)


def band(standard_deviation: float, low: float, high: float) -> DensityTable:
    """Return the covariance of white noise between two frequencies, in cycles per unit of the lag."""
    return DensityTable(np.array([low, high]), np.full(2, standard_deviation**2 / (high - low)))


#: Points of a map from a standard normal variable, which is straight beyond.
MAPPED: Array = np.linspace(-12.0, 12.0, 401)


def quantile_map(shares: Array, values: Array) -> Array:
    """Return the values at ``MAPPED`` of the monotone map of a standard normal variable to a variable with given
    quantiles: piecewise cubic between the points, straight beyond the first and the last.

    The quantiles are rising `values` (m,) of the rising probabilities `shares` (m,).

    References
    ----------
    Fritsch, Carlson: Monotone piecewise cubic interpolation, SIAM J. Numer. Anal. 17 (1980).
    """
    from statistics import NormalDist  # noqa: PLC0415  # slow to import, as SciPy is; most processes have none

    from scipy.interpolate import PchipInterpolator  # noqa: PLC0415

    normal = np.array([NormalDist().inv_cdf(float(share)) for share in shares])
    spline = PchipInterpolator(normal, values)
    slopes = spline(normal[[0, -1]], 1)
    y = spline(np.clip(MAPPED, normal[0], normal[-1]))
    y += slopes[0] * np.minimum(MAPPED - normal[0], 0.0) + slopes[1] * np.maximum(MAPPED - normal[-1], 0.0)
    return y


def translated_correlation(map_of: Callable[[Array], Array], correlation: Array) -> Array:
    """Return the correlation of T(g), in the shape of the given correlation of the standard normal g.

    ``map_of`` evaluates T at an array. Raises UsageError if T(g) has no variance.

    References
    ----------
    Grigoriu: Applied Non-Gaussian Processes (1995), 3.1.
    """
    nodes, weights = np.polynomial.hermite_e.hermegauss(160)
    values = map_of(nodes) * weights / math.sqrt(2.0 * math.pi)
    # forty orthonormal Hermite polynomials by recurrence: He_k / sqrt(k!)
    before, here, shares = np.zeros_like(nodes), np.ones_like(nodes), []
    for k in range(1, 41):
        before, here = here, (nodes * here - math.sqrt(k - 1.0) * before) / math.sqrt(k)
        shares.append(float(values @ here) ** 2)
    total = sum(shares)
    if not total > 1e-24 * float(np.max(np.abs(map_of(nodes)))) ** 2:  # not a number, too
        raise UsageError(Problem("", "the translation has no variance [E0966]", "a formula that depends on g"))
    result = np.zeros_like(correlation)
    for share in reversed(shares):
        result = (result + share / total) * correlation
    return result


def underlying(covariance: Covariance, map_of: Callable[[Array], Array], window: float) -> CovarianceTable:
    """Return the covariance of a standard normal g, as a table, whose translation has the correlation of
    ``covariance``.

    ``map_of`` evaluates the translation at an array; lags go from 0 to ``window``, s or m.

    Raises
    ------
    UsageError
        If no correlation of g gives the requested correlation: a translation bounds correlations from below.
    """
    lags = np.linspace(0.0, window, 1025)
    wanted = covariance.at(lags) / covariance.at(np.zeros(1))
    correlation = np.linspace(-1.0, 1.0, 4001)
    made = translated_correlation(map_of, correlation)
    falling = np.flatnonzero(np.diff(made) <= 0.0)
    first = int(falling[-1]) + 1 if len(falling) else 0
    lowest, worst = made[first], int(np.argmin(wanted))
    if wanted[worst] < lowest - COMPUTED:
        fault = (
            f"no Gaussian process has a translation with the correlation {wanted[worst]:.3g} at the lag"
            f" {lags[worst]:.3g}: of this one they are {lowest:.3g} or more [E0967]"
        )
        raise UsageError(Problem("", fault, "a covariance that is less negative, or the covariance of g"))
    result = np.interp(wanted, made[first:], correlation[first:])
    result[0] = 1.0
    return CovarianceTable(Curve("covariance", lags, result))
