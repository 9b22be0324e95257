"""Load steps: what is unbalanced at the start is held by forces of constant direction, which are taken away along a
path.

Where nothing is loaded at the start, that is the same as applying dead loads step by step: the factor s of what acts
goes from 0 to 1. Forces that hold are constant in the axes of the base, so components of bodies that turn change.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array

from eomgen.arrays import Array
from eomgen.lie.product import Factor
from eomgen.solvers.bordered_newton import Balance, LoadedStatics, Rest, Tangents
from eomgen.solvers.equilibrium_path import PathEndError, StepLimits, first_point, follow

#: Steps at most.
MAX_STEPS = 2000
#: Length of a path, its displacements in rad or lengths of the scene as root mean squares, that leads nowhere.
_FAR = 100.0


def by_load_steps(statics: LoadedStatics, start: Rest, limits: StepLimits) -> tuple[Rest, list[Array]]:
    """Return rest under all loads, and the configurations on the way.

    Parameters
    ----------
    statics : of which the load factor counts nothing
    start : on the constraints
    limits : of the steps

    Raises
    ------
    PathEndError
        The path cannot be followed to its end; its point's load factor says how far it came.
    """
    held = _held(statics, start)
    point = first_point(held, replace(start, s=0.0), 1.0)
    path = [point.rest.q]
    for reached in follow(held, point, 1.0, limits):
        point = reached
        path.append(point.rest.q)
        if point.way > _FAR:
            raise PathEndError("displacements grow without more load: nothing opposes them", point)
        if len(path) > MAX_STEPS:
            raise PathEndError(f"{MAX_STEPS} steps are not enough", point)
    return point.rest, path


def _held(statics: LoadedStatics, start: Rest) -> LoadedStatics:
    """Return statics in which what is unbalanced at the start is held, by 1 - s of it."""
    first = statics.balance(start)
    blocks = turning_blocks(statics.factors)
    fixed = dead_forces(blocks, start.q, first.residual, back=False)

    def balance(rest: Rest) -> Balance:
        now, left = statics.balance(rest), 1.0 - rest.s
        residual = now.residual - left * dead_forces(blocks, rest.q, fixed, back=True)
        return Balance(residual, now.constraint, now.rates - left * first.rates)

    def tangents(rest: Rest) -> Tangents:
        now = statics.tangents(rest)
        change = (rest.s - 1.0) * turned_derivative(blocks, dead_forces(blocks, rest.q, fixed, back=True))
        return replace(now, K=csc_array(now.K + change))

    def by_factor(rest: Rest) -> Balance:
        held = dead_forces(blocks, rest.q, fixed, back=True)
        return Balance(held, np.zeros(len(first.constraint)), first.rates)

    return replace(statics, reach=1.0, balance=balance, tangents=tangents, by_factor=by_factor)


@dataclass(frozen=True)
class Blocks:
    """Triples of components of v in axes that turn.

    Attributes
    ----------
    quaternions : (n, 4) places in q of the quaternions that turn them
    triples, turned_by : (n, 3) their places in v, and those of the angular velocities that turn them
    """

    quaternions: NDArray[np.intp]
    triples: NDArray[np.intp]
    turned_by: NDArray[np.intp]


def turning_blocks(factors: Sequence[Factor]) -> Blocks:
    """Return the triples of a configuration's rotations and poses."""
    found = []
    for factor in factors:
        if factor.group in ("SO3", "R3xSO3", "SE3"):
            found.append((factor.q_start, factor.v_start, factor.v_start))
        if factor.group == "SE3":
            found.append((factor.q_start, factor.v_start + 3, factor.v_start))
    places = np.array(found, np.intp).reshape(-1, 3, 1)
    return Blocks(places[:, 0] + np.arange(4), places[:, 1] + np.arange(3), places[:, 2] + np.arange(3))


def dead_forces(blocks: Blocks, q: Array, forces: Array, *, back: bool) -> Array:
    """Return generalized forces, (nv,), triples of bodies turned from their axes to those of the base, or ``back``."""
    result = forces.copy()
    if blocks.quaternions.size:
        places = blocks.triples
        w, vector = q[blocks.quaternions[:, 0]], q[blocks.quaternions[:, 1:]]
        vector = -vector if back else vector
        doubled = 2.0 * np.cross(vector, forces[places])
        result[places] = forces[places] + w[:, np.newaxis] * doubled + np.cross(vector, doubled)
    return result


def turned_derivative(blocks: Blocks, forces: Array) -> csc_array:
    """Return the derivative by q of forces that are constant in the base, (nv, nv), here in body axes (nv,)."""
    nv = len(forces)
    if not blocks.triples.size:
        return csc_array((nv, nv))
    rows = blocks.triples[:, [0, 0, 1, 1, 2, 2]]
    columns = blocks.turned_by[:, [1, 2, 0, 2, 0, 1]]
    x, y, z = forces[blocks.triples].T
    entries = np.stack([-z, y, z, -x, -y, x], axis=1)
    return csc_array((entries.ravel(), (rows.ravel(), columns.ravel())), shape=(nv, nv))
