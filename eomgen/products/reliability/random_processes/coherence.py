"""Coherence of processes of one spectrum G: their cross spectra are c(f) G(f), real, c between 0 and 1; the nearest
correlation matrix.

c^2 is the magnitude-squared coherence that is estimated from samples.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property
from itertools import pairwise
from typing import Protocol

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.rounding import SUMMED
from eomgen.errors import Problem, UsageError
from eomgen.products.reliability.random_processes.covariance import Covariance
from eomgen.products.reliability.random_processes.karhunen_loeve import PANEL
from eomgen.solvers.quadrature import gauss_legendre


def nearest_correlation(matrix: Array) -> Array:
    """Return the correlation matrix nearest to a symmetric matrix in the norm of Frobenius: positive definite, with 1
    on the diagonal. The argument is not changed.

    References
    ----------
    Higham: Computing the nearest correlation matrix, IMA J. Numer. Anal. 22 (2002), algorithm 3.3.
    """
    here, correction = matrix.copy(), np.zeros_like(matrix)
    for _ in range(2000):
        shifted = here - correction
        values, vectors = np.linalg.eigh(shifted)
        positive = (vectors * np.maximum(values, 0.0)) @ vectors.T
        correction = positive - shifted
        before, here = here, positive.copy()
        np.fill_diagonal(here, 1.0)
        if np.linalg.norm(here - before) <= SUMMED:
            break
    share = max(0.0, 1e-10 - float(np.linalg.eigvalsh(here)[0]))
    return np.asarray((here + share * np.eye(len(here))) / (1.0 + share))


#: Frequencies of a quadrature at most.
_MOST_NODES = 40_000


class Coherence(Protocol):
    """c at frequencies from 0 on.

    Attributes
    ----------
    edges : frequencies at which c is not smooth
    """

    @property
    def edges(self) -> tuple[float, ...]: ...

    def at(self, frequency: Array) -> Array: ...


@dataclass(frozen=True)
class ExponentialCoherence:
    """c = exp(-decay f): of gusts at two places (Davenport 1961), decay = C distance / speed; of the tracks of a road,
    decay a length."""

    decay: float
    edges = ()

    def at(self, frequency: Array) -> Array:
        return np.asarray(np.exp(-self.decay * frequency))


@dataclass(frozen=True, eq=False)
class CoherenceTable:
    """c through points (n,), linear between frequencies, constant before the first point, 0 after the last."""

    frequencies: Array
    values: Array

    @property
    def edges(self) -> tuple[float, ...]:
        return tuple(float(f) for f in self.frequencies)

    def at(self, frequency: Array) -> Array:
        return np.interp(frequency, self.frequencies, self.values, right=0.0)


@dataclass(frozen=True, eq=False)
class CrossCovariance:
    """Covariance of two processes of the same spectrum G with a coherence c: int_0^inf c G cos(2 pi f tau) df.

    A spline gives values at lags up to ``window``, s or m.

    Raises
    ------
    UsageError
        By ``at``: if c G falls too slowly for the integral.
    """

    covariance: Covariance
    coherence: Coherence
    window: float
    smooth = True

    def at(self, lag: Array) -> Array:
        return np.asarray(self._spline(np.abs(lag)))

    @cached_property
    def _spline(self) -> Callable[[Array], Array]:
        """Spline of the cross covariance over lags from 0 to the window, made once. Points are so dense for the
        shortest wave that the error is rounding."""
        from scipy.interpolate import make_interp_spline  # noqa: PLC0415  # slow to import; most processes have none

        frequencies, shares = self._rule
        points = 12  # for the shortest wave, and beyond both ends
        apart = 1.0 / (points * frequencies[-1])
        lags = apart * np.arange(-points, math.ceil(self.window / apart) + points + 1)
        values = np.empty(lags.size)
        for begin in range(0, lags.size, 1024):
            waves = np.multiply.outer(2.0 * math.pi * lags[begin : begin + 1024], frequencies)
            values[begin : begin + 1024] = np.cos(waves) @ shares
        spline: Callable[[Array], Array] = make_interp_spline(lags, values, k=9)
        return spline

    def density(self, frequency: Array) -> Array:
        return np.asarray(self.coherence.at(frequency) * self.covariance.density(frequency))

    @cached_property
    def _rule(self) -> tuple[Array, Array]:
        """Frequencies (n,) of the quadrature in cycles, and its weights times c G, (n,). Panels are halved until the
        integral converges; raises UsageError if more than 40000 frequencies are needed."""
        variance = float(self.covariance.at(np.zeros(1))[0])
        edges = sorted({edge for edge in (*getattr(self.covariance, "edges", ()), *self.coherence.edges) if edge > 0.0})
        borders = np.array([0.0, *(edges or [self._last(variance)])])
        lags, waves = np.linspace(0.0, self.window, 33), 4.0
        before = np.full(len(lags), np.inf)
        while True:
            frequencies, weights = _panels(borders, waves / self.window)
            shares = weights * self.density(frequencies)
            values = np.cos(2.0 * math.pi * np.multiply.outer(lags, frequencies)) @ shares
            if np.max(np.abs(values - before)) <= 1e-10 * variance:
                return frequencies, shares
            before, waves = values, 0.5 * waves

    def _last(self, variance: float) -> float:
        """Return the frequency in cycles beyond which c G is negligible relative to the variance; raises UsageError if
        this is too high for the quadrature."""
        last = 1.0 / self.window
        while float(self.density(np.array([last]))[0]) * last > 1e-11 * variance or last < 4.0 / self.window:
            last *= 2.0
            if last * self.window > _MOST_NODES:
                fault = "the coherence falls too slowly: at high frequencies the processes are one and the same [E0965]"
                raise UsageError(Problem("", fault, "a larger decay, or a correlation, the same at all frequencies"))
        return last


def _panels(borders: Array, widest: float) -> tuple[Array, Array]:
    """Return nodes and weights (n,) of Gauss's rule in panels between rising borders, no panel wider than ``widest``.
    Raises UsageError if more than the allowed nodes are needed."""
    counts = [max(1, math.ceil((end - start) / widest)) for start, end in pairwise(borders)]
    if sum(counts) * PANEL > _MOST_NODES:
        fault = f"the cross spectrum up to {borders[-1]:.3g} cycles needs more than {_MOST_NODES} frequencies [E0964]"
        raise UsageError(Problem("", fault, "a shorter window, a coherence that falls faster"))
    parts = [
        np.linspace(start, end, count + 1) for start, end, count in zip(borders[:-1], borders[1:], counts, strict=True)
    ]
    nodes, weights = gauss_legendre(np.concatenate([*(part[:-1] for part in parts), borders[-1:]]), PANEL)
    return nodes.ravel(), weights.ravel()


def least_eigenvalue(coherences: Sequence[Sequence[Coherence | None]]) -> tuple[float, float]:
    """Return the least eigenvalue of a symmetric matrix of coherences over all frequencies, and the frequency of this
    eigenvalue. None in the matrix stands for 0, and for 1 on the diagonal."""
    known = [coherence for row in coherences for coherence in row if coherence is not None]
    edges = np.array(sorted({edge for coherence in known for edge in coherence.edges}))
    decays = [coherence.decay for coherence in known if isinstance(coherence, ExponentialCoherence)]
    spread = np.concatenate([np.geomspace(1e-3, 30.0, 200) / decay for decay in decays]) if decays else np.zeros(0)
    frequencies = np.concatenate([np.zeros(1), edges, 0.5 * (edges[1:] + edges[:-1]), spread])
    matrices = np.tile(np.eye(len(coherences)), (len(frequencies), 1, 1))
    for i, row in enumerate(coherences):
        for j, coherence in enumerate(row):
            if coherence is not None:
                matrices[:, i, j] = coherence.at(frequencies)
    values = np.linalg.eigvalsh(matrices)[:, 0]
    worst = int(np.argmin(values))
    return float(values[worst]), float(frequencies[worst])
