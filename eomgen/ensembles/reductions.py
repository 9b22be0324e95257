"""What many runs come to over time, in memory that does not grow with their number: moments, envelopes, quantiles.

Blocks of samples are merged in their order, so that the numbers have the same bits however the blocks were computed.
Moments are merged by the formulas of Chan, Golub and LeVeque, Am. Stat. 37 (1983) 242; quantiles are those of the
t-digest of Dunning (2021), of Apache DataSketches.
"""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.arrays import Array
from eomgen.errors import Problem, UsageError

#: Compression of digests: of 50 000 samples, ranks are off by up to 0.005 in the middle and 0.0001 at 0.001 and 0.999;
#: a full digest takes 14 kB.
_COMPRESSION = 800
#: Samples that wait to be sketched together at most, and numbers of theirs: sorted, 2048 of them cost a third of what
#: they cost in blocks of 256, where all centroids of a digest are merged at each block.
_WAITING, _WAITING_NUMBERS = 2048, 2**22


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
        """Add samples, (samples, columns, times); NaN where a sample has none."""
        if not len(block):
            return
        there = np.isfinite(block)
        count = there.sum(axis=0).astype(float)
        filled = np.where(there, block, 0.0)
        mean = filled.sum(axis=0) / np.maximum(count, 1.0)
        squares = np.where(there, (block - mean) ** 2, 0.0).sum(axis=0)
        total = self.count + count
        share = np.divide(count, total, out=np.zeros_like(total), where=total > 0.0)
        apart = mean - self.mean
        self._squares += squares + apart**2 * self.count * share
        self.mean += apart * share
        self.count = total
        self.minimum = np.minimum(self.minimum, np.where(there, block, np.inf).min(axis=0))
        self.maximum = np.maximum(self.maximum, np.where(there, block, -np.inf).max(axis=0))
        self._add_products(block, np.asarray(np.all(there, axis=1)))
        if self._digests:
            self._waiting.append(np.array(block))
            waiting = sum(len(rows) for rows in self._waiting)
            if waiting >= _WAITING or waiting * self.count.size >= _WAITING_NUMBERS:
                self._sketch()

    def _sketch(self) -> None:
        """Bring what waits into the digests."""
        if not self._waiting:
            return
        rows = np.concatenate(self._waiting).reshape(-1, self.count.size)
        self._waiting = []
        ordered = np.sort(np.where(np.isfinite(rows), rows, np.nan).T, axis=1)  # what is not known comes last
        known = np.isfinite(ordered).sum(axis=1).tolist()
        for digest, values, count in zip(self._digests, ordered, known, strict=True):
            digest.update(values[:count])
            digest.compress()  # as writing it to a file does, so that what is read back goes on with the same bits

    def _add_products(self, block: Array, there: NDArray[np.bool_]) -> None:
        """Add products of deviations of samples that have numbers in all columns; ``there`` is (samples, times)."""
        rows = np.where(there[:, :, np.newaxis], block.transpose(0, 2, 1), 0.0)
        count = there.sum(axis=0).astype(float)
        mean = rows.sum(axis=0) / np.maximum(count, 1.0)[:, np.newaxis]
        off = np.where(there[:, :, np.newaxis], rows - mean, 0.0)
        total = self._joint_count + count
        share = np.divide(count, total, out=np.zeros_like(total), where=total > 0.0)
        apart = mean - self._joint_mean
        self._products += np.einsum("sti,stj->tij", off, off)
        self._products += (self._joint_count * share)[:, np.newaxis, np.newaxis] * apart[:, :, None] * apart[:, None]
        self._joint_mean += apart * share[:, np.newaxis]
        self._joint_count = total

    @property
    def deviation(self) -> Array:
        """Standard deviations, (columns, times), of the population that the samples are of; NaN below two samples."""
        return np.sqrt(_over(self._squares, self.count - 1.0))

    @property
    def covariance(self) -> Array:
        """Covariances of the columns, (times, columns, columns), over samples that have all of them."""
        return _over(self._products, (self._joint_count - 1.0)[:, np.newaxis, np.newaxis])

    @property
    def has_quantiles(self) -> bool:
        return bool(self._digests)

    def quantiles(self, column: int, probabilities: Array) -> Array:
        """Return quantiles of a column, (probabilities, times). Raises UsageError where nothing sketches them."""
        if not self._digests:
            what = "quantiles are sketched by the package datasketches, which is not installed"
            raise UsageError(Problem("quantile", what, "pip install 'eomgen[ensembles]', and the ensemble again"))
        self._sketch()
        times = self.count.shape[1]
        own = self._digests[column * times : (column + 1) * times]
        return np.array(
            [[np.nan if one.is_empty() else one.get_quantile(p) for one in own] for p in probabilities.tolist()]
        )

    def histogram(self, column: int, time: int, edges: Array) -> Array:
        """Return the probabilities between edges, (edges - 1,), of a column at a time; what is on an edge is below it.

        Raises UsageError where nothing sketches them.
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
        """Return all of it as arrays."""
        parts = [np.frombuffer(digest.serialize(), np.uint8) for digest in self._digests]
        sizes = np.array([len(part) for part in parts], dtype=np.int64)
        digests = np.concatenate(parts) if parts else np.empty(0, np.uint8)
        waiting = np.concatenate(self._waiting) if self._waiting else np.empty((0, *self.count.shape))
        rest = {"digests": digests, "sizes": sizes, "waiting": waiting}
        return {name.strip("_"): getattr(self, name) for name in self._KEPT} | rest

    @classmethod
    def of_arrays(cls, arrays: dict[str, Array]) -> Reduction:
        """Return what ``arrays`` gave."""
        columns, times = arrays["count"].shape
        found = cls(columns, times)
        for name in cls._KEPT:
            setattr(found, name, arrays[name.strip("_")])
        library = _sketches()
        found._digests = []
        if library is not None:
            found._waiting = [arrays["waiting"]] if len(arrays["waiting"]) else []
            ends = np.cumsum(arrays["sizes"]).tolist()
            text = arrays["digests"].tobytes()
            for begin, end in zip([0, *ends], ends, strict=False):
                found._digests.append(library.tdigest_double.deserialize(text[begin:end]))
        return found


def _over(sums: Array, count: Array) -> Array:
    there = np.broadcast_to(count > 0.0, sums.shape)
    return np.asarray(np.divide(sums, count, out=np.full(sums.shape, np.nan), where=there))


def _sketches() -> Any:
    """Return the package of sketches, or None where it is not installed."""
    try:
        return importlib.import_module("datasketches")
    except ImportError:
        return None
