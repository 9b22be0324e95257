"""Where equilibria lose stability along a path: stiffnesses next to zero, limit points and bifurcations.

Between two points of a path the load factor turns round (a limit point), or the number of negative stiffnesses changes
(a bifurcation, where it does not turn round). Both are located by false position along the path: R. Seydel, Practical
Bifurcation and Stability Analysis (2010), chapter 5.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from scipy.sparse import block_array, csc_array
from scipy.sparse.linalg import LinearOperator, eigs, splu

from eomgen.arrays import Array
from eomgen.solvers.bordered_newton import LoadedStatics, Rest
from eomgen.solvers.equilibrium_path import PathPoint, step_to

#: Up to so many velocity components stiffnesses come from whole matrices.
WHOLE = 60
#: Stiffnesses next to zero that are looked at beside the negative ones.
_NEXT = 6
#: Trials of false position, and the part of a step to which a critical point is located.
_TRIALS, _LOCATED = 40, 1e-10
#: Part of its size below which an eigenvalue has no imaginary part.
_REAL = 1e-6

Complex = NDArray[np.complex128]
Kind = Literal["limit point", "bifurcation"]


@dataclass(frozen=True)
class Stiffnesses:
    """Squared frequencies by stiffness alone that are next to zero, increasing, and their directions.

    Attributes
    ----------
    values : (n,) real ones, (rad/s)^2
    directions : (nv, n)
    """

    values: Array
    directions: Array

    @property
    def negative(self) -> int:
        return int(np.sum(self.values < 0.0))


@dataclass(frozen=True)
class CriticalPoint:
    """Where a path loses or regains stability.

    Attributes
    ----------
    kind : ``limit point``, where the load factor turns round, or ``bifurcation``
    point : of the path
    mode : (nv,) displacement that nothing opposes there, its largest component 1 (rad, or the scene's length)
    """

    kind: Kind
    point: PathPoint
    mode: Array


def stiffnesses(statics: LoadedStatics, rest: Rest, count: int = _NEXT) -> Stiffnesses:
    """Return the stiffnesses next to zero of what constraints leave free."""
    tangents, mass = statics.tangents(rest), statics.mass(rest)
    nv, rows = len(statics.sizes), len(rest.multipliers)
    if nv <= WHOLE:
        free = scipy.linalg.null_space(tangents.B.toarray()) if rows else np.eye(nv)
        if not free.shape[1]:
            return Stiffnesses(np.zeros(0), np.zeros((nv, 0)))
        inverse = compliance(tangents.K, tangents.B)
        if inverse is None:
            values, vectors = _eigen(free.T @ tangents.K @ free, free.T @ mass @ free)
            return _real(values, free @ vectors)
        flexible = free.T @ mass @ inverse(np.asarray(mass @ free))
        values, vectors = _eigen(flexible, free.T @ mass @ free)
        return _real(reciprocal(values), free @ vectors)
    inverse = compliance(tangents.K, tangents.B)
    if inverse is None:
        return Stiffnesses(np.zeros(1), np.zeros((nv, 1)))
    operator = LinearOperator((nv, nv), matvec=lambda x: inverse(mass @ x), dtype=float)
    start = np.ones(nv)  # so that the same path has the same bits
    values, vectors = eigs(operator, k=min(count, nv - 2), which="LM", v0=start)
    return _real(reciprocal(values), vectors)


def compliance(K: csc_array, B: csc_array) -> Callable[[Array], Array] | None:
    """Return what gives displacements by forces under the constraints; None where the stiffness is singular."""
    nv = K.shape[0]
    try:
        factors = splu(block_array([[K, B.T], [B, None]], format="csc"))
    except RuntimeError:
        return None

    def solve(right: Array) -> Array:
        below = np.zeros((B.shape[0], *right.shape[1:]))
        result: Array = factors.solve(np.concatenate([right, below]))[:nv]
        return result

    return solve if np.all(np.isfinite(solve(np.ones(nv)))) else None


def _eigen(A: Array, M: Array) -> tuple[Complex, Complex]:
    values, vectors = scipy.linalg.eig(A, M)
    return np.asarray(values, complex), np.asarray(vectors, complex)


def reciprocal(values: Complex) -> Complex:
    return np.divide(1.0, values, out=np.full_like(values, np.inf), where=values != 0.0)


def _real(values: Complex, vectors: Complex) -> Stiffnesses:
    """Return the real ones, increasing; complex pairs are of forces that follow the motion, and cross no zero."""
    real = np.isfinite(values) & (np.abs(values.imag) <= _REAL * np.abs(values))
    order = np.argsort(values.real[real], kind="stable")
    return Stiffnesses(values.real[real][order], vectors.real[:, real][:, order])


def critical_point(
    statics: LoadedStatics, ends: tuple[PathPoint, PathPoint], found: tuple[Stiffnesses, Stiffnesses]
) -> CriticalPoint | None:
    """Return the critical point between two neighbouring points of a path, whose stiffnesses are known; None without
    one."""
    first, second = ends
    before, after = found
    if first.direction.s * second.direction.s < 0.0:
        located = _located(statics, ends, lambda point: point.direction.s, (first.direction.s, second.direction.s))
        return _critical("limit point", statics, located)
    if before.negative == after.negative:
        return None
    number = min(before.negative, after.negative)
    if number >= min(len(before.values), len(after.values)):
        return None

    def crossing(point: PathPoint) -> float:
        values = stiffnesses(statics, point.rest).values
        return float(values[min(number, len(values) - 1)]) if len(values) else 0.0

    located = _located(statics, ends, crossing, (float(before.values[number]), float(after.values[number])))
    return _critical("bifurcation", statics, located)


def _critical(kind: Kind, statics: LoadedStatics, point: PathPoint) -> CriticalPoint:
    near = stiffnesses(statics, point.rest)
    mode = near.directions[:, int(np.argmin(np.abs(near.values)))]
    return CriticalPoint(kind, point, scaled_mode(statics, mode))


def scaled_mode(statics: LoadedStatics, mode: Array) -> Array:
    """Return a displacement whose largest component is 1: 1 rad, or the scene's length."""
    parts = mode / statics.sizes
    largest = parts[int(np.argmax(np.abs(parts)))]
    return mode / largest if largest else mode


def _located(
    statics: LoadedStatics,
    ends: tuple[PathPoint, PathPoint],
    value: Callable[[PathPoint], float],
    values: tuple[float, float],
) -> PathPoint:
    """Return the point between two at which a value is zero, by false position with halved weights (Illinois)."""
    first, second = ends
    low, high = 0.0, second.stride
    of_low, of_high = values
    best = min((abs(of_low), first), (abs(of_high), second), key=lambda pair: pair[0])
    for _ in range(_TRIALS):
        way = high - of_high * (high - low) / (of_high - of_low) if of_high != of_low else 0.5 * (low + high)
        reached = step_to(statics, first, way)
        if isinstance(reached, str):
            break
        now = value(reached)
        if abs(now) < best[0]:
            best = (abs(now), reached)
        if now == 0.0 or abs(high - low) <= _LOCATED * second.stride:
            break
        if now * of_high < 0.0:
            low, of_low = high, of_high
        else:
            of_low *= 0.5
        if abs(way - high) <= _LOCATED * second.stride:
            break
        high, of_high = way, now
    return best[1]
