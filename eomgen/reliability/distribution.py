"""Distribution of a quadratic form of standard normal variables: three inversions of its characteristic function.

With eigenvalues l and the gradient d along their eigenvectors, the cumulant generating function is

    K(s) = s value - sum ln(1 - s l) / 2 + sum s^2 d^2 / (2 (1 - s l)),

analytic off the real axis. ``steepest_descent`` is exact to rounding, relative to the smaller of both tails, however
far out; ``imhof`` is exact to rounding relative to 1; ``lugannani_rice`` is what is left of the first where all but
the saddle point is dropped.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import optimize, special

from eomgen.arrays import Array
from eomgen.errors import NumericalError
from eomgen.reliability.quadratic_form import QuadraticForm

Complex = NDArray[np.complex128]

#: Distance of nodes along the path, in standard deviations of the Gaussian that the integrand is there, and their
#: number: the next one is exp(-8.6^2 / 2) = 9e-17 of the first.
_APART, _NODES = 1.0 / 16.0, 138
#: Corrections of a node by Newton's method, at most.
_CORRECTIONS = 20
#: Difference to a third of the nodes, relative, beyond which the integral is refused.
_DIFFERENCE = 1e-6
#: Panels of Imhof's integral, at most.
_PANELS = 20_000
#: A saddle so near to zero, in standard deviations, that the formula of Lugannani and Rice takes its limit.
_AT_THE_MEAN = 1e-4


class Tails(NamedTuple):
    """P(Y <= y) and P(Y > y), each accurate by itself; shapes of the thresholds."""

    below: Array
    above: Array


class _Generating:
    """K - s y and its derivatives for thresholds (m,) at s (m,)."""

    def __init__(self, form: QuadraticForm, thresholds: Array) -> None:
        values, slopes = form.principal
        scale = max(form.standard_deviation, np.finfo(float).tiny)
        #: Standardised, so that steps and tolerances need no units.
        self.values, self.slopes = values / scale, slopes / scale
        self.offsets = (form.value - thresholds) / scale

    def __call__(self, s: Complex | Array, rows: NDArray[np.intp]) -> Complex:
        bent = 1.0 - s[:, None] * self.values
        half = -0.5 * np.log(bent) + 0.5 * (s[:, None] * self.slopes) ** 2 / bent
        return np.asarray(s * self.offsets[rows] + half.sum(axis=1))

    def first(self, s: Complex | Array, rows: NDArray[np.intp]) -> Complex:
        bent, z = 1.0 - s[:, None] * self.values, s[:, None]
        parts = 0.5 * self.values / bent + self.slopes**2 * z * (1.0 - 0.5 * z * self.values) / bent**2
        return np.asarray(self.offsets[rows] + parts.sum(axis=1))

    def second(self, s: Complex | Array) -> Complex:
        bent = 1.0 - s[:, None] * self.values
        parts = 0.5 * self.values**2 / bent**2 + self.slopes**2 / bent**3
        return np.asarray(parts.sum(axis=1))

    def third(self, s: Array) -> Array:
        bent = 1.0 - s[:, None] * self.values
        parts = self.values**3 / bent**3 + 3.0 * self.values * self.slopes**2 / bent**4
        return np.asarray(parts.sum(axis=1))

    def slope(self, s: float, row: int) -> float:
        """d(K - s y)/ds, where it is infinite beyond the strip of its poles."""
        return float(np.real(self.first(np.array([s]), np.array([row]))[0]))

    def saddle(self, row: int) -> float:
        """Return s between the poles where K' = y; an infinity where y is no value of the form."""
        low, high = min(self.values.min(), 0.0), max(self.values.max(), 0.0)
        at_zero = self.slope(0.0, row)
        if at_zero == 0.0:
            return 0.0
        sign = -1.0 if at_zero > 0.0 else 1.0
        edge = 1.0 / (high if sign > 0 else low) if (high if sign > 0 else low) else sign * np.inf
        inner, outer = 0.0, sign * 1.0
        for _ in range(200):
            if np.isfinite(edge) and abs(outer) >= abs(edge):
                outer = 0.5 * (inner + edge)
            if self.slope(outer, row) * at_zero <= 0.0:
                return float(optimize.brentq(self.slope, inner, outer, args=(row,), xtol=1e-15, rtol=1e-14))
            inner = outer
            outer = 2.0 * outer if not np.isfinite(edge) else 0.5 * (outer + edge)
            if abs(outer) > 1e12:
                break
        return sign * np.inf


def steepest_descent(form: QuadraticForm, thresholds: ArrayLike) -> Tails:
    """Return both tails at thresholds (m,): the inversion integral along the path of steepest descent.

    On that path from the saddle point the exponent falls as t^2 / 2 by its parameter t, so the integrand is a Gaussian
    by a smooth factor, and the trapezoidal rule is exact to rounding. The pole at s = 0, which lies at t = i w, is
    subtracted; its part is the normal distribution at w.

    Raises
    ------
    NumericalError
        Where a third of the nodes gives another number.

    References
    ----------
    Daniels: Saddlepoint approximations in statistics, Ann. Math. Stat. 25 (1954); Rice: Distribution of quadratic forms
    in normal random variables, SIAM J. Sci. Stat. Comput. 1 (1980).
    """
    y, shape = _flat(thresholds)
    generating, saddles, below, above = _begun(form, y)
    rows = np.flatnonzero(np.isfinite(saddles))
    if not rows.size:
        return Tails(below.reshape(shape), above.reshape(shape))
    s0 = saddles[rows]
    depth = np.real(generating(s0, rows))
    w = np.sign(s0) * np.sqrt(np.maximum(-2.0 * depth, 0.0))
    curvature = np.real(generating.second(s0))
    integral, thirds = np.zeros(rows.size), np.zeros(rows.size)
    s, t = s0.astype(complex), 0.0
    direction = 1j / np.sqrt(curvature)
    for node in range(_NODES):
        ahead = (node + 0.5) * _APART
        s = _on_path(generating, rows, s + direction * (ahead - t), depth - 0.5 * ahead**2)
        t, direction = ahead, -ahead / generating.first(s, rows)
        # the path is symmetric about the real axis: the real parts of both halves of the integral cancel
        part = np.imag(direction / s - 1.0 / (ahead - 1j * w)) * np.exp(-0.5 * ahead**2)
        integral += part * _APART
        if node % 3 == 1:
            thirds += 3.0 * part * _APART
    rest, other = (np.exp(-0.5 * w**2) * each / np.pi for each in (integral, thirds))
    smaller = np.maximum(special.ndtr(-np.abs(w)), np.finfo(float).tiny)
    off = np.abs(rest - other) / smaller
    if np.any(off > _DIFFERENCE):
        worst = int(np.argmax(off))
        what = f"the distribution at {y[rows[worst]]:.6g} is not resolved: a third of its nodes gives"
        what += f" a part of {off[worst]:.1e} more or less"
        raise NumericalError(what, "Imhof's inversion")
    below[rows], above[rows] = special.ndtr(w) - rest, special.ndtr(-w) + rest
    return Tails(below.reshape(shape), above.reshape(shape))


def _on_path(generating: _Generating, rows: NDArray[np.intp], guess: Complex, wanted: Array) -> Complex:
    """Return s with K - s y as wanted, next to a guess."""
    s = guess
    for _ in range(_CORRECTIONS):
        step = (generating(s, rows) - wanted) / generating.first(s, rows)
        s = s - step
        if np.all(np.abs(step) <= 1e-13 * np.abs(s)):
            break
    return s


def lugannani_rice(form: QuadraticForm, thresholds: ArrayLike) -> Tails:
    """Return both tails at thresholds (m,) by the saddle point alone.

    References
    ----------
    Lugannani, Rice: Saddle point approximation for the distribution of the sum of independent random variables, Adv.
    Appl. Prob. 12 (1980), eq. 2.
    """
    y, shape = _flat(thresholds)
    generating, saddles, below, above = _begun(form, y)
    rows = np.flatnonzero(np.isfinite(saddles))
    s0 = saddles[rows]
    w = np.sign(s0) * np.sqrt(np.maximum(-2.0 * np.real(generating(s0, rows)), 0.0))
    second = np.real(generating.second(s0))
    u = s0 * np.sqrt(second)
    with np.errstate(divide="ignore", invalid="ignore"):
        between = np.exp(-0.5 * w**2) / np.sqrt(2.0 * np.pi) * (1.0 / w - 1.0 / u)
    limit = generating.third(s0) / (6.0 * np.sqrt(2.0 * np.pi) * second**1.5)
    between = np.where(np.abs(w) < _AT_THE_MEAN, limit, between)
    below[rows], above[rows] = special.ndtr(w) + between, special.ndtr(-w) - between
    return Tails(below.reshape(shape), above.reshape(shape))


def imhof(form: QuadraticForm, thresholds: ArrayLike) -> Tails:
    """Return both tails at thresholds (m,) by the integral along the imaginary axis; small tails lose their digits.

    Raises
    ------
    NumericalError
        Where the characteristic function falls too slowly, as it does for a few variables.

    References
    ----------
    Imhof: Computing the distribution of quadratic forms in normal variables, Biometrika 48 (1961), eq. 3.2.
    """
    y, shape = _flat(thresholds)
    generating, saddles, below, above = _begun(form, y)
    rows = np.flatnonzero(np.isfinite(saddles))
    edge = _where_it_ends(generating)
    with np.errstate(over="ignore", under="ignore"):
        for row in rows:
            panels = max(64, int(np.ceil(edge * (1.0 + abs(generating.offsets[row])) / np.pi)))
            if panels > _PANELS:
                what = f"the characteristic function of {len(form.gradient)} variables falls too slowly"
                what += " for Imhof's integral"
                raise NumericalError(what, "inversion by steepest_descent")
            nodes, weights = _panels(edge, panels)
            turned = generating(np.asarray(1j * nodes, dtype=complex), np.full(nodes.size, row))
            below[row] = 0.5 - np.sum(weights * np.imag(np.exp(turned)) / nodes) / np.pi
            above[row] = 1.0 - below[row]
    return Tails(below.reshape(shape), above.reshape(shape))


def _where_it_ends(generating: _Generating) -> float:
    """Return u from which on the characteristic function, by u, is below rounding."""
    edge = 1.0
    row = np.zeros(1, dtype=np.intp)
    while edge < 1e8 and np.exp(np.real(generating(np.array([1j * edge]), row)))[0] / edge > 1e-17:
        edge *= 1.25
    return edge


def _panels(edge: float, panels: int) -> tuple[Array, Array]:
    """Return nodes and weights of Gauss and Legendre's rule in equal panels of (0, edge)."""
    points, shares = np.polynomial.legendre.leggauss(10)
    borders = np.linspace(0.0, edge, panels + 1)
    half = 0.5 * np.diff(borders)
    nodes = (borders[:-1] + half)[:, None] + half[:, None] * points
    return nodes.ravel(), (half[:, None] * shares).ravel()


def _flat(thresholds: ArrayLike) -> tuple[Array, tuple[int, ...]]:
    y = np.asarray(thresholds, dtype=float)
    return y.ravel(), y.shape


def _begun(form: QuadraticForm, y: Array) -> tuple[_Generating, Array, Array, Array]:
    """Return the generating function, saddles, and the tails where a form has no spread or never comes."""
    if not form.standard_deviation > 0.0:
        below = np.where(y >= form.value, 1.0, 0.0)
        return _Generating(form, y), np.full(y.size, np.inf), below, 1.0 - below
    generating = _Generating(form, y)
    saddles = np.array([generating.saddle(row) for row in range(y.size)])
    below = np.where(saddles > 0.0, 1.0, 0.0)
    return generating, saddles, below, 1.0 - below


#: How a distribution of a quadratic form is found, by name.
INVERSIONS: Mapping[str, Callable[[QuadraticForm, ArrayLike], Tails]] = {
    "steepest_descent": steepest_descent,
    "imhof": imhof,
    "lugannani_rice": lugannani_rice,
}
