"""Sparse rows of a constraint Jacobian in the metric of a block-diagonal inertia matrix: lengths, independence, and
corrections, in a time that grows with the nonzeros."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.rounding import WRITTEN

#: Number of rows up to which singular values are of whole matrices.
_FEW = 40


class SparseRows:
    """Rows B and an inertia matrix M = L L^T, both ``scipy.sparse`` matrices.

    Parameters
    ----------
    B : (rows, nv)
    M : (nv, nv)
    """

    def __init__(self, B: Any, M: Any) -> None:
        self.B = B.tocsr()
        self.M = M.tocsr()
        self.row, self.column = self.B.nonzero()
        self.magnitudes = np.abs(np.asarray(self.B[self.row, self.column]).ravel())

    @cached_property
    def inverse(self) -> Any | None:
        """Sparse L^-1 of M = L L^T; None if M is not positive definite or has large blocks."""
        from scipy import sparse  # noqa: PLC0415  # systems without constraints need no SciPy
        from scipy.sparse.csgraph import connected_components  # noqa: PLC0415

        count, labels = connected_components(self.M, directed=False)
        order = np.argsort(labels, kind="stable")
        sizes = np.bincount(labels, minlength=count)
        if sizes.max(initial=0) > 12:
            return None
        starts = np.concatenate([[0], np.cumsum(sizes)])
        rows: list[NDArray[np.intp]] = []
        columns: list[NDArray[np.intp]] = []
        values: list[Array] = []
        for size in np.unique(sizes):
            members = order[starts[:-1][sizes == size, np.newaxis] + np.arange(size)]
            at = np.repeat(members, size, axis=1), np.tile(members, (1, size))
            blocks = np.asarray(self.M[at[0].ravel(), at[1].ravel()]).reshape(-1, size, size)
            try:
                inverse = np.linalg.inv(np.linalg.cholesky(blocks))
            except np.linalg.LinAlgError:
                return None
            rows.append(at[0].ravel())
            columns.append(at[1].ravel())
            values.append(np.tril(inverse).ravel())
        shape = self.M.shape
        made = sparse.csr_matrix((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=shape)
        made.eliminate_zeros()
        return made

    def scale(self, reach: Array) -> SparseRows:
        """Return the rows in the metric of displacements ``reach``, (nv,), per unit of velocity."""
        from scipy import sparse  # noqa: PLC0415  # systems without constraints need no SciPy

        return SparseRows(self.B, sparse.diags(reach**2))

    @cached_property
    def lengths(self) -> Array:
        """Lengths of the rows B L^-T, (rows,)."""
        assert self.inverse is not None  # asked for by the caller
        weighed = self.B @ self.inverse.T
        lengths = np.sqrt(np.asarray(weighed.multiply(weighed).sum(axis=1)).ravel())
        return np.where(lengths > 0.0, lengths, 1.0)

    def larger(self, turning: Array, straight: Array, angular: NDArray[np.bool_], factor: Array, power: int) -> Array:
        """Return sum_j max(e_ij, |B_ij|)^power factor_j for each row i, (rows,).

        Parameters
        ----------
        turning, straight : e_ij of row i in angular and in other columns, (rows,)
        angular : whether a column is angular, (nv,)
        factor : (nv,)
        """
        total = turning**power * np.sum(factor[angular]) + straight**power * np.sum(factor[~angular])
        least = np.where(angular[self.column], turning[self.row], straight[self.row])
        more = (np.maximum(least, self.magnitudes) ** power - least**power) * factor[self.column]
        return np.asarray(total + np.bincount(self.row, more, minlength=len(turning)))

    def independent(self, scale: Array, count: int) -> IndependentRows | None:
        """Return the first ``count`` rows B L^-T, multiplied by ``scale``, factored, if they are clearly independent.
        None if the new part of a row next to earlier rows is below 1e-4, or if M has no sparse inverse root."""
        from scipy import sparse  # noqa: PLC0415  # systems without constraints need no SciPy
        from scipy.sparse.linalg import splu  # noqa: PLC0415

        if self.inverse is None or count > self.B.shape[1]:
            return None
        weighed = sparse.diags(scale[:count]) @ (self.B[:count] @ self.inverse.T)
        normal = (weighed @ weighed.T).tocsc()
        try:
            factors = splu(normal, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        except RuntimeError:  # singular
            return None
        places = np.arange(count)
        if np.any(factors.perm_r != places) or np.any(factors.perm_c != places):
            return None
        squares = factors.U.diagonal()
        # above the parts that corrections by whole matrices leave out
        if not np.all(squares >= 1e-4**2):
            return None
        return IndependentRows(weighed, self.inverse, factors, np.sqrt(squares))


class IndependentRows:
    """Independent rows W = B L^-T with scales, and factors of W W^T. ``new``, (rows,): length of the part of each row
    that is orthogonal to all earlier rows."""

    def __init__(self, weighed: Any, inverse: Any, factors: Any, new: Array) -> None:
        self.weighed, self.inverse, self.factors, self.new = weighed, inverse, factors, new

    def correction(self, right: Array) -> Array:
        """Return L^-T x with the shortest x of W x = right."""
        multipliers = self.factors.solve(right)
        left = right - self.weighed @ (self.weighed.T @ multipliers)
        multipliers = multipliers + self.factors.solve(left)
        return np.asarray(self.inverse.T @ (self.weighed.T @ multipliers))


def smallest_singular_value(rows: Any) -> float:
    """Return the smallest singular value of sparse rows W, (rows, nv); 0 if rows depend on each other.

    By Lanczos iterations on the inverse of W W^T, so values below 1e-8 of the largest are rounding.
    """
    from scipy.sparse.linalg import LinearOperator, eigsh, splu  # noqa: PLC0415  # systems without constraints need no SciPy

    count, columns = rows.shape
    if count > columns:
        return 0.0
    if count <= _FEW:
        return float(np.linalg.svd(rows.toarray(), compute_uv=False)[-1])
    normal = (rows @ rows.T).tocsc()
    try:
        factors = splu(normal, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        inverse = LinearOperator(normal.shape, factors.solve, dtype=float)
        (largest,) = eigsh(inverse, k=1, which="LM", v0=np.ones(count), return_eigenvectors=False, tol=WRITTEN)
    except RuntimeError:  # singular
        return 0.0
    return float(1.0 / np.sqrt(largest)) if largest > 0.0 else 0.0  # negative by rounding


def largest_singular_value(rows: Any) -> float:
    """Return the largest singular value of sparse rows W, (rows, nv)."""
    from scipy.sparse.linalg import eigsh  # noqa: PLC0415  # systems without constraints need no SciPy

    if min(rows.shape) <= _FEW:
        return float(np.linalg.norm(rows.toarray(), 2))
    start = np.ones(rows.shape[0])
    (largest,) = eigsh(rows @ rows.T, k=1, which="LA", v0=start, return_eigenvectors=False, tol=WRITTEN)
    return float(np.sqrt(largest))
