"""Small probabilities by importance sampling about a most probable point."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from eomgen.arrays import Array
from eomgen.reliability.response import Response

#: Samples that are asked for at once.
_BLOCK = 4096


class Estimate(NamedTuple):
    """A probability, its standard error, and the number of samples; not a number where the response has no value at
    some of them, for nothing is known of these."""

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
