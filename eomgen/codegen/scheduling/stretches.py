"""Tables of indices as rules: rows that repeat one period, each time moved by the same step.

Equal parts of a scene are numbered alike, so tables of the places read and stored by a loop repeat but at their ends.
Differences of neighbouring rows then repeat exactly, and repeats are found by hashes of windows (Karp and Rabin 1987).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from eomgen.base.data import dataclass

#: Least number of periods of a stretch, and of rows that it saves.
_COUNT, _SAVED = 4, 12
#: Lengths of the hashed windows, and candidate periods of each.
_WINDOWS, _DISTANCES = (1, 5, 24), 8


@dataclass(frozen=True)
class Stretch:
    """Rows ``start .. stop - 1``: row ``start + period k + j`` is row ``start + j`` plus k times the step of its
    column."""

    start: int
    period: int
    count: int

    @property
    def stop(self) -> int:
        return self.start + self.period * self.count


def stretches(columns: Sequence[Sequence[int]], moving: Sequence[bool]) -> list[Stretch]:
    """Cut a table into stretches, in order; stretches of period one have no repeats.

    Parameters
    ----------
    columns : of equal length
    moving : which columns may have a step other than 0
    """
    table = np.array(columns, dtype=np.int64).T
    fixed = [column for column, moves in enumerate(moving) if not moves]
    in_order = sorted(_search(table, fixed), key=lambda stretch: stretch.start)
    result: list[Stretch] = []
    end = 0
    for stretch in [*in_order, Stretch(len(table), 1, 0)]:
        if stretch.start > end:
            result.append(Stretch(end, stretch.start - end, 1))
        if stretch.count:
            result.append(stretch)
        end = stretch.stop
    return result


def ranges(places: Sequence[int]) -> list[tuple[int, int, int]]:
    """Cut places in ranges of equally spaced ones: (end, start, step) if place k < end is start + step k."""
    result: list[tuple[int, int, int]] = []
    for k, place in enumerate(places):
        if result and result[-1][1] + result[-1][2] * k == place:
            result[-1] = (k + 1, *result[-1][1:])
        else:
            step = places[k + 1] - place if k + 1 < len(places) else 0
            result.append((k + 1, place - step * k, step))
    return result


def _search(table: NDArray[np.int64], fixed: Sequence[int]) -> Iterator[Stretch]:
    """Yield the longest repeat, then repeats on both sides of it."""
    if len(table) < 2:
        return
    codes = np.unique(np.diff(table, axis=0), axis=0, return_inverse=True)[1].reshape(-1)
    pending = [(0, len(table))]
    while pending:
        low, high = pending.pop()
        if high - low <= _SAVED:
            continue
        best = _longest(table, codes, fixed, low, high)
        if best is not None:
            yield best
            pending += [(low, best.start), (best.stop, high)]


def _longest(
    table: NDArray[np.int64], codes: NDArray[np.intp], fixed: Sequence[int], low: int, high: int
) -> Stretch | None:
    inside = codes[low : high - 1]
    best: tuple[int, int, Stretch] | None = None
    for period in _periods(inside):
        same = np.concatenate(([False], inside[:-period] == inside[period:], [False]))
        edges = np.flatnonzero(same[1:] != same[:-1])
        for start, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
            count = (end - start + period + 1) // period
            saved = (count - 1) * period
            if count < _COUNT or saved < _SAVED or (best is not None and (saved, -period) <= best[:2]):
                continue
            first = low + start
            if not np.any(table[first + period, fixed] != table[first, fixed]):
                best = (saved, -period, Stretch(first, period, count))
    return None if best is None else best[2]


def _periods(codes: NDArray[np.intp]) -> list[int]:
    """Return distances at which windows are equal, the most frequent ones of each length of windows."""
    result: set[int] = set()
    for window in _WINDOWS:
        size = len(codes) - window + 1
        if size < 2:
            break
        hashes = np.zeros(size, np.uint64)
        for k in range(window):
            hashes = hashes * np.uint64(1000003) + codes[k : k + size].astype(np.uint64) + np.uint64(7)
        order = np.argsort(hashes, kind="stable")
        equal = hashes[order][1:] == hashes[order][:-1]
        distances = Counter((order[1:] - order[:-1])[equal].tolist())
        result |= {distance for distance, _ in distances.most_common(_DISTANCES)}
    return sorted(result)
