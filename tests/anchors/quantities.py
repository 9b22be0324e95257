"""Results of rows that are no runs: probabilities, frequencies, loads, rates at a state; each by public calls."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

import eomgen

Array = NDArray[np.float64]


def probability(
    model: eomgen.Model,
    method: str,
    below: Sequence[float] = (),
    above: Sequence[float] = (),
    **options: Any,
) -> Mapping[str, Array]:
    """Return the probability that the output ``g`` is below or above one of the thresholds, by a method."""
    study = eomgen.random_vibration(model, "g", thresholds=[*below, *above], **options)
    found = study.distributions[method]
    parts = [*found.below[: len(below)], *found.above[len(below) :]]
    return {"probability": np.array([[sum(parts)]])}


#: Results by the names that rows of ``runs*.toml`` give.
QUANTITIES: Mapping[str, Callable[..., Mapping[str, Array]]] = {
    "probability": probability,
}
