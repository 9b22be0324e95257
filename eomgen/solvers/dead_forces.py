"""Forces that keep their directions while the bodies that carry them turn: dead loads, in axes of the base."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array

from eomgen.base.arrays import Array
from eomgen.lie.product import Factor
from eomgen.solvers.bordered_newton import Matrix


@dataclass(frozen=True)
class Blocks:
    """Triples of components of v in rotating axes.

    Attributes
    ----------
    quaternions : (n, 4) indices in q of the quaternions of the axes
    triples, turned_by : (n, 3) indices in v of the triples, and of the angular velocities of the axes
    """

    quaternions: NDArray[np.intp]
    triples: NDArray[np.intp]
    turned_by: NDArray[np.intp]


def turning_blocks(factors: Sequence[Factor]) -> Blocks:
    """Return the triples of a configuration's rotations and poses."""
    blocks = []
    for factor in factors:
        if factor.group in ("SO3", "R3xSO3", "SE3"):
            blocks.append((factor.q_start, factor.v_start, factor.v_start))
        if factor.group == "SE3":
            blocks.append((factor.q_start, factor.v_start + 3, factor.v_start))
    places = np.array(blocks, np.intp).reshape(-1, 3, 1)
    return Blocks(places[:, 0] + np.arange(4), places[:, 1] + np.arange(3), places[:, 2] + np.arange(3))


def dead_forces(blocks: Blocks, q: Array, forces: Array, *, back: bool) -> Array:
    """Return generalized forces, (nv,), with triples rotated from body axes to base axes, or ``back``."""
    result = forces.copy()
    if blocks.quaternions.size:
        places = blocks.triples
        w, vector = q[blocks.quaternions[:, 0]], q[blocks.quaternions[:, 1:]]
        vector = -vector if back else vector
        doubled = 2.0 * _cross(vector, forces[places])
        result[places] = forces[places] + w[:, np.newaxis] * doubled + _cross(vector, doubled)
    return result


def _cross(one: Array, other: Array) -> Array:
    """Return cross products of rows, (n, 3); ``np.cross`` takes four times as long for few rows."""
    after, before = [1, 2, 0], [2, 0, 1]
    return np.asarray(one[:, after] * other[:, before] - one[:, before] * other[:, after])


def with_turned(K: Matrix, blocks: Blocks, forces: Array, factor: float) -> Matrix:
    """Return a stiffness (nv, nv) plus a factor times the derivative by q of forces that are constant in the base.

    Parameters
    ----------
    forces : (nv,), in body axes
    """
    nv = len(forces)
    if not blocks.triples.size:
        return K
    rows = blocks.triples[:, [0, 0, 1, 1, 2, 2]]
    columns = blocks.turned_by[:, [1, 2, 0, 2, 0, 1]]
    x, y, z = forces[blocks.triples].T
    entries = factor * np.stack([-z, y, z, -x, -y, x], axis=1)
    if isinstance(K, np.ndarray):
        total = K.copy()
        np.add.at(total, (rows.ravel(), columns.ravel()), entries.ravel())
        return total
    return csc_array(K + csc_array((entries.ravel(), (rows.ravel(), columns.ravel())), shape=(nv, nv)))
