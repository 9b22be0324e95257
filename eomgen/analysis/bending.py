"""How far beams bend: their equations hold for slopes whose squares are small against 1.

Curvature w'' is linear in the deflection w. A bent axis has w''/(1 - w'^2)^(1/2), so strain energy is wrong by
a part of w'^2, and the kinematics of order = 2 by as much. Half the mean square of the slope is also the shortening of
the axis, as a part of its length, so beyond 1 no beam is like that.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from eomgen.base.arrays import Array

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel

#: Shortening of a bent beam, as a part of its length, beyond which it is said.
_LARGE = 0.05


class Bending(NamedTuple):
    """The place of largest bending of a beam.

    Attributes
    ----------
    beam : its name
    time : s
    shortening : of its axis, as a part of its length: half the mean square of its slope
    """

    beam: str
    time: float
    shortening: float

    @property
    def possible(self) -> bool:
        """Whether there is a beam that is bent so."""
        return self.shortening < 1.0

    def __str__(self) -> str:
        where = f"the beam {self.beam} bends by slopes of {np.sqrt(2.0 * self.shortening):.3g} (root mean square) at"
        shorter = f"t = {self.time:.6g} s, which shortens it by {100.0 * self.shortening:.3g} % of its length"
        wrong = "its equations, linear in curvature, are wrong by as much"
        return f"{where} {shorter}: {wrong}; try: a stiffer beam, smaller loads, or shorter beams in a chain"


def shortenings(model: CompiledModel, q: Array) -> Array:
    """Return the shortening of each beam's axis, as a part of its length, (n, beams), at q (n, nq); infinite if
    that is no number."""
    places = {factor.name: factor.q for factor in model.factors}
    beams = model.library.layout["slopes"]
    result = np.empty((len(q), len(beams)))
    with np.errstate(over="ignore", invalid="ignore"):
        for k, item in enumerate(beams):
            bent = q[:, places[item["name"]]]
            result[:, k] = 0.5 * np.einsum("nk,kl,nl->n", bent, np.array(item["squares"]), bent) / item["length"]
    return np.where(np.isnan(result), np.inf, result)


def largest_bending(model: CompiledModel, t: Array, q: Array) -> Bending | None:
    """Return the most bent beam in some row of a run, t (n,) in s and q (n, nq), beyond the range of its theory; None
    if none does."""
    shares, beams = shortenings(model, q), model.library.layout["slopes"]
    rows = shares.argmax(axis=0)
    candidates = [
        Bending(item["name"], float(t[row]), float(shares[row, k]))
        for k, (item, row) in enumerate(zip(beams, rows, strict=True))
    ]
    most = max(candidates, key=lambda bending: bending.shortening, default=None)
    return most if most is not None and not most.shortening <= _LARGE else None
