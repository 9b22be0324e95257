"""Static equilibrium on a product of groups: forces balance at rest, constraints hold, internal states stand still.

In coordinates scaled by the roots of the inertias and reduced to what the constraints leave free, stiffnesses are squared angular
frequencies and unbalanced forces are accelerations. Descent: Newton steps with stiffnesses made positive (Levenberg 1944), taken
when the forces do work along them, so that they run down to stable equilibria. Newton: whole steps, halved until the imbalance
falls, to any equilibrium.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from eomgen.lie.product import FactorLike, update

Array = NDArray[np.float64]

MAX_DESCENTS, MAX_NEWTON = 300, 60
#: Largest turn of a step, rad.
LARGEST_TURN = 0.5
#: By how much the largest component is moved off an unstable equilibrium, rad or m.
NUDGE = 1e-3
#: Unbalanced accelerations below this, m/s^2 or rad/s^2, are none; round-off of stiff systems is allowed on top.
BALANCED = 1e-10
#: Eigenvalues of the stiffness below this part of the largest are zero: nothing opposes their directions.
SOFT = 1e-11
_EPSILON = float(np.finfo(float).eps)


@dataclass(frozen=True)
class Statics:
    """A system at rest at fixed time, inputs and parameters, as callables.

    Attributes
    ----------
    factors : of the configuration
    turning : (nv,) which components of v are angular
    holonomic : number of constraint rows at position level, the first ones
    mass(q), jacobian(q), constraint(q) : M, B (rows, nv), Phi (holonomic,)
    residual(q, lam, z) : r = -Q + B^T lam
    stiffness(q, lam, z) : left-trivialised derivative of r by q
    rates(q, z) : zdot
    couplings(q, z) : derivatives of r by z, of zdot by q, and of zdot by z
    followed(q) : q with what it counts over turns brought to where its poses are
    """

    factors: Sequence[FactorLike]
    turning: NDArray[np.bool_]
    holonomic: int
    mass: Callable[[Array], Array]
    jacobian: Callable[[Array], Array]
    constraint: Callable[[Array], Array]
    residual: Callable[[Array, Array, Array], Array]
    stiffness: Callable[[Array, Array, Array], Array]
    rates: Callable[[Array, Array], Array]
    couplings: Callable[[Array, Array], tuple[Array, Array, Array]]
    followed: Callable[[Array], Array]


@dataclass(frozen=True)
class Point:
    """What is known where the system rests.

    Attributes
    ----------
    q, z, lam : configuration, internal states, multipliers of least size
    residual : (nv,) r with the multipliers; what is left of it only the constraints' own directions carry
    basis : (nv, free) velocities that the constraints leave free, of unit kinetic energy each
    imbalance : (free,) forces along the basis
    stiffness : (free, free) along the basis: squared angular frequencies
    violation : (holonomic,) of the constraints
    correction : (nv,) increment that removes it to first order
    rates : (nz,) of the internal states
    couplings : of the basis and of the internal states
    """

    q: Array
    z: Array
    lam: Array
    residual: Array
    basis: Array
    imbalance: Array
    stiffness: Array
    violation: Array
    correction: Array
    rates: Array
    couplings: tuple[Array, Array, Array]

    @property
    def acceleration(self) -> Array:
        """(nv,) with which the system would start to move."""
        result: Array = -self.basis @ self.imbalance
        return result

    @property
    def finite(self) -> bool:
        return all(bool(np.all(np.isfinite(part))) for part in (self.residual, self.stiffness, self.rates))

    @property
    def symmetric(self) -> Array:
        result: Array = 0.5 * (self.stiffness + self.stiffness.T)
        return result

    @property
    def largest_stiffness(self) -> float:
        return float(np.max(np.abs(self.stiffness), initial=0.0))

    @property
    def balanced(self) -> bool:
        """Whether nothing is left but round-off."""
        floor = BALANCED + 64.0 * _EPSILON * self.largest_stiffness * (1.0 + float(np.max(np.abs(self.q), initial=0.0)))
        fastest = float(np.max(np.abs(self.couplings[2]), initial=0.0))
        rate_floor = BALANCED + 64.0 * _EPSILON * fastest * float(np.max(np.abs(self.z), initial=0.0))
        return bool(
            np.max(np.abs(self.acceleration), initial=0.0) <= floor
            and np.max(np.abs(self.rates), initial=0.0) <= rate_floor
            and np.max(np.abs(self.violation), initial=0.0) <= 1e-10
        )

    @property
    def size(self) -> float:
        """How far from equilibrium: accelerations, rates and violations together."""
        parts = (self.acceleration, self.rates, self.violation)
        return float(np.sqrt(sum(float(part @ part) for part in parts)))


@dataclass(frozen=True)
class Search:
    """The point a search ended at, whether it is balanced, and how many steps it took."""

    point: Point
    balanced: bool
    steps: int


def examine(statics: Statics, q: Array, z: Array) -> Point:
    """Return forces and stiffness at rest at q and z. Raises numpy.linalg.LinAlgError where M is not positive definite."""
    q = statics.followed(q)
    L = np.linalg.cholesky(statics.mass(q))
    inverse: Array = np.linalg.inv(L)
    B = statics.jacobian(q) @ inverse.T
    violation = statics.constraint(q)
    r0 = statics.residual(q, np.zeros(len(B)), z)
    free, spread = np.eye(len(L)), np.zeros((len(L), 0))
    lam = np.zeros(len(B))
    if len(B):
        U, sigma, Vt = np.linalg.svd(B)
        rank = int(np.sum(sigma > 1e-10 * np.max(sigma, initial=0.0)))
        free, spread = Vt[rank:].T, (Vt[:rank].T / sigma[:rank]) @ U[:, :rank].T
        lam = -spread.T @ (inverse @ r0)
    residual = r0 + statics.jacobian(q).T @ lam
    basis = inverse.T @ free
    K = statics.stiffness(q, lam, z)
    by_z, rate_q, rate_z = statics.couplings(q, z)
    aimed = np.zeros(len(B))
    aimed[: statics.holonomic] = -violation
    return Point(
        q, z, lam, residual, basis, basis.T @ residual, basis.T @ K @ basis, violation, inverse.T @ (spread @ aimed),
        statics.rates(q, z), (basis.T @ by_z, rate_q @ basis, rate_z),
    )  # fmt: skip


def descend(statics: Statics, q: Array, z: Array) -> Search:
    """Run down to a stable equilibrium; internal states follow their own equations meanwhile."""
    search = _descend(_rounded(statics), q, z)
    point = _polished(statics, examine(statics, search.point.q, search.point.z)) if search.balanced else search.point
    return Search(point, search.balanced and point.balanced, search.steps)


def _rounded(statics: Statics) -> Statics:
    """Return the system with inertias about all axes of a body as large as about the largest.

    Away from equilibrium turns of a slender body about its own axis and across it are coupled by the moment across it. With its
    small inertia that coupling would be the stiffest of all, and every step would be short.
    """
    groups = [slice(f.v_start, f.v_start + 3) for f in statics.factors if f.group != "R"]

    def mass(q: Array) -> Array:
        M = statics.mass(q).copy()
        for part in groups:
            M[part, part] += np.max(np.diag(M)[part]) * np.eye(3)
        return M

    return replace(statics, mass=mass)


def _descend(statics: Statics, q: Array, z: Array) -> Search:
    point = _onto_constraints(statics, examine(statics, q, z))
    shift, steps = 0.0, 0
    for steps in range(MAX_DESCENTS):
        if not point.finite:
            return Search(point, False, steps)
        if point.balanced:
            nudged = _nudged(statics, point)
            if nudged is None:
                return Search(point, True, steps)
            point = nudged
        scale = point.largest_stiffness
        for _ in range(40):
            change = _solve(point, *_made_positive(point, shift))
            moved = _moved(statics, point, change)
            if moved is not None:
                taken, next_point = moved
                work = float(taken @ (point.residual + next_point.residual))
                if work <= 0.0 or (len(point.z) and next_point.size <= 2.0 * point.size) or next_point.size < 0.5 * point.size:
                    break
            shift = max(8.0 * shift, 1e-3 * scale, 1e-6)
        else:
            return Search(point, False, steps)
        point, shift = next_point, shift / 8.0 if shift > 1e-9 * scale else 0.0
    return Search(point, point.finite and point.balanced, steps + 1)


def newton(statics: Statics, q: Array, z: Array) -> Search:
    """Go to an equilibrium nearby, stable or not."""
    point = _onto_constraints(statics, examine(statics, q, z))
    steps = 0
    for steps in range(MAX_NEWTON):
        if not point.finite:
            return Search(point, False, steps)
        if point.balanced:
            return Search(_polished(statics, point), True, steps)
        change, share = _solve(point, point.stiffness, 0.0), 1.0
        while share > 1e-4:
            moved = _moved(statics, point, share * change)
            if moved is not None and moved[1].size < (1.0 - 0.1 * share) * point.size:
                break
            share *= 0.5
        else:
            return Search(point, False, steps)
        point = moved[1]
    return Search(point, point.finite and point.balanced, steps + 1)


def _nudged(statics: Statics, point: Point) -> Point | None:
    """Return a point a little off an unstable equilibrium, on the way down; None from a stable one."""
    if not len(point.imbalance) or len(point.rates):
        return None
    values, vectors = np.linalg.eigh(point.symmetric)
    if values[0] >= -1e3 * SOFT * point.largest_stiffness:
        return None
    direction = point.basis @ vectors[:, 0]
    moved = _moved(statics, point, NUDGE / float(np.max(np.abs(direction))) * vectors[:, 0])
    return None if moved is None else moved[1]


def _made_positive(point: Point, shift: float) -> tuple[Array, float]:
    """Return the stiffness with the sizes of its eigenvalues in their place, none below the shift, and the shift of the rates."""
    values, vectors = np.linalg.eigh(point.symmetric)
    scale = point.largest_stiffness
    wanted = np.maximum(np.abs(values), max(shift, 1e-7 * scale) if scale > 0.0 else max(shift, 1.0))
    result: Array = point.stiffness + (vectors * (wanted - values)) @ vectors.T
    return result, shift


def _solve(point: Point, stiffness: Array, shift: float) -> Array:
    """Return changes along the basis and of z: an implicit step of 1/shift of y' = -imbalance, z' = rates; without, Newton's."""
    by_z, rate_q, rate_z = point.couplings
    nz = len(point.rates)
    matrix = np.block([[stiffness, by_z], [-rate_q, shift * np.eye(nz) - rate_z]])
    right = np.concatenate([-point.imbalance, point.rates])
    size: Array = np.max(np.abs(matrix), axis=1, initial=0.0)
    scale: Array = np.where(size > 0.0, size, 1.0)
    return np.asarray(np.linalg.lstsq(matrix / scale[:, np.newaxis], right / scale, rcond=SOFT)[0])


def _moved(statics: Statics, point: Point, change: Array) -> tuple[Array, Point] | None:
    """Return the increment that was taken and the point at its end; None where it has no numbers."""
    free = len(point.imbalance)
    increment = point.basis @ change[:free] + point.correction
    turn = float(np.max(np.abs(increment[statics.turning]), initial=0.0))
    share = min(1.0, LARGEST_TURN / turn) if turn > 0.0 else 1.0
    if not np.all(np.isfinite(increment)):
        return None
    with np.errstate(all="ignore"):
        try:
            reached = examine(statics, update(statics.factors, point.q, share * increment), point.z + share * change[free:])
            reached = _onto_constraints(statics, reached)
        except np.linalg.LinAlgError:
            return None
    return (share * increment, reached) if reached.finite else None


def _onto_constraints(statics: Statics, point: Point) -> Point:
    """Return the point brought onto the constraints, as near as a few corrections come."""
    for _ in range(12):
        if np.max(np.abs(point.violation), initial=0.0) <= 1e-13:
            break
        nearer = examine(statics, update(statics.factors, point.q, point.correction), point.z)
        if not nearer.finite or np.max(np.abs(nearer.violation)) >= np.max(np.abs(point.violation)):
            break
        point = nearer
    return point


def _polished(statics: Statics, point: Point) -> Point:
    """Return the point after Newton steps for as long as they halve what is left."""
    for _ in range(5):
        moved = _moved(statics, point, _solve(point, point.stiffness, 0.0))
        if moved is None or not moved[1].size < 0.5 * point.size or float(np.max(np.abs(moved[0]), initial=0.0)) > 1e-3:
            break
        point = moved[1]
    return point
