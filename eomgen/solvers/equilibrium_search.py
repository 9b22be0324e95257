"""Order of searches for rest: a damped motion first, and Newton's paths from slow points on its way, to equilibria that
are stable or not, with damped steps (Deuflhard 2004, section 3.3.3).

With damping that is large and in proportion to the inertias, a motion follows the accelerations of rest: in coordinates
of unit kinetic energy q' = -imbalance(q, z), and internal states follow their own equations meanwhile, c times as fast
as that time runs, c = 2 omega of the stiffest mode. That motion is followed by exponential Rosenbrock steps of order 3
with an embedded one of order 2 (Hochbruck and Ostermann 2010), which are exact for linear forces: stiff modes cost
no steps, unstable ones are left as fast as they grow, and close to rest a step is Newton's. Their error comes from
nonlinear forces over a step, and is a tenth of the step at most, so the path stays in the basin.

Long trees that fall far need thousands of such steps; they go on by Newton's steps in a trust region of displacements,
with magnitudes of negative stiffnesses (Nocedal and Wright 2006, chapter 4 and section 3.4).
"""

from __future__ import annotations

from functools import cached_property, partial

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, replace
from eomgen.base.rounding import COMPUTED, SUMMED
from eomgen.lie.product import difference
from eomgen.solvers.blocks import SOFT, Blocks
from eomgen.solvers.phi_functions import SymmetricPhi, phi_of_matrix
from eomgen.solvers.statics import (
    Search,
    SearchPoint,
    SearchTrail,
    Statics,
    examine,
    move,
    newton_right_side,
    newton_step,
    share_of_turn,
    told_if_interrupted,
)
from eomgen.solvers.tangent_stiffness import canonical_direction

#: Steps after which a motion may be left.
SLOW_STEPS = 100
#: Largest error of a step, as a part of the step; an error ten times smaller needs no correction.
_ERROR = 0.1
#: Time of a step times the largest stiffness at the change to Newton's.
_LAST = 1e8


def follow_damped_motion(statics: Statics, q: Array, z: Array, slower: float = 1.0, *, patient: bool = True) -> Search:
    """Return the equilibrium that the damped motion from q and z reaches, or the end of the motion without one.

    Unstable equilibria on the way are left by a small displacement.

    Parameters
    ----------
    slower : float
        Factor by which the rates of internal states are reduced.
    patient : bool
        Whether a motion with forces that have not halved after ``SLOW_STEPS`` goes on.

    Raises
    ------
    numpy.linalg.LinAlgError
        M is not positive definite at the start.
    """
    trail, pace = SearchTrail(statics, q, z), _MotionProgress()
    with told_if_interrupted(trail, "a damped motion"):
        while True:
            if trail.has_arrived():
                nudged = _nudge(statics, trail.point)
                if nudged is None:
                    return trail.end(balanced=True)
                pace.time = 0.0
                trail.move(nudged)
            left = trail.steps == 3 * SLOW_STEPS or (not patient and trail.steps >= SLOW_STEPS and trail.lags)
            # so many lengths of the scene: it moves away freely
            if not trail.point.finite or left or pace.way > 1e6:
                return trail.end(balanced=False)
            reached = _step(statics, trail.point, pace, slower)
            if reached is None:
                return trail.end()
            trail.step(reached)


@dataclass
class _MotionProgress:
    """Progress of a damped motion: time of the next step (0 if unknown), distance so far in scene lengths, and summed
    step sizes in the kinetic metric."""

    time: float = 0.0
    way: float = 0.0
    kinetic: float = 0.0


@dataclass(frozen=True)
class _LinearMotion:
    """The damped motion at a point, made linear: x' = J x + f for changes x along the basis and of internal states.

    Attributes
    ----------
    point : SearchPoint
    J, f : in changes multiplied by ``scale``
    scale : (free + nz,)
    rate : ratio of the rates of internal states to the rate of the scene
    """

    point: SearchPoint
    J: Blocks
    f: Array
    scale: Array
    rate: float

    @property
    def fastest(self) -> float:
        return self.point.largest_stiffness or self.J.largest

    @property
    def convex(self) -> bool:
        """Whether no direction is unstable."""
        return self.point.stiffness_blocks.symmetric.above(-SOFT * self.point.largest_stiffness)

    @cached_property
    def _symmetric_phi(self) -> SymmetricPhi | None:
        """The functions of J; None if J is not symmetric (internal states, follower forces)."""
        return None if self.J.skew > SUMMED * self.J.largest else SymmetricPhi(self.J)

    def _phi(self, f: Array, time: float, order: int) -> Array:
        """Return time phi_k(time J) f, phi_k being the k-th function of exponential integrators."""
        if self._symmetric_phi is None or not np.isfinite(f).all():
            return phi_of_matrix(self.J.whole, f, time, order)
        return self._symmetric_phi(f, time, order)

    def step(self, time: float) -> Array:
        """Return the change, (free + nz,), of the linear motion after a time; for infinite time Newton's step."""
        if np.isinf(time):
            return newton_step(self.point, newton_right_side(self.point))
        return self._phi(self.f, time, 1) / self.scale

    def error(self, change: Array, reached: SearchPoint, time: float) -> tuple[Array, Array]:
        """Return the change, (free + nz,), that nonlinear forces add to a step, and the rates of the changes at the
        end. ``change`` is the step, ``reached`` the point after it, and ``time`` the duration of the step."""
        free = len(self.point.imbalance)
        there = np.concatenate([self.point.dual @ reached.acceleration, self.rate * reached.rates])
        bent = self.scale * there - self.f - self.J.times(self.scale * change)
        if np.isinf(time):
            bent = bent / self.scale
            bent[free:] /= self.rate
            return newton_step(self.point, bent), there
        return 2.0 * self._phi(bent, time, 3) / self.scale, there


def _linear(point: SearchPoint, slower: float) -> _LinearMotion:
    by_z, rate_q, rate_z = point.couplings
    fastest = float(np.sqrt(point.largest_stiffness)) or float(np.max(np.abs(rate_z), initial=0.0)) or 1.0
    rate, scale = 2.0 * fastest / slower, point.scale
    f = np.concatenate([-point.imbalance, rate * point.rates])
    if not len(point.z):
        return _LinearMotion(point, point.stiffness_blocks.negative, f, scale, rate)
    J = np.block([[-point.stiffness, -by_z], [rate * rate_q, rate * rate_z]])
    return _LinearMotion(point, Blocks.of(scale[:, np.newaxis] * J / scale), scale * f, scale, rate)


def _step(statics: Statics, point: SearchPoint, pace: _MotionProgress, slower: float) -> SearchPoint | None:
    """Return the next point of the damped motion; None if no step is small enough, since forces jump and hold the
    motion. ``pace`` is updated in place; ``slower`` is the factor by which rates of internal states are reduced."""
    linear = _linear(point, slower)
    fastest = linear.fastest
    time = pace.time or (0.1 / fastest if fastest > 0.0 else 1e-6)
    if time * fastest > _LAST:
        time = np.inf if linear.convex else _LAST / fastest
    longest = max(1.0, 0.5 * pace.way)
    for _ in range(40):
        change = linear.step(time)
        gone = _length_of_change(statics, point, change)
        part = min(1.0, longest / gone) if gone else 1.0
        part = min(share_of_turn(statics, point, change), part) if np.isfinite(gone) else 0.0
        reached = move(statics, point, change) if part == 1.0 else None
        if reached is None:
            time = _LAST / fastest if np.isinf(time) else time * min(0.8, max(0.1, 0.8 * part))
            continue
        error, there = linear.error(change, reached, time)
        kinetic = point.weighted_size(change)
        size = point.weighted_size(error) / kinetic if kinetic > 0.0 else 0.0
        if size <= _ERROR:
            if size > 0.1 * _ERROR and (better := move(statics, point, change + error)) is not None:
                reached = better
            growth = min(8.0, max(0.5, 0.8 * (_ERROR / size) ** 0.5)) if size > 0.0 else 8.0
            pace.time = (_LAST / fastest if np.isinf(time) else time) * growth
            pace.way, pace.kinetic = pace.way + gone, pace.kinetic + kinetic
            return reached
        if kinetic <= COMPUTED * pace.kinetic:  # forces jump here; is their direction unchanged?
            pace.time = time
            free = len(point.imbalance)
            return reached if float(there[:free] @ change[:free]) > 0.0 else None
        time = _LAST / fastest if np.isinf(time) else time * min(0.7, max(0.1, 0.8 * (_ERROR / size) ** 0.5))
    return None


def _length_of_change(statics: Statics, point: SearchPoint, change: Array) -> float:
    """Return the length of a change, in lengths of the scene; rotations are judged elsewhere."""
    if not np.all(np.isfinite(change)):
        return np.nan
    increment = point.basis @ change[: len(point.imbalance)]
    return float(np.max(np.abs(increment[~statics.turning]), initial=0.0)) / statics.length


def _nudge(statics: Statics, point: SearchPoint) -> SearchPoint | None:
    """Return a point displaced from an unstable equilibrium along the direction of the most negative stiffness.

    The largest component moves by 1e-3 (rad or scene lengths), before a correction onto the constraints. None for a
    stable equilibrium, without a free direction, with rates of internal states, for follower forces under which the
    motion returns, and if the displaced point has no finite forces.
    """
    if not len(point.imbalance) or any(map(np.any, point.couplings[1:])):
        return None
    symmetric, unstable = point.stiffness_blocks.symmetric, -1e3 * SOFT * point.largest_stiffness
    if symmetric.above(unstable):
        return None
    values, vectors = symmetric.spectrum()
    # Follower forces: the damped motion returns although the symmetric part alone would drive it away.
    if point.stiffness_blocks.skew and np.min(np.linalg.eigvals(point.stiffness).real) >= unstable:
        return None
    lowest = values <= values[0] + 1e-9 * abs(values[0])
    away = canonical_direction(point.basis @ vectors[:, lowest], statics.sizes)  # rounding decides no side
    return move(statics, point, np.concatenate([1e-3 * (point.dual @ away), np.zeros(len(point.z))]))


def follow_descent(statics: Statics, q: Array, z: Array) -> Search:
    """Return the stable rest that steps of decreasing energy reach from q, at constant internal states z.

    If none is reached, the result is the end of the steps, not balanced.

    Raises
    ------
    numpy.linalg.LinAlgError
        M is not positive definite at the start.
    """
    trail, widest = SearchTrail(statics, q, z), 1.0  # rad or lengths of the scene
    with told_if_interrupted(trail, "decreasing energy"):
        while True:
            point = trail.point
            if trail.has_arrived():
                nudged = _nudge(statics, point)
                if nudged is None:
                    return trail.end(balanced=True)
                trail.move(nudged)
                continue
            if not point.finite or trail.steps == 10 * SLOW_STEPS:
                return trail.end(balanced=False)
            reached, widest = _descend(statics, point, widest)
            if reached is None:
                return trail.end()
            trail.step(reached)
            widest = min(1.0, 2.0 * widest)


def _descend(statics: Statics, point: SearchPoint, widest: float) -> tuple[SearchPoint | None, float]:
    """Return a point of less energy, displaced by at most ``widest`` rad or lengths of the scene, and the bound of this
    step. The bound is halved until the step works. The point is None if no step is small enough."""
    values, vectors = point.stiffness_blocks.symmetric.spectrum()
    largest, along = np.abs(values).max(initial=0.0), vectors.T @ point.imbalance
    moves = (point.basis @ vectors) / statics.sizes[:, np.newaxis]
    firm = np.maximum(np.abs(values), SOFT * largest if largest else 1.0)
    while widest > _SHORTEST:
        change = -vectors @ (along / (firm + _shift(firm, moves, along, widest)))
        reached = move(statics, point, change)
        if reached is not None:
            work = 0.5 * float((point.dual @ reached.acceleration - point.imbalance) @ change)
            # a tenth of the work of the linear forces
            if work >= -0.1 * float(point.imbalance @ change):
                return reached, widest
        widest *= 0.5
    return None, widest


def _shift(firm: Array, moves: Array, along: Array, widest: float) -> float:
    """Return the addition to positive stiffnesses with which no component moves by more than ``widest``, to a tenth; 0
    if none is needed.

    Parameters
    ----------
    firm, along : stiffnesses and imbalance along eigenvectors
    moves : (nv, free) displacements by eigenvectors, rad or lengths of the scene
    """

    def too_far(shift: float) -> bool:
        return float(np.abs(moves @ (along / (firm + shift))).max(initial=0.0)) > widest

    if not too_far(0.0):
        return 0.0
    low, high = float(firm.min()), float(firm.max())
    while too_far(high):
        high *= 10.0
    while high > 1.1 * low:
        middle = (low * high) ** 0.5
        low, high = (middle, high) if too_far(middle) else (low, middle)
    return high


MAX_STEPS = 60
#: Parts of a step below this are not tried.
_SHORTEST = 1e-4


def follow_newton(statics: Statics, q: Array, z: Array) -> Search:
    """Return the end of Newton's path from q and z, an equilibrium of any stability if the end is balanced.

    Raises
    ------
    numpy.linalg.LinAlgError
        M is not positive definite at the start.
    """
    trail, share = SearchTrail(statics, q, z), 1.0
    with told_if_interrupted(trail, "Newton's steps"):
        while not trail.has_arrived():
            point = trail.point
            if not point.finite or trail.steps == MAX_STEPS:
                return trail.end(balanced=False)
            change = newton_step(point, newton_right_side(point))
            nearer, share = _part(statics, point, change, min(1.0, 4.0 * share, share_of_turn(statics, point, change)))
            if nearer is None:
                return trail.end(balanced=False)
            trail.step(nearer)
        return trail.end(balanced=True)


def _part(statics: Statics, point: SearchPoint, change: Array, share: float) -> tuple[SearchPoint | None, float]:
    """Return the point after a part of Newton's step, and the part; None if no part down to 1e-4 will do. The step from
    that point with unchanged partials must be smaller. ``share`` is the first part that is tried, halved each time."""
    while share > _SHORTEST:
        reached = move(statics, point, share * change)
        if reached is not None:
            left = newton_step(point, np.concatenate([point.dual @ reached.acceleration, reached.rates]))
            if point.weighted_size(left) <= (1.0 - 0.25 * share) * point.weighted_size(change):
                return reached, share
        share *= 0.5
    return None, share


#: Factors by which the rates of internal states are reduced, if a damped motion does not settle with immediate internal
#: states.
_SLOWER = (1.0, 100.0)


def nearest_rest(statics: Statics, q: Array, z: Array, *, any_kind: bool) -> tuple[Search, Search | None]:
    """Return the end of a damped motion from q and z, and the nearest rest, or None without a rest.

    A motion that does not settle within its steps is continued by decreasing energy. Newton's paths are followed if
    neither settles, or if rest of any kind, unstable too, will do. Distances are measured by the kinetic energy of a
    motion from the start to the rest in unit time.

    Parameters
    ----------
    statics : Statics
        The scene at rest.
    q, z : (nq,) and (nz,) ndarray
        Start of the motion.
    any_kind : bool
        Whether an unstable rest is accepted.
    """
    descends = not len(z) and not any_kind
    damped = _by_damped_motion(statics, q, z, patient=not descends)
    if descends and not damped.balanced and damped.steps >= SLOW_STEPS:
        descent = follow_descent(statics, damped.point.q, z)
        if descent.balanced:
            return damped, replace(descent, steps=damped.steps + descent.steps, path=[*damped.path, *descent.path])
    others = [] if damped.balanced and not any_kind else _by_newton(statics, z, damped)
    at_rest = (search for search in (damped, *others) if search.balanced)
    return damped, min(at_rest, key=partial(_distance, statics), default=None)


def left_at_start(statics: Statics, z: Array, damped: Search) -> bool:
    """Return whether Newton's path from the start leads to an equilibrium much nearer to the start than the end of a
    damped motion. False for short motions."""
    start = damped.path[0]
    off = difference(statics.factors, start, damped.point.q)
    if not np.any(np.abs(off) > 0.5 * statics.sizes):
        return False
    try:
        near = follow_newton(statics, start, z)
    except np.linalg.LinAlgError:
        return False
    return near.balanced and _distance(statics, near) < 0.05 * _distance(statics, damped)


def _by_damped_motion(statics: Statics, q: Array, z: Array, *, patient: bool) -> Search:
    """Return the equilibrium at the end of a damped motion from q and z, or the end of the motion without one. If
    internal states prevent rest, a second motion has slower internal states."""
    search = Search(examine(statics, q, z), False, 0)
    for slower in _SLOWER if len(z) else (1.0,):
        try:
            search = follow_damped_motion(statics, q, z, slower, patient=patient)
        except np.linalg.LinAlgError:
            continue
        if search.balanced:
            break
    return search


def _by_newton(statics: Statics, z: Array, damped: Search) -> list[Search]:
    """Return the ends of Newton's paths from the start of a damped motion, and from up to four points of the motion at
    which forces are locally smallest."""
    path = [*damped.path, damped.point.q]
    forces = [examine(statics, q, z).force for q in path] if not len(z) else []
    slow = [k for k in range(1, len(forces) - 1) if forces[k - 1] > forces[k] < forces[k + 1]]
    searches = []
    for k in (0, *slow[:4]):
        try:
            search = follow_newton(statics, path[k], z)
        except np.linalg.LinAlgError:
            continue
        searches.append(replace(search, path=[*path[:k], *search.path]))
    return searches


def _distance(statics: Statics, search: Search) -> float:
    """Return the distance between the start and the end of a search in the kinetic metric, m kg^(1/2)."""
    start = search.path[0]
    way = difference(statics.factors, start, search.point.q)
    return float(np.sqrt(way @ statics.mass(start) @ way))
