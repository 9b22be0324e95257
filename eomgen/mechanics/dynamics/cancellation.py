"""Digits that the elimination of M loses: composite inertias against the articulated ones that it leaves.

M_ii is the inertia of a subtree with its joints locked, the pivot D_i that with its joints free. An entry of M holds
eps M_ii of rounding, so D_i has a relative error of eps M_ii / D_i. With light or short links before heavy or long ones
that ratio is about the square of the ratio of the links. Featherstone, Rigid Body Dynamics Algorithms (2008), 10.1.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from eomgen.arrays import Array
from eomgen.lie.product import update
from eomgen.mechanics.tree.links import Tree
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.scalar import Scalar

#: Largest ratio with which M is factored. Robots have up to 1200, and equal links as many as a tree has that are not
#: eliminated by articulated bodies anyway.
MOST_CANCELLATION = 3e3
#: Number of positions in which the ratio is evaluated.
_POSITIONS = 6


def cancellation(
    tree: Tree, M: Sequence[Mapping[int, Scalar]], start: Sequence[float], parameters: Sequence[float]
) -> float:
    """Return the largest ratio of composite to articulated inertia over a few positions.

    The components of one joint are compared with one another free: their coupling is the same in both inertias.

    Parameters
    ----------
    M : (nv,) rows of the lower triangle, by column
    start : (nq,) position from which joints are turned by up to half a turn; travels stay
    parameters : values of the tunable parameters
    """
    turns = np.random.default_rng(0).uniform(-3.0, 3.0, (_POSITIONS, tree.nv)) * np.array(tree.angular())
    q = update(tree.factors, np.tile(start, (_POSITIONS, 1)), turns)
    places = [(i, j) for i, row in enumerate(M) for j in row]
    matrices = np.zeros((_POSITIONS, tree.nv, tree.nv))
    with np.errstate(all="ignore"):  # infinite numbers are refused elsewhere
        values = evaluate(tree.algebra.tape, [M[i][j].ref for i, j in places], {"p": parameters, "q": q})
        for (i, j), value in zip(places, values.T, strict=True):
            matrices[:, i, j] = matrices[:, j, i] = value
        ratios = _ratios(matrices, [factor.v for factor in tree.factors])
    return float(np.max(ratios[np.isfinite(ratios)], initial=1.0))


def _ratios(M: Array, joints: Sequence[slice]) -> Array:
    """Return M_ii / D_i, (positions, nv), eliminating joint after joint from the tips; what is not positive counts as
    rounding."""
    left = M.copy()
    whole = np.diagonal(M, axis1=1, axis2=2)
    ratios = np.ones_like(whole)
    for joint in sorted(joints, key=lambda part: part.start, reverse=True):
        pivots = np.diagonal(left, axis1=1, axis2=2)[:, joint]
        ratios[:, joint] = whole[:, joint] / np.maximum(pivots, np.finfo(float).eps * whole[:, joint])
        block, above = left[:, joint, joint], left[:, joint, : joint.start]
        change = np.swapaxes(above, 1, 2) @ np.linalg.pinv(block) @ above
        left[:, : joint.start, : joint.start] -= change
    return ratios
