"""A linear plant in second-order form, M q'' + C q' + K q = B u, and its scaling."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import cholesky, solve_triangular

from eomgen.base.arrays import Array, Complex
from eomgen.base.data import dataclass
from eomgen.errors import UsageError


def real_matrix(name: str, value: ArrayLike, rows: int, columns: int) -> Array:
    """Return a matrix as floats. Raises UsageError for another shape or an entry that is not finite."""
    try:
        matrix = np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise UsageError(f"{name} is not a matrix of real numbers", f"an array of shape ({rows}, {columns})") from None
    if matrix.shape != (rows, columns):
        raise UsageError(f"{name} has the shape {matrix.shape}", f"({rows}, {columns})")
    if not np.all(np.isfinite(matrix)):
        row, column = np.argwhere(~np.isfinite(matrix))[0]
        raise UsageError(f"{name} has an entry [{row}, {column}] that is not finite", "finite numbers")
    return matrix


@dataclass(frozen=True)
class Scales:
    """Units in which the motion of a plant has numbers near one.

    Attributes
    ----------
    L : (n, n) lower triangular, M = L L^T; coordinates L^T q have the unit mass matrix.
    rate : float, 1/s. Times are multiplied by it, so that stiffness and damping are of the order of one.
    """

    L: Array
    rate: float

    @property
    def state(self) -> Array:
        """(2n, 2n) matrix T, x^ = T [q, v]: x^ = (rate L^T q, L^T v)."""
        n = len(self.L)
        T = np.zeros((2 * n, 2 * n))
        T[:n, :n], T[n:, n:] = self.rate * self.L.T, self.L.T
        return T

    @property
    def state_back(self) -> Array:
        """(2n, 2n) matrix, the inverse of ``state``."""
        n = len(self.L)
        inverse = solve_triangular(self.L, np.eye(n), lower=True).T
        T = np.zeros((2 * n, 2 * n))
        T[:n, :n], T[n:, n:] = inverse / self.rate, inverse
        return T


class Plant:
    """M q'' + C q' + K q = B u.

    Parameters
    ----------
    M : (n, n) symmetric, positive definite.
    C, K : (n, n), symmetric or not.
    B : (n, m)
    names : sequence of str, optional
        Of the coordinates, for messages.

    Raises
    ------
    UsageError
        A matrix of another shape, with entries that are not finite, or a mass matrix that no mechanism has.
    """

    def __init__(self, M: ArrayLike, C: ArrayLike, K: ArrayLike, B: ArrayLike, names: Sequence[str] = ()) -> None:
        n = len(np.atleast_1d(np.asarray(M)))
        self.M, self.C, self.K = (real_matrix(name, value, n, n) for name, value in (("M", M), ("C", C), ("K", K)))
        shape = np.shape(B)
        self.B = real_matrix("B", B, n, shape[1] if len(shape) == 2 else 1)
        self.names = tuple(names) or tuple(f"coordinate {k + 1}" for k in range(n))
        if not n or not np.allclose(self.M, self.M.T, rtol=0.0, atol=1e-9 * np.abs(self.M).max()):
            raise UsageError("the mass matrix M is not symmetric", "the inertia matrix of a mechanism")
        try:
            self._factor: Array = cholesky((self.M + self.M.T) / 2.0, lower=True)
        except np.linalg.LinAlgError:
            raise UsageError(
                "the mass matrix M is not positive definite", "the inertia matrix of a mechanism"
            ) from None

    @property
    def n(self) -> int:
        """Number of coordinates."""
        return len(self.M)

    @property
    def m(self) -> int:
        """Number of actuators."""
        return int(self.B.shape[1])

    @cached_property
    def scales(self) -> Scales:
        """Scales that bring the numbers of the plant near one."""
        half = solve_triangular(self._factor, self.K, lower=True)
        stiffness = float(np.linalg.norm(solve_triangular(self._factor, half.T, lower=True), 2))
        half = solve_triangular(self._factor, self.C, lower=True)
        damping = float(np.linalg.norm(solve_triangular(self._factor, half.T, lower=True), 2))
        rate = max(stiffness**0.5, damping)
        return Scales(self._factor, rate if rate > 0.0 else 1.0)

    @cached_property
    def scaled(self) -> tuple[Array, Array, Array]:
        """Stiffness k, damping c (n, n), actuation b (n, m) of q^'' + c q^' + k q^ = b u in the units of ``scales``."""
        rate = self.scales.rate

        def congruent(matrix: Array) -> Array:
            half = solve_triangular(self._factor, matrix, lower=True)
            return np.asarray(solve_triangular(self._factor, half.T, lower=True).T)

        b = solve_triangular(self._factor, self.B, lower=True) / rate
        return congruent(self.K) / rate**2, congruent(self.C) / rate, np.asarray(b)

    def state_space(self, G_p: ArrayLike | None = None, G_v: ArrayLike | None = None) -> tuple[Array, Array]:
        """Return A (2n, 2n), B (2n, m) of x' = A x + B u, x = [q, v], closed by u = -G_p q - G_v v if given."""
        n, m = self.n, self.m
        K = self.K if G_p is None else self.K + self.B @ real_matrix("G_p", G_p, m, n)
        C = self.C if G_v is None else self.C + self.B @ real_matrix("G_v", G_v, m, n)
        solved = np.linalg.solve(self.M, np.hstack([K, C, self.B]))
        A, B = np.zeros((2 * n, 2 * n)), np.zeros((2 * n, m))
        A[:n, n:], A[n:, :n], A[n:, n:] = np.eye(n), -solved[:, :n], -solved[:, n : 2 * n]
        B[n:] = solved[:, 2 * n :]
        return A, B

    def eigenvalues(self, G_p: ArrayLike | None = None, G_v: ArrayLike | None = None) -> Complex:
        """Return the 2n eigenvalues, 1/s, slow ones first; of the closed loop if gains are given."""
        k, c, b = self.scaled
        back = self.scales.state_back
        n, m = self.n, self.m
        if G_p is not None:
            k = k + b @ (real_matrix("G_p", G_p, m, n) @ back[:n, :n])
        if G_v is not None:
            c = c + b @ (real_matrix("G_v", G_v, m, n) @ back[n:, n:])
        values = self.scales.rate * np.linalg.eigvals(first_order(k, c))
        order = np.lexsort((values.imag, values.real, np.round(np.abs(values), 12)))
        return np.asarray(values[order], dtype=complex)


def first_order(k: Array, c: Array) -> Array:
    """Return the state matrix (2n, 2n) of q'' + c q' + k q = 0."""
    n = len(k)
    A = np.zeros((2 * n, 2 * n))
    A[:n, n:], A[n:, :n], A[n:, n:] = np.eye(n), -k, -c
    return A
