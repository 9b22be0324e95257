"""Statistics of many runs, in memory that does not grow with their number: moments, envelopes and quantiles over time;
shares of the varied quantities in the variance of results.

Samples are merged in order and in chunks of one size, so that the numbers have the same bits however the samples came.
Moments are merged by the formulas of Chan, Golub and LeVeque, Am. Stat. 37 (1983) 242. Quantiles are exact as long as
all numbers are kept; later they come from centroids whose sizes follow the arcsine scale of the t-digest, Dunning,
Software Impacts 7 (2021) 100049, in one array operation for all columns and times.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, field
from eomgen.base.messages import counted
from eomgen.errors import Problem, UsageError

#: Numbers that are kept as they are, 128 MB; and the number of centroids that replace more.
_KEPT, CENTROIDS = 2**24, 512


def are_kept(numbers: int) -> bool:
    """Return whether all numbers of an ensemble, samples x columns x times, are kept, for exact quantiles."""
    return numbers <= _KEPT


@dataclass(frozen=True)
class ReducedSamples:
    """Statistics of a chunk of samples.

    Attributes
    ----------
    count, mean, squares, minimum, maximum : (columns, times), squares of deviations from the mean
    joint_count, joint_mean, products : (times,), (times, columns), (times, columns, columns), of the samples that are
        known in all columns, with products of deviations
    kept : (columns * times, samples), all numbers, NaN if unknown; None: the centroids stand for them
    centroids, weights : (columns * times, centroids)
    """

    count: Array
    mean: Array
    squares: Array
    minimum: Array
    maximum: Array
    joint_count: Array
    joint_mean: Array
    products: Array
    kept: Array | None = None
    centroids: Array | None = None
    weights: Array | None = None

    @classmethod
    def of(cls, block: Array) -> ReducedSamples:
        """Return the statistics of a block (samples, columns, times); NaN are left out."""
        columns, times = block.shape[1:]
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
        ends = low.reshape(columns, times), high.reshape(columns, times)
        return cls(count, mean, squares, *ends, joint_count, joint_mean, products, rows)


class Reduction:
    """Statistics of columns at times over samples.

    Parameters
    ----------
    columns, times : int
    chunk : int
        Number of samples that are merged together, for any number of samples that are added.

    Attributes
    ----------
    count : (columns, times) samples that have a number there
    mean, minimum, maximum : (columns, times)
    """

    def __init__(self, columns: int, times: int, chunk: int) -> None:
        shape = (columns, times)
        self.chunk = chunk
        self.count = np.zeros(shape)
        self.mean, self._squares = np.zeros(shape), np.zeros(shape)
        self.minimum, self.maximum = np.full(shape, np.inf), np.full(shape, -np.inf)
        self._joint_count, self._joint_mean = np.zeros(times), np.zeros((times, columns))
        self._products = np.zeros((times, columns, columns))
        self._centroids, self._weights = (np.zeros((columns * times, 0)) for _ in range(2))
        self._kept: list[Array] = []
        self._pending = np.zeros((0, columns, times))

    def add(self, rows: Array) -> None:
        """Add samples, (samples, columns, times); NaN if a sample has none. Fewer than a chunk wait for more."""
        rows = np.concatenate([self._pending, rows])
        whole = len(rows) - len(rows) % self.chunk
        for begin in range(0, whole, self.chunk):
            self.merge(ReducedSamples.of(rows[begin : begin + self.chunk]))
        self._pending = rows[whole:].copy()

    def whole(self) -> Reduction:
        """Return a copy of the statistics that includes the samples which wait for a whole chunk."""
        result = copy.copy(self)
        result._kept, result._pending = list(self._kept), self._pending[:0]
        # only these are changed in place
        for name in ("mean", "_squares", "_products", "_joint_mean"):
            setattr(result, name, getattr(self, name).copy())
        if len(self._pending):
            result.merge(ReducedSamples.of(self._pending))
        return result

    def merge(self, part: ReducedSamples) -> None:
        """Merge the statistics of a chunk. Kept numbers are condensed to centroids if there are too many."""
        self._merge(part.count, part.mean, part.squares)
        self._merge_products(part.joint_count, part.joint_mean, part.products)
        self.minimum = np.minimum(self.minimum, part.minimum)
        self.maximum = np.maximum(self.maximum, part.maximum)
        if part.centroids is not None and part.weights is not None:
            joined = np.concatenate([self._centroids, part.centroids], axis=1)
            weights = np.concatenate([self._weights, part.weights], axis=1)
            self._centroids, self._weights = _condense(*_merge(joined, weights, joined[:, :0]))
        if part.kept is None:
            return
        self._kept.append(part.kept)
        if sum(rows.size for rows in self._kept) >= max(_KEPT, part.kept.size + 1):
            self._condense()

    def _merge(self, count: Array, mean: Array, squares: Array) -> None:
        """Merge counts, means and sums of squared deviations of a block, (columns, times) each, into the statistics."""
        total = self.count + count
        share = np.divide(count, total, out=np.zeros_like(total), where=total > 0.0)
        apart = mean - self.mean
        self._squares += squares + apart**2 * self.count * share
        self.mean += apart * share
        self.count = total

    def _merge_products(self, count: Array, mean: Array, products: Array) -> None:
        """Merge the moments of samples known in all columns: counts (times,), means (times, columns), and sums of
        products of deviations (times, columns, columns)."""
        total = self._joint_count + count
        share = np.divide(count, total, out=np.zeros_like(total), where=total > 0.0)
        apart = mean - self._joint_mean
        self._products += products
        self._products += (self._joint_count * share)[:, np.newaxis, np.newaxis] * apart[:, :, None] * apart[:, None]
        self._joint_mean += apart * share[:, np.newaxis]
        self._joint_count = total

    def _condense(self) -> None:
        """Replace the kept numbers and the present centroids by new centroids, which takes memory in parts."""
        rows = self._gather()
        cells, size = len(rows), max(1, _KEPT // (8 * (rows.shape[1] + self._centroids.shape[1])))
        parts = [
            _condense(*_merge(self._centroids[part], self._weights[part], rows[part]))
            for part in (slice(begin, begin + size) for begin in range(0, cells, size))
        ]
        self._centroids, self._weights = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
        self._kept = []

    def _gather(self) -> Array:
        """Return the kept numbers, (columns * times, samples), sorted with NaN last."""
        rows = np.concatenate(self._kept, axis=1) if self._kept else np.empty((self.count.size, 0))
        rows.sort(axis=1, kind="stable")  # of sorted numbers without cost
        self._kept = [rows]
        return rows

    @property
    def deviation(self) -> Array:
        """Standard deviations, (columns, times), with divisor n - 1; NaN below two samples."""
        return np.sqrt(_over(self._squares, self.count - 1.0))

    @property
    def covariance(self) -> Array:
        """Covariances of the columns, (times, columns, columns), over samples with all columns."""
        return _over(self._products, (self._joint_count - 1.0)[:, np.newaxis, np.newaxis])

    def quantiles(self, column: int, probabilities: Array) -> Array:
        """Return quantiles of the column with an index, (probabilities, times), NaN without samples. Kept numbers are
        interpolated between order statistics, centroids by their mean places in the order."""
        result = np.full((len(probabilities), self.count.shape[1]), np.nan)
        for time, (values, weights) in enumerate(self._distributions(column)):
            if len(values):
                # of a centroid: the mean place of its numbers in the order of all
                places = np.cumsum(weights) - 0.5 * (weights + 1.0)
                last = float(weights.sum()) - 1.0
                low, high = self.minimum[column, time], self.maximum[column, time]
                known = np.concatenate([[low], values, [high]]), np.concatenate([[0.0], places, [last]])
                result[:, time] = np.interp(probabilities * last, known[1], known[0])
        return result

    def histogram(self, column: int, time: int, edges: Array) -> Array:
        """Return the probabilities (edges - 1,) between edges, increasing, of a column at a time, both by index. A
        value on an edge counts below the edge; NaN without samples."""
        values, weights = self._distributions(column)[time]
        if not len(values):
            return np.full(len(edges) - 1, np.nan)
        total = np.concatenate([[0.0], np.cumsum(weights)])
        if not self._centroids.shape[1]:
            return np.asarray(np.diff(total[np.searchsorted(values, edges, side="right")]) / total[-1])
        low, high = self.minimum[column, time], self.maximum[column, time]
        places = np.concatenate([[0.0], 0.5 * (total[1:] + total[:-1]), [total[-1]]])
        return np.asarray(np.diff(np.interp(edges, np.concatenate([[low], values, [high]]), places)) / total[-1])

    def _distributions(self, column: int) -> list[tuple[Array, Array]]:
        """Return the sorted values and their weights at each time of a column."""
        times = self.count.shape[1]
        part = slice(column * times, (column + 1) * times)
        values, weights = _merge(self._centroids[part], self._weights[part], self._gather()[part])
        return [(x[w > 0.0], w[w > 0.0]) for x, w in zip(values, weights, strict=True)]

    # -- to a file and back --------------------------------------------------------------------------------------------

    _WRITTEN = (
        "count", "mean", "_squares", "minimum", "maximum", "_joint_count", "_joint_mean", "_products", "_centroids",
        "_weights", "_pending",
    )  # fmt: skip  # a table

    def arrays(self) -> dict[str, Array]:
        """Return all attributes as arrays."""
        rest = {"kept": self._gather(), "chunk": np.array(self.chunk)}
        return {name.strip("_"): getattr(self, name) for name in self._WRITTEN} | rest

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, Array]) -> Reduction:
        """Return the statistics whose ``arrays`` were written to a file."""
        columns, times = arrays["count"].shape
        result = cls(columns, times, int(arrays["chunk"]))
        for name in cls._WRITTEN:
            setattr(result, name, arrays[name.strip("_")])
        result._kept = [arrays["kept"]]
        return result


def _merge(centroids: Array, weights: Array, rows: Array) -> tuple[Array, Array]:
    """Return centroids and rows, (cells, n) each, in one order by value, and their weights: 0 of numbers that are
    unknown, which come last."""
    values = np.concatenate([centroids, rows], axis=1)
    sizes = np.concatenate([weights, np.isfinite(rows)], axis=1)
    if not centroids.shape[1]:
        return values, sizes  # sorted
    order = np.argsort(np.where(sizes > 0.0, values, np.inf), axis=1, kind="stable")
    return np.take_along_axis(values, order, 1), np.take_along_axis(sizes, order, 1)


def _condense(values: Array, weights: Array) -> tuple[Array, Array]:
    """Return 512 centroids and their weights, (cells, centroids), of sorted values with weights, (cells, n) each: 0.3 %
    of the samples are in one in the middle, 0.001 % at both ends. Empty ones are NaN."""
    known, count = np.where(weights > 0.0, values, 0.0), CENTROIDS
    with np.errstate(invalid="ignore", divide="ignore"):
        share = (np.cumsum(weights, axis=1) - 0.5 * weights) / weights.sum(axis=1, keepdims=True)
        places = _groups(share) + count * np.arange(len(values))[:, np.newaxis]
        sizes, sums = (
            np.bincount(places.ravel(), part.ravel(), count * len(values)).reshape(len(values), count)
            for part in (weights, weights * known)
        )
        return np.asarray(sums / sizes), np.asarray(sizes, float)


def _groups(share: Array) -> NDArray[np.intp]:
    """Return the number of the centroid of numbers at shares of all weight, by the arcsine scale."""
    scale = np.nan_to_num(np.arcsin(np.clip(2.0 * share - 1.0, -1.0, 1.0)) / np.pi + 0.5)
    return np.minimum((CENTROIDS * scale).astype(np.intp), CENTROIDS - 1)


def places_of_centroids(count: int) -> NDArray[np.intp]:
    """Return the places in ``count`` sorted numbers at which the numbers of each centroid begin, and the last end."""
    return np.searchsorted(_groups((np.arange(count) + 0.5) / max(count, 1)), np.arange(CENTROIDS + 1))


def _mean(values: Array, known: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Return the count and the mean, (columns, times), of values (columns, times, samples) that are known."""
    count = known.sum(axis=2).astype(float)
    return count, np.where(known, values, 0.0).sum(axis=2) / np.maximum(count, 1.0)


def _over(sums: Array, count: Array) -> Array:
    there = np.broadcast_to(count > 0.0, sums.shape)
    return np.asarray(np.divide(sums, count, out=np.full(sums.shape, np.nan), where=there))


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
    """Rank the varied quantities by their influence on a result. Raises UsageError for too few samples.

    Parameters
    ----------
    design, asked : str and int
        Design of the samples, and the number that was asked for.
    values : mapping from str to (n,) ndarray
        Varied quantities.
    result, results : str and (n,) ndarray
        Name of the result, and the value for each sample; not a number for a failed sample.
    """
    from scipy import stats  # noqa: PLC0415  # it takes half a second to import

    if design == "saltelli":
        return _sobol(asked, list(values), result, results)
    there = np.isfinite(results)
    varying = [name for name, column in values.items() if there.any() and np.ptp(column[there]) > 0.0]
    known = int(there.sum())
    numbers = max(len(varying if known > 1 else values), 1)  # a single sample shows no variation
    least = 8 * numbers
    if known < least:
        fault = f"too few samples for {counted(numbers, 'number that varies', 'numbers that vary')}: {known} [E0686]"
        raise UsageError(Problem("sensitivity", fault, f"{least} samples or more"))
    shares = dict.fromkeys(values, 0.0)
    if np.ptp(results[there]) > 0.0 and varying:
        ranks = np.array([stats.zscore(stats.rankdata(values[name][there])) for name in varying])
        target = stats.zscore(stats.rankdata(results[there]))
        weights = np.linalg.lstsq(ranks.T, target, rcond=None)[0]
        shares |= {name: float(weight) ** 2 for name, weight in zip(varying, weights, strict=True)}
    ordered = dict(sorted(shares.items(), key=lambda item: -item[1]))
    return Ranking(result, "squared rank regression", ordered, ordered)


def _sobol(asked: int, names: list[str], result: str, results: Array) -> Ranking:
    """Return Sobol' indices of a result: first-order indices by Saltelli and others (2010), total indices by Jansen
    (1999), with 95 % intervals by 200 resamplings of the design's rows (Archer, Saltelli, Sobol' 1997), largest total
    first. `asked` is the number of all samples of the design ``saltelli``,
    n (d + 2) for d `names`; `results` are (asked,) in the order of the design. Raises UsageError if a result is missing
    or not finite. Indices are 0 for a constant result and 1 for a single name, without intervals."""
    dimensions = len(names)
    n = asked // (dimensions + 2)
    if len(results) < asked or not np.all(np.isfinite(results)):
        missing = asked - int(np.isfinite(results).sum())
        fault = f"Sobol' indices need all {asked} samples of the design, and {missing} failed or are missing [E0687]"
        raise UsageError(Problem("sensitivity", fault, "distributions without failing samples, or another design"))
    f_A, f_B, f_AB = results[:n], results[n : 2 * n], results[2 * n :].reshape(dimensions, n)
    if (spread := np.ptp(results)) == 0.0 or dimensions == 1:
        shares = dict.fromkeys(names, float(spread > 0.0))
        return Ranking(result, "Sobol' indices", shares, shares)
    middle = 0.5 * float(f_A.mean() + f_B.mean())
    A, B, AB = f_A - middle, f_B - middle, f_AB - middle
    parts = B * (AB - A), 0.5 * (AB - A) ** 2

    def indices(rows: NDArray[np.intp]) -> list[Array]:
        variance = np.var(np.concatenate([A[rows], B[rows]]))
        return [part[:, rows].mean(axis=1) / variance for part in parts]

    first, total = (values.tolist() for values in indices(np.arange(n)))
    random = np.random.default_rng(0)
    resampled = [indices(random.integers(0, n, n)) for _ in range(200)]
    bounds = np.quantile(np.array(resampled), (0.025, 0.975), axis=0).transpose(1, 2, 0).tolist()
    order = sorted(range(dimensions), key=lambda k: -total[k])
    by_first, by_total = ({names[k]: values[k] for k in order} for values in (first, total))
    of_first, of_total = ({names[k]: (values[k][0], values[k][1]) for k in order} for values in bounds)
    return Ranking(result, "Sobol' indices", by_first, by_total, of_first, of_total)
