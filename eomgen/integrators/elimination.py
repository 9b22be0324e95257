"""The order in which a sparse matrix of known pattern is eliminated, found once from sample values and kept ever after.

Threshold Markowitz: of the entries that are large enough in their column in every sample, the one that fills in least.
Markowitz, Management Science 3 (1957) 255; Duff, Erisman and Reid, Direct Methods for Sparse Matrices (2017).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from eomgen.errors import ModelError, Problem

Array = NDArray[np.float64]

#: A pivot is at least this part of the largest entry of its column, in every sample.
THRESHOLD = 0.02
#: What is taken in the end rather than nothing.
_LAST_THRESHOLDS = (1e-3, 1e-8)
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


def eliminate(
    size: int, samples: Mapping[tuple[int, int], Array], stages: Sequence[tuple[Sequence[int], Sequence[int]]] | None = None
) -> Elimination:
    """Choose the pivots.

    Parameters
    ----------
    samples : mapping from (row, column) to (n,) values
        Every entry that is not zero by structure, at n states of the system.
    stages : sequence of (rows, columns), optional
        Where to look for pivots, one after the other; what finds none waits for the next stage.

    Raises
    ------
    ModelError
        When some sample is singular.
    """
    everything = [(range(size), range(size))]
    state = _Active(size, samples)
    rows: list[int] = []
    columns: list[int] = []
    left: dict[int, list[int]] = {row: [] for row in range(size)}
    right: list[list[int]] = []
    operations = 0
    active_rows: set[int] = set()
    active_columns: set[int] = set()
    plan = list(stages) if stages is not None else everything
    for number, (new_rows, new_columns) in enumerate(plan):
        active_rows |= set(new_rows)
        active_columns |= set(new_columns)
        thresholds = (THRESHOLD,) if number < len(plan) - 1 else (THRESHOLD, *_LAST_THRESHOLDS)
        while active_columns and (found := state.pivot(active_rows, active_columns, thresholds)) is not None:
            row, column = found
            rows.append(row)
            columns.append(column)
            active_rows.discard(row)
            active_columns.discard(column)
            below, beside = state.eliminate(row, column)
            operations += len(below) * len(beside)
            for other in below:
                left[other].append(len(rows) - 1)
            right.append(beside)
    if len(rows) < size:
        raise ModelError(
            Problem(
                "iteration matrix",
                "it is singular at the initial state: constraints repeat each other, or a mass is missing",
                "remove constraints that say the same twice, and give every moving part a mass",
            )
        )
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

    def pivot(self, rows: set[int], columns: set[int], thresholds: Sequence[float]) -> tuple[int, int] | None:
        """Return the best pivot in some rows and columns, None where none is large enough in its column."""
        best: tuple[float, float, int, int] | None = None
        for row in sorted(rows, key=lambda k: (len(self.rows[k]), k))[:_SEARCHED]:
            for column in self.rows[row]:
                if column in columns:
                    best = self._better(best, row, column, thresholds[0])
        for column in sorted(columns, key=lambda k: (len(self.columns[k]), k))[:_SEARCHED]:
            for row in self.columns[column]:
                if row in rows:
                    best = self._better(best, row, column, thresholds[0])
        for threshold in thresholds:
            if best is not None:
                break
            for row in sorted(rows):
                for column in self.rows[row]:
                    if column in columns:
                        best = self._better(best, row, column, threshold)
        return None if best is None else (best[2], best[3])

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
        self.rows[row] = {}
        self.columns[column] = set()
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

