"""Signs and small eigenvalues of a tangent stiffness under constraints, without masses.

The number of negative stiffnesses is read off the pivots of a symmetric-indefinite factorization of the bordered matrix
[[K, B^T], [B, 0]], which has as many negative ones as K on the null space of B, and one for each row of B (Gould, Math.
Program. 32 (1985) 90; pivots: Bunch and Kaufman, Math. Comp. 31 (1977) 163). If forces have no potential, K is not
symmetric; then the sign of its determinant is used.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from scipy.sparse import block_array, csc_array, csr_array, diags_array
from scipy.sparse.csgraph import connected_components, reverse_cuthill_mckee
from scipy.sparse.linalg import SuperLU, splu

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, replace
from eomgen.base.rounding import COMPUTED, SUMMED
from eomgen.solvers.bordered_newton import LoadedState, LoadedStatics, Matrix, columns_of, plus, solver, sparse, whole

#: Largest number of rows for a dense factorization.
_WHOLE = 600
#: Rounding error of a stiffness relative to the sum of its absolute terms.
ROUNDING = 1e3 * float(np.finfo(float).eps)

Components = NDArray[np.intp]


@dataclass(frozen=True)
class TangentStiffness:
    """A stiffness K (nv, nv) under constraints B (rows, nv), by components measured in ``sizes`` (nv,)."""

    K: Matrix
    B: Matrix
    sizes: Array

    @classmethod
    def at(cls, statics: LoadedStatics, rest: LoadedState) -> TangentStiffness:
        """Return the stiffness at a state of rest, with independent constraint rows. Internal states are eliminated if
        the Jacobian of their rates is regular."""
        tangents = statics.tangents(rest)
        K = tangents.K
        if tangents.Fz.shape[0]:
            inner = solver(tangents.Fz)
            if inner is not None:
                K = plus(K, -(tangents.Rz @ inner(whole(tangents.Fq))))
        return cls(K, _independent(tangents.B, statics.sizes), statics.sizes)

    @cached_property
    def symmetric(self) -> bool:
        """Whether the stiffness is symmetric up to tolerances, so that forces have a potential."""
        size = diags_array(self.sizes)
        K = csc_array(size @ sparse(self.K) @ size)
        skew = abs(K - K.T).tocoo()
        if not skew.nnz:
            return True
        diagonal = np.sqrt(np.abs(K.diagonal()))
        row, column = skew.coords
        allowed = 1e-7 * diagonal[row] * diagonal[column] + SUMMED * float(abs(K).max())
        return bool(np.all(skew.data <= allowed))

    @cached_property
    def bordered_matrix(self) -> csc_array:
        """[[K, B^T], [B, 0]] after a symmetric positive scaling, which keeps the signs of the eigenvalues."""
        matrix = _bordered_matrix(self.K, self.B)
        scale, rows, columns = np.ones(matrix.shape[0]), matrix.indices, columns_of(matrix)
        size = np.abs(matrix.data)
        for _ in range(4):
            largest = np.zeros(len(scale))
            np.maximum.at(largest, rows, scale[rows] * size * scale[columns])
            scale = scale / np.sqrt(np.where(largest > 0.0, largest, 1.0))
        matrix.data = scale[rows] * matrix.data * scale[columns]
        return matrix

    @cached_property
    def negative(self) -> int:
        """The number of negative stiffnesses under the constraints, beyond rounding. If forces have no potential: the
        number of groups of coupled components with a negative determinant."""
        if not self.symmetric:
            return sum(sign < 0 for sign, _ in self.determinants(self.groups()))
        return self.below(-self._neutral_stiffnesses[1]) if self.below(0.0) else 0

    @property
    def neutral(self) -> int:
        """The number of stiffnesses that are zero but for rounding, as along a family of equilibria."""
        return self._neutral_stiffnesses[0]

    @cached_property
    def _neutral_stiffnesses(self) -> tuple[int, float]:
        """The number of stiffnesses that are zero up to rounding, at most two, and the largest rounding error of
        these."""
        values, X = self.next_to_zero(2)
        every = np.abs(X)
        measured = np.einsum("ij,ij->j", every, abs(self.K) @ every)
        rounding = ROUNDING * measured / np.einsum("ij,ij->j", every, every / self.sizes[:, np.newaxis] ** 2)
        zero = np.abs(values) <= rounding
        return int(np.sum(zero)), float(np.max(rounding[zero], initial=0.0))

    def below(self, value: float) -> int:
        """Return the number of constrained eigenvalues of K x = k W x, W = diag(1 / sizes^2), below ``value``."""
        rows = int(self.B.shape[0])
        if value:
            return replace(self, K=plus(self.K, csc_array(diags_array(-value / self.sizes**2)))).below(0.0)
        if len(self.sizes) + rows > _WHOLE:
            result = self._sparse_negative()
            if result is not None:
                return result
        matrix = whole(self.bordered_matrix)
        return _negative_pivots(0.5 * (matrix + matrix.T)) - rows

    def groups(self, other: TangentStiffness | None = None) -> Components:
        """Return the group number of each component and constraint row, (nv + rows,). Coupled components have the same
        group; with ``other``, couplings in another stiffness count, too."""
        pattern = self._coupling if other is None else self._coupling + other._coupling
        _, labels = connected_components(csr_array(pattern), directed=False)
        return np.asarray(labels, np.intp)

    @cached_property
    def _coupling(self) -> Any:
        """Whether components and rows are coupled, sparse."""
        return abs(self.bordered_matrix) > SUMMED

    def determinants(self, groups: Components) -> list[tuple[int, float]]:
        """Return for each group the sign of det K on the null space of B, and a logarithm of a magnitude. ``groups``
        are group numbers (nv + rows,). The logarithm belongs to the determinant of the scaled matrix
        ``bordered_matrix``, not of K."""
        nv, result = len(self.sizes), []
        for group in range(int(groups.max(initial=-1)) + 1):
            members = np.flatnonzero(groups == group)
            part = self.bordered_matrix[members][:, members]
            sign, logarithm = _determinant(part)
            result.append((sign * (-1) ** int(np.sum(members >= nv)), logarithm))
        return result

    def next_to_zero(self, count: int, mass: Matrix | None = None) -> tuple[Array, Array]:
        """Return the real eigenvalues of K x = k W x under the constraints that are nearest to zero, and the
        eigenvectors x (nv, n).

        Parameters
        ----------
        mass : W (nv, nv), positive definite; the squares of 1 / sizes, if None

        Returns
        -------
        values : (n,) by size; n may exceed ``count``; zero directions come first as 0
        directions : (nv, n)
        """
        nv = len(self.sizes)
        W: Matrix = csc_array(diags_array(1.0 / self.sizes**2)) if mass is None else mass
        W = whole(W) if isinstance(self.K, np.ndarray) else W
        free = nv - min(self.B.shape[0], nv)
        # more directions than are asked for, so that these settle
        wide = min(free, count + 4)
        solve = self._compliance() if wide > 0 else None
        if solve is None:
            return np.zeros(0), np.zeros((nv, 0))
        generator = np.random.default_rng(4)
        X = answers = np.zeros((nv, 0))
        values, before = np.zeros(wide), np.full(wide, np.inf)
        for _ in range(60):
            if X.shape[1] < wide:
                others = generator.normal(size=(nv, wide - X.shape[1])) * self.sizes[:, np.newaxis]
                others = others - X @ (X.T @ (W @ others))  # else the smallest eigenvalues dominate all columns
                answers = np.hstack([answers, solve(np.asarray(W @ others))])
            X = _orthonormal(answers, W)
            answers = solve(np.asarray(W @ X))
            values, turn = _ritz(np.asarray(X.T @ (W @ answers), float), symmetric=self.symmetric)
            whole_space = X.shape[1] == free
            X, answers = X @ turn, answers @ turn
            led = slice(0, min(count, len(values)))
            settled = len(values) == len(before) and np.all(
                np.abs(values - before)[led] <= SUMMED * np.abs(values)[led]
            )
            if whole_space or settled:
                break
            before = values
        return values, X

    def _compliance(self) -> Callable[[Array], Array] | None:
        """Return the map from forces to displacements under the constraints; None if there is none. An exactly singular
        stiffness is shifted by a rounding error."""
        result = compliance(self.K, self.B)
        if result is None:
            diagonal = np.abs(self.K.diagonal())
            shift = 1e-14 * np.where(diagonal > 0.0, diagonal, np.max(diagonal, initial=0.0))
            result = compliance(plus(self.K, csc_array(diags_array(shift))), self.B)
        return result

    def _sparse_negative(self) -> int | None:
        """Return the number of negative stiffnesses by sparse pivots without exchanges; None if pivots lose digits.

        Adding B^T B to K keeps the inertia, and makes K regular if only constraints hold a body.
        """
        nv, rows = len(self.sizes), int(self.B.shape[0])
        scaled = self.bordered_matrix
        K, B = csc_array(scaled[:nv, :nv]), csc_array(scaled[nv:, :nv])
        first = csc_array(0.5 * (K + K.T) + B.T @ B)
        order = reverse_cuthill_mckee(csr_array(first), symmetric_mode=True)
        order = np.concatenate([order, nv + np.arange(rows)])
        matrix = csc_array(csc_array(block_array([[first, B.T], [B, None]], format="csc"))[order][:, order])
        factors = _factors(matrix, exchanges=False)
        if factors is None or np.any(factors.perm_r != np.arange(nv + rows)):
            return None
        right = np.random.default_rng(5).normal(size=nv + rows)
        solution = factors.solve(right)
        if not np.max(np.abs(matrix @ solution - right)) <= COMPUTED * (1.0 + float(np.max(np.abs(solution)))):
            return None
        return int(np.sum(factors.U.diagonal() < 0.0)) - rows


def compliance(K: Matrix, B: Matrix) -> Callable[[Array], Array] | None:
    """Return the map from forces (nv, ...) to displacements (nv, ...) under constraints B (rows, nv), by the bordered
    matrix. None if the bordered matrix is singular."""
    nv = K.shape[0]
    bordered = _bordered_matrix(K, B)
    solve_bordered = solver(whole(bordered) if isinstance(K, np.ndarray) else bordered)
    if solve_bordered is None:
        return None

    def solve(right: Array) -> Array:
        below = np.zeros((B.shape[0], *right.shape[1:]))
        result: Array = solve_bordered(np.concatenate([right, below]))[:nv]
        return result

    return solve if np.all(np.isfinite(solve(np.ones(nv)))) else None


def _bordered_matrix(K: Matrix, B: Matrix) -> csc_array:
    """Return [[K, B^T], [B, 0]]."""
    rows = sparse(B)
    return csc_array(block_array([[sparse(K), rows.T], [rows, None]], format="csc"))


def _independent(B: Matrix, sizes: Array) -> Matrix:
    """Return independent rows of a constraint Jacobian B (rows, nv); all rows if B is too large for a dense QR."""
    if not B.shape[0] or B.shape[0] * B.shape[1] > _WHOLE**2:
        return B
    _, R, order = scipy.linalg.qr((whole(B) * sizes).T, mode="economic", pivoting=True)
    left = np.abs(np.diagonal(R))
    rank = int(np.sum(left > COMPUTED * np.max(left, initial=0.0)))
    return B if rank == B.shape[0] else B[np.sort(order[:rank])]


def canonical_direction(directions: Array, sizes: Array) -> Array:
    """Return the direction in a space, (nv,), that depends neither on rounding nor on the choice of the basis (nv, n).
    The direction is the projection of the component with the largest part in the space, scaled to a largest component
    of 1 rad, or of the scene's length, by ``sizes`` (nv,); for a single direction this fixes the sign."""
    basis = np.linalg.qr(directions / sizes[:, np.newaxis])[0]
    held = np.sum(basis**2, axis=1)
    first = int(np.flatnonzero(held >= (1.0 - 1e-6) * np.max(held))[0])
    direction = basis @ basis[first]
    return np.asarray(sizes * direction / np.max(np.abs(direction)), float)


def _factors(matrix: csc_array, *, exchanges: bool = True) -> SuperLU[np.float64] | None:
    """Return sparse triangular factors; None if the matrix is exactly singular. Without ``exchanges`` rows and columns
    are not permuted, and pivots are on the diagonal."""
    try:
        if exchanges:
            return splu(matrix)
        return splu(matrix, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    except RuntimeError:
        return None


def _negative_pivots(matrix: Array) -> int:
    """Return the number of negative eigenvalues of a symmetric matrix, from the pivots of a factorization. Each
    negative 1 x 1 pivot counts as one, and each 2 x 2 pivot, which is indefinite."""
    if not matrix.size:
        return 0
    factors, pivots, _ = scipy.linalg.lapack.dsytrf(matrix, lower=1)
    single = pivots > 0
    return int(np.sum(np.diagonal(factors)[single] < 0.0)) + int(np.sum(~single)) // 2


def _determinant(matrix: csc_array) -> tuple[int, float]:
    """Return the sign of the determinant and the logarithm of its magnitude; (0, -inf) for a singular matrix."""
    factors = _factors(matrix)
    if factors is None:
        return 0, -np.inf
    diagonal = factors.U.diagonal()
    exchanges = _parity(factors.perm_r) * _parity(factors.perm_c)
    return int(np.prod(np.sign(diagonal))) * exchanges, float(np.sum(np.log(np.abs(diagonal))))


def _parity(order: NDArray[np.intp]) -> int:
    n = len(order)
    cycles, _ = connected_components(csr_array((np.ones(n), (np.arange(n), order)), shape=(n, n)), directed=False)
    return 1 if (n - cycles) % 2 == 0 else -1


def _orthonormal(X: Array, W: Matrix) -> Array:
    """Return a basis (nv, m) of X's column space, orthonormal in the metric W, without nearly dependent columns."""
    X = X / np.sqrt(np.maximum(np.einsum("ij,ij->j", X, W @ X), np.finfo(float).tiny))
    values, vectors = np.linalg.eigh(X.T @ (W @ X))
    kept = values > 1e-14 * values[-1]
    X = X @ (vectors[:, kept] / np.sqrt(values[kept]))
    return np.asarray(X / np.sqrt(np.einsum("ij,ij->j", X, W @ X)))


def _ritz(reduced: Array, *, symmetric: bool) -> tuple[Array, Array]:
    """Return the reciprocals of the real eigenvalues of a reduced compliance, nearest to zero first, and the
    eigenvectors as columns. Complex eigenvalues of a matrix that is not ``symmetric`` are left out."""
    if symmetric:
        inverse, turn = np.linalg.eigh(0.5 * (reduced + reduced.T))
    else:
        of_all, vectors = np.linalg.eig(reduced)
        real = np.abs(of_all.imag) <= 1e-6 * np.abs(of_all)
        inverse, turn = of_all.real[real], vectors.real[:, real]
    order = np.argsort(-np.abs(inverse), kind="stable")
    inverse = inverse[order]
    return np.divide(1.0, inverse, out=np.full_like(inverse, np.inf), where=inverse != 0.0), turn[:, order]
