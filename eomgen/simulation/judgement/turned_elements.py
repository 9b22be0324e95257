"""Elements of geometrically exact beams that turn by more than half a turn, at which strains jump in sign."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from eomgen.base.arrays import Array
from eomgen.results.finding import Finding

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel

#: Rows that are looked at together.
_ROWS = 2048
#: Half a turn is passed if the scalar part of the relative quaternion, which is 0 there, changes its sign within
#: this distance; other changes of sign are due to the sign of a pose's quaternion and mean no rotation.
_NEAR = 0.7


def turned_elements(model: CompiledModel, t: Array, q: Array, p: Array) -> Finding | None:
    """Return a finding on the element that passes half a turn first; None if there is none.

    Runs of models without ``poses`` are left out.

    Parameters
    ----------
    t, q : (rows,) in s, (rows, nq)
    p : (np,) tunable parameters
    """
    beams = model.description.exact_beams
    if not beams or "poses" not in model.functions or len(t) < 2:
        return None
    for start in range(0, len(t) - 1, _ROWS):
        rows = slice(start, start + _ROWS + 1)  # the last one is the first of the next
        if result := _passed(model, t[rows], q[rows], p):
            return result
    return None


def _passed(model: CompiledModel, t: Array, q: Array, p: Array) -> Finding | None:
    beams = model.description.exact_beams
    quaternion = model.evaluate("poses", q, t=t, parameters=p)["pose"][..., :4]
    quaternion_of = {name: quaternion[:, k] for k, name in enumerate(model.bodies)}
    for nodes in beams:
        for number, (first, second) in enumerate(pairwise(nodes), 1):
            cosine = np.sum(quaternion_of[first] * quaternion_of[second], axis=1)
            before, after = cosine[:-1], cosine[1:]
            passed = (before * after < 0.0) & (np.maximum(np.abs(before), np.abs(after)) < _NEAR)
            if passed.any():
                when = t[1:][passed][0]
                sentence = f"element {number} of the beam {nodes[0]} turns by more than half a turn at t = {when:.6g} s"
                hint = f"elements = {2 * (len(nodes) - 1)}, which turn less each"
                return Finding(time=float(when), text=f"{sentence}, which strains cannot tell", hint=hint)
    return None
