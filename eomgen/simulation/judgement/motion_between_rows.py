"""Rows too far apart to resolve the motion between them: the travel does not follow from the velocities there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from eomgen.lie.product import Factor
from eomgen.simulation.stepping.states import States

#: Share of the way between rows that velocities at the rows do not tell, in the middle of all intervals.
_UNTOLD = 0.5
#: Ways that are rounding, in parts of the largest coordinate.
_ROUNDING = 1e-12


def untold_between_rows(states: States, factors: Sequence[Factor]) -> bool:
    """Return whether a coordinate moves between most rows otherwise than its velocities at the rows say.

    A force of 1 kHz, for instance, has the same phase at rows that are 1 ms apart.
    """
    duration = np.diff(states.t)
    for factor in factors:
        if factor.group != "R" or not len(duration):
            continue
        q, v = states.q[:, factor.q_start], states.v[:, factor.v_start]
        way = np.diff(q)
        untold = np.median(np.abs(way - 0.5 * duration * (v[1:] + v[:-1])))
        if untold > max(_UNTOLD * float(np.median(np.abs(way))), _ROUNDING * float(np.max(np.abs(q)))):
            return True
    return False
