"""Equilibria along Newton's path, stable or not, with damped steps (Deuflhard 2004, section 3.3.3)."""

from __future__ import annotations

import numpy as np

from eomgen.base.arrays import Array
from eomgen.solvers.statics import (
    Point,
    Search,
    Statics,
    Trail,
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
