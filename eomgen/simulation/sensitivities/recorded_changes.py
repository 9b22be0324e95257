"""Changes of vectors as a record of how each follows from others, from which adjoints are pulled back.

Changes that are taken along directions are arrays (n, size, directions); ``RecordedChange`` stands in their place where
all of what they are for is one product from the left. All of it is linear, so each entry keeps transposes alone.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
Pull = Callable[[Array], Array]


class Record:
    """The changes in the order in which they were made."""

    def __init__(self) -> None:
        self.entries: list[Sequence[tuple[int, Pull]]] = []

    def change(self, size: int, *pulls: tuple[RecordedChange, Pull]) -> RecordedChange:
        """Return a change of vectors of a size; ``pulls``: what it follows from, and what adjoints of it make there."""
        self.entries.append([(source.number, pull) for source, pull in pulls])
        return RecordedChange(self, len(self.entries) - 1, size)

    def pulled(self, end: RecordedChange, adjoint: Array) -> Array:
        """Return adjoints of the first change, (n, size, functionals), by those of another."""
        adjoints = {end.number: adjoint}
        for number in range(end.number, 0, -1):
            own = adjoints.pop(number, None)
            if own is None:
                continue
            for source, pull in self.entries[number]:
                taken = pull(own)
                adjoints[source] = adjoints[source] + taken if source in adjoints else taken
        return adjoints[0]


class RecordedChange:
    """A change that is an entry of a record."""

    __array_ufunc__ = None  # products with arrays are those of this class

    def __init__(self, record: Record, number: int, size: int) -> None:
        self.record, self.number, self.size = record, number, size

    def __add__(self, other: RecordedChange) -> RecordedChange:
        return self.record.change(self.size, (self, _same), (other, _same))

    def __sub__(self, other: RecordedChange) -> RecordedChange:
        return self.record.change(self.size, (self, _same), (other, lambda adjoint: -adjoint))

    def __rmul__(self, factor: float) -> RecordedChange:
        return self.record.change(self.size, (self, lambda adjoint: factor * adjoint))

    def __rmatmul__(self, matrix: Array) -> RecordedChange:
        return self.record.change(matrix.shape[1], (self, lambda adjoint: np.swapaxes(matrix, 1, 2) @ adjoint))

    def __getitem__(self, place: tuple[slice, slice]) -> RecordedChange:
        numbers = np.arange(self.size)[place[1]]

        def pull(adjoint: Array) -> Array:
            found = np.zeros((len(adjoint), self.size, adjoint.shape[2]), adjoint.dtype)
            found[:, numbers] = adjoint
            return found

        return self.record.change(len(numbers), (self, pull))


def stacked(parts: Sequence[Any]) -> Any:
    """Return changes, one below the other."""
    if not isinstance(parts[0], RecordedChange):
        return np.concatenate(parts, axis=1)
    ends = np.cumsum([0, *(part.size for part in parts)]).tolist()
    pulls = [(part, _rows(first, last)) for part, first, last in zip(parts, ends[:-1], ends[1:], strict=True)]
    return parts[0].record.change(ends[-1], *pulls)


def solved(matrix: Array, change: Any) -> Any:
    """Return what a matrix (n, size, size) makes a change of."""
    if not isinstance(change, RecordedChange):
        return np.linalg.solve(matrix, change)
    return change.record.change(
        change.size, (change, lambda adjoint: np.linalg.solve(np.swapaxes(matrix, 1, 2), adjoint))
    )


def _same(adjoint: Array) -> Array:
    return adjoint


def _rows(first: int, last: int) -> Pull:
    return lambda adjoint: adjoint[:, first:last]
