"""Signs that the pivots of a step's matrix have in small steps: others tell of growth that the step cannot follow.

The matrix I - gamma h J has a real eigenvalue 1 - gamma h lambda for each real lambda of J. Where something grows with
lambda > 1/(gamma h), it is negative, and the step turns and shrinks what grows: a wrong answer without a sign of it in
q and v. By the inertia of M + gain C + gain^2 K (Sylvester; Parlett, The Symmetric Eigenvalue Problem, 1998, section
3.3) each such mode turns the sign of one pivot, where pivots are on the diagonal; of others their product counts.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from eomgen.arrays import Array
from eomgen.integrators.newton.matrix import MatrixIndex, evaluate_terms
from eomgen.integrators.newton.sample_matrices import Samples
from eomgen.integrators.newton.solver import Solver

#: The matrix is looked at with gains this much smaller than that of the step.
_SMALL = 1e-6


def pivot_signs(solver: Solver, samples: Samples, gain: float) -> dict[str, Any]:
    """Return what ``newton/growth.c.jinja`` reads of a solver that was made ``at_start``.

    Returns
    -------
    dict
        ``each``: whether every pivot is on the diagonal of the unknowns, so that each counts, and otherwise their
        product; ``signs`` of the pivots in their order, 1 where the product counts; ``product`` of these signs;
        ``whole``, the sign of the determinant.
    """
    small = _SMALL * gain
    weights = (1.0, small, small * small, 1.0, 1.0, 1.0, small)
    count, size = len(samples.numbers), solver.unknowns.matrix_size
    none = np.zeros((count, 0))
    entries = evaluate_terms(solver.terms, samples.numbers, none, none, weights)
    elimination = solver.elimination
    rows, columns = (elimination.rows, elimination.columns) if elimination else (tuple(range(size)),) * 2
    found = np.sign(
        [_pivots({index: float(values[k]) for index, values in entries.items()}, rows, columns) for k in range(count)]
    )
    each = rows == columns and not solver.unknowns.inner
    product = 1 if np.sum(np.prod(found, axis=1)) >= 0.0 else -1
    return {
        "each": each,
        "signs": [-1 if total < 0.0 else 1 for total in np.sum(found, axis=0)] if each else [1] * size,
        "product": product,
        "whole": product * _parity(rows) * _parity(columns),
    }


def _pivots(entries: dict[MatrixIndex, float], rows: tuple[int, ...], columns: tuple[int, ...]) -> Array:
    """Return the pivots of a sparse matrix that is eliminated in a given order; zero from where it breaks down."""
    row_at = {row: position for position, row in enumerate(rows)}
    column_at = {column: position for position, column in enumerate(columns)}
    by_row: list[dict[int, float]] = [{} for _ in rows]
    below: list[set[int]] = [set() for _ in rows]
    for (row, column), value in entries.items():
        by_row[row_at[row]][column_at[column]] = value
        below[column_at[column]].add(row_at[row])
    pivots = np.zeros(len(rows))
    for position, own in enumerate(by_row):
        pivot = own.get(position, 0.0)
        if pivot == 0.0 or not np.isfinite(pivot):
            break
        pivots[position] = pivot
        across = [(column, value) for column, value in own.items() if column > position]
        for row in below[position]:
            if row > position and (factor := by_row[row].get(position, 0.0) / pivot) != 0.0:
                for column, value in across:
                    by_row[row][column] = by_row[row].get(column, 0.0) - factor * value
                    below[column].add(row)
    return pivots


def _parity(order: tuple[int, ...]) -> int:
    """Return 1 for an even permutation, -1 for an odd one."""
    seen, sign = [False] * len(order), 1
    for start in range(len(order)):
        place, length = start, 0
        while not seen[place]:
            seen[place] = True
            place, length = order[place], length + 1
        if length and length % 2 == 0:
            sign = -sign
    return sign
