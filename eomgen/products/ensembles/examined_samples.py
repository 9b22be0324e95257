"""Estimates of discretisation errors in an ensemble: of the run without variations and of a few samples that are spread
over the whole design, each by the comparison runs of ``simulate``."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

from eomgen.base.arrays import Array
from eomgen.errors import EomgenError
from eomgen.products.ensembles.samples import Samples
from eomgen.results.error_estimate import ErrorEstimate
from eomgen.results.finding import WARNING
from eomgen.results.sample_errors import SampleErrors
from eomgen.results.solution import Solution
from eomgen.simulation.simulate import simulate

#: Maximum number of samples with an error estimate, and ensemble samples per estimate, which bound the cost.
_MOST, _FOR_EACH = 4, 8
#: Number of first samples of a design to choose from.
_CANDIDATES = 4096
#: Name of the finding on estimated errors, reported by ``SampleErrors``.
_OF_ERROR = "discretisation_error"
#: Attributes of a solution that an estimate has under the same name.
_STATES = ("q", "v", "z", "multipliers")


def sample_errors(work: Samples, nominal: Solution, *, examined: bool) -> tuple[SampleErrors, list[str]]:
    """Return the estimated errors of the run without variations and, if ``examined``, of a few samples of ``work``.

    The second result has the warnings of these samples that the run without variations has not, the first of each kind.
    """
    began = time.perf_counter()
    solutions = _with_estimates(work) if examined else {}
    estimates = {number: one.error for number, one in solutions.items()}
    every = [nominal.error, *estimates.values()]
    places = {} if work.alike is None else work.alike.places
    columns = {name: _of_column(every, *places[name]) for name in work.columns if name in places}
    step = float(nominal.metadata["settings"]["step"])
    known, told = {finding.name for finding in nominal.findings} | {_OF_ERROR}, []
    for number, one in solutions.items():
        for finding in one.findings:
            if finding.severity == WARNING and finding.name not in known:
                known.add(finding.name)
                told.append(f"sample {number}: {finding}")
    return SampleErrors(nominal.error, estimates, columns, step, time.perf_counter() - began), told


def _with_estimates(work: Samples) -> dict[int, Solution]:
    """Run a few samples over the whole design with estimates of their errors; return the successful ones by number."""
    total = work.design.samples
    count = min(_MOST, total // _FOR_EACH)
    result: dict[int, Solution] = {}
    if not count:
        return result
    values = work.design.values(0, min(_CANDIDATES, total))
    for number in spread_samples(values, count):
        try:
            solution = simulate(work.model, *work.span, **work.options.of(values[number]))
        except EomgenError:  # a failed sample, named with its reason by the ensemble
            continue
        if solution.interrupted:
            break
        if solution.success:
            result[number] = solution
    return result


def _of_column(estimates: Sequence[ErrorEstimate], attribute: str, place: int) -> float:
    """Return the largest error of a column over runs; NaN if no run has an estimate."""
    kind, _, name = attribute.partition(".")
    found = []
    for estimate in estimates:
        if not estimate.available:
            continue
        if kind == "output" and name in estimate.outputs_at:
            found.append(np.atleast_1d(estimate.outputs[name])[place])
        elif attribute in _STATES:
            found.append(getattr(estimate, attribute)[place])
    known = [float(error) for error in found if np.isfinite(error)]
    return max(known, default=float("nan"))


def spread_samples(values: Array, count: int) -> list[int]:
    """Return the numbers of samples that are spread over a design.

    The first one is the farthest from the middle; each further one is the farthest from all before it, in ranks.

    Parameters
    ----------
    values : (samples, varied)
    count : int
    """
    ranks = np.argsort(np.argsort(values, axis=0, kind="stable"), axis=0, kind="stable") / max(len(values) - 1, 1)
    fixed = np.ptp(values, axis=0) == 0.0
    ranks[:, fixed] = 0.5
    distance = np.linalg.norm(ranks - 0.5, axis=1)
    chosen: list[int] = []
    for _ in range(min(count, len(values))):
        distance[chosen] = -1.0
        chosen.append(int(np.argmax(distance)))
        apart = np.linalg.norm(ranks - ranks[chosen[-1]], axis=1)
        distance = apart if len(chosen) == 1 else np.minimum(distance, apart)
    return chosen
