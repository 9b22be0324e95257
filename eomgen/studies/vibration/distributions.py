"""Distributions by each method: of quadratic forms, at most probable points, of samples."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np
from scipy import special

from eomgen.arrays import Array
from eomgen.reliability import (
    INVERSIONS,
    MostProbablePoint,
    QuadraticForm,
    Response,
    Unreached,
    breitung,
    first_order,
    hohenbichler_rackwitz,
    importance_sampling,
    rivals,
    why_it_ends,
)
from eomgen.studies.vibration.findings import Distribution
from eomgen.studies.vibration.run_response import RunResponse

#: Directions in which a second most probable point is looked for.
_DIRECTIONS = 2
#: Standard errors of samples, and share of the probability, by which a form may be off.
_SURE, _LIKE = 3.0, 0.2
_NONE: Array = np.zeros(0)


def moments_of(form: QuadraticForm) -> tuple[float, float, float, float]:
    return form.mean, form.standard_deviation, form.skewness, form.excess_kurtosis


def of_form(form: QuadraticForm, thresholds: Array) -> Distribution:
    tails = INVERSIONS["steepest_descent"](form, thresholds)
    return Distribution(tails.below, tails.above, _NONE, _NONE)


def at_points(reached: Sequence[MostProbablePoint]) -> dict[str, Distribution]:
    forms, thresholds = [one.form for one in reached], [one.threshold for one in reached]
    found = {
        "form": _of_upper([first_order(one) for one in reached]),
        "breitung": _of_upper([breitung(one) for one in reached]),
        "hohenbichler_rackwitz": _of_upper([hohenbichler_rackwitz(one) for one in reached]),
    }
    for name, inversion in (("lugannani_rice", "lugannani_rice"), ("quadratic", "steepest_descent")):
        tails = INVERSIONS[inversion](forms, thresholds)
        found[name] = Distribution(tails.below, tails.above, _NONE, _NONE)
    return found


def _of_upper(above: Sequence[float]) -> Distribution:
    upper = np.array(above)
    return Distribution(1.0 - upper, upper, _NONE, _NONE)


def doubts_of(response: Response, reached: Sequence[MostProbablePoint], seed: int) -> list[str]:
    """Return notes on most probable points that are not the nearest ones, or not the only ones."""
    notes = []
    for one in reached:
        if not one.nearest:
            notes.append(f"the most probable point of {one.threshold:.6g} is no nearest one: trust samples there")
    for one in {id(one): one for one in (reached[0], reached[-1])}.values():
        others = rivals(response, one, _DIRECTIONS, seed)
        if others:
            far = float(np.linalg.norm(others[0].point))
            notes.append(
                f"{one.threshold:.6g} has another most probable point, {far:.3g} standard deviations out beside"
                f" {abs(one.index):.3g}: probabilities of one point are too small there, samples count both"
            )
    return notes


def unreached(missed: Mapping[int, Unreached], thresholds: Array) -> list[str]:
    """Return notes on thresholds that have no most probable point, one for each end of the curve of these."""
    ends: dict[int, list[int]] = {}
    for k in sorted(missed, key=lambda k: float(thresholds[k])):
        ends.setdefault(id(missed[k].last), []).append(k)
    notes = []
    for places in ends.values():
        last = missed[places[0]].last
        names = ", ".join(f"{thresholds[k]:.6g}" for k in places)
        far = float(np.linalg.norm(last.point))
        notes.append(
            f"the curve of most probable points ends at {last.threshold:.6g}, {far:.3g} standard deviations out,"
            f" {why_it_ends(last)}: {names} have none, trust samples there"
        )
    return notes


def disagreements(reached: Sequence[MostProbablePoint], form: Distribution, sampled: Distribution) -> dict[int, str]:
    """Return by place the thresholds whose quadratic form gives another probability than samples about their point."""
    sides = ["above" if one.index >= 0.0 else "below" for one in reached]
    found = _apart([one.threshold for one in reached], sides, form, sampled)
    ending = "samples: the response is no quadratic form there, which is left out; trust samples"
    return {k: f"{text} by {ending}" for k, text in found.items()}


def against_samples(wanted: Array, form: Distribution, counted: Distribution) -> dict[int, str]:
    """Return by place the thresholds whose quadratic form gives another probability than samples of the whole
    distribution, on the side where there are fewer."""
    sides = ["above" if above <= 0.5 else "below" for above in counted.above]
    found = _apart(wanted.tolist(), sides, form, counted)
    return {k: f"{text} by Monte Carlo: the form is left out, trust samples" for k, text in found.items()}


def _apart(
    thresholds: Sequence[float], sides: Sequence[str], form: Distribution, counted: Distribution
) -> dict[int, str]:
    """Return by place what a form and samples give, where these are apart."""
    found = {}
    for k, (threshold, side) in enumerate(zip(thresholds, sides, strict=True)):
        ours, theirs = float(getattr(form, side)[k]), float(getattr(counted, side)[k])
        error = 0.5 * float(counted.high[k] - counted.low[k]) / 1.96
        if abs(ours - theirs) > _SURE * error + _LIKE * max(ours, theirs):
            sign = ">" if side == "above" else "<="
            found[k] = (
                f"P(y {sign} {threshold:.6g}) is {ours:.3g} by the quadratic form and {theirs:.2g} +- {error:.1g}"
            )
    return found


def without(one: Distribution, places: Collection[int]) -> Distribution:
    """Return a distribution that is not a number at some thresholds."""
    below, above = one.below.copy(), one.above.copy()
    below[list(places)] = above[list(places)] = np.nan
    return Distribution(below, above, one.low, one.high)


def spread(one: Distribution, places: Sequence[int], count: int) -> Distribution:
    """Return a distribution of all thresholds, not a number where one has no point."""

    def wide(values: Array) -> Array:
        found = np.full(count, np.nan)
        found[list(places)] = values
        return found

    return Distribution(*(wide(part) if len(part) else part for part in (one.below, one.above, one.low, one.high)))


def tails_of(
    response: RunResponse, reached: Sequence[MostProbablePoint], samples: int, seed: int, *, nearest: float = 0.0
) -> Distribution:
    """Return probabilities by samples about most probable points; about the mean of those nearer to it, whose regions
    are too wide for samples elsewhere."""
    below, above, low, high = (np.empty(len(reached)) for _ in range(4))
    for k, one in enumerate(reached):
        upper = one.index >= 0.0
        centre = one.point if abs(one.index) >= nearest else 0.0 * one.point
        estimate = importance_sampling(response, centre, one.threshold, above=upper, samples=samples, seed=seed + k)
        tail, spread = estimate.probability, 1.96 * estimate.standard_error
        above[k] = tail if upper else 1.0 - tail
        below[k] = 1.0 - tail if upper else tail
        low[k], high[k] = below[k] - spread, below[k] + spread
    return Distribution(below, above, low, high)


def of_samples(y: Array, thresholds: Array) -> tuple[Distribution, tuple[float, float, float, float]]:
    """Return the empirical distribution with bounds of Clopper and Pearson, and moments."""
    count = len(y)
    under = np.array([np.count_nonzero(y <= threshold) for threshold in thresholds])
    with np.errstate(invalid="ignore"):
        low = np.where(under > 0, special.betaincinv(under, count - under + 1.0, 0.025), 0.0)
        high = np.where(under < count, special.betaincinv(under + 1.0, count - under, 0.975), 1.0)
    below = under / count
    mean, deviation = float(y.mean()), float(y.std())
    shape = (np.nan, np.nan)
    if np.ptp(y) > 0.0:
        scaled = (y - mean) / deviation
        shape = float(np.mean(scaled**3)), float(np.mean(scaled**4)) - 3.0
    moments = mean, deviation, *shape
    return Distribution(below, 1.0 - below, low, high), moments
