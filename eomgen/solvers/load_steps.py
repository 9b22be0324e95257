"""Load steps: unbalanced forces at the start are held by forces of constant direction, which are removed along a
path.

If nothing is loaded at the start, that is the same as applying dead loads step by step: the factor s of the loads
goes from 0 to 1. Forces that hold are constant in the axes of the base, so components of bodies that turn change.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from eomgen.base.arrays import Array
from eomgen.solvers.bordered_newton import Balance, LoadedStatics, Rest, Tangents
from eomgen.solvers.dead_forces import dead_forces, turning_blocks, with_turned
from eomgen.solvers.equilibrium_path import PathEndError, StepLimits, first_point, follow
from eomgen.solvers.stable_branch import stable_branch

#: Steps at most.
MAX_STEPS = 2000
#: First step after a jump from an unstable rest, as a fraction of the limits.
_CLOSE = 0.2
#: Length of a diverging path; displacements as root mean squares, in rad or lengths of the scene.
_FAR = 100.0


class LoadSteps(NamedTuple):
    """Rest at the end of load steps, configurations on the way, and the displacement (nv,) along which an unstable rest
    was left first; None if none was."""

    rest: Rest
    path: Sequence[Array]
    left_along: Array | None


def by_load_steps(statics: LoadedStatics, start: Rest, limits: StepLimits, *, stable: bool = False) -> LoadSteps:
    """Return rest under all loads.

    Parameters
    ----------
    statics : at full loads; its load factor is ignored
    start : on the constraints
    limits : of the steps
    stable : whether the path leaves a rest that becomes unstable for a stable rest nearby, if one is found

    Raises
    ------
    PathEndError
        The path cannot be followed to its end; the error has the last point, with its load factor.
    """
    held = _held(statics, start)
    point = first_point(held, replace(start, s=0.0), 1.0)
    path, left_along, part = [point.rest.q], None, np.inf
    while point.rest.s != 1.0:
        for reached in follow(held, point, 1.0, limits, part):
            before, point = point, reached
            path.append(point.rest.q)
            if point.way > _FAR:
                raise PathEndError("displacements grow without more load: nothing opposes them", point)
            if len(path) > MAX_STEPS:
                raise PathEndError(f"{MAX_STEPS} steps are not enough", point)
            branch = stable_branch(held, point.rest, before.direction) if stable else None
            if branch is not None:
                left_along = branch.left_along if left_along is None else left_along
                path += branch.path
                point, part = replace(first_point(held, branch.rest, 1.0), way=point.way), _CLOSE
                break
    return LoadSteps(point.rest, path, left_along)


def _held(statics: LoadedStatics, start: Rest) -> LoadedStatics:
    """Return statics with the residual of the start, times 1 - s, as an additional load."""
    first = statics.balance(start)
    blocks = turning_blocks(statics.factors)
    fixed = dead_forces(blocks, start.q, first.residual, back=False)

    def balance(rest: Rest) -> Balance:
        now, left = statics.balance(rest), 1.0 - rest.s
        residual = now.residual - left * dead_forces(blocks, rest.q, fixed, back=True)
        return Balance(residual, now.constraint, now.rates - left * first.rates)

    def tangents(rest: Rest) -> Tangents:
        now = statics.tangents(rest)
        held = dead_forces(blocks, rest.q, fixed, back=True)
        return replace(now, K=with_turned(now.K, blocks, held, rest.s - 1.0))

    def by_factor(rest: Rest) -> Balance:
        held = dead_forces(blocks, rest.q, fixed, back=True)
        return Balance(held, np.zeros(len(first.constraint)), first.rates)

    return replace(statics, reach=1.0, balance=balance, tangents=tangents, by_factor=by_factor)
