"""Eigenvalues and eigenvectors in balanced units, with bounds of the rounding errors of eigenvalues, and their order.

An eigenvalue is known to machine precision times the norm of its balanced part of the matrix times its condition
1 / |y^H x| (Wilkinson 1965). For the double zero of a rigid-body motion it is the square root of the precision. Parts
are sets of states: states of no other part act on them, or they act on no other; so the eigenvalues of the matrix are
the eigenvalues of the parts, for any gains between these.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from eomgen.base.arrays import Array, Complex

#: Rounding errors are this many times the bound's unit.
MARGIN = 16.0
EPSILON = float(np.finfo(float).eps)


def balance(A: Array, *, permute: bool = True) -> tuple[Array, Array]:
    """Return B = T^-1 A T and T, (n, n) both; T is diagonal, and permuted if ``permute`` is true.

    SciPy converts the scales to whole numbers, too, to find permutations among the scales. Scales above 2^63 are not a
    permutation and are not used, so the warning of SciPy is suppressed.
    """
    with np.errstate(invalid="ignore"):
        balanced, T = scipy.linalg.matrix_balance(A, permute=permute, separate=False)
    return np.asarray(balanced), np.asarray(T)


def unbalance(T: Array, vectors: Complex) -> Complex:
    """Return T times vectors for the T of ``balance``, which has one number in each row: (n, any)."""
    column = np.argmax(np.abs(T), axis=1)
    result: Complex = vectors[column]
    result *= T[np.arange(len(T)), column][:, np.newaxis]
    return result


def eigenvalues_of_parts(A: Array) -> tuple[Complex, Array]:
    """Return the eigenvalues (n,) of A in no order, and their rounding errors (n,), by parts of states that all act on
    one another, in which A is block triangular."""
    values, errors = np.zeros(len(A), complex), np.zeros(len(A))
    for part in _parts(A, "strong"):
        balanced, _ = balance(A[np.ix_(part, part)])
        values[part], _, cosines = eigenvectors(balanced)
        errors[part] = uncertainties(norm(balanced), values[part], cosines)
    return values, errors


def decomposition(A: Array) -> tuple[Complex, Complex, Array]:
    """Return the eigenvalues (n,) of A, the right eigenvectors (n, n), and the rounding errors of eigenvalues (n,).

    Parts of A that are not coupled are decomposed each, and equal ones once: bending in two planes, bodies that turn
    freely. The work grows with the cube of the number of states.
    """
    parts = _parts(A, "weak")
    values, vectors, errors = np.zeros(len(A), complex), np.zeros(A.shape, complex), np.zeros(len(A))
    known: dict[bytes, tuple[Complex, Complex, Array]] = {}
    for part in parts:
        block = np.ascontiguousarray(A[np.ix_(part, part)]) if len(parts) > 1 else A
        content = block.tobytes() if len(parts) > 1 else b""
        if content not in known:
            of_block, right, cosines = eigenvectors(block)
            known[content] = (of_block, right, uncertainties(norm(block), of_block, cosines))
        values[part], vectors[np.ix_(part, part)], errors[part] = known[content]
    return values, vectors, errors


def eigenvectors(A: Array) -> tuple[Complex, Complex, Array]:
    """Return the eigenvalues (n,) of A, the right eigenvectors (n, n), and |y^H x| of the eigenvectors (n,)."""
    size = _power_of_two(A)  # LAPACK's own scaling loses eigenvalues above 1e138
    solution: Any = scipy.linalg.eig(A / size, left=True, right=True)  # the stubs know of one kind of vectors only
    values, left, right = solution
    return size * values, right, np.abs(np.sum(left.conj() * right, axis=0))


def _parts(A: Array, connection: Literal["weak", "strong"]) -> list[NDArray[np.intp]]:
    """Return the numbers of the states of each part of A. States of parts of the connection ``weak`` and of other parts
    do not act on each other; all states of a ``strong`` part act on one another."""
    labels = part_labels(A != 0.0, connection)
    return np.split(np.argsort(labels, kind="stable"), np.cumsum(np.bincount(labels))[:-1])


def part_labels(coupled: NDArray[np.bool_], connection: Literal["weak", "strong"] = "weak") -> NDArray[np.intp]:
    """Return the number of the part of each state, (n,), by couplings (n, n)."""
    n = len(coupled)
    places = np.flatnonzero(coupled)  # in a fifth of the time of a search by rows and columns
    graph = csr_array((np.ones(len(places)), (places // max(n, 1), places % max(n, 1))), shape=(n, n))
    return np.asarray(connected_components(graph, connection=connection)[1], np.intp)


def _power_of_two(A: Array) -> float:
    """Return the largest power of two up to the largest magnitude of an entry of a matrix; 1/2 for zeros."""
    return float(np.ldexp(1.0, np.frexp(np.max(np.abs(A), initial=0.0))[1] - 1))


def norm(A: Array) -> float:
    """Return the Frobenius norm of a matrix, whose squares neither overflow nor underflow."""
    size = _power_of_two(A)
    return size * float(np.linalg.norm(A / size))


def uncertainties(size: float, values: Complex, cosines: Array) -> Array:
    """Return the rounding errors (n,) of the eigenvalues ``values`` of a matrix with the norm ``size``.

    ``cosines`` (n,) are |y^H x| for left and right eigenvectors of length 1.

    An eigenvalue of m that meet without m eigenvectors moves by the m-th root of the precision at most. m counts the
    eigenvalues that such errors may have parted.
    """
    with np.errstate(divide="ignore"):
        condition = 1.0 / cosines
    orders = np.arange(1, len(values) + 1)
    for k in np.flatnonzero(condition > 1.0 / np.sqrt(EPSILON)):
        reach = 2.0 * size * (MARGIN * EPSILON) ** (1.0 / orders)
        m = max(2, int(np.max(orders[np.sort(np.abs(values - values[k])) <= reach])))
        condition[k] = min(condition[k], EPSILON ** (1.0 / m - 1.0))
    return np.asarray(MARGIN * EPSILON * size * condition)


def verdict(growth: Array, uncertainty: Array) -> str:
    """Return ``stable`` if all motions decay by more than the uncertainty of their growth, both (n,), ``unstable`` if
    one grows by more, else ``marginal``. Without motions ``stable``."""
    if np.any(growth > uncertainty):
        return "unstable"
    return "stable" if np.all(growth < -uncertainty) else "marginal"


def order_of_eigenvalues(values: Complex, uncertainty: Array) -> NDArray[np.intp]:
    """Return the order of eigenvalues: zeros first, then by size, equal ones by decay."""
    first = np.argsort(np.abs(values), kind="stable")
    sizes = np.abs(values[first])
    sizes = np.where(sizes <= uncertainty[first], 0.0, [round(size, 12) for size in sizes.tolist()])
    return np.asarray(first[np.lexsort((values[first].real, sizes))])
