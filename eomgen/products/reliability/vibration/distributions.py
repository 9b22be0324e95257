"""Distributions by each method: of quadratic forms, at most probable points, of samples."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from eomgen.base.arrays import Array
from eomgen.base.limits import Limit
from eomgen.products.reliability.tails.distribution import (
    FEWEST,
    Draws,
    ProbabilityEstimate,
    corrected_tail,
    far_branches,
    importance_sampling,
    lugannani_rice,
    steepest_descent,
)
from eomgen.products.reliability.tails.most_probable_point import (
    JUMPING,
    MostProbablePoint,
    UnreachedThreshold,
    all_centres,
    breitung,
    descend,
    first_order,
    further_design_points,
    hohenbichler_rackwitz,
)
from eomgen.products.reliability.tails.quadratic_form import Response
from eomgen.products.reliability.vibration.result import Distribution
from eomgen.products.reliability.vibration.run_response import RunResponse, chance_of

#: Accuracy of probabilities that samples correct, relative; samples about a most probable point at most, and half of
#: the samples about the mean. A form that is good needs 200.
ACCURACY, _MOST = 0.1, 4000
FEWEST_SEEN = Limit(
    10.0, "1", "samples in a region that give its probability", "standard error of a count: 1 / sqrt(10) of it"
)
_CHANCE = Limit(
    1e-4,
    "1",
    "chance of samples about the mean by which these contradict a probability",
    "one false contradiction in 100 runs with 100 thresholds",
)
_SURE = Limit(3.0, "1", "difference of a form and samples in standard errors", "chance of 0.3 %")
_LIKE = Limit(
    2.0 * ACCURACY, "1", "difference of a form and samples in parts of the probability", "twice the accuracy of samples"
)


def at_points(reached: Sequence[MostProbablePoint]) -> dict[str, Distribution]:
    """Return the distributions by each method at the thresholds of most probable points, by name."""
    forms, thresholds = [point.form for point in reached], [point.threshold for point in reached]
    upper = {"form": first_order, "breitung": breitung, "hohenbichler_rackwitz": hohenbichler_rackwitz}
    tails = {name: np.array([of(point) for point in reached]) for name, of in upper.items()}
    result = {name: Distribution.without_samples(1.0 - above, above) for name, above in tails.items()}
    for name, inversion in (("lugannani_rice", lugannani_rice), ("quadratic", steepest_descent)):
        result[name] = Distribution.without_samples(*inversion(forms, thresholds))
    return result


def further_points(
    response: Response, reached: Sequence[MostProbablePoint], seed: int
) -> tuple[dict[int, list[MostProbablePoint]], list[str]]:
    """Return further most probable points by number of the reached threshold, and notes on points that are not nearest.
    The numbers are places in ``reached``; some are missing if there are no others. Points are searched for at the first
    and the last threshold, and from these followed to thresholds on the same side of the mean."""
    notes, others = [], {}
    if not reached:
        return {}, []
    for design_point in reached:
        if not design_point.nearest and not design_point.aside:  # Hessians miss jumps of the gradient
            threshold = f"{design_point.threshold:.6g}"
            notes.append(f"the most probable point of {threshold} is not the nearest one: trust samples there [W0058]")
    ends = dict.fromkeys((0, len(reached) - 1))
    for k in ends:
        others[k] = further_design_points(response, reached[k], seed)
    for k, design_point in enumerate(reached):
        near = [end for end in ends if others[end] and reached[end].index * design_point.index > 0.0]
        if k not in ends and near:
            share = design_point.index / reached[near[0]].index
            points = (
                descend(response, share * start.point, design_point.threshold, [design_point])
                for start in others[near[0]]
            )
            others[k] = [point for point in points if point is not None]
    return others, notes


def why_gradient_changes(kinks: Sequence[str]) -> str:
    """Return the reason why a curve ends at a point near which the gradient changes more than the Hessian predicts.

    Parameters
    ----------
    kinks : operations of the scene at which slopes jump, in words
    """
    if kinks:
        return f"{JUMPING}: by {', '.join(kinks)}"
    return (
        "where the gradient of the response changes more than its Hessian predicts, as near a saddle from which motions"
        " part (no jump of slopes was found in formulas)"
    )


def notes_on_unreached(
    missed: Mapping[int, UnreachedThreshold], thresholds: Array, kinks: Callable[[], Sequence[str]]
) -> list[str]:
    """Return notes on thresholds that have no most probable point, one for each end of the curve of these points.
    `missed` are the errors by number of the threshold, and ``kinks`` returns the operations of the scene at which
    slopes jump, in words."""
    ends: dict[int, list[int]] = {}
    for k in sorted(missed, key=lambda k: float(thresholds[k])):
        ends.setdefault(id(missed[k].last), []).append(k)
    notes = []
    for places in ends.values():
        last, why = missed[places[0]].last, missed[places[0]].why
        if why == JUMPING:
            why = why_gradient_changes(kinks())
        names = ", ".join(f"{thresholds[k]:.6g}" for k in places)
        far = float(np.linalg.norm(last.point))
        notes.append(
            f"the curve of most probable points ends at {last.threshold:.6g}, {far:.3g} standard deviations out,"
            f" {why}: {names} have none, trust samples there [W0060]"
        )
    return notes


def correct_by_samples(
    response: Response,
    thresholds: Array,
    reached: Mapping[int, MostProbablePoint],
    forms: Distribution,
    about_mean: Draws,
    others: Mapping[int, Sequence[MostProbablePoint]],
    seed: int,
) -> tuple[Distribution, list[str]]:
    """Return probabilities of quadratic forms corrected by samples, with bounds of 95 % confidence, and notes.

    Samples are drawn about all points of a threshold, about the far branches of forms that bend back, about the mean
    and farther about the mean; thresholds near the mean, whose regions are too wide for local samples, have common
    samples about the mean. A probability whose samples are too unequal for bounds is counted about the mean, or NaN,
    with a note. The result has all thresholds, (n,).

    Parameters
    ----------
    thresholds : (n,), values of the output
    reached, others : most probable point, and further points, by index of a threshold; thresholds without a point have
        samples alone
    forms : by the quadratic forms at most probable points, NaN at other thresholds
    about_mean : common samples about the mean
    seed : of the samples about points of the first threshold
    """
    uppers, tails = np.zeros(len(thresholds), dtype=bool), np.zeros((len(thresholds), 3))
    several, unknown = [], []
    indices = {k: abs(point.index) for k, point in reached.items()}
    for k in sorted(range(len(thresholds)), key=lambda k: indices.get(k, np.inf)):  # near points first
        threshold, design_point = float(thresholds[k]), reached.get(k)
        upper = _is_upper(about_mean, threshold) if design_point is None else bool(forms.above[k] <= forms.below[k])
        of_form = 0.0 if design_point is None else float(np.fmin(forms.above[k], forms.below[k]))
        form = None if design_point is None else design_point.form
        best = ProbabilityEstimate(np.nan, np.nan, 0)
        if indices.get(k, np.inf) < 1.5:  # near enough to the mean for samples about it
            best = corrected_tail(about_mean, form, of_form, threshold, above=upper, accuracy=ACCURACY, most=2 * _MOST)
        if np.isnan(best.probability):
            points = [point.point for point in ([] if design_point is None else [design_point, *others.get(k, ())])]
            if design_point is not None:
                points += [*far_branches(design_point.form, threshold, design_point.point, of_form, above=upper)]
            centres, draws = all_centres(response, points, threshold, above=upper, seed=seed + k)
            if draws is not None:
                best = corrected_tail(draws, form, of_form, threshold, above=upper, accuracy=ACCURACY, most=_MOST)
            if len(centres) > 1:
                several.append((k, len(centres)))
        bound = 1.96 * best.standard_error
        tail = min(best.probability, 1.0), max(best.probability - bound, 0.0), min(best.probability + bound, 1.0)
        if not bound <= best.probability:
            tail = _count_tail(about_mean, threshold, above=upper)
        if np.isnan(tail[0]):
            unknown.append(k)
        uppers[k], tails[k] = upper, tail
    return Distribution.from_tails(uppers, *tails.T), _notes_on_regions(thresholds, sorted(several), sorted(unknown))


def _is_upper(about_mean: Draws, threshold: float) -> bool:
    """Return whether most samples about the mean do not exceed a threshold."""
    return bool(np.nanmedian(about_mean.first(FEWEST)[1]) <= threshold)


def _notes_on_regions(thresholds: Array, several: Sequence[tuple[int, int]], unknown: Sequence[int]) -> list[str]:
    notes = []
    if several:
        names = ", ".join(f"{thresholds[k]:.6g} ({count})" for k, count in several)
        notes.append(
            f"several regions lead to {names}: `corrected` counts all that were found, other methods one of"
            f" them [W0267]"
        )
    if unknown:
        names = ", ".join(f"{thresholds[k]:.6g}" for k in unknown)
        notes.append(
            f"no `corrected` probability of {names}: samples that pass it are too few, or too unequal, for bounds; try:"
            " samples=... (--monte-carlo) [W0268]"
        )
    return notes


def _count_tail(about_mean: Draws, threshold: float, *, above: bool) -> tuple[float, float, float]:
    """Return P(y > threshold), or P(y <= threshold) if not `above`, and bounds of 95 % confidence, by counts of samples
    about the mean; three NaN if fewer than ten are counted or a sample failed."""
    _, y, *_ = about_mean.first(2 * _MOST)
    seen = int(np.count_nonzero((y > threshold) == above))
    if np.isnan(y).any() or seen < FEWEST_SEEN:
        return np.nan, np.nan, np.nan
    low, high = _bounds(seen, len(y))
    return seen / len(y), float(low), float(high)


def counted_instead(wanted: Array, distribution: Distribution, about_mean: Draws) -> tuple[Distribution, list[str]]:
    """Return a corrected distribution with some probabilities replaced by counts of samples about the mean, and notes.
    They are replaced, with their bounds, if the counts contradict them: other regions contribute then. `wanted` (n,)
    are the thresholds. The given distribution is not changed."""
    z, y, *_ = about_mean.first(FEWEST)
    count, notes = len(z), []
    below, above, low, high = (part.copy() for part in vars(distribution).values())
    for k, threshold in enumerate(wanted.tolist()):
        if np.isnan(below[k]) or np.isnan(y).any():
            continue
        upper = above[k] <= 0.5
        seen = int(np.count_nonzero(y > threshold) if upper else np.count_nonzero(y <= threshold))
        least, most = (1.0 - high[k], 1.0 - low[k]) if upper else (low[k], high[k])
        if chance_of(seen, count, least, most) > _CHANCE:
            continue
        sign, told = (">", above[k]) if upper else ("<=", below[k])
        share = seen / count
        notes.append(
            f"P(y {sign} {threshold:.6g}) is {told:.3g} by samples about its most probable point, but {share:.3g} by"
            f" {count} samples about the mean: other regions contribute, and the latter is taken [W0061]"
        )
        below[k], above[k] = (1.0 - share, share) if upper else (share, 1.0 - share)
        under = count - seen if upper else seen
        low[k], high[k] = _bounds(under, count)
    return Distribution(below, above, low, high), notes


def relative_errors(distribution: Distribution, true: Distribution) -> Array:
    """Return the error of a distribution at each threshold, relative to the true probability on the less probable
    side."""
    upper = true.above <= 0.5
    ours, theirs = np.where(upper, distribution.above, distribution.below), np.where(upper, true.above, true.below)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray((ours - theirs) / theirs)


def doubts_of_forms(thresholds: Array, errors: Mapping[str, Array], true: Distribution) -> list[str]:
    """Return notes on quadratic forms that are off by more than a tenth, and on corrections that are not accurate.
    `errors` (n,) by method, with "quadratic" and "form", are relative to the corrected distribution ``true`` at the
    thresholds (n,)."""
    notes = []
    off, of_form = np.nan_to_num(np.abs(errors["quadratic"])), errors["form"]
    tail = np.fmin(true.below, true.above)
    with np.errstate(divide="ignore", invalid="ignore"):
        spread = 0.5 * (true.high - true.low) / tail
    worst = int(np.argmax(off))
    if off[worst] > ACCURACY and off[worst] > spread[worst]:
        notes.append(
            f"probabilities of `quadratic` are off by up to {100.0 * off[worst]:.2g} %, at {thresholds[worst]:.6g}"
            f" ({100.0 * errors['quadratic'][worst]:+.2g} %; `form` {100.0 * of_form[worst]:+.2g} %): take"
            f" `corrected` [W0062]"
        )
    vague = [k for k in range(len(spread)) if spread[k] > 1.5 * ACCURACY]
    if vague:
        names = ", ".join(f"{thresholds[k]:.6g} (+- {100.0 * spread[k]:.2g} %)" for k in vague)
        hint = "samples=... or tail_samples=... (--monte-carlo, --tail-samples)"
        notes.append(f"`corrected` probabilities are known less well at {names}; try: {hint} [W0063]")
    return notes


def disagreements(thresholds: Array, form: Distribution, counted: Distribution, ending: str) -> dict[int, str]:
    """Return sentences on thresholds at which a form and samples differ significantly, by number of the threshold. Each
    has the probabilities of both on the less probable side, and the ending; the standard error follows from the bounds
    of `counted`, the distribution by samples."""
    result = {}
    for k, threshold in enumerate(thresholds.tolist()):
        side, sign = ("above", ">") if counted.above[k] <= 0.5 else ("below", "<=")
        ours, theirs = float(getattr(form, side)[k]), float(getattr(counted, side)[k])
        error = 0.5 * float(counted.high[k] - counted.low[k]) / 1.96
        if abs(ours - theirs) > _SURE * error + _LIKE * max(ours, theirs):
            told = f"is {ours:.3g} by the quadratic form and {theirs:.2g} +- {error:.1g} by {ending}"
            result[k] = f"P(y {sign} {threshold:.6g}) {told}"
    return result


def without(distribution: Distribution, places: Collection[int]) -> Distribution:
    """Return a distribution with values at some thresholds replaced by not a number."""
    below, above = distribution.below.copy(), distribution.above.copy()
    below[list(places)] = above[list(places)] = np.nan
    return Distribution(below, above, distribution.low, distribution.high)


def spread(distribution: Distribution, places: Sequence[int], count: int) -> Distribution:
    """Return a distribution at `count` thresholds from one at the thresholds ``places``, NaN at the others; empty
    bounds stay empty."""

    def wide(values: Array) -> Array:
        result = np.full(count, np.nan)
        result[list(places)] = values
        return result

    return Distribution(*(wide(part) if len(part) else part for part in vars(distribution).values()))


def tails_of(response: RunResponse, reached: Sequence[MostProbablePoint], samples: int, seed: int) -> Distribution:
    """Estimate the probabilities below and above thresholds by importance sampling about most probable points.

    The result has one value for each point, with bounds of 95 % confidence of the probability below.

    Parameters
    ----------
    response : RunResponse
        Output of a run as a function of standard normal variables.
    reached : sequence of MostProbablePoint
        One for each threshold.
    samples, seed : int
        Number of samples for each threshold, and seed of the first.
    """
    upper = np.array([point.index >= 0.0 for point in reached])
    estimates = [
        importance_sampling(response, point.point, point.threshold, above=above, samples=samples, seed=seed + k)
        for k, (point, above) in enumerate(zip(reached, upper.tolist(), strict=True))
    ]
    tail, spread, _ = np.array(estimates).T * np.array([[1.0], [1.96], [1.0]])
    return Distribution.from_tails(upper, tail, tail - spread, tail + spread)


def empirical_distribution(y: Array, thresholds: Array) -> tuple[Distribution, tuple[float, float, float, float]]:
    """Return the empirical distribution of samples y (m,) at thresholds (n,), and the moments. Bounds are of 95 %
    confidence (Clopper and Pearson). The moments are mean, standard deviation, skewness and excess kurtosis, the last
    two NaN for equal samples."""
    count = len(y)
    under = np.array([np.count_nonzero(y <= threshold) for threshold in thresholds])
    low, high = _bounds(under, count)
    below = under / count
    mean, deviation = float(y.mean()), float(y.std())
    shape = (np.nan, np.nan)
    if np.ptp(y) > 0.0:
        scaled = (y - mean) / deviation
        shape = float(np.mean(scaled**3)), float(np.mean(scaled**4)) - 3.0
    moments = mean, deviation, *shape
    return Distribution(below, 1.0 - below, low, high), moments


def _bounds(under: ArrayLike, count: int) -> tuple[Array, Array]:
    """Return bounds of 95 % confidence of a probability whose event came ``under`` times among ``count`` samples.

    References
    ----------
    Clopper, Pearson: The use of confidence or fiducial limits, Biometrika 26 (1934).
    """
    under = np.asarray(under, dtype=float)
    with np.errstate(invalid="ignore"):
        low = np.where(under > 0, special.betaincinv(under, count - under + 1.0, 0.025), 0.0)
        high = np.where(under < count, special.betaincinv(under + 1.0, count - under, 0.975), 1.0)
    return low, high
