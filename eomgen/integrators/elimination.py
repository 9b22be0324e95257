"""The order in which a sparse matrix of known pattern is eliminated, found once from sample values and kept ever after.

Threshold Markowitz: of the entries that are large enough in their column in every sample, the one that fills in least.
Markowitz, Management Science 3 (1957) 255; Duff, Erisman and Reid, Direct Methods for Sparse Matrices (2017).
"""

from __future__ import annotations

import heapq
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.errors import ModelError, Problem

Array = NDArray[np.float64]

#: A pivot is at least this part of the largest entry of its column, in every sample.
THRESHOLD = 0.02
#: Rows and columns of lowest count among which a pivot is looked for before all are.
_SEARCHED = 4


@dataclass(frozen=True)
class Elimination:
    """An LU factorization without numbers. Position k means: the k-th pivot.

    Attributes
    ----------
    rows, columns : (N,)
        Row and column of the matrix at each position.
    lower, upper : (N,) tuples of positions, increasing
        Row by row, where L (left of the pivot) and U (right of it) are not zero.
    operations : int
        Multiply-subtracts of the factorization.
    """

    rows: tuple[int, ...]
    columns: tuple[int, ...]
    lower: tuple[tuple[int, ...], ...]
    upper: tuple[tuple[int, ...], ...]
    operations: int

    @property
    def size(self) -> int:
        return len(self.rows)

    @property
    def solve_operations(self) -> int:
        """Multiply-subtracts and multiplications of one solution."""
        return self.size + sum(map(len, self.lower)) + sum(map(len, self.upper))


def eliminate(size: int, samples: Mapping[tuple[int, int], Array]) -> Elimination:
    """Choose the pivots.

    Parameters
    ----------
    samples : mapping from (row, column) to (n,) values
        Every entry that is not zero by structure, at n states of the system.

    Raises
    ------
    ModelError
        When some sample is singular.
    """
    state = _Active(size, samples)
    rows: list[int] = []
    columns: list[int] = []
    left: dict[int, list[int]] = {row: [] for row in range(size)}
    right: list[list[int]] = []
    operations = 0
    for position in range(size):
        row, column = state.pivot()
        rows.append(row)
        columns.append(column)
        below, beside = state.eliminate(row, column)
        operations += len(below) * len(beside)
        for other in below:
            left[other].append(position)
        right.append(beside)
    place = {column: position for position, column in enumerate(columns)}
    lower = tuple(tuple(left[row]) for row in rows)
    upper = tuple(tuple(sorted(place[column] for column in beside)) for beside in right)
    return Elimination(tuple(rows), tuple(columns), lower, upper, operations)


class _Active:
    """What is left of the matrix: rows of scaled samples, and in which rows each column is."""

    def __init__(self, size: int, samples: Mapping[tuple[int, int], Array]) -> None:
        self.rows: list[dict[int, Array]] = [{} for _ in range(size)]
        self.columns: list[set[int]] = [set() for _ in range(size)]
        for (row, column), values in _equilibrated(size, samples).items():
            self.rows[row][column] = values
            self.columns[column].add(row)
        self.row_heap = [(len(entries), row) for row, entries in enumerate(self.rows)]
        self.column_heap = [(len(entries), column) for column, entries in enumerate(self.columns)]
        heapq.heapify(self.row_heap)
        heapq.heapify(self.column_heap)

    def pivot(self) -> tuple[int, int]:
        best: tuple[float, float, int, int] | None = None
        for row in self._shortest(self.row_heap, self.rows):
            for column in self.rows[row]:
                best = self._better(best, row, column, THRESHOLD)
        for column in self._shortest(self.column_heap, self.columns):
            for row in self.columns[column]:
                best = self._better(best, row, column, THRESHOLD)
        for threshold in (THRESHOLD, 1e-3, 1e-8):
            if best is not None:
                break
            for row, entries in enumerate(self.rows):
                for column in entries:
                    best = self._better(best, row, column, threshold)
        if best is None:
            raise ModelError(
                Problem(
                    "iteration matrix",
                    "it is singular at the initial state: constraints repeat each other, or a mass is missing",
                    "remove constraints that say the same twice, and give every moving part a mass",
                )
            )
        return best[2], best[3]

    def _shortest(self, heap: list[tuple[int, int]], entries: Sequence[Any]) -> list[int]:
        """Return those of lowest count; counts in the heap that are out of date are dropped or brought up to date."""
        found: list[tuple[int, int]] = []
        while heap and len(found) < _SEARCHED:
            count, number = heapq.heappop(heap)
            now = len(entries[number])
            if now and (count, number) not in found:
                if count == now:
                    found.append((count, number))
                else:
                    heapq.heappush(heap, (now, number))
        for item in found:
            heapq.heappush(heap, item)
        return [number for _, number in found]

    def _better(
        self, best: tuple[float, float, int, int] | None, row: int, column: int, threshold: float
    ) -> tuple[float, float, int, int] | None:
        cost = float((len(self.rows[row]) - 1) * (len(self.columns[column]) - 1))
        if best is not None and cost > best[0]:
            return best
        largest = np.max([np.abs(self.rows[other][column]) for other in self.columns[column]], axis=0)
        own = np.abs(self.rows[row][column])
        if not (np.all(own > 1e-13) and np.all(own >= threshold * largest)):
            return best
        candidate = (cost, -float(np.min(own / largest)), row, column)
        return candidate if best is None or candidate < best else best

    def eliminate(self, row: int, column: int) -> tuple[list[int], list[int]]:
        """Eliminate with a pivot; return the rows below it and the columns beside it."""
        pivot_row = self.rows[row]
        pivot = pivot_row.pop(column)
        beside = sorted(pivot_row)
        self.columns[column].discard(row)
        below = sorted(self.columns[column])
        for other in pivot_row:
            self.columns[other].discard(row)
        for number in below:
            target = self.rows[number]
            factor = target.pop(column) / pivot
            for other, value in pivot_row.items():
                known = target.get(other)
                target[other] = -factor * value if known is None else known - factor * value
                self.columns[other].add(number)
            heapq.heappush(self.row_heap, (len(target), number))
        self.rows[row] = {}
        self.columns[column] = set()
        for other in beside:
            heapq.heappush(self.column_heap, (len(self.columns[other]), other))
        return below, beside


def _equilibrated(size: int, samples: Mapping[tuple[int, int], Array]) -> dict[tuple[int, int], Array]:
    """Return the entries with rows and columns scaled so that the largest of each is about 1 (Ruiz 2001)."""
    places = np.array(list(samples), dtype=np.intp).reshape(-1, 2)
    values = np.array(list(samples.values()), dtype=float)
    magnitude = np.max(np.abs(values), axis=1)
    row_scale, column_scale = np.ones(size), np.ones(size)
    for _ in range(8):
        scaled = magnitude * row_scale[places[:, 0]] * column_scale[places[:, 1]]
        for scale, index in ((row_scale, places[:, 0]), (column_scale, places[:, 1])):
            largest = np.zeros(size)
            np.maximum.at(largest, index, scaled)
            scale[:] = scale / np.sqrt(np.where(largest > 0.0, largest, 1.0))
    values = values * (row_scale[places[:, 0]] * column_scale[places[:, 1]])[:, np.newaxis]
    return dict(zip(samples, values, strict=True))

