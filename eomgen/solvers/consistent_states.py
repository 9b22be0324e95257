"""Consistent positions and velocities of many samples at once, by the steps of ``consistency``.

The correction of a sample, and its end, follow from its own numbers alone; samples that are done wait.
Corrections of least kinetic size are computed by singular values here, so last digits differ from ``consistency``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.lie.product import Factor, update
from eomgen.solvers.consistency import MAX_ITERATIONS, ROUNDING
from eomgen.solvers.constraint_rows import CONTRADICTION, EPSILON, SINGULAR, VANISHING, WORST_ROUNDING

#: Numbers of samples.
Chosen = NDArray[np.intp]


@dataclass(frozen=True)
class ConstrainedSamples:
    """A constrained system as callables of n chosen samples at their own parameters.

    Attributes
    ----------
    factors : of the configuration
    lengths : (rows,) whether a row is measured in m, the ``holonomic`` first ones at position level
    angular : (nv,) whether a velocity component turns something
    constraint(q, chosen) -> (n, holonomic), velocity(q, v, chosen) -> (n, rows), jacobian(q, chosen) -> (n, rows, nv)
    mass(q, chosen) -> (n, nv, nv)
    sizes(q, chosen) -> (n, rows), (n, rows)
        As of ``Constrained``.
    """

    factors: Sequence[Factor]
    lengths: NDArray[np.bool_]
    angular: NDArray[np.bool_]
    holonomic: int
    constraint: Callable[[Array, Chosen], Array]
    velocity: Callable[[Array, Array, Chosen], Array]
    jacobian: Callable[[Array, Chosen], Array]
    mass: Callable[[Array, Chosen], Array]
    sizes: Callable[[Array, Chosen], tuple[Array, Array]]


class ConsistentStates(NamedTuple):
    """States on the constraints.

    Attributes
    ----------
    q, v : (n, nq), (n, nv)
    met : (n,) whether they are; ``consistency`` examines the others and words their faults
    """

    q: Array
    v: Array
    met: NDArray[np.bool_]


class _Rows:
    """``constraint_rows.Rows`` of samples; ``defined`` says which have finite rows and a metric."""

    def __init__(self, system: ConstrainedSamples, q: Array, chosen: Chosen) -> None:
        self.holonomic, self.lengths = system.holonomic, system.lengths
        self.B, mass = system.jacobian(q, chosen), system.mass(q, chosen)
        self.size, extent = system.sizes(q, chosen)
        spread = _spread(system.factors, q)
        rounding = WORST_ROUNDING * EPSILON * np.maximum(self.size, spread[:, np.newaxis])
        extent = np.where((spread[:, np.newaxis] == 0.0) | (extent > rounding), extent, 0.0)
        machine = extent.max(axis=1, initial=0.0)
        machine = np.where(machine > 0.0, machine, np.where(spread > 0.0, spread, 1.0))[:, np.newaxis]
        self.extent = np.where(extent > CONTRADICTION * machine, extent, machine)
        self.angular = system.angular
        finite = [np.isfinite(part.reshape(len(q), -1)).all(axis=1) for part in (self.B, mass, self.size, self.extent)]
        self.defined: NDArray[np.bool_] = np.logical_and.reduce(finite)
        mass[~self.defined], self.B[~self.defined] = np.eye(mass.shape[-1]), 0.0
        self.metric = self._factored(mass)

    def _factored(self, mass: Array) -> Array:
        """Return L of M = L L^T; samples with coordinates without inertia are not defined here."""
        try:
            return np.asarray(np.linalg.cholesky(mass))
        except np.linalg.LinAlgError:
            for k, one in enumerate(mass):
                try:
                    np.linalg.cholesky(one)
                except np.linalg.LinAlgError:
                    self.defined[k], mass[k] = False, np.eye(len(one))
            return np.asarray(np.linalg.cholesky(mass))

    @property
    def scale(self) -> Array:
        """Scales of violations of the rows, (n, rows)."""
        return np.where(self.lengths, self.extent, 1.0)

    @property
    def limits(self) -> Array:
        """Violations of the holonomic rows beyond which they are not met, (n, holonomic)."""
        first = slice(self.holonomic)
        return np.maximum(CONTRADICTION * self.scale[:, first], WORST_ROUNDING * EPSILON * self.size[:, first])

    def rate_limits(self, speeds: Array) -> Array:
        """Return rates of rows beyond which they are not met at components of v as large as ``speeds`` (n, nv)."""
        return np.maximum(
            CONTRADICTION * _times(self._possible(), speeds),
            WORST_ROUNDING * EPSILON * _times(self._summands(), speeds),
        )

    def _entries(self, scale: Array) -> Array:
        by_length = np.where(self.lengths, 1.0, 1.0 / self.extent)
        return np.where(self.angular, scale[:, :, np.newaxis], by_length[:, :, np.newaxis])

    def _possible(self) -> Array:
        return np.maximum(self._entries(self.scale), np.abs(self.B))

    def _summands(self) -> Array:
        return np.maximum(self._entries(np.maximum(self.scale, self.size)), np.abs(self.B))

    def correction(self, violation: Array) -> Array:
        """Return M^-1 B^T (B M^-1 B^T)^+ violation of the first rows, (n, nv); rows that vanish are left alone."""
        count = violation.shape[1]
        if count == 0:
            return np.zeros((len(violation), self.B.shape[2]))
        inverse = np.linalg.inv(self.metric)
        speeds = np.sum(inverse**2, axis=1)
        summands = self._summands()
        vanishing = VANISHING * EPSILON * np.sqrt(_times(summands**2, speeds))[:, :count]
        there = np.abs(self.B) > VANISHING * EPSILON * summands
        natural = np.sqrt(_times(np.where(there, self._possible(), 0.0) ** 2, speeds))[:, :count]
        says = natural > vanishing
        weights = np.where(says, 1.0 / np.where(says, natural, 1.0), 0.0)
        weighed = np.linalg.solve(self.metric, np.swapaxes(self.B[:, :count], 1, 2))
        left, values, right = np.linalg.svd(np.swapaxes(weighed, 1, 2) * weights[:, :, np.newaxis], full_matrices=False)
        kept = values > SINGULAR * values[:, :1]
        parts = _times(np.swapaxes(left, 1, 2), violation * weights) * kept / np.where(kept, values, 1.0)
        along = _times(np.swapaxes(right, 1, 2), parts)
        return np.asarray(np.linalg.solve(np.swapaxes(self.metric, 1, 2), along[:, :, np.newaxis]))[:, :, 0]


def consistent_states(system: ConstrainedSamples, q: Array, v: Array) -> ConsistentStates:
    """Return the consistent states nearest to guesses q (n, nq), v (n, nv)."""
    with np.errstate(all="ignore"):
        q, met = _positions(system, q)
        chosen = np.flatnonzero(met)
        v = np.array(v, dtype=float)
        if not len(chosen):
            return ConsistentStates(q, v, met)
        rows, guess = _Rows(system, q[chosen], chosen), v[chosen]
        rates = system.velocity(q[chosen], guess, chosen)
        corrected = guess - rows.correction(np.where(np.isfinite(rates), rates, 0.0))
        left = system.velocity(q[chosen], corrected, chosen)
        limits = rows.rate_limits(np.maximum(np.abs(guess), np.abs(corrected)))
        limits = np.maximum(np.maximum(limits, CONTRADICTION * np.abs(rates)), np.finfo(float).tiny)
        v[chosen] = corrected
        met[chosen] = rows.defined & (np.abs(left) <= limits).all(axis=1)
    return ConsistentStates(q, v, met)


def _positions(system: ConstrainedSamples, q: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Return configurations on the constraints, and which of them are."""
    q, met = np.array(q, dtype=float), np.zeros(len(q), dtype=bool)
    best = np.full((len(q), system.holonomic), np.inf)
    chosen = np.arange(len(q))
    for _ in range(MAX_ITERATIONS):
        violation, rows = system.constraint(q[chosen], chosen), _Rows(system, q[chosen], chosen)
        summands = np.maximum(rows.size[:, : system.holonomic], np.finfo(float).tiny)
        size = np.abs(violation) / summands / EPSILON
        kept = np.abs(violation) <= rows.limits
        done = ((size <= ROUNDING) | (kept & (size >= 0.5 * best[chosen]))).all(axis=1)
        going = rows.defined & np.isfinite(violation).all(axis=1)
        met[chosen[done & going]] = True
        best[chosen] = np.minimum(best[chosen], size)
        going &= ~done
        if not going.any():
            break
        violation[~going] = 0.0
        step = -rows.correction(violation)[going]
        chosen = chosen[going]
        largest = np.abs(step[:, system.angular]).max(axis=1, initial=0.0)
        q[chosen] = update(system.factors, q[chosen], step / np.maximum(1.0, largest)[:, np.newaxis])
    return q, met


def _times(matrices: Array, vectors: Array) -> Array:
    """Return products of matrices (n, rows, columns) and vectors (n, columns)."""
    return np.asarray(np.matmul(matrices, vectors[:, :, np.newaxis]))[:, :, 0]


def _spread(factors: Sequence[Factor], q: Array) -> Array:
    """Return the distance between bodies that move freely, (n,) in m."""
    places = [q[:, factor.q][:, 4:] for factor in factors if factor.group == "SE3"]
    return np.asarray(np.ptp(places, axis=0).max(axis=1)) if places else np.zeros(len(q))
