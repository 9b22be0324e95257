"""Frontal elimination: stages with equal structure share one function, parametrised by index offsets.

A front holds the rows of U and the columns of L of its pivots in one run of the factors. Updates of later entries
are subtracted there, in the runs of the fronts above it: Duff and Reid, ACM TOMS 9 (1983) 302. For a
tree this is the elimination of one body after the other from the tips to the root.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from eomgen.base.data import dataclass
from eomgen.integrators.newton.elimination import Elimination
from eomgen.integrators.newton.matrix import MatrixIndex

#: A row or column of a front: (0, offset) of the front itself, (k, offset) of the k-th front that receives
#: contributions.
Local = tuple[int, int]


@dataclass(frozen=True)
class Fronts:
    """A factorization as fronts.

    Attributes
    ----------
    kinds : computations of the distinct structures; see ``_Front.work``.
    kind_of : the number of each front's kind, in the order of elimination.
    table : for each front, the starts of its factors, entries, positions; then factors and positions of the fronts it
        reaches.
    read_order : the matrix' entries in the order in which fronts read them.
    slots : place of each factor of the elimination, by (row position, column position).
    """

    kinds: tuple[Mapping[str, Any], ...]
    kind_of: tuple[int, ...]
    table: tuple[tuple[int, ...], ...]
    read_order: tuple[MatrixIndex, ...]
    slots: Mapping[MatrixIndex, int]

    @property
    def operations(self) -> int:
        """Multiply-subtracts that are written out."""
        return sum(
            len(taken["updates"]) + len(taken["outside"])
            for kind in self.kinds
            for row in kind["rows"]
            for taken in row["taken"]
        )


def fewest_operations(elimination: Elimination) -> int:
    """Return a lower bound of ``Fronts.operations``, which is found without fronts.

    Fronts of one kind agree in the numbers of rows and columns of their pivots; of each such shape one is counted.
    """
    starts = [start for start in elimination.stages if start < elimination.size]
    below = [0] * elimination.size
    for across in elimination.lower:
        for column in across:
            below[column] += 1
    pivots = list(zip(below, map(len, elimination.upper), strict=True))
    shapes = {tuple(pivots[start:end]) for start, end in zip(starts, [*starts[1:], elimination.size], strict=True)}
    return sum(rows * columns for shape in shapes for rows, columns in shape)


def make_fronts(elimination: Elimination, entries: Sequence[MatrixIndex], sided: int | None = None) -> Fronts:
    """Cut an elimination at the ends of its stages.

    Parameters
    ----------
    entries : (row, column) of the matrix, in any order
    sided : number of the first rows that can have right sides, all by default; other rows have zero ones
    """
    starts = [start for start in elimination.stages if start < elimination.size]
    ends = [*starts[1:], elimination.size]
    front_of = [number for number, (start, end) in enumerate(zip(starts, ends, strict=True)) for _ in range(start, end)]
    below: list[list[int]] = [[] for _ in range(elimination.size)]
    for row, across in enumerate(elimination.lower):
        for column in across:
            below[column].append(row)
    row_at = {row: position for position, row in enumerate(elimination.rows)}
    column_at = {column: position for position, column in enumerate(elimination.columns)}
    at_positions = {(row_at[row], column_at[column]): (row, column) for row, column in entries}
    live = [sided is None or row < sided for row in elimination.rows]
    for position, rows in enumerate(below):
        if live[position]:
            for row in rows:
                live[row] = True
    fronts = [
        _Front(start, range(start, end), elimination, below, at_positions, starts, front_of, live)
        for start, end in zip(starts, ends, strict=True)
    ]
    for front in fronts:
        for target in front.targets:
            fronts[front_of[min(target)]].receive(target)
    kinds: dict[str, int] = {}
    descriptions: list[Mapping[str, Any]] = []
    kind_of: list[int] = []
    for front in fronts:
        work = front.work(fronts, front_of)
        key = repr(work)
        if key not in kinds:
            kinds[key] = len(descriptions)
            descriptions.append(work)
        kind_of.append(kinds[key])
    first_factor, first_entry = [0], [0]
    for front in fronts:
        first_factor.append(first_factor[-1] + len(front.own))
        first_entry.append(first_entry[-1] + len(front.read))
    table: list[tuple[int, ...]] = []
    for number, front in enumerate(fronts):
        begins = [first_factor[number], first_entry[number], front.start]
        for reached in front.reached:
            begins += [first_factor[reached], starts[reached]]
        table.append(tuple(begins))
    slots = {
        index: first_factor[number] + k for number, front in enumerate(fronts) for index, k in front.number.items()
    }
    read_order = [at_positions[index] for front in fronts for index in front.read]
    return Fronts(tuple(descriptions), tuple(kind_of), tuple(table), tuple(read_order), slots)


class _Front:
    """The pivots of one stage."""

    def __init__(
        self,
        start: int,
        pivots: range,
        elimination: Elimination,
        below: Sequence[Sequence[int]],
        entries: Mapping[MatrixIndex, MatrixIndex],
        starts: Sequence[int],
        front_of: Sequence[int],
        live: Sequence[bool],
    ) -> None:
        self.start, self.pivots = start, pivots
        self.live = {pivot: live[pivot] for pivot in pivots}
        self.upper = {pivot: elimination.upper[pivot] for pivot in pivots}
        self.below = {pivot: below[pivot] for pivot in pivots}
        border = sorted({k for pivot in pivots for k in (*self.upper[pivot], *self.below[pivot]) if k not in pivots})
        self.reached = sorted({front_of[k] for k in border})
        order = {number: k for k, number in enumerate(self.reached, 1)}
        self.local: dict[int, Local] = {k: (0, k - start) for k in pivots}
        self.local |= {k: (order[front_of[k]], k - starts[front_of[k]]) for k in border}
        self.own: list[MatrixIndex] = []
        for pivot in pivots:
            self.own += [
                (pivot, pivot),
                *((pivot, k) for k in self.upper[pivot]),
                *((k, pivot) for k in self.below[pivot]),
            ]
        self.number = {index: k for k, index in enumerate(self.own)}
        self.read = [index for index in self.own if index in entries]
        self.targets = sorted(
            {(row, k) for pivot in pivots for row in self.below[pivot] for k in self.upper[pivot]} - set(self.own)
        )
        self.received: set[MatrixIndex] = set()

    def receive(self, index: MatrixIndex) -> None:
        self.received.add(index)

    def work(self, fronts: Sequence[_Front], front_of: Sequence[int]) -> dict[str, Any]:
        """Return the work of a front, in numbers of its own.

        ``size`` factors, ``pivots`` of them; ``rows``, rows of pivots first, with the updates ``taken`` from each: the
        factor in ``slot``, by the ``pivot``, which ``updates`` (factor, by which of an upper row) and goes ``outside``
        (number in ``targets``); ``loads`` [factor, entry or -1, whether others subtracted something before]; rows of
        pivots have their ``diagonal``, ``upper`` factors and the ``columns`` [front, offset] that both are in; others
        have ``targets`` [front reached, factor there];
        for right sides ``forward`` [[front, offset], [[factor, own position], ...]] of each row and ``backward`` [own
        position, diagonal or -1 if the right side stays zero, [[factor, [front, offset]], ...]].
        """
        below: dict[int, list[int]] = {pivot: [] for pivot in self.pivots}
        for pivot in self.pivots:
            for row in self.below[pivot]:
                below.setdefault(row, []).append(pivot)
        entry = {index: k for k, index in enumerate(self.read)}
        return {
            "size": len(self.own),
            "pivots": len(self.pivots),
            "entries": len(self.read),
            "reached": len(self.reached),
            "rows": [self._row(row, below[row], entry, fronts, front_of) for row in sorted(below)],
            "forward": self._forward(),
            "backward": [
                [
                    pivot - self.start,
                    self.number[pivot, pivot] if self.live[pivot] else -1,
                    [[self.number[pivot, k], list(self.local[k])] for k in self.upper[pivot]],
                ]
                for pivot in reversed(self.pivots)
            ],
        }

    def _row(
        self,
        row: int,
        earlier: Sequence[int],
        entry: Mapping[MatrixIndex, int],
        fronts: Sequence[_Front],
        front_of: Sequence[int],
    ) -> dict[str, Any]:
        """Return the work on a row, from which the rows of ``earlier`` pivots are taken."""
        own = row in self.pivots
        upper = [(row, k) for k in (row, *self.upper[row])] if own else []
        outside = {index: k for k, index in enumerate(index for index in self.targets if index[0] == row)}
        taken = []
        for pivot in earlier:
            by = [((row, k), self.number[pivot, k]) for k in self.upper[pivot]]
            taken.append(
                {
                    "slot": self.number[row, pivot],
                    "pivot": self.number[pivot, pivot],
                    "updates": [[self.number[index], slot] for index, slot in by if index in self.number],
                    "outside": [[outside[index], slot] for index, slot in by if index not in self.number],
                }
            )
        loaded = [*((row, pivot) for pivot in earlier), *upper]
        made = {
            "loads": [[self.number[index], entry.get(index, -1), index in self.received] for index in loaded],
            "taken": taken,
        }
        if own:
            columns = [list(self.local[k]) for _, k in upper]
            slots = [self.number[index] for index in upper]
            return made | {"diagonal": slots[0], "upper": slots[1:], "columns": columns, "targets": []}
        targets = [(front_of[min(index)], index) for index in outside]
        return made | {
            "targets": [[self.reached.index(front) + 1, fronts[front].number[index]] for front, index in targets]
        }

    def _forward(self) -> list[Any]:
        """Return the terms subtracted from each row, own rows first, since later ones use them."""
        terms: dict[int, list[list[int]]] = {pivot: [] for pivot in self.pivots if self.live[pivot]}
        for pivot in self.pivots:
            for row in self.below[pivot] if self.live[pivot] else ():
                terms.setdefault(row, []).append([self.number[row, pivot], pivot - self.start])
        used = {own for products in terms.values() for _, own in products}
        return [
            [list(self.local[row]), products]
            for row, products in sorted(terms.items())
            if products or row - self.start in used
        ]
