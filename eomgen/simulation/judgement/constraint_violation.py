"""The largest violation of the holonomic constraints over the samples of a run, relative to the mechanism size, and the
largest deviation of its quaternions from unit length, which every step restores.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from eomgen.base.arrays import Array

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel


#: Parts of the machine, or rad, by which a constraint may be off: the first is reported, the second fails the run.
REPORTED, FAILED = 1e-6, 1e-3
#: Rounding of a constraint row, in last places of the sum of its terms' magnitudes.
_LAST_PLACES = 1e3
#: Rows of a run that are looked at, spread over all of it.
_MOST_ROWS = 1000


class Violation(NamedTuple):
    """A violation of a holonomic row.

    Attributes
    ----------
    share : part of the size of the machine, or rad
    text : message with row, size and time
    time : s; NaN between rows
    """

    share: float
    text: str
    time: float = math.nan


def largest_violation(model: CompiledModel, t: Array, q: Array, p: Array, largest: float = 0.0) -> Violation | None:
    """Return the worst violation of the holonomic constraints in a run; None if all are kept, or if the model has no
    functions to evaluate them.

    Parameters
    ----------
    t, q : (rows,) in s, (rows, nq)
    p : (np,) parameters
    largest : the largest violation at any step, in the units of the rows, if the stepper counts it
    """
    count = model.functions.sizes.get("holonomic", 0)
    if not count or not all(name in model.functions for name in ("constraint", "constraint_size")):
        return None
    chosen = np.unique(np.linspace(0, len(t) - 1, min(len(t), _MOST_ROWS)).round().astype(int))
    t, q = t[chosen], q[chosen]
    violation = np.abs(next(iter(model.evaluate("constraint", q, t=t, parameters=p).values())))[:, :count]
    blocks = list(model.evaluate("constraint_size", q, t=t, parameters=p).values())
    sizes = np.concatenate([np.asarray(part).reshape(len(t), -1) for part in blocks], axis=1)
    rows = sizes.shape[1] // 2
    summands, extents = sizes[:, :count], sizes[:, rows:]
    lengths = np.array([unit != "1" for unit in model.library.layout["row_units"][:count]])
    machine = extents.max(axis=1, initial=0.0)
    scale = np.where(lengths, np.where(machine > 0.0, machine, 1.0)[:, None], 1.0)
    epsilon = np.finfo(np.float32 if model.library.real == "float" else np.float64).eps
    rounding = _LAST_PLACES * epsilon * summands
    shares = np.where(violation > rounding, violation / scale, 0.0)
    row, k = np.unravel_index(int(np.argmax(np.nan_to_num(shares, nan=np.inf))), shares.shape)
    share, by = float(shares[row, k]), float(violation[row, k])
    if share > REPORTED:
        unit = " m" if lengths[k] else ""
        message = f"the constraint {model.multipliers[k]} is off by {by:.3g}{unit} at t = {t[row]:.6g} s"
        return Violation(share, message, float(t[row]))
    between = largest / float(scale.max())
    if between > REPORTED and largest > rounding.max():
        return Violation(between, f"constraints are off by up to {largest:.3g} between the rows")
    return None


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
