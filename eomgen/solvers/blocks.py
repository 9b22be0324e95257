"""Square matrices by their diagonal blocks that are not coupled, as of scenes of many bodies without joints: spectra,
products, solutions, and inverse roots of inertia matrices.

A matrix with few components, or with many couplings, is one block.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgecon, dgetrf, dgetrs, dtrtri
from scipy.sparse import csc_array, csr_array
from scipy.sparse.csgraph import connected_components, reverse_cuthill_mckee

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.solvers.bordered_newton import Matrix, columns_of, whole

#: Eigenvalues of the stiffness below this part of the largest are zero: no force opposes these directions.
SOFT = 1e-11
#: Part of nonzeros of a matrix, and number of components, up to which the matrix counts as whole.
_SPARSE, _FEW = 0.1, 64

Places = NDArray[np.intp]


@dataclass(frozen=True)
class Blocks:
    """A square matrix by its diagonal blocks that are not coupled with one another.

    Attributes
    ----------
    stacks : blocks of equal size: indices of rows and columns (blocks, size), and entries (blocks, size, size)
    """

    stacks: Sequence[tuple[Places, Array]]

    @classmethod
    def of(cls, matrix: Matrix, *, narrow: bool = False) -> Blocks:
        """Return the blocks of a whole or sparse matrix (n, n). With ``narrow``, rows of blocks of a sparse matrix are
        ordered for narrow bands. Small or dense matrices are one block."""
        n = matrix.shape[0]
        if isinstance(matrix, np.ndarray):
            if n <= _FEW or np.count_nonzero(matrix) > _SPARSE * n * n:
                return cls([(np.arange(n)[np.newaxis], matrix[np.newaxis])])
            return cls.of(csc_array(matrix))
        if n <= _FEW or matrix.nnz > _SPARSE * n * n:
            return cls.of(whole(matrix))
        matrix = csc_array(matrix)  # by rows if a product
        members, targets = _targets(n, matrix.indices.tobytes(), matrix.indptr.tobytes(), narrow)
        entries = np.zeros(sum(part.size * part.shape[1] for part in members))
        entries[targets] = matrix.data
        ends = np.cumsum([part.size * part.shape[1] for part in members])[:-1]
        pieces = zip(members, np.split(entries, ends), strict=True)
        return cls([(part, piece.reshape(*part.shape, part.shape[1])) for part, piece in pieces])

    @cached_property
    def single(self) -> bool:
        """Whether the matrix is one block in its own order."""
        places = self.stacks[0][0]
        return len(self.stacks) == 1 == len(places) and bool(np.all(places[0] == np.arange(self.size)))

    @cached_property
    def size(self) -> int:
        return sum(places.size for places, _ in self.stacks)

    @cached_property
    def whole(self) -> Array:
        """The matrix as a dense array, (n, n)."""
        if self.single:
            return np.asarray(self.stacks[0][1][0])
        result = np.zeros((self.size, self.size))
        for places, entries in self.stacks:
            result[places[:, :, np.newaxis], places[:, np.newaxis, :]] = entries
        return result

    @cached_property
    def largest(self) -> float:
        """The largest magnitude of an entry."""
        return max((float(np.abs(entries).max(initial=0.0)) for _, entries in self.stacks), default=0.0)

    @cached_property
    def largest_of_rows(self) -> Array:
        """(n,) the largest magnitudes of entries in rows."""
        return self.join([np.abs(entries).max(axis=2, initial=0.0) for _, entries in self.stacks])

    @cached_property
    def skew(self) -> float:
        """The largest magnitude of an entry of the matrix minus its transpose."""
        parts = (np.abs(entries - np.swapaxes(entries, 1, 2)) for _, entries in self.stacks)
        return max((float(part.max(initial=0.0)) for part in parts), default=0.0)

    @cached_property
    def symmetric(self) -> Blocks:
        """The symmetric part."""
        return Blocks([(places, 0.5 * (part + np.swapaxes(part, 1, 2))) for places, part in self.stacks])

    @property
    def negative(self) -> Blocks:
        """Minus the matrix."""
        return Blocks([(places, -entries) for places, entries in self.stacks])

    def divide_rows(self, rows: Array) -> Blocks:
        """Return the matrix with rows divided by numbers (n,)."""
        return Blocks([(places, entries / rows[places][:, :, np.newaxis]) for places, entries in self.stacks])

    def times(self, x: Array) -> Array:
        """Return the product with a vector (n,)."""
        if self.single:
            return np.asarray(self.whole @ x)
        return self.join([(entries @ x[places][:, :, np.newaxis])[:, :, 0] for places, entries in self.stacks])

    @cached_property
    def spectra(self) -> Sequence[tuple[Array, Array]]:
        """Eigenvalues (blocks, size), increasing, and eigenvectors (blocks, size, size) of each stack of a symmetric
        matrix."""
        pairs = (np.linalg.eigh(entries) for _, entries in self.stacks)
        return [(values, vectors) for values, vectors in pairs]

    def spectrum(self) -> tuple[Array, Array]:
        """Return eigenvalues (n,), increasing, and eigenvectors (n, n) of a symmetric matrix."""
        if self.single:
            values, vectors = self.spectra[0]
            return values[0].copy(), vectors[0]
        return self.lowest(np.inf)

    def lowest(self, limit: float) -> tuple[Array, Array]:
        """Return all eigenvalues (n,), increasing, of a symmetric matrix, and the eigenvectors (n, m) of the m lowest
        eigenvalues, up to ``limit``; in large blocks without such eigenvalues only eigenvalues are computed."""
        every, count = np.zeros(self.size), 0
        kept: list[tuple[Places, Places, Array]] = []  # rows, columns in this order, and entries
        for places, entries in self.stacks:
            if entries.shape[1] > _FEW and _above(entries, limit):
                every[places] = np.linalg.eigvalsh(entries)
                continue
            values, vectors = np.linalg.eigh(entries)
            every[places] = values
            block, number = np.nonzero(values <= limit)
            kept.append((places[block], places[block, number], vectors[block, :, number]))
            count += len(block)
        order = np.argsort(every, kind="stable")
        column = np.empty(self.size, np.intp)
        column[order] = np.arange(self.size)
        result = np.zeros((self.size, count))
        for rows, origin, columns in kept:
            result[rows, column[origin][:, np.newaxis]] = columns
        return every[order], result

    def above(self, value: float) -> bool:
        """Return whether all eigenvalues of a symmetric matrix are at least ``value``. By Cholesky factorizations, and
        only if these are in doubt by eigenvalues."""
        if all(_above(entries, value) for _, entries in self.stacks):
            return True
        return all(bool(np.all(values >= value)) for values, _ in self.spectra)

    def join(self, parts: Sequence[Array]) -> Array:
        """Return the vector (n,) whose components are given block by block, (blocks, size) for each stack."""
        if self.single:
            return np.asarray(parts[0][0])
        result = np.zeros(self.size)
        for (places, _), part in zip(self.stacks, parts, strict=True):
            result[places] = part
        return result


def _above(entries: Array, value: float) -> bool:
    """Return whether all eigenvalues of symmetric blocks are above a value by more than rounding."""
    try:
        np.linalg.cholesky(entries - value * np.eye(entries.shape[1]))
    except np.linalg.LinAlgError:
        return False
    return True


def _by_size(pattern: csr_array | csc_array, *, narrow: bool = False) -> list[Places]:
    """Return the connected components of a sparsity pattern as indices, (components, size) for each size. Indices of a
    component increase, or with ``narrow`` are in an order with narrow bands."""
    _, labels = connected_components(pattern, directed=False)
    order = np.arange(len(labels))
    if narrow:
        order = reverse_cuthill_mckee(csr_array(pattern + pattern.T), symmetric_mode=True).astype(np.intp)
    order = order[np.argsort(labels[order], kind="stable")]
    sizes = np.bincount(labels)
    starts = np.cumsum(sizes) - sizes
    return [order[starts[sizes == size][:, np.newaxis] + np.arange(size)] for size in sorted(set(sizes.tolist()))]


@lru_cache(maxsize=8)
def _targets(n: int, indices: bytes, ends: bytes, narrow: bool) -> tuple[list[Places], Places]:
    """Return the connected components of a sparse matrix as indices, (components, size) for each size, and the position
    of each stored entry among the dense entries of all components. The matrix is given by the bytes of its column
    arrays; a search meets equal patterns again, so results are cached."""
    pattern = _by_columns(n, indices, ends, None)
    members, rows, columns = _by_size(pattern, narrow=narrow), pattern.indices, columns_of(pattern)
    first, within = np.zeros(n, np.intp), np.zeros(n, np.intp)  # place of the entry below which a row's entries are
    wide, total = np.zeros(n, np.intp), 0
    for part in members:
        count, size = part.shape
        first[part] = total + size * size * np.arange(count)[:, np.newaxis]
        within[part], wide[part] = np.arange(size), size
        total += count * size * size
    return members, first[rows] + within[rows] * wide[rows] + within[columns]


def inverse_root(M: Matrix) -> Matrix:
    """Return L^-1 of M = L L^T, (n, n), sparse if M has many blocks that are not coupled, as of bodies without joints.

    Raises
    ------
    numpy.linalg.LinAlgError
        M is not positive definite.
    """
    if not isinstance(M, np.ndarray):
        return _inverse_root(M.shape[0], *(part.tobytes() for part in (M.indices, M.indptr, M.data)))
    return _root_of_blocks(Blocks.of(M))


def _root_of_blocks(M: Blocks) -> Matrix:
    if len(M.stacks) == 1 == len(M.stacks[0][0]):
        return np.asarray(dtrtri(np.linalg.cholesky(M.whole), lower=1)[0])
    data = np.concatenate([np.linalg.inv(np.linalg.cholesky(entries)).ravel() for _, entries in M.stacks])
    shapes = [(places, entries.shape) for places, entries in M.stacks]
    rows = np.concatenate([np.broadcast_to(places[:, :, np.newaxis], shape).ravel() for places, shape in shapes])
    columns = np.concatenate([np.broadcast_to(places[:, np.newaxis, :], shape).ravel() for places, shape in shapes])
    return csc_array((data, (rows, columns)), shape=(M.size, M.size))


@lru_cache(maxsize=2)
def _inverse_root(n: int, indices: bytes, ends: bytes, data: bytes) -> Matrix:
    """Return the inverse root of a sparse matrix by columns, which a search of free bodies meets again."""
    M = _by_columns(n, indices, ends, data)
    M.eliminate_zeros()
    return _root_of_blocks(Blocks.of(M))


def _by_columns(n: int, indices: bytes, ends: bytes, data: bytes | None) -> csc_array:
    """Return a sparse matrix by the bytes of its arrays; of ones without data."""
    kind: Any = np.int32 if len(ends) == 4 * (n + 1) else np.int64
    rows, starts = (np.array(np.frombuffer(part, kind)) for part in (indices, ends))
    entries = np.ones(len(rows)) if data is None else np.array(np.frombuffer(data))
    return csc_array((entries, rows, starts), shape=(n, n))


def congruent(basis: Matrix, matrix: Matrix) -> Matrix:
    """Return basis^T matrix basis, (n, n); sparse if both are sparse, with the same pattern for a diagonal basis."""
    n = basis.shape[0]
    if isinstance(basis, np.ndarray) or isinstance(matrix, np.ndarray):
        return np.asarray(basis.T @ matrix @ basis)
    ends = np.arange(n + 1)
    if not np.array_equal(basis.indptr, ends) or not np.array_equal(basis.indices, ends[:-1]):
        return csc_array(basis.T @ matrix @ basis)
    sizes = basis.data
    return csc_array(
        (sizes[matrix.indices] * matrix.data * sizes[columns_of(matrix)], matrix.indices, matrix.indptr),
        shape=matrix.shape,
    )


def least_solution(matrix: Blocks, right: Array) -> Array:
    """Return the least-squares solution x, (n,), of matrix x = right of least length. Singular values below ``SOFT``
    times the largest count as zero. A block without such singular values is eliminated, which takes a tenth of the
    time: the reciprocal condition in the 1-norm divided by n bounds the ratio of singular values from below."""
    if matrix.single:
        only = matrix.whole
        largest = float(np.max(np.linalg.norm(only, axis=0), initial=0.0))
        solution = _solve_by_elimination(only, right, largest) if len(only) else None
        return np.asarray(np.linalg.lstsq(only, right, rcond=SOFT)[0]) if solution is None else solution
    result, left = np.zeros(matrix.size), []
    norms = [(np.abs(entries).sum(axis=1).max(), np.abs(entries).sum(axis=2).max()) for _, entries in matrix.stacks]
    largest = float(np.sqrt(max(row for row, _ in norms) * max(column for _, column in norms)))
    eliminated = False  # the bound is at least the largest singular value
    for places, entries in matrix.stacks:
        solution = _solve_by_elimination(entries[0], right[places[0]], largest) if len(entries) == 1 else None
        if solution is None:
            left.append((places, np.linalg.svd(entries)))
        else:
            eliminated, result[places[0]] = True, solution
    smallest = SOFT * (largest if eliminated else max(float(np.max(sigma)) for _, (_, sigma, _) in left))
    for places, (U, sigma, Vt) in left:
        inverse = np.divide(1.0, sigma, out=np.zeros_like(sigma), where=sigma > smallest)
        result[places] = ((right[places][:, np.newaxis] @ U) * inverse[:, np.newaxis] @ Vt)[:, 0]
    return result


def _solve_by_elimination(matrix: Array, right: Array, largest: float) -> Array | None:
    """Return the solution, (n,), of a whole matrix's equations by elimination. None if a singular value may be below
    ``SOFT`` times ``largest``, a bound of the largest singular value."""
    factors, pivots, fault = dgetrf(matrix)
    if fault or not dgecon(factors, np.linalg.norm(matrix, 1))[0] * np.max(np.linalg.norm(matrix, axis=0)) > (
        len(matrix) * SOFT * largest
    ):
        return None
    return np.asarray(dgetrs(factors, pivots, right)[0])
