"""Order of searches for rest: a damped motion first, and Newton's paths from slow points on its way.

Equilibria along Newton's path, stable or not, with damped steps (Deuflhard 2004, section 3.3.3).
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from eomgen.base.arrays import Array
from eomgen.lie.product import difference
from eomgen.solvers.damped_motion import follow_damped_motion
from eomgen.solvers.statics import (
    Point,
    Search,
    Statics,
    Trail,
    examine,
    moved,
    newton_step,
    share_of_turn,
    unbalanced,
)

MAX_STEPS = 60
#: Parts of a step below this are not tried.
_SHORTEST = 1e-4


def follow_newton(statics: Statics, q: Array, z: Array) -> Search:
    """Return the end of Newton's path from q and z.

    Raises
    ------
    numpy.linalg.LinAlgError
        M is not positive definite at the start.
    """
    trail, share = Trail(statics, q, z), 1.0
    while not trail.arrived():
        point = trail.point
        if not point.finite or trail.steps == MAX_STEPS:
            return trail.end(balanced=False)
        change = newton_step(point, unbalanced(point))
        nearer, share = _part(statics, point, change, min(1.0, 4.0 * share, share_of_turn(statics, point, change)))
        if nearer is None:
            return trail.end(balanced=False)
        trail.step(nearer)
    return trail.end(balanced=True)


def _part(statics: Statics, point: Point, change: Array, share: float) -> tuple[Point | None, float]:
    """Return the point after a part of Newton's step, at which a step with the same partials is smaller, and the
    part."""
    while share > _SHORTEST:
        reached = moved(statics, point, share * change)
        if reached is not None:
            left = newton_step(point, np.concatenate([point.dual @ reached.acceleration, reached.rates]))
            if point.weighed(left) <= (1.0 - 0.25 * share) * point.weighed(change):
                return reached, share
        share *= 0.5
    return None, share


#: Factor by which internal states follow a damped motion more slowly, if it does not settle with states that follow at
#: once.
_SLOWER = (1.0, 100.0)
#: Slow points of a damped motion from which Newton's path is followed, too.
_LINGERING = 4
#: Ways of a damped motion, in rad or lengths of the scene, from which on it may have left an equilibrium at its start,
#: and the ratio by which that is nearer than the settled point.
_LONG, _NEARER = 0.5, 0.05


def nearest_rest(statics: Statics, q: Array, z: Array, *, any_kind: bool) -> tuple[Search, Search | None]:
    """Return the end of a damped motion from q, z, and the nearest rest that was found; None if none was.

    Newton's paths are followed if the damped motion does not settle, or rest of ``any_kind`` will do: unstable too.
    Distances are measured by the kinetic energy that gets there in unit time.
    """
    damped = _by_damped_motion(statics, q, z)
    others = [] if damped.balanced and not any_kind else _by_newton(statics, z, damped)
    at_rest = (search for search in (damped, *others) if search.balanced)
    return damped, min(at_rest, key=partial(_distance, statics), default=None)


def left_at_start(statics: Statics, z: Array, damped: Search) -> bool:
    """Return whether an equilibrium is much nearer to the start than the one to which a damped motion came."""
    start = damped.path[0]
    off = difference(statics.factors, start, damped.point.q)
    if not np.any(np.abs(off) > _LONG * statics.sizes):
        return False
    try:
        near = follow_newton(statics, start, z)
    except np.linalg.LinAlgError:
        return False
    return near.balanced and _distance(statics, near) < _NEARER * _distance(statics, damped)


def _by_damped_motion(statics: Statics, q: Array, z: Array) -> Search:
    """Return the equilibrium that a damped motion reaches; if internal states prevent it, with slower internal
    states."""
    search = Search(examine(statics, q, z), False, 0)
    for slower in _SLOWER if len(z) else (1.0,):
        try:
            search = follow_damped_motion(statics, q, z, slower)
        except np.linalg.LinAlgError:
            continue
        if search.balanced:
            break
    return search


def _by_newton(statics: Statics, z: Array, damped: Search) -> list[Search]:
    """Return the ends of Newton's paths from the start, and from slow points of the motion on its way to rest."""
    path = [*damped.path, damped.point.q]
    forces = [examine(statics, q, z).force for q in path] if not len(z) else []
    slow = [k for k in range(1, len(forces) - 1) if forces[k - 1] > forces[k] < forces[k + 1]]
    searches = []
    for k in (0, *slow[:_LINGERING]):
        try:
            search = follow_newton(statics, path[k], z)
        except np.linalg.LinAlgError:
            continue
        searches.append(replace(search, path=[*path[:k], *search.path]))
    return searches


def _distance(statics: Statics, search: Search) -> float:
    """Return the kinetic distance between start and rest, in m kg^(1/2)."""
    start = search.path[0]
    way = difference(statics.factors, start, search.point.q)
    return float(np.sqrt(way @ statics.mass(start) @ way))
