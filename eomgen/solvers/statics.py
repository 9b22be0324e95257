"""Statics on a product of Lie groups: balanced forces, satisfied constraints, constant internal states.

In coordinates scaled by the roots of the inertias and reduced to directions left free by constraints, stiffnesses are
squared angular frequencies and unbalanced forces are accelerations. This module has the quantities at a configuration,
and the criterion of rest; ``equilibrium_search`` finds a rest by a heavily damped motion (``follow_damped_motion``),
and a rest of any stability by Newton's path (``follow_newton``), and chooses between both.

No number here has a unit of its own: lengths are measured by the scene's, forces by its weight and by the largest met
on the way.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.rounding import COMPUTED, WRITTEN
from eomgen.lie.product import Factor, update
from eomgen.solvers.blocks import Blocks, congruent, inverse_root, least_solution
from eomgen.solvers.bordered_newton import Matrix
from eomgen.solvers.regular_inertia import inertia_with_rows

#: Largest turn of a step, rad.
LARGEST_TURN = 0.5
#: Unbalanced forces and rates below this part of the largest are none; round-off of stiff systems is allowed on top.
BALANCED = 1e-11
#: Violations of constraints below this part of the change by moving the scene's length are none.
MET = 1e-10
_EPSILON = float(np.finfo(float).eps)


@dataclass(frozen=True)
class Statics:
    """A system at rest at fixed time, inputs and parameters, as callables.

    Attributes
    ----------
    factors : of the configuration
    turning : (nv,) which components of v are angular
    holonomic : number of constraint rows at position level, which come first
    mass(q), jacobian(q), constraint(q) : M, B (rows, nv), Phi (holonomic,)
    residual(q, lam, z) : r = -Q + B^T lam
    stiffness(q, lam, z) : left-trivialised derivative of r by q
    rates(q, z), rates_in_motion(q, z, v) : zdot at rest and at velocities, which are small
    couplings(q, z) : derivatives of r by z, of zdot by q, of zdot by v, and of zdot by z
    carried_in_motion(q, z, v) : derivative of zdot by v at velocities
    followed(q) : q with counted turns adapted to the poses
    length : m, scale of coordinates in m: the scene's largest
    gravity : m/s^2
    total : kg, the scene's mass
    """

    factors: Sequence[Factor]
    turning: NDArray[np.bool_]
    holonomic: int
    mass: Callable[[Array], Matrix]
    jacobian: Callable[[Array], Array]
    constraint: Callable[[Array], Array]
    residual: Callable[[Array, Array, Array], Array]
    stiffness: Callable[[Array, Array, Array], Matrix]
    rates: Callable[[Array, Array], Array]
    couplings: Callable[[Array, Array], tuple[Array, ...]]
    rates_in_motion: Callable[[Array, Array, Array], Array]
    carried_in_motion: Callable[[Array, Array, Array], Array]
    followed: Callable[[Array], Array]
    length: float = 1.0
    gravity: float = 0.0
    total: float = 0.0

    @property
    def weight(self) -> float:
        """Largest possible gravity force along a direction of unit kinetic energy, N / kg^(1/2)."""
        return self.gravity * float(np.sqrt(max(self.total, 0.0)))

    @property
    def sizes(self) -> Array:
        """(nv,) scales of the components of a displacement: 1 rad, or the scene's length."""
        return np.where(self.turning, 1.0, self.length)


@dataclass(frozen=True)
class SearchPoint:
    """Quantities of statics at one configuration of a search for rest.

    Internal states move with the coordinates by their rates in a motion, as bristles and lagged slips do: next to this
    point z = w + (dzdot/dv) q. Stiffness and derivatives by q hold w, not z.

    Attributes
    ----------
    q, z, lam : configuration, internal states, multipliers of least size
    residual : (nv,) r with the multipliers; the remainder is along the directions of the constraints
    basis : (nv, free) velocities that the constraints leave free, of unit kinetic energy each
    dual : (free, nv) maps a velocity to components along the basis
    imbalance : (free,) forces along the basis
    K : (nv, nv) stiffness
    violation : (holonomic,) of the constraints
    correction : (nv,) increment that removes the violation to first order
    rates : (nz,) of the internal states
    carried : (nz, nv) changes of internal states that move with the coordinates
    couplings : derivatives of forces along the basis by z, of zdot along the basis, and of zdot by z
    rounding() : root sum of squares of the rounding of the imbalance: rounding of terms of forces that cancel
    rate_noise, row_sizes : (nz,) the same of the rates, and (holonomic,) the scales of the rows of constraints
    """

    q: Array
    z: Array
    lam: Array
    residual: Array
    basis: Matrix
    dual: Matrix
    imbalance: Array
    K: Matrix
    violation: Array
    correction: Array
    rates: Array
    carried: Array
    couplings: tuple[Array, Array, Array]
    rounding: Callable[[], float]
    rate_noise: Array
    row_sizes: Array

    @property
    def acceleration(self) -> Array:
        """(nv,) accelerations with which the system would start to move."""
        result: Array = -(self.basis @ self.imbalance)
        return result

    @property
    def force(self) -> float:
        """The imbalance, in N / kg^(1/2): the root of the sum of squares along the basis."""
        return float(np.linalg.norm(self.imbalance))

    @property
    def finite(self) -> bool:
        entries = self.K if isinstance(self.K, np.ndarray) else self.K.data
        return all(bool(np.isfinite(part).all()) for part in (entries, self.residual, self.rates, self.z))

    @cached_property
    def stiffness_blocks(self) -> Blocks:
        """Stiffness (free, free) along the basis, squared angular frequencies, by blocks."""
        return Blocks.of(congruent(self.basis, self.K), narrow=True)

    @cached_property
    def noise(self) -> float:
        """The rounding of the imbalance."""
        return self.rounding()

    @cached_property
    def stiffness(self) -> Array:
        """(free, free) along the basis: squared angular frequencies."""
        return self.stiffness_blocks.whole

    @cached_property
    def largest_stiffness(self) -> float:
        return self.stiffness_blocks.largest

    @property
    def meets_constraints(self) -> bool:
        """Whether the constraints hold."""
        return bool(np.all(np.abs(self.violation) <= MET * self.row_sizes))

    @cached_property
    def pushes(self) -> Array:
        """(nz,) effect of internal states along the basis relative to the largest stiffness; 0 without effect."""
        stiffness = self.largest_stiffness or np.inf
        return np.asarray(np.linalg.norm(self.couplings[0], axis=0) / stiffness)

    @property
    def scale(self) -> Array:
        """(free + nz,) factors that make changes along the basis and of z comparable, as far as these push."""
        pushes = self.pushes
        return np.concatenate([np.ones(len(self.imbalance)), np.where(pushes > 0.0, pushes, 1.0)])

    def weighted_size(self, change: Array) -> float:
        """Return the size of changes along the basis and of z; changes of z are weighted by ``pushes``."""
        free = len(self.imbalance)
        return float(np.hypot(np.linalg.norm(change[:free]), np.linalg.norm(self.pushes * change[free:])))


@dataclass
class LargestForces:
    """The largest forces and rates of a search, as scales of the residuals."""

    force: float
    rates: Array

    def include(self, point: SearchPoint) -> None:
        self.force = max(self.force, point.force)
        self.rates = np.maximum(self.rates, np.abs(point.rates))

    def balances(self, point: SearchPoint) -> bool:
        """Return whether only round-off remains."""
        return self.rests(point) and bool(np.all(np.abs(point.rates) <= BALANCED * self.rates + point.rate_noise))

    def rests(self, point: SearchPoint) -> bool:
        """Return whether only round-off remains of forces and constraints, for any rates of internal states."""
        return point.force <= BALANCED * self.force + point.noise and point.meets_constraints


@dataclass(frozen=True)
class Search:
    """End of a search for rest. ``balanced``: whether forces and rates of internal states vanish at the end up to
    round-off; ``steps``: number of steps; ``path``: configurations on the way; ``states_alone``: whether forces and
    constraints are balanced, and rates of internal states are not."""

    point: SearchPoint
    balanced: bool
    steps: int
    path: Sequence[Array] = ()
    states_alone: bool = False


class SearchTrail:
    """The way of a search from a start to balanced forces.

    Attributes
    ----------
    point : present point of the search
    steps : number of steps so far
    """

    def __init__(self, statics: Statics, q: Array, z: Array) -> None:
        """Start at q and z, brought onto the constraints. Raises numpy.linalg.LinAlgError if M is not positive
        definite."""
        self.point = onto_constraints(statics, examine(statics, q, z))
        self.steps = 0
        self._statics, self._path = statics, [self.point.q]
        self._largest = LargestForces(statics.weight, np.abs(self.point.rates))

    def has_arrived(self) -> bool:
        """Return whether forces balance at this point, relative to the largest forces of the search."""
        self._largest.include(self.point)
        return self._largest.balances(self.point)

    @property
    def lags(self) -> bool:
        """Whether the forces are more than half of the largest on the way."""
        return self.point.force > 0.5 * self._largest.force

    def step(self, point: SearchPoint) -> None:
        """Go on to a point."""
        self.move(point)
        self.steps += 1

    def move(self, point: SearchPoint) -> None:
        """Put the search at a point without counting a step."""
        self.point = point
        self._path.append(point.q)

    def end(self, *, balanced: bool | None = None) -> Search:
        """Return the end of the search, after Newton's last steps unless ``balanced`` is False. ``balanced`` marks the
        result; by default the forces decide."""
        last = self.point if balanced is False else polish(self._statics, self.point)
        if np.any(last.carried):
            last = examine(self._statics, last.q, last.z)
        reached = self._largest.balances(last) if balanced is None else balanced
        states_alone = not reached and self._largest.rests(last) and not self._largest.balances(last)
        return Search(last, reached, self.steps, self._path, states_alone)


@contextlib.contextmanager
def told_if_interrupted(trail: SearchTrail, way: str) -> Iterator[None]:
    """Add a note on a search's progress to a KeyboardInterrupt in the body; ``way`` names the method."""
    try:
        yield
    except KeyboardInterrupt as stop:
        left = float(np.max(np.abs(trail.point.acceleration), initial=0.0))
        stop.add_note(
            f"the search for an equilibrium by {way} had {trail.steps} steps; the largest unbalanced acceleration there"
            f" is {left:.3g} m/s^2 or rad/s^2"
        )
        raise


def examine(statics: Statics, q: Array, z: Array, *, sliding: bool = False) -> SearchPoint:
    """Return the quantities of statics at a configuration q and internal states z: forces, stiffness, constraints. q is
    adapted to counted turns. Raises numpy.linalg.LinAlgError if M is not positive definite, also with constraints.

    ``sliding``: whether internal states move as in a motion along the acceleration, by which bristles slide that are
    elastic in the opposite direction; else as in small motions about rest.
    """
    q = statics.followed(q)
    M, B0, sizes = statics.mass(q), statics.jacobian(q), statics.sizes
    try:
        inverse: Any = inverse_root(M)
    except np.linalg.LinAlgError:
        if not len(B0):
            raise
        M = inertia_with_rows(M if isinstance(M, np.ndarray) else M.toarray(), B0, sizes)
        inverse = inverse_root(M)
    root = inverse.T
    B = B0 @ root
    violation = statics.constraint(q)
    r0 = statics.residual(q, np.zeros(len(B)), z)
    free: Array | None = None
    spread = np.zeros((len(sizes), 0))
    lam = np.zeros(len(B))
    if len(B):
        U, sigma, Vt = np.linalg.svd(B)
        rank = geometric_rank(B0 * sizes)
        free, spread = Vt[rank:].T, (Vt[:rank].T / sigma[:rank]) @ U[:, :rank].T
        lam = -spread.T @ (inverse @ r0)
    residual = r0 + B0.T @ lam
    basis: Any = root if free is None else np.asarray(root @ free)
    onto = basis.T
    K: Any = statics.stiffness(q, lam, z)
    by_z, rate_q, carried, rate_z = statics.couplings(q, z)
    if np.any(carried):
        if sliding:
            carried = statics.carried_in_motion(q, z, -(basis @ (onto @ residual)))
        springs, rate_q = by_z @ carried, rate_q + rate_z @ carried
        K = K + (springs if isinstance(K, np.ndarray) else csc_array(springs))
    aimed = np.zeros(len(B))
    aimed[: statics.holonomic] = -violation
    few = 64.0 * _EPSILON
    row_sizes = np.abs(B0[: statics.holonomic]) @ sizes
    return SearchPoint(
        q,
        z,
        lam,
        residual,
        basis,
        onto @ M,
        onto @ residual,
        K,
        violation,
        root @ (spread @ aimed),
        statics.rates(q, z),
        carried,
        (onto @ by_z, rate_q @ basis, rate_z),
        lambda: few * float(np.linalg.norm(abs(inverse) @ (abs(K) @ sizes + np.abs(by_z) @ np.abs(z)))),
        few * (np.abs(rate_q) @ sizes + np.abs(rate_z) @ np.abs(z)),
        np.where(row_sizes > 0.0, row_sizes, statics.length),
    )


def geometric_rank(B: Array) -> int:
    """Return the number of independent rows of a constraint Jacobian, (rows, nv), whose columns are per rad or per
    length of the scene; masses have no part in it."""
    lengths = np.linalg.norm(B, axis=1)
    values = np.linalg.svd(B[lengths > 0.0] / lengths[lengths > 0.0, np.newaxis], compute_uv=False)
    return int(np.sum(values > 1e-10 * np.max(values, initial=0.0)))


def newton_step(point: SearchPoint, right: Array) -> Array:
    """Return Newton's change, (free + nz,), along the basis and of internal states, of least size. ``right``, (free +
    nz,), are minus the imbalance and the rates; see ``newton_right_side``."""
    by_z, rate_q, rate_z = point.couplings
    matrix = point.stiffness_blocks
    if len(point.z):
        matrix = Blocks.of(np.block([[point.stiffness, by_z], [-rate_q, -rate_z]]) / point.scale)
    size = matrix.largest_of_rows
    rows: Array = np.where(size > 0.0, size, 1.0)
    return least_solution(matrix.divide_rows(rows), right / rows) / point.scale


def newton_right_side(point: SearchPoint) -> Array:
    """Return the right side of Newton's step: minus the imbalance, and the rates."""
    return np.concatenate([-point.imbalance, point.rates])


def share_of_turn(statics: Statics, point: SearchPoint, change: Array) -> float:
    """Return the part of a change after which a component has turned by ``LARGEST_TURN``; 1 if none turns so far."""
    increment = point.basis @ change[: len(point.imbalance)]
    turn = float(np.max(np.abs(increment[statics.turning]), initial=0.0))
    return min(1.0, LARGEST_TURN / turn) if turn > 0.0 else 1.0


def move(statics: Statics, point: SearchPoint, change: Array) -> SearchPoint | None:
    """Return the point after a change (free + nz,) along the basis and of internal states, brought onto the
    constraints. None if quantities there are not finite."""
    free = len(point.imbalance)
    increment = point.basis @ change[:free] + point.correction
    if not np.all(np.isfinite(increment)):
        return None
    with np.errstate(all="ignore"):
        try:
            z = change[free:] + _moved_states(statics, point, increment)
            reached = examine(statics, update(statics.factors, point.q, increment), z, sliding=True)
            reached = onto_constraints(statics, reached)
        except np.linalg.LinAlgError:
            return None
    return reached if reached.finite else None


def _moved_states(statics: Statics, point: SearchPoint, increment: Array) -> Array:
    """Return the internal states after a motion of the coordinates, (nv,), by their rates in this motion; not finite if
    the states grow without bound on the way."""
    if not np.any(point.carried):
        return point.z

    def rates(_: float, z: Array) -> Array:
        return statics.rates_in_motion(point.q, z, increment) - statics.rates(point.q, z)

    change = rates(0.0, point.z)
    bent = np.max(np.abs(rates(1.0, point.z + change) - change))
    if not bent > WRITTEN * np.max(np.abs(change)):
        return point.z + change
    from scipy.integrate import LSODA  # noqa: PLC0415  # for states that slide alone

    solver = LSODA(rates, 0.0, point.z, 1.0, rtol=WRITTEN, atol=COMPUTED * np.max(np.abs(change)))
    while solver.status == "running" and solver.nfev < 5000:  # states that slide take some hundreds
        solver.step()
    return np.where(solver.status == "finished", solver.y, np.nan)


def onto_constraints(statics: Statics, point: SearchPoint) -> SearchPoint:
    """Return the point brought onto the constraints by at most twelve corrections, while these reduce the violation."""
    for _ in range(12):
        if np.all(np.abs(point.violation) <= 1e-3 * MET * point.row_sizes):
            break
        z = _moved_states(statics, point, point.correction)
        nearer = examine(statics, update(statics.factors, point.q, point.correction), z, sliding=True)
        if not nearer.finite or np.max(np.abs(nearer.violation)) >= np.max(np.abs(point.violation)):
            break
        point = nearer
    return point


def polish(statics: Statics, point: SearchPoint) -> SearchPoint:
    """Return the point after at most five Newton steps, while these are small and each at most half the last."""
    left = newton_step(point, newton_right_side(point))
    for _ in range(5):
        moved = np.abs(point.basis @ left[: len(point.imbalance)]) / statics.sizes
        if not np.any(left) or np.max(moved, initial=0.0) > 1e-3:
            break
        nearer = move(statics, point, left)
        if nearer is None:
            break
        still = newton_step(nearer, newton_right_side(nearer))
        if not point.weighted_size(still) < 0.5 * point.weighted_size(left):
            break
        point, left = nearer, still
    return point
