"""Statistics of many runs, in memory that does not grow with their number: moments, envelopes and quantiles over time;
shares of the varied quantities in the variance of results.

Statistics of many runs over time, in memory that does not grow with their number: moments, envelopes, quantiles.

Blocks of samples are merged in order, so that the numbers have the same bits however the blocks were computed.
Moments are merged by the formulas of Chan, Golub and LeVeque, Am. Stat. 37 (1983) 242; quantiles come from the
t-digest of Dunning (2021), of Apache DataSketches.
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, field
from eomgen.errors import Problem, UsageError

#: Compression of digests: of 50 000 samples, ranks are off by up to 0.005 in the middle and 0.0001 at 0.001 and 0.999;
#: a full digest takes 14 kB.
_COMPRESSION = 800
#: Largest number of samples that wait to be sketched together, and of numbers: 2048 sorted samples take a third of the
#: time of blocks of 256, since all centroids of a digest are merged at each block. Samples of small ensembles wait for
#: the first quantile that is asked for.
_WAITING, _WAITING_NUMBERS = 2**14, 2**22


class Reduction:
    """Statistics of columns at times over samples.

    Attributes
    ----------
    count : (columns, times) samples that have a number there
    mean, minimum, maximum : (columns, times)
    """

    def __init__(self, columns: int, times: int) -> None:
        shape = (columns, times)
        self.count = np.zeros(shape)
        self.mean, self._squares = np.zeros(shape), np.zeros(shape)
        self.minimum, self.maximum = np.full(shape, np.inf), np.full(shape, -np.inf)
        self._joint_count, self._joint_mean = np.zeros(times), np.zeros((times, columns))
        self._products = np.zeros((times, columns, columns))
        library = _sketches()
        self._digests: list[Any] = [] if library is None else [
            library.tdigest_double(_COMPRESSION) for _ in range(columns * times)
        ]  # fmt: skip  # one expression
        self._waiting: list[Array] = []

    def add(self, block: Array) -> None:
        """Add samples, (samples, columns, times); NaN if a sample has none."""
        if not len(block):
            return
        columns, times = self.count.shape
        rows = np.ascontiguousarray(block.reshape(len(block), -1).T)  # sums over samples run along memory
        there = np.isfinite(rows)
        if there.all():
            mean = rows.sum(axis=1) / len(block)
            off = (rows - mean[:, np.newaxis]).reshape(columns, times, -1)
            products = np.einsum("its,jts->tij", off, off)
            squares = products.diagonal(axis1=1, axis2=2).T
            count, mean = np.full((columns, times), float(len(block))), mean.reshape(columns, times)
            low, high = rows.min(axis=1), rows.max(axis=1)
            joint_count, joint_mean = count[0], mean.T
        else:
            known = there.reshape(columns, times, -1)
            values = rows.reshape(columns, times, -1)
            count, mean = _mean(values, known)
            squares = np.where(known, (values - mean[:, :, np.newaxis]) ** 2, 0.0).sum(axis=2)
            low, high = np.where(there, rows, np.inf).min(axis=1), np.where(there, rows, -np.inf).max(axis=1)
            whole = np.broadcast_to(known.all(axis=0), known.shape)  # samples with numbers in all columns
            joint, joint_mean = _mean(values, whole)
            joint_count, joint_mean = joint[0], joint_mean.T
            off = np.where(whole, values - joint_mean.T[:, :, np.newaxis], 0.0)
            products = np.einsum("its,jts->tij", off, off)
        self._merge(count, mean, squares)
        self._merge_products(joint_count, joint_mean, products)
        self.minimum = np.minimum(self.minimum, low.reshape(columns, times))
        self.maximum = np.maximum(self.maximum, high.reshape(columns, times))
        if self._digests:
            self._waiting.append(rows)
            waiting = sum(part.shape[1] for part in self._waiting)
            if waiting >= _WAITING or waiting * self.count.size >= _WAITING_NUMBERS:
                self._sketch()

    def _merge(self, count: Array, mean: Array, squares: Array) -> None:
        """Merge moments of a block, (columns, times)."""
        total = self.count + count
        share = np.divide(count, total, out=np.zeros_like(total), where=total > 0.0)
        apart = mean - self.mean
        self._squares += squares + apart**2 * self.count * share
        self.mean += apart * share
        self.count = total

    def _merge_products(self, count: Array, mean: Array, products: Array) -> None:
        """Merge samples with numbers in all columns: (times,), (times, columns), (times, columns, columns)."""
        total = self._joint_count + count
        share = np.divide(count, total, out=np.zeros_like(total), where=total > 0.0)
        apart = mean - self._joint_mean
        self._products += products
        self._products += (self._joint_count * share)[:, np.newaxis, np.newaxis] * apart[:, :, None] * apart[:, None]
        self._joint_mean += apart * share[:, np.newaxis]
        self._joint_count = total

    def _sketch(self) -> None:
        """Bring the waiting samples into the digests."""
        if not self._waiting:
            return
        rows = np.concatenate(self._waiting, axis=1)
        self._waiting = []
        ordered = np.sort(np.where(np.isfinite(rows), rows, np.nan), axis=1)  # unknown numbers come last
        known = np.isfinite(ordered).sum(axis=1).tolist()
        for digest, values, count in zip(self._digests, ordered, known, strict=True):
            digest.update(values[:count])
            digest.compress()  # as for files, so that a digest read back continues with the same bits

    @property
    def deviation(self) -> Array:
        """Standard deviations, (columns, times), of the population that the samples are of; NaN below two samples."""
        return np.sqrt(_over(self._squares, self.count - 1.0))

    @property
    def covariance(self) -> Array:
        """Covariances of the columns, (times, columns, columns), over samples with all columns."""
        return _over(self._products, (self._joint_count - 1.0)[:, np.newaxis, np.newaxis])

    @property
    def has_quantiles(self) -> bool:
        return bool(self._digests)

    def quantiles(self, column: int, probabilities: Array) -> Array:
        """Return quantiles of a column, (probabilities, times). Raises UsageError without a sketch."""
        if not self._digests:
            fault = "quantiles are sketched by the package datasketches, which is not installed"
            raise UsageError(Problem("quantile", fault, "pip install 'eomgen[ensembles]', and the ensemble again"))
        self._sketch()
        times = self.count.shape[1]
        own = self._digests[column * times : (column + 1) * times]
        return np.array(
            [[np.nan if one.is_empty() else one.get_quantile(p) for one in own] for p in probabilities.tolist()]
        )

    def histogram(self, column: int, time: int, edges: Array) -> Array:
        """Return the probabilities between edges, (edges - 1,), of a column at a time; a value on an edge is below it.

        Raises UsageError without a sketch.
        """
        if not self._digests:
            self.quantiles(column, np.array([0.5]))
        self._sketch()
        digest = self._digests[column * self.count.shape[1] + time]
        if digest.is_empty():
            return np.full(len(edges) - 1, np.nan)
        low, high = self.minimum[column, time], self.maximum[column, time]
        return np.diff([0.0 if x < low else 1.0 if x >= high else digest.get_rank(x) for x in edges.tolist()])

    # -- to a file and back --------------------------------------------------------------------------------------------

    _KEPT = (
        "count", "mean", "_squares", "minimum", "maximum", "_joint_count", "_joint_mean", "_products"
    )  # fmt: skip  # a table

    def arrays(self) -> dict[str, Array]:
        """Return all attributes as arrays."""
        parts = [np.frombuffer(digest.serialize(), np.uint8) for digest in self._digests]
        sizes = np.array([len(part) for part in parts], dtype=np.int64)
        digests = np.concatenate(parts) if parts else np.empty(0, np.uint8)
        waiting = np.concatenate(self._waiting, axis=1) if self._waiting else np.empty((self.count.size, 0))
        rest = {"digests": digests, "sizes": sizes, "waiting": waiting}
        return {name.strip("_"): getattr(self, name) for name in self._KEPT} | rest

    @classmethod
    def of_arrays(cls, arrays: dict[str, Array]) -> Reduction:
        """Return the reductions written as ``arrays``."""
        columns, times = arrays["count"].shape
        result = cls(columns, times)
        for name in cls._KEPT:
            setattr(result, name, arrays[name.strip("_")])
        library = _sketches()
        result._digests = []
        if library is not None:
            result._waiting = [arrays["waiting"]] if arrays["waiting"].size else []
            ends = np.cumsum(arrays["sizes"]).tolist()
            text = arrays["digests"].tobytes()
            for begin, end in zip([0, *ends], ends, strict=False):
                result._digests.append(library.tdigest_double.deserialize(text[begin:end]))
        return result


def _mean(values: Array, known: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Return the count and the mean, (columns, times), of values (columns, times, samples) that are known."""
    count = known.sum(axis=2).astype(float)
    return count, np.where(known, values, 0.0).sum(axis=2) / np.maximum(count, 1.0)


def _over(sums: Array, count: Array) -> Array:
    there = np.broadcast_to(count > 0.0, sums.shape)
    return np.asarray(np.divide(sums, count, out=np.full(sums.shape, np.nan), where=there))


def _sketches() -> Any:
    """Return the package of sketches, or None if not installed."""
    try:
        return importlib.import_module("datasketches")
    except ImportError:
        return None


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
    first : name -> share of the variance due to the quantity alone
    total : name -> share with all interactions; of a regression as ``first``
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


def ranking(design: str, asked: int, values: Mapping[str, Array], result: str, results: Array) -> Ranking:
    """Return the ranking for a result (n,) of samples with varied quantities (n,). Raises UsageError."""
    from scipy import stats  # noqa: PLC0415  # it takes half a second to import

    if design == "saltelli":
        return _sobol(asked, list(values), result, results)
    there = np.isfinite(results)
    varying = [name for name, column in values.items() if there.any() and np.ptp(column[there]) > 0.0]
    least = _LEAST * max(len(varying), 1)
    if there.sum() < least:
        known = int(there.sum())
        fault = f"{known} {'sample is' if known == 1 else 'samples are'} too few for {len(values)} numbers that vary"
        raise UsageError(Problem("sensitivity", fault, f"{least} samples or more"))
    shares = dict.fromkeys(values, 0.0)
    if np.ptp(results[there]) > 0.0 and varying:
        ranks = np.array([_standard(stats.rankdata(values[name][there])) for name in varying])
        target = _standard(stats.rankdata(results[there]))
        weights = np.linalg.lstsq(ranks.T, target, rcond=None)[0]
        shares |= {name: float(weight) ** 2 for name, weight in zip(varying, weights, strict=True)}
    ordered = dict(sorted(shares.items(), key=lambda item: -item[1]))
    return Ranking(result, "squared rank regression", ordered, ordered)


def _standard(ranks: Array) -> Array:
    return np.asarray((ranks - ranks.mean()) / ranks.std())


def _sobol(asked: int, names: list[str], result: str, results: Array) -> Ranking:
    """Return Sobol' indices: first-order indices by Saltelli and others (2010), total indices by Jansen (1999)."""
    dimensions = len(names)
    n = asked // (dimensions + 2)
    if len(results) < asked or not np.all(np.isfinite(results)):
        missing = asked - int(np.isfinite(results).sum())
        fault = f"Sobol' indices need all {asked} samples of the design, and {missing} failed or are missing"
        raise UsageError(
            Problem("sensitivity", fault, "distributions without the samples that fail, or another design")
        )
    f_A, f_B, f_AB = results[:n], results[n : 2 * n], results[2 * n :].reshape(dimensions, n)
    if np.ptp(results) == 0.0:
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
    """Return bounds of 95 % confidence of the first-order and the total indices, (dimensions,) each, by the bootstrap
    over rows of the design (Archer, Saltelli, Sobol' 1997)."""
    random, n = np.random.default_rng(0), len(f_A)
    middle = 0.5 * float(f_A.mean() + f_B.mean())
    A, B, AB = f_A - middle, f_B - middle, f_AB - middle
    of_first, of_total = B * (AB - A), 0.5 * (AB - A) ** 2
    indices = []
    for _ in range(_RESAMPLED):
        rows = random.integers(0, n, n)
        variance = np.var(np.concatenate([A[rows], B[rows]]))
        indices.append([part[:, rows].mean(axis=1) / variance for part in (of_first, of_total)])
    low, high = np.quantile(np.array(indices), (0.025, 0.975), axis=0)
    return [(low[k], high[k]) for k in (0, 1)]
