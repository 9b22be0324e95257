"""Load steps: what is unbalanced at the start is held by forces of constant direction, which are taken away along a
path.

Where nothing is loaded at the start, that is the same as applying dead loads step by step: the factor s of what acts
goes from 0 to 1. Forces that hold are constant in the axes of the base, so components of bodies that turn change.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.sparse import csc_array

from eomgen.arrays import Array
from eomgen.lie import numeric
from eomgen.lie.groups import SO3
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
    blocks = _turning(statics.factors)
    fixed = _turned(blocks, start.q, first.residual, back=False)

    def balance(rest: Rest) -> Balance:
        now, left = statics.balance(rest), 1.0 - rest.s
        residual = now.residual - left * _turned(blocks, rest.q, fixed, back=True)
        return Balance(residual, now.constraint, now.rates - left * first.rates)

    def tangents(rest: Rest) -> Tangents:
        now = statics.tangents(rest)
        change = (rest.s - 1.0) * _derivative(blocks, _turned(blocks, rest.q, fixed, back=True))
        return replace(now, K=csc_array(now.K + change))

    def by_factor(rest: Rest) -> Balance:
        held = _turned(blocks, rest.q, fixed, back=True)
        return Balance(held, np.zeros(len(first.constraint)), first.rates)

    return replace(statics, reach=1.0, balance=balance, tangents=tangents, by_factor=by_factor)


def _turning(factors: Sequence[Factor]) -> list[tuple[int, int]]:
    """Return where in q quaternions start, and in v each triple of components in the axes that they turn."""
    found = []
    for factor in factors:
        if factor.group in ("SO3", "R3xSO3"):
            found.append((factor.q_start, factor.v_start))
        elif factor.group == "SE3":
            found += [(factor.q_start, factor.v_start), (factor.q_start, factor.v_start + 3)]
    return found


def _turned(blocks: Sequence[tuple[int, int]], q: Array, forces: Array, *, back: bool) -> Array:
    """Return generalized forces, (nv,), triples of bodies turned from their axes to those of the base, or back."""
    result = forces.copy()
    for quaternion, place in blocks:
        R = numeric.adjoint(SO3, q[quaternion : quaternion + 4])
        triple = forces[place : place + 3]
        result[place : place + 3] = R.T @ triple if back else R @ triple
    return result


def _derivative(blocks: Sequence[tuple[int, int]], forces: Array) -> csc_array:
    """Return the derivative by q of forces that are constant in the base, (nv, nv), where they are in body axes."""
    nv = len(forces)
    rows, columns, entries = [], [], []
    turned_by: dict[int, int] = {}
    for quaternion, place in blocks:
        turned_by.setdefault(quaternion, place)  # the angular components come first
        x, y, z = forces[place : place + 3]
        for row, column, entry in ((0, 1, -z), (0, 2, y), (1, 0, z), (1, 2, -x), (2, 0, -y), (2, 1, x)):
            rows.append(place + row)
            columns.append(turned_by[quaternion] + column)
            entries.append(entry)
    return csc_array((entries, (rows, columns)), shape=(nv, nv))
