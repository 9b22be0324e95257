"""Where a run comes near positions at which its constraints are singular: branches of configurations cross there.

A parallelogram that lies flat is one: from there it may go on as a parallelogram or crossed over. What the constraints say in one
direction vanishes, so multipliers grow without bound and corrections lose their digits as the position comes near.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from eomgen.runtime.model import Model

Array = NDArray[np.float64]

#: Smallest singular value of the weighed rows, as a part of its largest in the run, below which a position is nearly singular.
NEARLY = 0.05
#: Rows of a run that are looked at: spread over all of it, and the last ones.
_SPREAD, _LAST = 200, 40
_NEEDED = ("mass", "constraint_jacobian")


@dataclass(frozen=True)
class Singular:
    """A nearly singular position: when, and its smallest singular value as a part of the largest in the run."""

    time: float
    part: float

    @property
    def what(self) -> str:
        return f"the constraints are nearly singular at t = {self.time:.6g} s, where branches of configurations cross"


def nearest_singular(model: Model, t: Array, q: Array, p: Array, *, at_end: bool = False) -> Singular | None:
    """Return the position of a run at which its constraints are most nearly singular; None where none is nearly so.

    Parameters
    ----------
    t, q : (rows,), (rows, nq)
    at_end : whether only the last row is in question, for which the others are the measure
    """
    if not model.multipliers or len(t) < 2 or not all(name in model.functions for name in _NEEDED):
        return None
    spread = np.unique(np.linspace(0, len(t) - 1, _SPREAD).astype(int))
    chosen = np.union1d(spread, np.arange(max(0, len(t) - _LAST), len(t)))
    with np.errstate(all="ignore"):
        M = model.mass(q[chosen], parameters=p)
        (B,) = model.evaluate("constraint_jacobian", q[chosen], t=t[chosen], parameters=p).values()
    if not (np.all(np.isfinite(M)) and np.all(np.isfinite(B))):
        return None
    try:
        weighed = np.swapaxes(np.linalg.solve(np.linalg.cholesky(M), np.swapaxes(B, -1, -2)), -1, -2)
    except np.linalg.LinAlgError:
        return None
    lengths = np.linalg.norm(weighed, axis=-1).max(axis=0)  # of each row, the largest in the run: units and kinds drop out
    values = np.linalg.svd(weighed / np.where(lengths > 0.0, lengths, 1.0)[:, np.newaxis], compute_uv=False)[:, -1]
    place = len(values) - 1 if at_end else int(np.argmin(values))
    part = float(values[place] / values.max()) if values.max() > 0.0 else 1.0
    return Singular(float(t[chosen][place]), part) if part < NEARLY else None


def way_past(method: str, step: float) -> str:
    """Return what to try where a method stops, or goes wrong, at a singular position."""
    if method == "rk4_partitioned":
        return "lengths or a start with which the motion does not come so near it, or crosses it faster"
    nearer = f"steps smaller than {step:.3g} s only come nearer to it"
    return f"rk4_partitioned, which passes such positions along the velocity; {nearer}"


def passages(count: int) -> str:
    """Return what a run says that has passed so many singular positions; empty for none."""
    if not count:
        return ""
    where = "a position" if count == 1 else f"{count} positions"
    return f"it passed {where} where the constraints are singular, or nearly, and branches cross, each time along its velocity"
