"""How far the quaternions of a run are off unit length, which every step restores."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from eomgen.base.arrays import Array
from eomgen.simulation.judgement.constraint_violation import REPORTED, Violation

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel


def largest_stretch(model: CompiledModel, t: Array, q: Array) -> Violation | None:
    """Return the worst quaternion of a run; None if all have unit length, but for rounding.

    Parameters
    ----------
    t, q : (rows,) in s, (rows, nq)
    """
    turning = [factor for factor in model.factors if factor.group != "R"]
    if not turning:
        return None
    lengths = np.stack([np.linalg.norm(q[:, f.q_start : f.q_start + 4], axis=1) for f in turning], axis=1)
    off = np.abs(lengths - 1.0)
    if (off <= REPORTED).all():
        return None
    off = np.nan_to_num(off, nan=np.inf)
    row, k = np.unravel_index(int(np.argmax(off)), off.shape)
    message = f"the quaternion of {turning[k].name} has the length {lengths[row, k]:.6g} at t = {t[row]:.6g} s"
    return Violation(float(off[row, k]), message, float(t[row]))
