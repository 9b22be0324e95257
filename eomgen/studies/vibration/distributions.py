"""Distributions by each method: of quadratic forms, at most probable points, of samples."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import special, stats

from eomgen.arrays import Array
from eomgen.reliability import (
    INVERSIONS,
    MostProbablePoint,
    QuadraticForm,
    Response,
    breitung,
    first_order,
    hohenbichler_rackwitz,
    importance_sampling,
    rivals,
)
from eomgen.studies.vibration.findings import Distribution
from eomgen.studies.vibration.run_response import RunResponse

#: Directions in which a second most probable point is looked for.
_DIRECTIONS = 2
_NONE: Array = np.zeros(0)


def moments_of(form: QuadraticForm) -> tuple[float, float, float, float]:
    return form.mean, form.standard_deviation, form.skewness, form.excess_kurtosis


def of_form(form: QuadraticForm, thresholds: Array) -> Distribution:
    tails = INVERSIONS["steepest_descent"](form, thresholds)
    return Distribution(tails.below, tails.above, _NONE, _NONE)


def at_points(reached: Sequence[MostProbablePoint]) -> dict[str, Distribution]:
    quadratic = [INVERSIONS["steepest_descent"](one.form, one.threshold) for one in reached]
    saddle = [INVERSIONS["lugannani_rice"](one.form, one.threshold) for one in reached]
    found = {
        "form": _of_upper([first_order(one) for one in reached]),
        "breitung": _of_upper([breitung(one) for one in reached]),
        "hohenbichler_rackwitz": _of_upper([hohenbichler_rackwitz(one) for one in reached]),
    }
    for name, tails in (("lugannani_rice", saddle), ("quadratic", quadratic)):
        below, above = (np.array([float(getattr(one, side)) for one in tails]) for side in ("below", "above"))
        found[name] = Distribution(below, above, _NONE, _NONE)
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


def tails_of(response: RunResponse, reached: Sequence[MostProbablePoint], samples: int, seed: int) -> Distribution:
    below, above, low, high = (np.empty(len(reached)) for _ in range(4))
    for k, one in enumerate(reached):
        upper = one.index >= 0.0
        estimate = importance_sampling(response, one.point, one.threshold, above=upper, samples=samples, seed=seed + k)
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
    moments = float(y.mean()), float(y.std()), float(stats.skew(y)), float(stats.kurtosis(y))
    return Distribution(below, 1.0 - below, low, high), moments
