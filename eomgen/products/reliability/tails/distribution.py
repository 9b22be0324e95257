"""Distributions of responses: quadratic forms in standard normal variables by two inversions of the characteristic
function, and small probabilities by importance sampling about the most probable point and, for a form that bends back,
its far branches.

With eigenvalues l and the gradient d along their eigenvectors, the cumulant generating function is

    K(s) = s value - sum ln(1 - s l) / 2 + sum s^2 d^2 / (2 (1 - s l)),

analytic off the real axis. ``steepest_descent`` is exact to rounding, relative to the smaller of both tails, however
far out; ``lugannani_rice`` is reduced to its saddle point.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special
from scipy.optimize import brentq

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, field
from eomgen.base.limits import Limit
from eomgen.base.rounding import COMPUTED, WRITTEN
from eomgen.errors import NumericalError
from eomgen.products.reliability.tails.quadratic_form import QuadraticForm, Response

Complex = NDArray[np.complex128]
#: One quadratic form, or one for each threshold.
Forms = QuadraticForm | Sequence[QuadraticForm]


class Tails(NamedTuple):
    """P(Y <= y) and P(Y > y), each with relative accuracy; shapes of the thresholds."""

    below: Array
    above: Array


class _CumulantFunction:
    """K(s) - s y of quadratic forms at thresholds y (m,), and its first three derivatives, at s (m,). All numbers are
    divided by the standard deviation of the form, by which s is multiplied. There is one form for each threshold, or
    one for all; methods take s for the thresholds ``rows`` and return as many values."""

    def __init__(self, forms: Sequence[QuadraticForm], thresholds: Array) -> None:
        scales = np.array([form.standard_deviation or 1.0 for form in forms])
        # standardised, so that steps and tolerances need no units
        values, slopes = (np.stack([form.principal[k] for form in forms]) / scales[:, None] for k in (0, 1))
        self.values, self.slopes = (
            np.broadcast_to(part, (thresholds.size, part.shape[1])) for part in (values, slopes)
        )
        self.offsets = (np.array([form.value for form in forms]) - thresholds) / scales

    def __call__(self, s: Complex | Array, rows: NDArray[np.intp]) -> Complex:
        bent = 1.0 - s[:, None] * self.values[rows]
        half = -0.5 * np.log(bent) + 0.5 * (s[:, None] * self.slopes[rows]) ** 2 / bent
        return np.asarray(s * self.offsets[rows] + half.sum(axis=1))

    def first(self, s: Complex | Array, rows: NDArray[np.intp]) -> Complex:
        values, z = self.values[rows], s[:, None]
        bent = 1.0 - z * values
        parts = 0.5 * values / bent + self.slopes[rows] ** 2 * z * (1.0 - 0.5 * z * values) / bent**2
        return np.asarray(self.offsets[rows] + parts.sum(axis=1))

    def second(self, s: Complex | Array, rows: NDArray[np.intp]) -> Complex:
        values = self.values[rows]
        bent = 1.0 - s[:, None] * values
        parts = 0.5 * values**2 / bent**2 + self.slopes[rows] ** 2 / bent**3
        return np.asarray(parts.sum(axis=1))

    def third(self, s: Array, rows: NDArray[np.intp]) -> Array:
        values = self.values[rows]
        bent = 1.0 - s[:, None] * values
        parts = values**3 / bent**3 + 3.0 * values * self.slopes[rows] ** 2 / bent**4
        return np.asarray(parts.sum(axis=1))

    def beside(self, u: Complex, s: Array, rows: NDArray[np.intp]) -> tuple[Complex, Complex]:
        """Return K(s + u) - K(s) and its derivative by u, for saddles s and complex u of the thresholds ``rows``. The
        slope at s, which is rounding, is left out."""
        values, at = self.values[rows], u[:, None]
        bent = 1.0 - s[:, None] * values
        ahead, x = bent - at * values, at * values / bent
        squares = (self.slopes[rows] / bent) ** 2
        rise = -0.5 * (np.log1p(-x) + x) + 0.5 * squares * at**2 / ahead
        slope = 0.5 * x * values / ahead + 0.5 * squares * at * (bent + ahead) / ahead**2
        return np.asarray(rise.sum(axis=1)), np.asarray(slope.sum(axis=1))

    def saddles(self) -> Array:
        """Return s (m,) between the poles at which K' = y: inf if y is above all values of the form, -inf if below. K'
        rises all along the strip between the poles."""
        return np.array([self._saddle(row) for row in range(self.offsets.size)])

    def _saddle(self, row: int) -> float:
        rows = np.array([row])

        def slope(s: float) -> float:
            return float(self.first(np.array([s]), rows)[0])

        if not (at_zero := slope(0.0)):
            return 0.0
        sign = -1.0 if at_zero > 0.0 else 1.0
        pole = max(float(np.max(sign * self.values[row], initial=0.0)), 1e-12)
        end = sign * (1.0 - np.finfo(float).eps) / pole
        if slope(end) * at_zero > 0.0:
            return sign * np.inf
        s = float(brentq(slope, 0.0, end, xtol=np.finfo(float).tiny, maxiter=1000))
        return s - slope(s) / float(self.second(np.array([s]), rows)[0])


def steepest_descent(forms: Forms, thresholds: ArrayLike) -> Tails:
    """Return P(Y <= y) and P(Y > y) of quadratic forms at thresholds, by integration along paths of steepest descent.

    `forms` is one form for all thresholds, or one for each. The tails have the shape of the thresholds. On the path
    from the saddle point the exponent falls as t^2 / 2 with the parameter t, so the integrand is a Gaussian times a
    smooth factor, and the trapezoidal rule is exact to rounding. The pole at s = 0, at t = i w, is subtracted; the
    contribution of the pole is the normal distribution at w.

    Raises
    ------
    NumericalError
        If a third of the nodes gives another number.

    References
    ----------
    Daniels: Saddlepoint approximations in statistics, Ann. Math. Stat. 25 (1954); Rice: Distribution of quadratic forms
    in normal random variables, SIAM J. Sci. Stat. Comput. 1 (1980).
    """
    apart = 1.0 / 16.0  # of nodes along the path, in standard deviations of the Gaussian integrand

    def off_normal(generating: _CumulantFunction, s0: Array, rows: NDArray[np.intp], w: Array) -> Array:
        integral, thirds = np.zeros(rows.size), np.zeros(rows.size)
        u, t = np.zeros(rows.size, dtype=complex), 0.0
        direction = 1j / np.sqrt(np.real(generating.second(s0, rows)))
        for node in range(138):  # the next node has exp(-8.6^2 / 2) = 9e-17 of the first value
            ahead = (node + 0.5) * apart
            u, slope = _on_path(generating, s0, rows, u + direction * (ahead - t), ahead)
            t, direction = ahead, -ahead / slope
            # the path is symmetric about the real axis: the real parts of both halves of the integral cancel
            part = np.imag(direction / (s0 + u) - 1.0 / (ahead - 1j * w)) * np.exp(-0.5 * ahead**2)
            integral += part * apart
            if node % 3 == 1:
                thirds += 3.0 * part * apart
        rest, rough = (np.exp(-0.5 * w**2) * each / np.pi for each in (integral, thirds))
        smaller = np.maximum(special.ndtr(-np.abs(w)), np.finfo(float).tiny)
        off = np.abs(rest - rough) / smaller
        if np.any(off > WRITTEN):
            worst = int(np.argmax(off))
            fault = (
                f"the distribution at {np.ravel(thresholds)[rows[worst]]:.6g} is not resolved: a third of its nodes"
                f" gives a part of {off[worst]:.1e} more or less [E1028]"
            )
            raise NumericalError(fault, "samples=... (--monte-carlo)")
        return np.asarray(-rest)

    return _tails(forms, thresholds, off_normal)


def _on_path(
    generating: _CumulantFunction, saddles: Array, rows: NDArray[np.intp], guess: Complex, t: float
) -> tuple[Complex, Complex]:
    """Return u next to a guess at which K has fallen by t^2 / 2 from its value at a saddle, and the slope of K at the
    saddle plus u: complex, one for each of the thresholds ``rows``."""
    u = guess
    for _ in range(20):
        rise, slope = generating.beside(u, saddles, rows)
        step = (rise + 0.5 * t**2) / slope
        u = u - step
        if np.all(np.abs(step) <= COMPUTED * np.abs(u)):  # Newton's next step is the square of this step
            break
    return u, generating.beside(u, saddles, rows)[1]


def lugannani_rice(forms: Forms, thresholds: ArrayLike) -> Tails:
    """Return P(Y <= y) and P(Y > y) of quadratic forms at thresholds by the saddle point alone, an approximation.

    `forms` is one form for all thresholds, or one for each. The tails have the shape of the thresholds.

    References
    ----------
    Lugannani, Rice: Saddle point approximation for the distribution of the sum of independent random variables, Adv.
    Appl. Prob. 12 (1980), eq. 2.
    """

    def off_normal(generating: _CumulantFunction, s0: Array, rows: NDArray[np.intp], w: Array) -> Array:
        second = np.real(generating.second(s0, rows))
        with np.errstate(divide="ignore", invalid="ignore"):
            between = np.exp(-0.5 * w**2) / np.sqrt(2.0 * np.pi) * (1.0 / w - 1.0 / (s0 * np.sqrt(second)))
        limit = generating.third(s0, rows) / (6.0 * np.sqrt(2.0 * np.pi) * second**1.5)
        return np.asarray(np.where(np.abs(w) < 1e-4, limit, between))

    return _tails(forms, thresholds, off_normal)


def _tails(
    several_forms: Forms,
    thresholds: ArrayLike,
    off_normal: Callable[[_CumulantFunction, Array, NDArray[np.intp], Array], Array],
) -> Tails:
    """Return the probabilities of a normal variable at w, plus and minus ``off_normal`` of the cumulant function, the
    finite saddles, their rows and w; 0 or 1 if the form has no spread, or never takes the value y."""
    y = np.ravel(np.asarray(thresholds, dtype=float))
    forms = [several_forms] if isinstance(several_forms, QuadraticForm) else list(several_forms)
    generating = _CumulantFunction(forms, y)
    spread = np.broadcast_to([form.standard_deviation > 0.0 for form in forms], y.shape)
    fixed = np.broadcast_to([form.value for form in forms], y.shape)
    saddles = np.where(spread, generating.saddles(), np.inf)
    below = np.where(np.where(spread, saddles > 0.0, y >= fixed), 1.0, 0.0)
    above = 1.0 - below
    if (rows := np.flatnonzero(np.isfinite(saddles))).size:
        s0 = saddles[rows]
        w = np.sign(s0) * np.sqrt(np.maximum(-2.0 * np.real(generating(s0, rows)), 0.0))
        rest = off_normal(generating, s0, rows, w)
        below[rows], above[rows] = special.ndtr(w) + rest, special.ndtr(-w) - rest
    return Tails(below.reshape(np.shape(thresholds)), above.reshape(np.shape(thresholds)))


#: Least number of samples for the correction of a probability.
FEWEST = 200
UNSEEN = Limit(
    1e-3, "1", "probability beyond a point that is left out, in parts of the whole", "a hundredth of the accuracy"
)
LEAST_FOR_SKEWNESS = Limit(
    25.0,
    "1",
    "samples in parts of the square of their skewness",
    "95 % intervals hold at least 94 %: Cochran, Sampling Techniques (1977), 2.15",
)


class ProbabilityEstimate(NamedTuple):
    """A probability, its standard error, and the number of samples; not a number if the response has no value at some
    samples."""

    probability: float
    standard_error: float
    samples: int


def importance_sampling(
    response: Response, point: Array, threshold: float, *, above: bool, samples: int, seed: int
) -> ProbabilityEstimate:
    """Estimate P(y > threshold), or P(y <= threshold), by importance sampling with unit covariance about a point.

    The estimate is NaN if the response has no value at some sample.

    Parameters
    ----------
    response : Response
        y as a function of standard normal variables.
    point : (n,) ndarray
        Mean of the samples.
    threshold, above : float and bool
        Threshold, and whether the probability is of values above.
    samples, seed : int
        Number of samples, and seed.

    References
    ----------
    Schueller, Stix: A critical appraisal of methods to determine failure probabilities, Structural Safety 4 (1987).
    """
    random, block = np.random.default_rng(seed), 4096
    total = squares = 0.0
    for begin in range(0, samples, block):
        z = point + random.standard_normal((min(block, samples - begin), len(point)))
        weights = np.exp(0.5 * point @ point - z @ point)
        y = response.values(z)
        parts = np.where(np.isnan(y), np.nan, np.where((y > threshold) == above, weights, 0.0))
        total += float(parts.sum())
        squares += float((parts**2).sum())
    mean = total / samples
    return ProbabilityEstimate(mean, float(np.sqrt(np.maximum(squares / samples - mean**2, 0.0) / samples)), samples)


@dataclass
class Draws:
    """Samples of normal variables about centres in turn, run at use; a larger sample contains all smaller samples.

    Parameters
    ----------
    run : callable
        From points (m, n) to results, (m,) each; the first result is the response.
    centre : (n,) or (c, n)
        Means of the points.
    seed : int
    scales : (c,) or 1
        Standard deviations of the points about the means.

    References
    ----------
    Veach, Guibas: Optimally combining sampling techniques for Monte Carlo rendering, SIGGRAPH (1995): the weights of
    several centres, "balance heuristic".
    """

    run: Callable[[Array], tuple[Array, ...]]
    centre: Array
    seed: int
    scales: Array | float = 1.0
    _parts: list[tuple[Array, ...]] = field(default_factory=list, init=False)

    def __post_init__(self) -> None:
        self.centre = np.atleast_2d(self.centre)
        self._scales: Array = np.broadcast_to(self.scales, len(self.centre))

    def first(self, count: int) -> tuple[Array, ...]:
        """Return all points (m, n) drawn so far, m at least `count`, and the results of the runs, (m,) each. Only
        missing points are drawn and run; they are kept for later calls."""
        have = sum(len(part[0]) for part in self._parts)
        if have < count:
            random = np.random.default_rng([self.seed, have])
            turns = np.arange(have, count) % len(self.centre)
            points = random.standard_normal((count - have, self.centre.shape[1]))
            points = self.centre[turns] + self._scales[turns, np.newaxis] * points
            self._parts.append((points, *self.run(points)))
        return tuple(np.concatenate(same) for same in zip(*self._parts, strict=True))

    def weights(self, points: Array) -> Array:
        """Return the density of standard normal variables relative to the density of the samples at points (m, n):
        (m,)."""
        return np.asarray(np.exp(-special.logsumexp(self._exponents(points), axis=1)))

    def shares(self, points: Array) -> Array:
        """Return the share of each centre in the samples' density at points (m, n), (m, c)."""
        return np.asarray(special.softmax(self._exponents(points), axis=1))

    def _exponents(self, points: Array) -> Array:
        """Return logarithms of each centre's part in the density of samples, relative to the standard normal density,
        (m, c) at points (m, n); their exponentials add up to the relative density of all samples."""
        centres, scales = self.centre, self._scales
        # |z - c|^2 without the cancellation of large squares for the scale 1
        squares = points @ centres.T - 0.5 * np.sum(centres**2, axis=1)
        size = 0.5 * np.sum(points**2, axis=1)[:, np.newaxis]
        rest = np.where(scales == 1.0, 0.0, size)
        return np.asarray((squares - rest) / scales**2 + rest - points.shape[1] * np.log(scales) - np.log(len(centres)))


def far_branches(form: QuadraticForm, threshold: float, point: Array, probability: float, *, above: bool) -> Array:
    """Return points of a form's limit state on other branches than the most probable point, (m, n), the nearest first.

    A form that bends back reaches the threshold on both sides of the mean along a principal axis. Samples about the
    most probable point never see the other side, so a correction by such samples is wrong by the probability there.
    There are three points at most; none, (0, n), if the mean passes the threshold.

    Parameters
    ----------
    point : (n,)
        The most probable point.
    probability : float
        P(y > threshold), or P(y <= threshold), by the form: sides that are likely by less than a thousandth of this
        probability are left out.
    above : bool
        Whether y > threshold is meant, or y <= threshold.
    """
    values, vectors = np.linalg.eigh(0.5 * (form.hessian + form.hessian.T))
    sign = 1.0 if above else -1.0
    bend, slope, start = sign * values, sign * (vectors.T @ form.gradient), sign * (form.value - threshold)
    if start >= 0.0:
        return np.empty((0, len(slope)))
    back = np.flatnonzero(bend > 0.0)
    root = np.sqrt(slope[back] ** 2 - 2.0 * bend[back] * start)
    places = np.concatenate([(-slope[back] - root) / bend[back], (-slope[back] + root) / bend[back]])
    points = places[:, np.newaxis] * np.tile(vectors[:, back].T, (2, 1))
    distance = np.abs(places)
    likely = special.ndtr(-distance) > UNSEEN * probability
    seen = points @ point > 0.5 * distance * np.linalg.norm(point)
    chosen = np.flatnonzero(likely & ~seen)
    nearest: Array = points[chosen[np.argsort(distance[chosen])[:3]]]
    return nearest


def corrected_tail(
    draws: Draws,
    form: QuadraticForm | None,
    of_form: float,
    threshold: float,
    *,
    above: bool,
    accuracy: float,
    most: int,
) -> ProbabilityEstimate:
    """Estimate P(y > threshold), or P(y <= threshold), by a quadratic form and a correction by samples.

    For a good form both limit states nearly coincide, and their difference needs few samples. Samples alone are used if
    their error is less, as for a bad form. The number of samples doubles until the standard error is half of
    ``accuracy``, relative to the probability, or until twice the number would exceed ``most``. Two additional samples
    between both limit states enter the error, of which none is seen with a chance of an eighth. The result is NaN if a
    sample has no value, or if samples end before that accuracy with weights so unequal that their mean is not normally
    distributed.

    Parameters
    ----------
    draws : Draws
        About a point near the limit state.
    form : QuadraticForm, optional
    of_form : float
        Probability by the quadratic form; 0 without one.
    above : bool
        Whether y > threshold is meant, or y <= threshold.

    References
    ----------
    Hammersley, Handscomb: Monte Carlo Methods (1964), 5.5: control variates; Cochran: Sampling Techniques (1977), 2.15:
    samples for confidence intervals of skewed distributions.
    """
    count = FEWEST
    while True:
        z, y, *_ = draws.first(count)
        count = len(z)
        if np.isnan(y).any():
            return ProbabilityEstimate(float("nan"), float("nan"), count)
        weights = draws.weights(z)
        theirs = (y > threshold) == above
        ours = theirs if form is None else (form.values(z) > threshold) == above
        typical = float(weights[ours].mean()) if ours.any() else float(weights.mean())
        estimates, each = [], [(weights * theirs, 0.0)]
        if form is not None:
            each.append((weights * (1.0 * theirs - 1.0 * ours), of_form))
        for parts, known in each:
            estimate = _mean(parts, known, typical)
            small = float(np.abs(parts).mean()) <= 0.5 * accuracy * estimate.probability
            if small or _is_normal(parts):
                estimates.append(estimate)
        if estimates:
            result = min(estimates, key=lambda estimate: estimate.standard_error)
            if result.standard_error <= 0.5 * accuracy * max(result.probability, 0.1 * of_form) or 2 * count > most:
                return result
        elif 2 * count > most:
            return ProbabilityEstimate(float("nan"), float("nan"), count)
        count *= 2


def _is_normal(parts: Array) -> bool:
    """Return whether the mean of parts (m,) is so nearly normal that 95 % intervals hold at least 94 %."""
    off = parts - parts.mean()
    variance = float(np.mean(off**2))
    return not variance > 0.0 or len(parts) * variance**3 >= LEAST_FOR_SKEWNESS * float(np.mean(off**3)) ** 2


def _mean(parts: Array, known: float, typical: float) -> ProbabilityEstimate:
    """Return a known probability plus the mean of parts (m,); the error includes two more parts of typical size."""
    count = len(parts)
    error = float(np.sqrt((parts.var() + 2.0 * typical**2 / count) / count))
    return ProbabilityEstimate(max(known + float(parts.mean()), 0.0), error, count)
