"""How much of a result's variance each varied number accounts for."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from eomgen.base.arrays import Array
from eomgen.errors import Problem, UsageError

#: Samples for each number that varies, at least, for a regression.
_LEAST = 8
#: Number of bootstrap resamplings for confidence intervals of indices.
_RESAMPLED = 200


@dataclass(frozen=True)
class Ranking:
    """Shares of the variance of a result, by varied quantity, largest first.

    Attributes
    ----------
    kind : ``Sobol' indices``, or ``squared rank regression``
    first : name -> share that a number accounts for by itself
    total : name -> share with all its interactions; of a regression as ``first``
    first_interval, total_interval : name -> bounds of 95 % confidence by resampling; empty but for Sobol' indices
    error : largest estimated discretisation error of samples, as a part of the result's standard deviation; NaN if not
        known
    explained : sum of ``first``: the rest is due to interactions, or to no monotonic relation
    """

    result: str
    kind: str
    first: Mapping[str, float]
    total: Mapping[str, float]
    first_interval: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    total_interval: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    error: float = math.nan

    @property
    def explained(self) -> float:
        return sum(self.first.values())


def ranking(design: str, asked: int, values: Mapping[str, Array], result: str, found: Array) -> Ranking:
    """Return the ranking for a result (n,) of samples with varied quantities (n,). Raises UsageError."""
    from scipy import stats  # noqa: PLC0415  # it takes half a second to import

    if design == "saltelli":
        return _sobol(asked, list(values), result, found)
    there = np.isfinite(found)
    varying = [name for name, column in values.items() if there.any() and np.ptp(column[there]) > 0.0]
    least = _LEAST * max(len(varying), 1)
    if there.sum() < least:
        known = int(there.sum())
        fault = f"{known} {'sample is' if known == 1 else 'samples are'} too few for {len(values)} numbers that vary"
        raise UsageError(Problem("sensitivity", fault, f"{least} samples or more"))
    shares = dict.fromkeys(values, 0.0)
    if np.ptp(found[there]) > 0.0 and varying:
        ranks = np.array([_standard(stats.rankdata(values[name][there])) for name in varying])
        target = _standard(stats.rankdata(found[there]))
        weights = np.linalg.lstsq(ranks.T, target, rcond=None)[0]
        shares |= {name: float(weight) ** 2 for name, weight in zip(varying, weights, strict=True)}
    ordered = dict(sorted(shares.items(), key=lambda item: -item[1]))
    return Ranking(result, "squared rank regression", ordered, ordered)


def _standard(ranks: Array) -> Array:
    return np.asarray((ranks - ranks.mean()) / ranks.std())


def _sobol(asked: int, names: list[str], result: str, found: Array) -> Ranking:
    """Return Sobol' indices: of first order by Saltelli and others (2010), total by Jansen (1999)."""
    dimensions = len(names)
    n = asked // (dimensions + 2)
    if len(found) < asked or not np.all(np.isfinite(found)):
        missing = asked - int(np.isfinite(found).sum())
        fault = f"Sobol' indices need all {asked} samples of the design, and {missing} failed or are missing"
        raise UsageError(
            Problem("sensitivity", fault, "distributions without the samples that fail, or another design")
        )
    f_A, f_B, f_AB = found[:n], found[n : 2 * n], found[2 * n :].reshape(dimensions, n)
    if np.ptp(found) == 0.0:
        nothing = dict.fromkeys(names, 0.0)
        return Ranking(result, "Sobol' indices", nothing, nothing)
    from scipy import stats  # noqa: PLC0415  # as above

    if dimensions == 1:
        whole = {names[0]: 1.0}
        return Ranking(result, "Sobol' indices", whole, whole)
    blocks: Mapping[Literal["f_A", "f_B", "f_AB"], Array] = {
        "f_A": f_A[np.newaxis],
        "f_B": f_B[np.newaxis],
        "f_AB": f_AB[:, np.newaxis],
    }
    indices = stats.sobol_indices(func=blocks, n=n)
    first, total = np.ravel(indices.first_order).tolist(), np.ravel(indices.total_order).tolist()
    order = sorted(range(dimensions), key=lambda k: -total[k])
    of_first, of_total = (
        {names[k]: (float(low[k]), float(high[k])) for k in order} for low, high in _resampled(f_A, f_B, f_AB)
    )
    return Ranking(
        result,
        "Sobol' indices",
        {names[k]: first[k] for k in order},
        {names[k]: total[k] for k in order},
        of_first,
        of_total,
    )


def _resampled(f_A: Array, f_B: Array, f_AB: Array) -> list[tuple[Array, Array]]:
    """Return bounds of 95 % confidence of the indices of first order and of the total ones, (dimensions,) each, by the
    bootstrap over rows of the design (Archer, Saltelli, Sobol' 1997)."""
    random, n = np.random.default_rng(0), len(f_A)
    middle = 0.5 * float(f_A.mean() + f_B.mean())
    A, B, AB = f_A - middle, f_B - middle, f_AB - middle
    of_first, of_total = B * (AB - A), 0.5 * (AB - A) ** 2
    found = []
    for _ in range(_RESAMPLED):
        rows = random.integers(0, n, n)
        variance = np.var(np.concatenate([A[rows], B[rows]]))
        found.append([part[:, rows].mean(axis=1) / variance for part in (of_first, of_total)])
    low, high = np.quantile(np.array(found), (0.025, 0.975), axis=0)
    return [(low[k], high[k]) for k in (0, 1)]
