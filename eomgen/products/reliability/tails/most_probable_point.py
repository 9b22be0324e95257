"""The most probable points at which a response takes given values, which are the nearest to the mean, and samples about
all points of a value.

Samples are drawn about each point, about the mean, and about the mean with so large a deviation that they come as far
as the nearest point: of a region without a point some of these see something. A sample that passes the threshold and is
hardly of the points' own samples starts another search.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np
from scipy import special

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.rounding import COMPUTED
from eomgen.errors import EomgenError, NumericalError
from eomgen.products.reliability.tails.distribution import FEWEST, UNSEEN, Draws
from eomgen.products.reliability.tails.quadratic_form import QuadraticForm, Response, ResponseExpansion

#: The first step along the curve of most probable points, in standard deviations.
_STRIDE = 0.25
#: Largest number of iterations of a search.
_ITERATIONS = 25
#: Tolerance of points next to a jump of the gradient, which stalls the iteration, normal to the limit state.
_ROUGHLY_OFF = 1e-3
#: Reason for the end of a curve.
JUMPING = "where the gradient of the response jumps, as it does if slopes of forces or of the output jump"
#: Searches for further points at most.
_STARTS = 32
#: Distance from the mean, in standard deviations, beyond which no point is sought: P = 8e-24.
FARTHEST = 10.0


@dataclass(frozen=True)
class MostProbablePoint:
    """The point nearest to the mean at which a response takes a value, in the space of standard normal variables.

    Attributes
    ----------
    threshold : the value
    point : (n,), values of the standard normal variables
    multiplier : m of the conditions z + m grad y = 0, y = threshold
    expansion : value, gradient and Hessian of the response there
    iterations : of Newton's method from the point before
    aside : distance to the point that has the direction of the gradient exactly, in standard deviations; 0 but for
        responses whose gradient jumps
    """

    threshold: float
    point: Array
    multiplier: float
    expansion: ResponseExpansion
    iterations: int
    aside: float = 0.0

    @property
    def index(self) -> float:
        """Distance from the mean, positive if the threshold is above the response there (reliability index)."""
        distance = float(np.linalg.norm(self.point))
        return distance if self.multiplier <= 0.0 else -distance

    @property
    def curvatures(self) -> Array:
        """Principal curvatures (n - 1,) of the limit state y = threshold at the point, per standard deviation. Positive
        if y bends down along the surface, so that for a positive index the limit state bends away from the mean."""
        n = len(self.point)
        gradient = self.expansion.gradient
        length = float(np.linalg.norm(gradient))
        normal = gradient / length
        basis = np.linalg.svd(normal[None])[2][1:] if n > 1 else np.zeros((0, n))
        result = np.linalg.eigvalsh(basis @ self.expansion.hessian @ basis.T) / length
        return np.asarray(-result, dtype=float)

    @property
    def nearest(self) -> bool:
        """Whether no point near by has the threshold and lies nearer to the mean."""
        return bool(np.all(1.0 + self.index * self.curvatures > -1e-9))

    @property
    def form(self) -> QuadraticForm:
        """The quadratic form that has the response's value, gradient and Hessian at the point."""
        return self.expansion.form.about(self.point, self.expansion.value)


def first_order(design_point: MostProbablePoint) -> float:
    """Return P(y > threshold) if the limit state is a plane.

    References
    ----------
    Hasofer, Lind: Exact and invariant second-moment code format, J. Eng. Mech. Div. 100 (1974).
    """
    return float(special.ndtr(-design_point.index))


def breitung(design_point: MostProbablePoint) -> float:
    """Return P(y > threshold) by the curvatures of the limit state, for a large index.

    References
    ----------
    Breitung: Asymptotic approximations for multinormal integrals, J. Eng. Mech. 110 (1984), eq. 17.
    """
    return _curvature_corrected_tail(design_point, abs(design_point.index))


def hohenbichler_rackwitz(design_point: MostProbablePoint) -> float:
    """Return P(y > threshold) by the curvatures of the limit state, for smaller indices too.

    References
    ----------
    Hohenbichler, Rackwitz: Improvement of second-order reliability estimates by importance sampling, J. Eng. Mech. 114
    (1988).
    """
    distance = abs(design_point.index)
    density = np.exp(-0.5 * distance**2) / np.sqrt(2.0 * np.pi)
    return _curvature_corrected_tail(design_point, float(density / special.ndtr(-distance)))


def _curvature_corrected_tail(design_point: MostProbablePoint, weight: float) -> float:
    sign = 1.0 if design_point.index >= 0.0 else -1.0
    bent = 1.0 + weight * sign * design_point.curvatures
    if np.any(bent <= 0.0):
        return float("nan")
    tail = float(special.ndtr(-abs(design_point.index)) / np.sqrt(np.prod(bent)))
    return tail if sign > 0 else 1.0 - tail


def points_on_curve(
    response: Response, thresholds: Sequence[float], kinks: Callable[[], object] = bool
) -> tuple[dict[int, MostProbablePoint], dict[int, UnreachedThreshold]]:
    """Return the most probable points and the errors of missing points, each a dict by number of the threshold.

    From the mean the curve of most probable points is followed to both sides in steps of a quarter of a standard
    deviation or more; each point solves z + m g = 0, y = threshold by Newton's method, from the extrapolation of two
    points before it and the curve's slopes. The Hessian of the search starts from the expansion and is corrected by
    gradients (symmetric, of rank one); each result has an exact Hessian, evaluated once. ``kinks`` is called if no
    point is found, and returns reasons why the gradient may jump, so that points count that are off by little.

    References
    ----------
    Allgower, Georg: Introduction to Numerical Continuation Methods (2003), 2 and 7; Conn, Gould, Toint: Convergence of
    quasi-Newton matrices generated by the symmetric rank one update, Math. Prog. 50 (1991).
    """
    start = response.expansion(np.zeros(response.size))
    slope = float(np.linalg.norm(start.gradient))
    origin = MostProbablePoint(start.value, np.zeros(response.size), 0.0, start, 0)
    order = np.argsort(thresholds)
    result: dict[int, MostProbablePoint] = {}
    missed: dict[int, UnreachedThreshold] = {}
    before: MostProbablePoint | None
    flat = "" if slope > 1e-12 * np.linalg.norm(start.hessian) else "since the response has no slope there"
    for side in (1.0, -1.0):
        before, last, ended = None, origin, flat
        chosen = [int(k) for k in order if side * (thresholds[k] - start.value) > 0.0]
        for k in chosen if side > 0 else reversed(chosen):
            if ended:
                missed[k] = UnreachedThreshold(last, float(thresholds[k]), ended)
                continue
            try:
                before, last = _follow_curve(response, before, last, float(thresholds[k]), kinks)
                result[k] = last
            except UnreachedThreshold as error:
                last, missed[k], ended = error.last, error, error.why
    for k, threshold in enumerate(thresholds):
        if threshold == start.value:
            result[k] = origin
    return result, missed


def _why_it_ends(response: Response, last: MostProbablePoint) -> str:
    """Return the reason, in words, why the curve of most probable points ends at `last`: too far from the mean, a
    gradient that jumps next to the point (``JUMPING``), or a bound of the response."""
    if np.linalg.norm(last.point) > FARTHEST:
        return "beyond which nothing is so probable as 1e-23"
    ahead = _ROUGHLY_OFF * last.expansion.gradient / np.linalg.norm(last.expansion.gradient)
    change = response.gradient(last.point + ahead)[1] - response.gradient(last.point - ahead)[1]
    missed = np.linalg.norm(change - 2.0 * last.expansion.hessian @ ahead)
    if missed > 0.5 * np.linalg.norm(change):
        return JUMPING
    return "where the response has its bound or folds"


class UnreachedThreshold(NumericalError):
    """Error for a threshold that the curve of most probable points from the mean does not reach; ``last`` is the last
    point of the curve, ``why`` the reason in words."""

    def __init__(self, last: MostProbablePoint, threshold: float, why: str) -> None:
        far = float(np.linalg.norm(last.point))
        message = f"the curve of most probable points from the mean does not come to {threshold:.6g}: it ends at "
        message += f"{last.threshold:.6g}, {far:.3g} standard deviations out, {why}"
        super().__init__(message, "a threshold nearer to the mean, or Monte Carlo without most probable points")
        self.last, self.why = last, why


def _follow_curve(
    response: Response,
    before: MostProbablePoint | None,
    last: MostProbablePoint,
    threshold: float,
    kinks: Callable[[], object],
) -> tuple[MostProbablePoint, MostProbablePoint]:
    """Follow the curve of most probable points from `last` to a threshold; return the previous point and the point of
    the threshold. `before` is the point before `last` on the curve, or None. Steps are halved if Newton's method fails;
    then ``kinks`` says whether to accept points next to jumps of the gradient with reduced accuracy. Raises
    UnreachedThreshold if the steps become too small, or the points too far from the mean."""
    stride = _STRIDE
    while True:
        slope = float(np.linalg.norm(last.expansion.gradient))
        rest = threshold - last.threshold
        ahead = np.sign(rest) * min(abs(rest), stride * slope)
        wanted = last.threshold + ahead if abs(ahead) < abs(rest) else threshold
        rough = last.aside > 0.0 or (stride < 0.3 * _STRIDE and bool(kinks()))
        reached = _newton(response, before, last, wanted, rough=rough)
        if reached is None:
            stride *= 0.5
            if stride < 1e-3 * _STRIDE:
                raise UnreachedThreshold(last, threshold, _why_it_ends(response, last))
            continue
        if reached.threshold == threshold:
            return last, reached
        if np.linalg.norm(reached.point) > FARTHEST:
            raise UnreachedThreshold(reached, threshold, _why_it_ends(response, reached))
        before, last = last, reached
        if reached.aside:
            stride = _STRIDE
        elif reached.iterations <= 3:
            stride = min(2.0 * stride, 1.0)


def _rates(at: MostProbablePoint) -> Array:
    """Return the derivatives of the point and the multiplier by the threshold, (n + 1,)."""
    n = len(at.point)
    system = _system(at.multiplier, at.expansion.gradient, at.expansion.hessian)
    return np.linalg.solve(system, np.append(np.zeros(n), 1.0))


def _system(multiplier: float, gradient: Array, hessian: Array) -> Array:
    """Return the matrix of Newton's steps of z + m g = 0, y = threshold, (n + 1, n + 1)."""
    n = len(gradient)
    system = np.zeros((n + 1, n + 1))
    system[:n, :n] = np.eye(n) + multiplier * hessian
    system[:n, n] = system[n, :n] = gradient
    return system


def _extrapolate(
    before: MostProbablePoint | None, last: MostProbablePoint, threshold: float
) -> tuple[Array, float, Array]:
    """Return a point (n,), a multiplier and a Hessian (n, n) extrapolated along the curve to a threshold, to start
    Newton's method. The point and the multiplier follow values and slopes at both points (Hermite), the Hessian the
    line through both. If ``before`` is None or too close to ``last``, the slope at ``last`` alone and its Hessian are
    taken."""
    here, rate = np.append(last.point, last.multiplier), _rates(last)
    hessian = last.expansion.hessian.copy()
    ahead = threshold - last.threshold
    span = 0.0 if before is None else last.threshold - before.threshold
    if before is None or not 0.0 < ahead / span <= 10.0:
        result = here + ahead * rate
        return result[:-1], float(result[-1]), hessian
    t, there, slope = 1.0 + ahead / span, np.append(before.point, before.multiplier), _rates(before)
    of_end, of_start = t * t * (3.0 - 2.0 * t), (t - 1.0) ** 2 * (1.0 + 2.0 * t)
    result = of_start * there + of_end * here + span * t * (t - 1.0) * ((t - 1.0) * slope + t * rate)
    return result[:-1], float(result[-1]), hessian + (t - 1.0) * (hessian - before.expansion.hessian)


def _newton(
    response: Response,
    before: MostProbablePoint | None,
    last: MostProbablePoint,
    threshold: float,
    *,
    rough: bool = False,
) -> MostProbablePoint | None:
    """Return the most probable point of a threshold, continued from another; None if Newton's method fails.

    ``rough``: whether to accept the larger tolerances of points next to jumps of the gradient.

    A gradient costs a run and an adjoint run, a Hessian as many tangents as there are variables: so the Hessian is
    corrected by the change of the gradient along each step, and evaluated again after many iterations.
    """
    n = len(last.point)
    at, slope = last.point, last.expansion.gradient
    try:
        z, multiplier, hessian = _extrapolate(before, last, threshold)
        for iteration in range(1, _ITERATIONS + 1):
            moved = z - at
            length = float(np.linalg.norm(moved))
            if not length <= 2.0:
                return None
            value, gradient = response.gradient(z)
            close = iteration > 1 and length <= 1e-10 * (1.0 + np.linalg.norm(z))
            aside, steep = (float(np.linalg.norm(part)) for part in (z + multiplier * gradient, gradient))
            off = abs(value - threshold)
            # the distance is off by the square of the lateral part; rounding of large values counts, too
            if close or (aside <= 3e-8 and off <= COMPUTED * steep + 1e-14 * abs(threshold)):
                return MostProbablePoint(threshold, z, multiplier, response.expansion(z), iteration)
            hit = off <= _ROUGHLY_OFF * steep
            if rough and hit and aside <= 0.02:
                return MostProbablePoint(threshold, z, multiplier, response.expansion(z), iteration, aside)
            if iteration % 6 == 0:
                hessian = response.expansion(z).hessian.copy()
            else:
                missed = gradient - slope - hessian @ moved
                along = float(missed @ moved)
                if abs(along) > 1e-8 * length * float(np.linalg.norm(missed)):
                    hessian += np.outer(missed, missed) / along
            at, slope = z, gradient
            system = _system(multiplier, gradient, hessian)
            step = np.linalg.solve(system, -np.append(z + multiplier * gradient, value - threshold))
            z, multiplier = z + step[:n], multiplier + float(step[n])
    except np.linalg.LinAlgError:
        return None
    return None


def further_design_points(response: Response, design_point: MostProbablePoint, seed: int) -> list[MostProbablePoint]:
    """Return other most probable points of the same threshold, less than one standard deviation farther from the mean
    than the design point, the nearest first.

    A bistable system has several such points, and the probability is then some sum of the contributions. The search
    starts from the mirrored point and random directions at the same distance, by the method of Hasofer and Lind with
    Newton's at the end, until half a point or less is expected to be unseen; a search without result is not a proof.

    References
    ----------
    Boender, Rinnooy Kan: Bayesian stopping rules for multistart global optimization methods, Math. Prog. 37 (1987).
    """
    random = np.random.default_rng(seed)
    distance = float(np.linalg.norm(design_point.point))

    def begins(points: Sequence[MostProbablePoint]) -> Iterator[Array]:
        for begun in range(_STARTS):
            if _unseen_points(begun, len(points)) <= 0.5:
                return
            direction = random.standard_normal(len(design_point.point)) if begun else -design_point.point
            yield distance * direction / np.linalg.norm(direction)

    return _search(response, design_point.threshold, begins, [design_point], distance + 1.0, _STRIDE)


def _search(
    response: Response,
    threshold: float,
    begins: Callable[[Sequence[MostProbablePoint]], Iterable[Array]],
    known: Sequence[MostProbablePoint],
    farthest: float,
    distance: float,
) -> list[MostProbablePoint]:
    """Return the points of a threshold that searches find in addition to known ones, the nearest to the mean first.
    `begins` returns the starts, given the list of points, which grows; points beyond ``farthest`` from the mean, or
    nearer to another than `distance`, are left out."""
    points = list(known)
    for begin in begins(points):
        point = descend(response, begin, threshold, points)
        if point is None or np.linalg.norm(point.point) > farthest:
            continue
        if all(np.linalg.norm(point.point - neighbour.point) > distance for neighbour in points):
            points.append(point)
    return sorted(points[len(known) :], key=lambda point: float(np.linalg.norm(point.point)))


def _unseen_points(starts: int, points: int) -> float:
    """Return the expected number of points that so many searches have not come to."""
    return points * (starts - 1) / (starts - points - 2) - points if starts > points + 2 else np.inf


def descend(
    response: Response, begin: Array, threshold: float, known: Sequence[MostProbablePoint]
) -> MostProbablePoint | None:
    """Return a most probable point found from a start by steps of at most one standard deviation, or None.

    None if the steps come to a known point or end much farther out than the first known point (10 standard deviations
    without known points), if the response has no slope, or if Newton's method at the end fails.

    Parameters
    ----------
    response : Response
        y as a function of standard normal variables.
    begin : (n,) ndarray
        Start of the search.
    threshold : float
        Value of y at the point.
    known : sequence of MostProbablePoint
        Points of earlier searches.
    """
    farthest = min([np.linalg.norm(design_point.point) + 1.0 for design_point in known[:1]], default=FARTHEST)
    z = begin
    for _ in range(_ITERATIONS):
        value, gradient = response.gradient(z)
        square = float(gradient @ gradient)
        if not square > 0.0:
            return None
        step = (gradient @ z - value + threshold) / square * gradient - z
        length = float(np.linalg.norm(step))
        z = z + step * min(1.0, 1.0 / max(length, 1e-300))
        if any(np.linalg.norm(z - design_point.point) < _STRIDE for design_point in known):
            return None
        if length < _STRIDE:
            break
    if np.linalg.norm(z) > farthest + _STRIDE:
        return None
    here = response.expansion(z)
    square = float(here.gradient @ here.gradient)
    if not square > 0.0:
        return None
    multiplier = -float(here.gradient @ z) / square
    return _newton(response, None, MostProbablePoint(here.value, z, multiplier, here, 0), threshold)


def draws_about(run: Callable[[Array], tuple[Array, ...]], centres: Array, seed: int) -> Draws:
    """Return samples about centres (c, n), about the mean, and about the mean with a deviation that reaches these.

    References
    ----------
    Owen, Zhou: Safe and effective importance sampling, J. Am. Stat. Assoc. 95 (2000): defensive mixtures.
    """
    count, size = centres.shape
    times = -(-4 // count)  # samples about the points for each one about the mean, at least
    reach = max(1.0, float(np.linalg.norm(centres, axis=1).min()) / np.sqrt(size))
    means = np.vstack([*([centres] * times), np.zeros((2, size))])
    return Draws(run, means, seed, np.append(np.ones(len(means) - 1), reach))


def all_centres(
    response: Response, points: Sequence[Array], threshold: float, *, above: bool, seed: int
) -> tuple[Array, Draws | None]:
    """Return points (c, n) about which the response passes a threshold, and samples about all of them.

    Samples far from known points that pass the threshold start searches for further points, which end by the rule in
    ``further_design_points``. The points are (0, n) and the samples None if no point is known or found.

    Parameters
    ----------
    response : Response
    points : sequence of (n,)
        Known points; if empty, samples look for a first one.
    threshold : float
    above : bool
        Whether y > threshold is the passage, or y <= threshold.
    seed : int
        Of the samples.
    """
    centres = np.array(points) if points else _first_centre(response, threshold, above=above, seed=seed)
    if not len(centres):
        return centres, None
    searches = 0
    while True:
        draws = draws_about(lambda z: (response.values(z),), centres, seed)
        z, y, *_ = draws.first(FEWEST)
        passed = np.where(np.isnan(y), False, (y > threshold) == above)
        parts = draws.weights(z) * passed
        total = float(parts.sum())
        share = draws.shares(z)[:, :-2].sum(axis=1)
        order = np.argsort(-parts)
        new: Array | None = None
        for k in order[(parts[order] > 0.02 * total) & (share[order] < 0.5)].tolist():
            if searches == _STARTS or _unseen_points(searches, len(centres)) <= 0.5:
                break
            searches += 1
            nearest = _nearest(response, z[k], threshold, above=above)
            likely = special.ndtr(-np.linalg.norm(nearest)) > UNSEEN * total / len(z)
            if likely and np.linalg.norm(centres - nearest, axis=1).min() > 1.0:
                new = nearest
                break
        if new is None:
            return centres, draws
        centres = np.vstack([centres, new])


def _first_centre(response: Response, threshold: float, *, above: bool, seed: int) -> Array:
    """Return a point that passes a threshold, (1, n), by samples about the mean whose deviation is doubled until one
    passes; (0, n) if none does. `above` says whether y > threshold is the passage, or y <= threshold."""
    reach = 1.0
    while reach * np.sqrt(response.size) <= max(FARTHEST, np.sqrt(response.size)):
        draws = Draws(lambda z: (response.values(z),), np.zeros(response.size), seed, np.array([reach]))
        z, y, *_ = draws.first(FEWEST)
        passed = z[np.where(np.isnan(y), False, (y > threshold) == above)]
        if len(passed):
            first = passed[np.argmin(np.linalg.norm(passed, axis=1))]
            return _nearest(response, first, threshold, above=above)[np.newaxis]
        reach *= 2.0
    return np.empty((0, response.size))


def _nearest(response: Response, point: Array, threshold: float, *, above: bool) -> Array:
    """Return a point (n,) nearer to the mean that just passes a threshold, given a point that passes. The result is the
    most probable point if a search finds one, else the first place on the ray from the mean to ``point`` that passes.
    `above` says whether y > threshold is the passage, or y <= threshold."""
    parts = 1 + int(np.linalg.norm(point) / _STRIDE)
    ray = np.linspace(0.0, 1.0, parts + 1)[1:, np.newaxis] * point
    y = response.values(ray)
    first = int(np.argmax((y > threshold) == above))
    begin: Array = ray[first]
    try:
        nearest = descend(response, begin, threshold, [])
    except EomgenError:  # a run without derivatives there
        nearest = None
    return begin if nearest is None else nearest.point


def searched_points(response: Response, threshold: float, starts: int, seed: int) -> list[MostProbablePoint]:
    """Return most probable points of a threshold, the nearest to the mean first; an empty list if no search succeeds.
    Searches start at a distance of one standard deviation from the mean, in random directions, ``starts`` in number,
    and their opposites."""
    directions = np.random.default_rng(seed).standard_normal((starts, response.size))
    directions /= np.linalg.norm(directions, axis=1)[:, np.newaxis]
    begins = np.concatenate([directions, -directions])
    return _search(response, threshold, lambda _: begins, [], np.inf, 1.0)
