"""Small probabilities by importance sampling about a most probable point, and corrections of quadratic forms."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, field
from eomgen.products.reliability.tails.quadratic_form import QuadraticForm, Response

#: Samples that are asked for at once.
_BLOCK = 4096
#: Least number of samples for the correction of a probability.
FEWEST = 200


class Estimate(NamedTuple):
    """A probability, its standard error, and the number of samples; not a number if the response has no value at
    some of them, since these are unknown."""

    probability: float
    standard_error: float
    samples: int


def importance_sampling(
    response: Response, point: Array, threshold: float, *, above: bool, samples: int, seed: int
) -> Estimate:
    """Return P(y > threshold), or P(y <= threshold), by samples with mean ``point`` (n,) and unit covariance.

    References
    ----------
    Schueller, Stix: A critical appraisal of methods to determine failure probabilities, Structural Safety 4 (1987).
    """
    random = np.random.default_rng(seed)
    total = squares = 0.0
    for begin in range(0, samples, _BLOCK):
        z = point + random.standard_normal((min(_BLOCK, samples - begin), len(point)))
        weights = np.exp(0.5 * point @ point - z @ point)
        y = response.values(z)
        parts = np.where(np.isnan(y), np.nan, np.where((y > threshold) == above, weights, 0.0))
        total += float(parts.sum())
        squares += float((parts**2).sum())
    mean = total / samples
    return Estimate(mean, float(np.sqrt(np.maximum(squares / samples - mean**2, 0.0) / samples)), samples)


@dataclass
class Draws:
    """Samples of normal variables about a centre, run on demand; a larger sample contains all smaller ones.

    Parameters
    ----------
    run : callable
        From points (m, n) to results, (m,) each; the first one is the response.
    centre : (n,)
        Mean of the points, whose covariance is the identity.
    seed : int
    """

    run: Callable[[Array], tuple[Array, ...]]
    centre: Array
    seed: int
    _parts: list[tuple[Array, ...]] = field(default_factory=list, init=False)

    def first(self, count: int) -> tuple[Array, ...]:
        """Return at least ``count`` points, (m, n), and their results, (m,) each."""
        have = sum(len(part[0]) for part in self._parts)
        if have < count:
            random = np.random.default_rng([self.seed, have])
            points = self.centre + random.standard_normal((count - have, len(self.centre)))
            self._parts.append((points, *self.run(points)))
        return tuple(np.concatenate(same) for same in zip(*self._parts, strict=True))


def corrected_tail(
    draws: Draws, form: QuadraticForm, of_form: float, threshold: float, *, above: bool, accuracy: float, most: int
) -> Estimate:
    """Estimate P(y > threshold), or P(y <= threshold), by a quadratic form and a correction by samples.

    The estimate uses samples alone if their error is less than the error with the correction, as for a bad form.

    If the form is good, both limit states nearly coincide, and their difference needs few samples. The number of
    samples doubles until the standard error is half of ``accuracy``, relative to the probability, or until twice the
    number would exceed ``most``. One additional sample between both limit states enters the error.

    Parameters
    ----------
    draws : Draws
        About a point near the limit state.
    form : QuadraticForm
    of_form : float
        Probability by the quadratic form.

    References
    ----------
    Hammersley, Handscomb: Monte Carlo Methods (1964), 5.5: control variates.
    """
    count = FEWEST
    while True:
        z, y, *_ = draws.first(count)
        count = len(z)
        if np.isnan(y).any():
            return Estimate(float("nan"), float("nan"), count)
        weights = np.exp(0.5 * draws.centre @ draws.centre - z @ draws.centre)
        ours, theirs = (form.values(z) > threshold) == above, (y > threshold) == above
        typical = float(weights[ours].mean()) if ours.any() else float(weights.mean())
        result = min(
            (_mean(weights * (1.0 * theirs - 1.0 * ours), of_form, typical), _mean(weights * theirs, 0.0, typical)),
            key=lambda one: one.standard_error,
        )
        if result.standard_error <= 0.5 * accuracy * max(result.probability, 0.1 * of_form) or 2 * count > most:
            return result
        count *= 2


def _mean(parts: Array, known: float, typical: float) -> Estimate:
    """Return a known probability plus the mean of parts (m,); the error includes one more part of typical size."""
    count = len(parts)
    error = float(np.sqrt((parts.var() + typical**2 / count) / count))
    return Estimate(max(known + float(parts.mean()), 0.0), error, count)
