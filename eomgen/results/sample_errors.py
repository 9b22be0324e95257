"""SampleErrors: discretisation errors of the samples of a study, estimated on a few of its runs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from eomgen.results.error_estimate import NOTICED, ErrorEstimate, Largest

#: Error target of the hint, relative to the motion.
_AIM = 0.01


@dataclass(frozen=True)
class SampleErrors:
    """Estimated discretisation errors of samples.

    Attributes
    ----------
    nominal : ErrorEstimate
        Of the run without variations.
    of_samples : mapping
        Number of the sample -> its estimate.
    columns : mapping
        Name of the column -> its largest error over these runs, in the column's unit; NaN if no run has an estimate.
    step : float
        Of the runs, s.
    seconds : float
        Time that the estimates took, s.
    """

    nominal: ErrorEstimate = field(default_factory=lambda: ErrorEstimate.missing("no estimate was made"))
    of_samples: Mapping[int, ErrorEstimate] = field(default_factory=dict)
    columns: Mapping[str, float] = field(default_factory=dict)
    step: float = float("nan")
    seconds: float = 0.0

    @property
    def available(self) -> bool:
        """Whether any of the runs has an estimate."""
        return any(one.available for one in self._every)

    @property
    def relative(self) -> float:
        """The largest error of a coordinate, a state or an output as a part of its motion; NaN if not known."""
        worst = self.worst
        return float("nan") if worst is None else worst[1].share

    @property
    def worst(self) -> tuple[int | None, Largest] | None:
        """Number of the worst sample, None for the run without variations, with its largest error."""
        result = [(number, one) for number, estimate in self._numbered for one in _largest(estimate)]
        return max(result, key=lambda pair: pair[1].share, default=None)

    @property
    def _numbered(self) -> list[tuple[int | None, ErrorEstimate]]:
        return [(None, self.nominal), *self.of_samples.items()]

    @property
    def _every(self) -> list[ErrorEstimate]:
        return [self.nominal, *self.of_samples.values()]

    def __str__(self) -> str:
        worst = self.worst
        if worst is None:
            return f"the discretisation error of samples is not known: {self.nominal.reason}"
        number, largest = worst
        run = "the run without variations" if number is None else f"sample {number}"
        known = sum(one.available for one in self._every)
        of = f", the worst of {known} runs with estimates" if known > 1 else ""
        text = f"the estimated error of samples is {largest} ({run}{of})"
        if not largest.share > NOTICED:
            return text
        estimate = self.nominal if number is None else self.of_samples[number]
        factor = estimate.refinement(_AIM) if estimate.relative > _AIM else 0.5
        return f"{text}; try: a step smaller than {self.step * factor:.2g} s"

    def summary(self) -> dict[str, Any]:
        """Return JSON data."""
        worst = self.worst
        return {
            "available": self.available,
            "reason": "" if self.available else self.nominal.reason,
            "relative": None if worst is None else worst[1].share,
            "worst_sample": None if worst is None else worst[0],
            "largest": None if worst is None else vars(worst[1]),
            "columns": {name: None if np.isnan(error) else error for name, error in self.columns.items()},
            "without_variations": self.nominal.described(),
            "samples": {str(number): one.described() for number, one in self.of_samples.items()},
            "seconds": self.seconds,
        }


def _largest(estimate: ErrorEstimate) -> list[Largest]:
    return [one for one in (estimate.largest, estimate.largest_output) if estimate.available and one is not None]
