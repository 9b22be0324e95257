"""Elimination of a sparse matrix of known pattern; order and pivots are chosen once from sample values.

Threshold Markowitz: of the entries that are large enough in their column in every sample, the one that fills in least.
Markowitz, Management Science 3 (1957) 255; Duff, Erisman and Reid, Direct Methods for Sparse Matrices (2017).

Rows of ``groups`` hold the sum over the columns of the group in place of the diagonal entry, which is the sum minus the
entries off the diagonal. With d for the sum, w for entries off the diagonal with a minus, and pivot k,

    p = d_k + sum_j w_kj,   w_ij + w_ik w_kj / p,   d_i + w_ik d_k / p,

so there is no subtraction if all of these are positive: Grassmann, Taksar and Heyman, Operations Research 33 (1985)
1107. Pivots of such rows are on the diagonal. Sums over columns of other groups go with other pivots' rows.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.errors import ModelError, Problem
from eomgen.system.system import WHOLE, Sample

#: A pivot is at least this part of the largest entry of its column among the rows of its stage, in every sample.
THRESHOLD = 0.02
#: Number of stages above which the limit decreases with the cube of the number, so that fewer of many stages have
#: separate code.
_MANY = 16
#: Threshold of a last resort.
_LAST_THRESHOLDS = (1e-3, 1e-8)


@dataclass(frozen=True)
class Elimination:
    """Symbolic LU factorization; position k belongs to the k-th pivot.

    Attributes
    ----------
    rows, columns : (N,)
        Row and column of the matrix at each position.
    lower, upper : (N,) tuples of positions, increasing
        Row by row, the nonzeros of L (left of the pivot) and U (right of it).
    operations : int
        Multiply-subtracts of the factorization.
    stages : positions at which the stages begin, without empty stages.
    groups : (N,)
        At each position the group number of its unknown, -1 for none.
    """

    rows: tuple[int, ...]
    columns: tuple[int, ...]
    lower: tuple[tuple[int, ...], ...]
    upper: tuple[tuple[int, ...], ...]
    operations: int
    stages: tuple[int, ...] = (0,)
    groups: tuple[int, ...] = ()

    @property
    def size(self) -> int:
        return len(self.rows)

    @property
    def solve_operations(self) -> int:
        """Multiply-subtracts and multiplications of one solution."""
        return self.size + sum(map(len, self.lower)) + sum(map(len, self.upper))


def _singular(samples: Mapping[tuple[int, int], Array], constrained: bool) -> ModelError:
    """Return the error for a matrix without enough pivots, with possible causes."""
    if constrained:
        why = "constraints repeat each other, or a mass is missing"
        hint = "remove constraints that say the same twice, and give every moving part a mass"
    else:
        sizes = np.abs(np.concatenate([np.ravel(values) for values in samples.values()]))
        sizes = sizes[np.logical_and(sizes > 0.0, np.isfinite(sizes))]
        why = "a mass is missing, or masses and stiffnesses differ by more orders of magnitude than numbers have digits"
        why += f" (entries from {sizes.min():.1g} to {sizes.max():.1g})" if sizes.size else ""
        hint = "give every moving part a mass, and stiffnesses and lengths that differ less"
    return ModelError(Problem("iteration matrix", f"it is singular at the initial state: {why} [E0357]", hint))


def eliminate(
    size: int,
    samples: Mapping[tuple[int, int], Array],
    stages: Sequence[tuple[Sequence[int], Sequence[int]]] | None = None,
    *,
    groups: Sequence[Sequence[int]] = (),
    constrained: bool = False,
    diagonal_first: bool = False,
    sample: Sample = WHOLE,
) -> Elimination:
    """Return the symbolic factorization of a sparse matrix, with pivots chosen stage by stage at sample values.

    Stages of equal structure repeat the choice of the first; of many stages, a stage leaves the same columns to the
    next one as its example did.

    Parameters
    ----------
    size : number of rows and columns
    samples : mapping from (row, column) to (n,) values
        Every entry that is not zero by structure, at n states of the system.
    stages : sequence of (rows, columns), optional
        Candidates of pivots, stage by stage; rows without a pivot wait for the next stage.
    groups : unknowns whose rows have the sum over the group on the diagonal.
    constrained : whether there are rows of constraints, for messages.
    diagonal_first : whether diagonal pivots are preferred among pivots of equal fill, so that their signs are the
        inertia of the matrix.
    sample : of the scene that is meant; keeps the choices for later eliminations

    Raises
    ------
    ModelError
        When some sample is singular.
    """
    plan = list(stages) if stages is not None else [(range(size), range(size))]
    meant = sample.growth * len(plan)
    # of many stages, pivots of a tenth count as equal, so that the choice depends little on their number
    state = _ActiveSubmatrix(size, samples, groups, diagonal_first, 0.1 if meant > _MANY else 1.0)
    pivots, starts = _PivotOrder(state), list[int]()
    orders: dict[object, list[tuple[int, int]]] = sample.orders_of(diagonal_first)
    # a pivot that an earlier stage of the same structure chose may be smaller: one order for all is one piece of code
    repeated = THRESHOLD / 10 * (_MANY / max(meant, _MANY)) ** 3
    # in a long chain, pivots of the first stages may be too small, and each stage then leaves a column to the next one:
    # stages to which earlier ones leave columns serve as an example as well
    long = meant > 200 or sample.orders is not None
    for number, (new_rows, new_columns) in enumerate(plan):
        begun, last = len(pivots.rows), number == len(plan) - 1
        delayed = bool(state.columns_of_stage)
        late_rows, late_columns = state.remaining_indices(long=long)
        rows, columns = [*late_rows, *new_rows], [*late_columns, *new_columns]
        state.rows_of_stage |= set(new_rows)
        state.columns_of_stage |= set(new_columns)
        state.sizes.clear()
        structure = None
        if long or not delayed:
            structure = len(late_rows), len(late_columns), state.structure(rows, columns)
        example = orders.get(structure)
        served = pivots.follow([(rows[i], columns[j]) for i, j in example or ()], repeated)
        if not (long and example is not None and served and not last):
            pivots.search((THRESHOLD, *_LAST_THRESHOLDS) if last else (THRESHOLD,))
        if structure is not None and example is None and (long or not state.columns_of_stage):
            orders[structure] = pivots.numbers_within(rows, columns, begun)
        if len(pivots.rows) > begun:
            starts.append(begun)
    if len(pivots.rows) < size:
        raise _singular(samples, constrained)
    return pivots.elimination(starts)


class _PivotOrder:
    """Pivots in the order of their elimination, and the fill of each."""

    def __init__(self, state: _ActiveSubmatrix) -> None:
        self.state, self.rows, self.columns = state, list[int](), list[int]()
        self._left, self._right, self._operations = [list[int]() for _ in state.rows], list[list[int]](), 0

    def _take(self, row: int, column: int) -> None:
        """Eliminate with a pivot."""
        self.state.rows_of_stage.discard(row)
        self.state.columns_of_stage.discard(column)
        below, beside = self.state.eliminate(row, column)
        self._operations += len(below) * len(beside)
        for number in below:
            self._left[number].append(len(self.rows))
        self._right.append(beside)
        self.rows.append(row)
        self.columns.append(column)

    def follow(self, pairs: Iterable[tuple[int, int]], threshold: float) -> bool:
        """Take pivots as long as they are large enough; return whether all are."""
        for row, column in pairs:
            if not self.state.serves(row, column, threshold):
                return False
            self._take(row, column)
        return True

    def search(self, thresholds: Sequence[float]) -> None:
        """Take the best pivots of the stage, as long as there are any."""
        while self.state.columns_of_stage and (pivot := self.state.pivot(thresholds)) is not None:
            self._take(*pivot)

    def numbers_within(self, rows: Sequence[int], columns: Sequence[int], begun: int) -> list[tuple[int, int]]:
        """Return the pivots from ``begun`` on, numbered within the rows and columns of a stage."""
        row_at = {row: k for k, row in enumerate(rows)}
        column_at = {column: k for k, column in enumerate(columns)}
        return [(row_at[i], column_at[j]) for i, j in zip(self.rows[begun:], self.columns[begun:], strict=True)]

    def elimination(self, starts: Sequence[int]) -> Elimination:
        """Return the factorization; ``starts``: positions at which the stages begin."""
        position_of = {column: position for position, column in enumerate(self.columns)}
        lower = tuple(tuple(self._left[row]) for row in self.rows)
        upper = tuple(tuple(sorted(position_of[column] for column in beside)) for beside in self._right)
        groups = tuple(self.state.group[column] for column in self.columns) if self.state.grouped else ()
        return Elimination(tuple(self.rows), tuple(self.columns), lower, upper, self._operations, tuple(starts), groups)


#: Cost, whether another place is preferred, the size with a minus, row and column.
_Candidate = tuple[float, bool, float, int, int]


class _ActiveSubmatrix:
    """The submatrix that remains in an elimination, at all samples.

    Attributes
    ----------
    rows : for each row, the place of each entry in ``values`` by column
    columns : for each column, its rows
    values : (places, n) scaled samples; place 0 is reserved, not an entry
    group : for each unknown the number of its group, -1 for none
    rows_of_stage, columns_of_stage : candidates of pivots
    """

    def __init__(
        self,
        size: int,
        samples: Mapping[tuple[int, int], Array],
        groups: Sequence[Sequence[int]],
        diagonal_first: bool,
        alike: float,
    ) -> None:
        """Store all entries of a matrix of `size` rows, equilibrated; see ``eliminate`` for the arguments. `alike`:
        part of the largest entry from which candidates of pivots count as equal."""
        self.diagonal_first, self.grouped, self.alike = diagonal_first, bool(groups), alike
        self.group = [-1] * size
        for number, group in enumerate(groups):
            for k in group:
                self.group[k] = number
        self.rows: list[dict[int, int]] = [{} for _ in range(size)]
        self.columns: list[set[int]] = [set() for _ in range(size)]
        self.used, scaled = len(samples) + 1, _equilibrate(size, samples, groups)
        self.values = np.zeros((2 * self.used, scaled.shape[1]))
        self.values[1 : self.used] = scaled
        for slot, (row, column) in enumerate(samples, 1):
            self.rows[row][column] = slot
            self.columns[column].add(row)
        self.rows_of_stage: set[int] = set()
        self.columns_of_stage: set[int] = set()
        self.sizes: dict[int, dict[float, dict[int, float]]] = {}  # by column, threshold and row, while they hold

    def remaining_indices(self, *, long: bool) -> tuple[list[int], list[int]]:
        """Return the rows and columns that earlier stages leave; none unless there are many stages."""
        return (sorted(self.rows_of_stage), sorted(self.columns_of_stage)) if long else ([], [])

    def structure(self, rows: Sequence[int], columns: Sequence[int]) -> tuple[int, int, tuple[tuple[int, int], ...]]:
        """Return the nonzeros of a stage, with rows and columns numbered within the stage."""
        number = {column: k for k, column in enumerate(columns)}
        nonzeros = [(i, number[column]) for i, row in enumerate(rows) for column in self.rows[row] if column in number]
        return len(rows), len(columns), tuple(sorted(nonzeros))

    def pivot(self, thresholds: Sequence[float]) -> tuple[int, int] | None:
        """Return row and column of the pivot with the least fill in the stage; None if no candidate is large enough.
        Candidates are at least a threshold times the largest entry of their column in every sample; smaller
        `thresholds` are tried if there is none. A few short rows and columns are searched before all."""
        rows, columns = self.rows_of_stage, self.columns_of_stage
        best: _Candidate | None = None
        few = slice(4)
        for row in sorted(rows, key=lambda k: (len(self.rows[k]), k))[few]:
            for column in self.rows[row]:
                if column in columns:
                    best = self._better(best, row, column, thresholds[0])
        for column in sorted(columns, key=lambda k: (len(self.columns[k]), k))[few]:
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
        return None if best is None else best[3:]

    def serves(self, row: int, column: int, threshold: float) -> bool:
        """Return whether an entry is large enough in its column, in every sample."""
        return column in self.rows[row] and self._size(row, column, threshold) > 0.0

    def _size(self, row: int, column: int, threshold: float) -> float:
        """Return the smallest ratio of an entry to the largest of its column within the stage; 0 if the entry cannot be
        a pivot."""
        if self.group[row] >= 0 or self.group[column] >= 0:
            if row != column:
                return 0.0
            pivot = self._pivot_value(row, column)
            return 1.0 if np.all(np.isfinite(pivot) & (pivot != 0.0)) else 0.0
        of_column = self.sizes.setdefault(column, {})
        if threshold not in of_column:
            of_column[threshold] = self._sizes_in(column, threshold)
        return of_column[threshold].get(row, 0.0)

    def _sizes_in(self, column: int, threshold: float) -> dict[int, float]:
        """Return by row the smallest ratio, over the samples, of an entry of a column to the largest entry of the stage
        there. Only entries that can be a pivot are included: at least `threshold` times the largest in every sample,
        and not zero."""
        all_rows = self.columns[column]
        near = [row for row in all_rows if row in self.rows_of_stage]
        entries = np.abs(self.values[[self.rows[row][column] for row in near]])
        largest = entries.max(axis=0)
        able = np.all((entries > 1e-13) & (entries >= threshold * largest), axis=1)
        if len(all_rows) > 1:
            # the iteration makes up for digits lost to growth: the residual does not depend on the factors
            largest_of_all = np.abs(self.values[[self.rows[row][column] for row in all_rows]]).max(axis=0)
            able &= np.all(entries >= 1e-6 * largest_of_all, axis=1)
        return {near[k]: float(np.min(entries[k] / largest)) for k in np.flatnonzero(able)}

    def _better(self, best: _Candidate | None, row: int, column: int, threshold: float) -> _Candidate | None:
        cost = float((len(self.rows[row]) - 1) * (len(self.columns[column]) - 1))
        if (best is not None and cost > best[0]) or not (size := self._size(row, column, threshold)):
            return best
        candidate = (cost, self.diagonal_first and row != column, -min(size, self.alike), row, column)
        return candidate if best is None or candidate < best else best

    def _sums(self, row: int) -> dict[int, Array]:
        """Return the sums (n,) of a row over the columns of each group, by group. The diagonal is left out if the row
        belongs to a group, whose sum stands there."""
        result: dict[int, Array] = {}
        for column, slot in self.rows[row].items():
            group = self.group[column]
            if group >= 0 and (column != row or self.group[row] < 0):
                result[group] = result.get(group, 0.0) + self.values[slot]
        return result

    def _pivot_value(self, row: int, column: int) -> Array:
        entry: Array = self.values[self.rows[row][column]]
        return entry - self._sums(row).get(self.group[row], 0.0) if self.group[row] >= 0 else entry

    def eliminate(self, row: int, column: int) -> tuple[list[int], list[int]]:
        """Subtract the pivot row from all rows below, and remove row and column of the pivot from the submatrix.
        Returns the sorted rows that change, and the sorted columns of the pivot row. Rows with a group keep sums
        without subtraction."""
        pivot_row, group = self.rows[row], self.group[row]
        for changed in pivot_row:
            self.sizes.pop(changed, None)
        pivot = self._pivot_value(row, column)
        sums = self._sums(row) if self.grouped else {}
        if group >= 0:
            sums[group] = self.values[pivot_row[column]]
        del pivot_row[column]
        beside = sorted(pivot_row)
        self.columns[column].discard(row)
        below = sorted(self.columns[column])
        factors = self.values[[self.rows[number].pop(column) for number in below]] / pivot
        for other_column in pivot_row:
            self.columns[other_column].discard(row)
            self.columns[other_column].update(below)
        places: list[list[int]] = []
        for number, factor in zip(below, factors, strict=True):
            target = self.rows[number]
            if self.group[number] in sums:
                slot = target[number]
                self.values[slot] = self.values[slot] - factor * sums[self.group[number]]
            for other_column in [other_column for other_column in pivot_row if other_column not in target]:
                target[other_column] = self.used
                self.used += 1
            places.append([target[other_column] for other_column in pivot_row])
            if self.group[number] >= 0 and number in pivot_row:
                places[-1][list(pivot_row).index(number)] = 0
        if self.used > len(self.values):
            self.values = np.concatenate([self.values, np.zeros((self.used, self.values.shape[1]))])
        if below:
            products = factors[:, np.newaxis] * self.values[list(pivot_row.values())]
            self.values[places] = self.values[places] - products
        self.rows[row] = {}
        self.columns[column] = set()
        return below, beside


def _equilibrate(size: int, samples: Mapping[tuple[int, int], Array], groups: Sequence[Sequence[int]]) -> Array:
    """Return the entries (n, samples) with rows and columns scaled so that the largest of each is about 1 (Ruiz 2001).

    Every sample has separate scales: stiffness and inertia of an entry may differ by more orders of magnitude than
    numbers have digits, through the unit of time alone. Columns of a group have a common scale, so that row sums over
    the group remain sums.
    """
    indices = np.array(list(samples), dtype=np.intp).reshape(-1, 2)
    values = np.array(list(samples.values()), dtype=float)
    magnitude = np.abs(values)
    row_scale, column_scale = np.ones((2, size, values.shape[1]))
    for _ in range(8):
        scaled = magnitude * row_scale[indices[:, 0]] * column_scale[indices[:, 1]]
        for scale, index in ((row_scale, indices[:, 0]), (column_scale, indices[:, 1])):
            largest = np.zeros_like(scale)
            np.maximum.at(largest, index, scaled)
            scale[:] = scale / np.sqrt(np.where(largest > 0.0, largest, 1.0))
        for group in groups:
            column_scale[list(group)] = np.max(column_scale[list(group)], axis=0)
    return values * (row_scale[indices[:, 0]] * column_scale[indices[:, 1]])
