"""Symmetric banded matrices of fixed-point numbers, and modes of a pencil (K, M) to full precision.

Rayleigh's quotient iteration starts from SciPy's eigenvectors and triples the digits in every step (B. N.
Parlett, The Symmetric Eigenvalue Problem, 1980, section 4.6). So the result does not depend on the library or the
processor.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mpmath
import numpy as np
import scipy.linalg

_STEPS = 4


class Banded:
    """A symmetric matrix; ``rows[i][j]`` is its entry (i, i - j)."""

    def __init__(self, size: int, width: int) -> None:
        self.rows = [[mpmath.mpf(0)] * (width + 1) for _ in range(size)]
        self.width = width

    def add(self, row: int, column: int, value: Any) -> None:
        """Add to an entry on or below the diagonal."""
        self.rows[row][row - column] += value

    def restricted(self, kept: Sequence[int]) -> Banded:
        """Return the matrix of the given rows and columns, in order."""
        result = Banded(len(kept), self.width)
        for new, row in enumerate(kept):
            for other in range(max(0, new - self.width), new + 1):
                if row - kept[other] <= self.width:
                    result.rows[new][new - other] = self.rows[row][row - kept[other]]
        return result

    def applied(self, vector: Sequence[Any]) -> list[Any]:
        """Return the product with a vector."""
        result = [row[0] * value for row, value in zip(self.rows, vector, strict=True)]
        for k, row in enumerate(self.rows):
            for below in range(1, min(self.width, k) + 1):
                result[k] += row[below] * vector[k - below]
                result[k - below] += row[below] * vector[k]
        return result

    def product(self, left: Sequence[Any], right: Sequence[Any]) -> Any:
        """Return left^T matrix right."""
        return mpmath.fdot(left, self.applied(right))

    def less(self, factor: Any, other: Banded) -> Banded:
        """Return the matrix minus a multiple of another."""
        result = Banded(len(self.rows), self.width)
        for k, (mine, theirs) in enumerate(zip(self.rows, other.rows, strict=True)):
            result.rows[k] = [entry - factor * part for entry, part in zip(mine, theirs, strict=True)]
        return result

    def solved(self, right: Sequence[Any]) -> list[Any]:
        """Return the solution x of matrix x = right, by L D L^T without pivoting; the precision suffices."""
        rows, x, size = [list(row) for row in self.rows], list(right), len(self.rows)
        for pivot in range(size):
            below = range(pivot + 1, min(pivot + self.width, size - 1) + 1)
            column = [rows[row][row - pivot] for row in below]
            rows[pivot][0] = rows[pivot][0] or mpmath.eps  # the shift of a mode that is found to its last digit
            for row, entry in zip(below, column, strict=True):
                factor = entry / rows[pivot][0]
                for other in range(pivot + 1, row + 1):
                    rows[row][row - other] -= factor * column[other - pivot - 1]
                rows[row][row - pivot] = factor
                x[row] -= factor * x[pivot]
        for pivot in reversed(range(size)):
            x[pivot] /= rows[pivot][0]
            for row in range(pivot + 1, min(pivot + self.width, size - 1) + 1):
                x[pivot] -= rows[row][row - pivot] * x[row]
        return x

    def doubles(self) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
        """Return the dense matrix in double precision."""
        result = np.zeros((len(self.rows),) * 2)
        for k, row in enumerate(self.rows):
            for below in range(min(self.width, k) + 1):
                result[k, k - below] = result[k - below, k] = float(row[below])
        return result


def modes(stiffness: Banded, mass: Banded, first: int, count: int) -> list[list[Any]]:
    """Return modes, (count, n), of K x = w^2 M x from number ``first`` on by frequency, not normalised."""
    wanted = (first, first + count - 1)
    squares, guesses = scipy.linalg.eigh(stiffness.doubles(), mass.doubles(), subset_by_index=wanted)
    shapes = []
    for square, guess in zip(squares, guesses.T, strict=True):
        mode, shift = [mpmath.mpf(float(entry)) for entry in guess], mpmath.mpf(float(square))
        for _ in range(_STEPS):
            mode = stiffness.less(shift, mass).solved(mass.applied(mode))
            length = mpmath.sqrt(mass.product(mode, mode))
            mode = [entry / length for entry in mode]
            shift = stiffness.product(mode, mode)
        shapes.append(mode)
    return shapes
