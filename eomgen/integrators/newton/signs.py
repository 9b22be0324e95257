"""Signs that the pivots of a step's matrix have in small steps: other signs show growth that the step cannot follow.

The matrix I - gamma h J has a real eigenvalue 1 - gamma h lambda for each real lambda of J. If a motion grows with
lambda > 1/(gamma h), it is negative, and the step turns and shrinks the growth: a wrong answer without a trace in
q and v. By the inertia of M + gain C + gain^2 K (Sylvester; Parlett, The Symmetric Eigenvalue Problem, 1998, section
3.3) each such mode turns the sign of one pivot, if pivots are on the diagonal; of others their product counts. M is
positive definite, and equations of internal states are taken with a minus, so signs without growth are known
beforehand; with inner unknowns they are taken at the initial state in a much smaller step. Rows of constraints, with
[S B^T; B 0], make as many negative ones in addition to the negative pivots of S on B v = 0 (Haynsworth 1968), at
unknown places, so that only the product decides.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.integrators.newton.matrix import evaluate_terms
from eomgen.integrators.newton.sample_matrices import SampledPartials
from eomgen.integrators.newton.solver import Solver


def pivot_signs(solver: Solver, samples: SampledPartials, gain: float) -> dict[str, Any]:
    """Return the signs that the pivots of a solver made ``at_start`` have without growth, as data of
    ``growth.c.jinja``.

    `gain` is gamma times the step, s; `samples` are needed for inner unknowns only.

    Returns
    -------
    dict
        ``each``: whether every pivot is on the diagonal of the unknowns, so that each sign counts, and otherwise the
        product of signs; ``signs`` of the pivots in order, 1 if the product counts; ``product`` of these signs;
        ``whole``, the sign of the determinant.
    """
    unknowns, elimination = solver.unknowns, solver.elimination
    size = unknowns.matrix_size
    rows, columns = (elimination.rows, elimination.columns) if elimination else (tuple(range(size)),) * 2
    turned = _parity(rows) * _parity(columns)
    each = rows == columns and not unknowns.inner and not unknowns.lam
    if unknowns.inner:
        product = turned * _sign_of_determinant(*_small_matrix(solver, samples, gain))
    else:
        product = turned * (-1) ** (unknowns.z + unknowns.lam)
    of_states = range(unknowns.first_z, unknowns.size)
    return {
        "each": each,
        "signs": [-1 if each and column in of_states else 1 for column in columns],
        "product": product,
        "whole": product * turned,
    }


def _small_matrix(solver: Solver, samples: SampledPartials, gain: float) -> tuple[Array, NDArray[np.intp]]:
    """Return the entries (n,) of the matrix at the initial state, and their rows and columns (2, n), for a gain a
    million times smaller than `gain`."""
    small = 1e-6 * gain
    weights = (1.0, small, small * small, 1.0, 1.0, 1.0, small)
    none = np.zeros((1, 0))
    entries = evaluate_terms(solver.terms, samples.numbers[:1], none, none, weights)
    return np.concatenate(list(entries.values())), np.array(list(entries)).T


def _sign_of_determinant(values: Array, places: NDArray[np.intp]) -> int:
    """Return the sign of the determinant of a sparse matrix with ``values`` (n,) at ``places`` (2, n): 0 if it is
    exactly singular."""
    from scipy.sparse import csc_array  # noqa: PLC0415  # of long trees alone, since SciPy is slow to import
    from scipy.sparse.linalg import splu  # noqa: PLC0415

    try:
        factors = splu(csc_array((values, (places[0], places[1]))))
    except RuntimeError:
        return 0
    turned = _parity(factors.perm_r.tolist()) * _parity(factors.perm_c.tolist())
    return turned * int(np.prod(np.sign(factors.U.diagonal())))


def _parity(order: Sequence[int]) -> int:
    """Return 1 for an even permutation of 0 to n - 1, -1 for an odd one."""
    seen, sign = [False] * len(order), 1
    for start in range(len(order)):
        position, length = start, 0
        while not seen[position]:
            seen[position] = True
            position, length = order[position], length + 1
        if length and length % 2 == 0:
            sign = -sign
    return sign
