"""Correlation of translated processes X = T(g), and the Gaussian covariance that gives X a wanted one.

With the Hermite coefficients c_k of T of a standard normal argument, the covariance of X at a lag at which g has the
correlation r is sum over k from 1 on of c_k^2 k! r^k: smaller in size than r says, by the distortion of T.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from statistics import NormalDist

import numpy as np

from eomgen.base.arrays import Array
from eomgen.errors import Problem, UsageError
from eomgen.formula.curves import Curve
from eomgen.products.reliability.random_processes.covariance import Covariance, CovarianceTable

#: Standard deviations to which a map by quantiles is known, and points of it.
BEYOND, _MAP_POINTS = 12.0, 401
#: Hermite polynomials, and nodes of the rule that projects on them.
_DEGREES, _NODES = 40, 160
#: Correlations of g at which the correlation of X is known, and lags at which it is inverted.
_CORRELATIONS, _LAGS = 4001, 1025
#: Tolerated excess of an inverted correlation: rounding of the projection.
_ROUNDING = 1e-9


def quantile_map(shares: Array, values: Array) -> tuple[Array, Array]:
    """Return points (n,), (n,) of the monotone map of a standard normal variable to one whose quantiles of rising
    shares (m,) are rising values (m,): piecewise cubic between them, straight beyond the first and the last.

    References
    ----------
    Fritsch, Carlson: Monotone piecewise cubic interpolation, SIAM J. Numer. Anal. 17 (1980).
    """
    from scipy.interpolate import PchipInterpolator  # noqa: PLC0415  # slow to import; most processes have none

    normal = np.array([NormalDist().inv_cdf(float(share)) for share in shares])
    x = np.linspace(-BEYOND, BEYOND, _MAP_POINTS)
    spline = PchipInterpolator(normal, values)
    slopes = spline(normal[[0, -1]], 1)
    y = spline(np.clip(x, normal[0], normal[-1]))
    y += slopes[0] * np.minimum(x - normal[0], 0.0) + slopes[1] * np.maximum(x - normal[-1], 0.0)
    return x, y


def translated_correlation(map_of: Callable[[Array], Array], correlation: Array) -> Array:
    """Return the correlation of T(g), given a correlation of any shape of the standard normal g.

    References
    ----------
    Grigoriu: Applied Non-Gaussian Processes (1995), 3.1.
    """
    nodes, weights = np.polynomial.hermite_e.hermegauss(_NODES)
    values = map_of(nodes) * weights / math.sqrt(2.0 * math.pi)
    # orthonormal Hermite polynomials, by their recurrence: He_k / sqrt(k!)
    before, here, shares = np.zeros(_NODES), np.ones(_NODES), []
    for k in range(1, _DEGREES + 1):
        before, here = here, (nodes * here - math.sqrt(k - 1.0) * before) / math.sqrt(k)
        shares.append(float(values @ here) ** 2)
    total = sum(shares)
    if not total > 1e-24 * float(np.max(np.abs(map_of(nodes)))) ** 2:  # not a number, too
        raise UsageError(Problem("", "the translation has no variance", "a formula that depends on g"))
    result = np.zeros_like(correlation)
    for share in reversed(shares):
        result = (result + share / total) * correlation
    return result


def underlying(covariance: Covariance, map_of: Callable[[Array], Array], window: float) -> CovarianceTable:
    """Return the covariance of g, of variance 1, whose translation has the correlation of another covariance.

    Raises
    ------
    UsageError
        If no correlation of g makes one that is asked for: a translation bounds them from below.
    """
    lags = np.linspace(0.0, window, _LAGS)
    wanted = covariance.at(lags) / covariance.at(np.zeros(1))
    correlation = np.linspace(-1.0, 1.0, _CORRELATIONS)
    made = translated_correlation(map_of, correlation)
    falling = np.flatnonzero(np.diff(made) <= 0.0)
    first = int(falling[-1]) + 1 if len(falling) else 0
    lowest, worst = made[first], int(np.argmin(wanted))
    if wanted[worst] < lowest - _ROUNDING:
        fault = f"no Gaussian process has a translation with the correlation {wanted[worst]:.3g} at the lag"
        fault += f" {lags[worst]:.3g}: of this one they are {lowest:.3g} or more"
        raise UsageError(Problem("", fault, "a covariance that is less negative, or the covariance of g"))
    result = np.interp(wanted, made[first:], correlation[first:])
    result[0] = 1.0
    return CovarianceTable(Curve("covariance", lags, result))
