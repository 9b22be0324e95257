"""Functions phi_k of exponential integrators of a matrix, times a vector.

phi_k(x) = (exp(x) - 1 - x - ... - x^(k-1)/(k-1)!)/x^k, phi_k(0) = 1/k!: Hochbruck and Ostermann, Acta Numerica 19
(2010) 209, equation 2.11. Of a large symmetric matrix with few couplings they are found by Lanczos' method with the
inverse of 1 - gamma t J, whose few iterations do not depend on stiffness: J. van den Eshof and M. Hochbruck, SIAM J.
Sci. Comput. 27 (2006) 1438.
"""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np
from scipy.linalg import expm
from scipy.linalg.lapack import dpbtrf, dpbtrs

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.solvers.blocks import Blocks

#: Iterations of Lanczos' method at most.
_ITERATIONS = 60


def phi(x: Array, order: int) -> Array:
    """Return phi_k(x), k = ``order``, elementwise; by a series for |x| < 1."""
    near = np.abs(x) < 1.0
    small, large = np.where(near, x, 0.0), np.where(near, 1.0, x)
    term = np.full(np.shape(x), 1.0 / math.factorial(order))
    series = term
    for k in range(order + 1, order + 18):  # the next term is below rounding
        term = term * small / k
        series = series + term
    rest = np.expm1(large)
    for k in range(1, order):
        rest = rest - large**k / math.factorial(k)
    return np.where(near, series, rest / large**order)


def phi_of_matrix(J: Array, f: Array, time: float, order: int) -> Array:
    """Return time phi_k(time J) f for any matrix J, by one exponential of a larger matrix.

    Parameters
    ----------
    J, f : (n, n) and (n,) ndarray
        Matrix and vector.
    time : float
        Factor of the matrix.
    order : int
        k, from 1.
    """
    n = len(f)
    matrix = np.zeros((n + order, n + order))
    matrix[:n, :n], matrix[:n, n] = time * J, time * f
    for k in range(n, n + order - 1):
        matrix[k, k + 1] = 1.0
    if not np.all(np.isfinite(matrix)):
        return np.full(n, np.nan)
    with np.errstate(all="ignore"):
        result: Array = expm(matrix)[:n, -1]
    return result


@dataclass(frozen=True)
class SymmetricPhi:
    """The functions phi_k of a symmetric matrix J, at any times; factors of J are computed once."""

    J: Blocks

    def __call__(self, f: Array, time: float, order: int) -> Array:
        """Return time phi_k(time J) f."""
        return self.J.join(
            [part(f[places], time, order) for part, (places, _) in zip(self._parts, self.J.stacks, strict=True)]
        )

    @cached_property
    def _parts(self) -> list[_Stack]:
        return [_Stack(entries) for _, entries in self.J.stacks]


@dataclass(frozen=True)
class _Stack:
    """The functions phi_k of symmetric blocks of equal size, (blocks, size, size)."""

    entries: Array

    def __call__(self, f: Array, time: float, order: int) -> Array:
        """Return time phi_k(time J) f for each block, (blocks, size), with k = ``order`` and f of the same shape."""
        if not self.entries.any():
            return time / math.factorial(order) * f
        if self._band is not None:
            result = _by_lanczos(self._band, f[0], time, order)
            if result is not None:
                return result[np.newaxis]
        values, vectors = self._spectra
        with np.errstate(all="ignore"):  # unstable directions may overflow: such steps are shortened
            if len(f) == 1:
                part = time * (vectors[0] @ (phi(time * values[0], order) * (vectors[0].T @ f[0])))
                return np.asarray(part[np.newaxis])
            along = (f[:, np.newaxis] @ vectors)[:, 0]
            return np.asarray(time * (vectors @ (phi(time * values, order) * along)[:, :, np.newaxis])[:, :, 0])

    @cached_property
    def _spectra(self) -> tuple[Array, Array]:
        return np.linalg.eigh(self.entries)

    @cached_property
    def _band(self) -> Array | None:
        """The lower band of a single large block, (width, size), diagonal first. None for several or small blocks, and
        if the band is not narrow."""
        count, size = self.entries.shape[:2]
        # for these all eigenvalues take less time than Lanczos' method
        if count > 1 or size < 120:
            return None
        matrix = self.entries[0]
        places = np.arange(size)
        first = np.where(matrix.any(axis=1), (matrix != 0.0).argmax(axis=1), places)
        width = int(np.max(places - first)) + 1
        if width > 0.25 * size:
            return None
        band = np.zeros((width, size))
        for k in range(width):
            band[k, : size - k] = np.diagonal(matrix, -k)
        return band


def _by_lanczos(band: Array, f: Array, time: float, order: int) -> Array | None:
    """Return time phi_k(time J) f, (n,), k = ``order``, for a symmetric banded J, by Lanczos' method.

    None if 1 - gamma t J is not positive definite, or without convergence.

    Parameters
    ----------
    band : lower band of J, (width, n), diagonal first
    """
    gamma, settled = 0.1, 1e-10  # part of the time in the shifted matrix, and last change as a part of the result
    shifted = -gamma * time * band
    shifted[0] += 1.0
    factors, fault = dpbtrf(shifted, lower=1)
    length = float(np.linalg.norm(f))
    if fault or not np.isfinite(length):
        return None
    if not length:
        return np.zeros(len(f))
    V, H = np.zeros((_ITERATIONS + 1, len(f))), np.zeros((_ITERATIONS + 1, _ITERATIONS + 1))
    V[0] = f / length
    before = np.zeros(0)
    for k in range(1, _ITERATIONS + 1):
        w, _ = dpbtrs(factors, V[k - 1], lower=1)
        for _ in range(2):  # orthogonal to rounding
            along = V[:k] @ w
            w -= along @ V[:k]
            H[:k, k - 1] += along
        H[k, k - 1] = left = float(np.linalg.norm(w))
        ends = left <= settled * H[0, 0]
        if ends or k % 4 == 0:
            values, turn = np.linalg.eigh(H[:k, :k])
            with np.errstate(all="ignore"):  # unstable directions may overflow: such steps are shortened
                now = length * time * (turn @ (phi((1.0 - 1.0 / values) / gamma, order) * turn[0]))
            change = now.copy()
            change[: len(before)] -= before
            if ends or not np.linalg.norm(change) > settled * np.linalg.norm(now):
                return np.asarray(now @ V[:k])
            before = now
        V[k] = w / left
    return None
