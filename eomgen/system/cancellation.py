"""Digits that the elimination of an inertia matrix loses: ratios of composite inertias to the remaining articulated
inertias.

M_ii is the inertia of a subtree with its joints locked, the pivot D_i its inertia with these joints free. Rounding of
M_ii is eps M_ii, so D_i has a relative error of eps M_ii / D_i. With light or short links before heavy or long ones the
ratio is about the square of the ratio of the links. Featherstone, Rigid Body Dynamics Algorithms (2008), section 10.1.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.limits import Limit

ROUNDING = float(np.finfo(float).eps)
LOST = Limit(1e-8, "1", "relative error of accelerations by cancellation", "half of the digits of doubles")


@np.errstate(all="ignore")  # numbers that are not finite give NaN
def cancellation(M: Array, joints: Sequence[slice]) -> Array:
    """Return the largest ratio M_ii / D_i of each inertia matrix, at most 1 / eps; NaN for a non-finite matrix.

    Components of the same joint stay free together: the coupling of these components is the same in both inertias.

    Parameters
    ----------
    M : (n, nv, nv) array
    joints : velocity components of each joint, parents first
    """
    left, whole = M.copy(), np.diagonal(M, axis1=1, axis2=2)
    ratios = np.ones_like(whole)
    finite = np.isfinite(left).all(axis=(1, 2))
    left[~finite] = 0.0
    for joint in sorted(joints, key=lambda part: part.start, reverse=True):
        pivots = np.diagonal(left, axis1=1, axis2=2)[:, joint]
        least = np.finfo(float).eps * whole[:, joint]  # rounding alone
        np.divide(whole[:, joint], np.maximum(pivots, least), out=ratios[:, joint], where=least > 0.0)
        block, above = left[:, joint, joint], left[:, joint, : joint.start]
        if joint.stop - joint.start == 1:  # a pseudoinverse costs ten times as much
            solved = np.divide(above, block, out=np.zeros_like(above), where=block != 0.0)
        else:
            solved = np.linalg.pinv(block) @ above
        left[:, : joint.start, : joint.start] -= np.swapaxes(above, 1, 2) @ solved
    return np.where(finite, np.max(ratios, axis=1, initial=1.0), np.nan)


def largest_cancellation(M: Array) -> float:
    """Return an upper bound of ``cancellation`` for one inertia matrix, by a Cholesky factorization.

    Infinite if the factorization fails. Components of a joint are eliminated one by one, so pivots are at most the
    inertias of ``cancellation``.

    Parameters
    ----------
    M : (nv, nv) array
    """
    try:
        with np.errstate(invalid="ignore"):
            ratios = M.diagonal()[::-1] / np.linalg.cholesky(M[::-1, ::-1]).diagonal() ** 2
    except np.linalg.LinAlgError:
        return math.inf
    largest = float(ratios.max(initial=1.0))
    return largest if math.isfinite(largest) else math.inf


def relative_error(ratio: float, *, articulated: bool) -> float:
    """Return the relative error of accelerations at a ratio of inertias; articulated bodies lose about half the digits
    that the elimination of M loses."""
    return ROUNDING * float(np.sqrt(ratio) if articulated else ratio)


def digits_kept(lost: float) -> str:
    """Return in words how many digits accelerations keep with a relative error, and why."""
    digits = max(0, int(-np.log10(lost)))
    return f"accelerations keep some {digits} digits, since light or short links carry heavy or long ones"
