"""The limit of a heavily damped motion: the stable equilibrium in whose basin of attraction the start lies.

With damping that is large and in proportion to the inertias, a motion follows the accelerations of rest: in coordinates
of unit kinetic energy q' = -imbalance(q, z), and internal states follow their own equations meanwhile, c times as fast
as that time runs, c = 2 omega of the stiffest mode. That motion is followed by exponential Rosenbrock steps of order 3
with an embedded one of order 2 (Hochbruck and Ostermann 2010), which are exact for linear forces: stiff modes cost
no steps, unstable ones are left as fast as they grow, and close to rest a step is Newton's. Their error comes from
nonlinear forces over a step, and is a tenth of the step at most, so the path stays in the basin.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from eomgen.base.arrays import Array
from eomgen.solvers.statics import (
    SOFT,
    Point,
    Search,
    Statics,
    Trail,
    moved,
    newton_step,
    share_of_turn,
    unbalanced,
)
from eomgen.solvers.tangent_stiffness import canonical_direction

MAX_STEPS = 300
#: Largest error of a step, a part of the step; below the second one it is not worth a correction.
_ERROR, _CORRECTED = 0.1, 0.01
#: By how much the largest component is moved off an unstable equilibrium: rad, or parts of the scene's length.
_NUDGE = 1e-3
#: Time of a step times the largest stiffness: of the first, and of the change to Newton's.
_FIRST, _LAST = 0.1, 1e8
#: The same time if there is neither stiffness nor rate, s^2.
_FREE = 1e-6
#: A motion longer than so many lengths of the scene is not held.
_FAR = 1e6
#: A step below this part of the way that is not accurate crosses a jump of the forces.
_TINY = 1e-9
_TRIALS = 40


def follow_damped_motion(statics: Statics, q: Array, z: Array, slower: float = 1.0) -> Search:
    """Return the equilibrium that the damped motion from q and z reaches.

    Parameters
    ----------
    slower : float
        Factor by which the rates of internal states are reduced.

    Raises
    ------
    numpy.linalg.LinAlgError
        M is not positive definite at the start.
    """
    trail, pace = Trail(statics, q, z), _Pace()
    while True:
        if trail.arrived():
            nudged = _nudged(statics, trail.point)
            if nudged is None:
                return trail.end(balanced=True)
            pace.time = 0.0
            trail.move(nudged)
        if not trail.point.finite or trail.steps == MAX_STEPS or pace.way > _FAR:
            return trail.end(balanced=False)
        reached = _step(statics, trail.point, pace, slower)
        if reached is None:
            return trail.end()
        trail.step(reached)


@dataclass
class _Pace:
    """Progress of a motion: time of the next step, 0 if it is unknown, the way so far in lengths, and
    kinetic."""

    time: float = 0.0
    way: float = 0.0
    kinetic: float = 0.0


@dataclass(frozen=True)
class _Linear:
    """The damped motion at a point, made linear: x' = J x + f for changes x along the basis and of z, scaled alike.

    Attributes
    ----------
    point : Point
    J, f : in changes times ``scale``
    scale : (free + nz,)
    rate : by how much faster internal states follow than they do in the time of the scene
    """

    point: Point
    J: Array
    f: Array
    scale: Array
    rate: float

    @property
    def fastest(self) -> float:
        return self.point.largest_stiffness or float(np.max(np.abs(self.J), initial=0.0))

    @property
    def convex(self) -> bool:
        """Whether no direction is unstable."""
        return bool(np.all(np.linalg.eigvalsh(self.point.symmetric) >= -SOFT * self.point.largest_stiffness))

    def step(self, time: float) -> Array:
        """Return the change after a time; of infinite time Newton's."""
        if np.isinf(time):
            return newton_step(self.point, unbalanced(self.point))
        return _phi(self.J, self.f, time, 1) / self.scale

    def error(self, change: Array, reached: Point, time: float) -> tuple[Array, Array]:
        """Return the addition of nonlinear forces to a change, and the rates of the changes at its end."""
        free = len(self.point.imbalance)
        there = np.concatenate([self.point.dual @ reached.acceleration, self.rate * reached.rates])
        bent = self.scale * there - self.f - self.J @ (self.scale * change)
        if np.isinf(time):
            bent = bent / self.scale
            bent[free:] /= self.rate
            return newton_step(self.point, bent), there
        return 2.0 * _phi(self.J, bent, time, 3) / self.scale, there


def _linear(point: Point, slower: float) -> _Linear:
    by_z, rate_q, rate_z = point.couplings
    fastest = float(np.sqrt(point.largest_stiffness)) or float(np.max(np.abs(rate_z), initial=0.0)) or 1.0
    rate, scale = 2.0 * fastest / slower, point.scale
    J = np.block([[-point.stiffness, -by_z], [rate * rate_q, rate * rate_z]])
    f = np.concatenate([-point.imbalance, rate * point.rates])
    return _Linear(point, scale[:, np.newaxis] * J / scale, scale * f, scale, rate)


def _step(statics: Statics, point: Point, pace: _Pace, slower: float) -> Point | None:
    """Return the next point; None if no step is small enough, since forces jump and hold the motion at the jump."""
    linear = _linear(point, slower)
    fastest = linear.fastest
    time = pace.time or (_FIRST / fastest if fastest > 0.0 else _FREE)
    if time * fastest > _LAST:
        time = np.inf if linear.convex else _LAST / fastest
    longest = max(1.0, 0.5 * pace.way)
    for _ in range(_TRIALS):
        change = linear.step(time)
        gone = _gone(statics, point, change)
        part = (
            min(share_of_turn(statics, point, change), longest / gone if gone > longest else 1.0)
            if np.isfinite(gone)
            else 0.0
        )
        reached = moved(statics, point, change) if part == 1.0 else None
        if reached is None:
            time = _LAST / fastest if np.isinf(time) else time * min(0.8, max(0.1, 0.8 * part))
            continue
        error, there = linear.error(change, reached, time)
        kinetic = point.weighed(change)
        size = point.weighed(error) / kinetic if kinetic > 0.0 else 0.0
        if size <= _ERROR:
            if size > _CORRECTED and (better := moved(statics, point, change + error)) is not None:
                reached = better
            growth = min(8.0, max(0.5, 0.8 * (_ERROR / size) ** 0.5)) if size > 0.0 else 8.0
            pace.time = (_LAST / fastest if np.isinf(time) else time) * growth
            pace.way, pace.kinetic = pace.way + gone, pace.kinetic + kinetic
            return reached
        if kinetic <= _TINY * pace.kinetic:  # forces jump here; do they still push the same way?
            pace.time = time
            free = len(point.imbalance)
            return reached if float(there[:free] @ change[:free]) > 0.0 else None
        time = _LAST / fastest if np.isinf(time) else time * min(0.7, max(0.1, 0.8 * (_ERROR / size) ** 0.5))
    return None


def _phi(J: Array, f: Array, time: float, order: int) -> Array:
    """Return time phi_k(time J) f, phi_k being the k-th function of exponential integrators, by one exponential."""
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


def _gone(statics: Statics, point: Point, change: Array) -> float:
    """Return the length of a change, in lengths of the scene; rotations are judged elsewhere."""
    if not np.all(np.isfinite(change)):
        return np.nan
    increment = point.basis @ change[: len(point.imbalance)]
    return float(np.max(np.abs(increment[~statics.turning]), initial=0.0)) / statics.length


def _nudged(statics: Statics, point: Point) -> Point | None:
    """Return a point a little off an unstable equilibrium, on the way down; None from a stable one."""
    if not len(point.imbalance) or len(point.rates):
        return None
    values, vectors = np.linalg.eigh(point.symmetric)
    if values[0] >= -1e3 * SOFT * point.largest_stiffness:
        return None
    lowest = values <= values[0] + 1e-9 * abs(values[0])
    away = canonical_direction(point.basis @ vectors[:, lowest], statics.sizes)  # rounding decides no side
    return moved(statics, point, _NUDGE * (point.dual @ away))
