"""One state of a run."""

from __future__ import annotations

from typing import NamedTuple

from eomgen.base.arrays import Array


class State(NamedTuple):
    """Time (...), configuration (..., nq), velocity and acceleration (..., nv), internal states (..., nz)."""

    t: Array
    q: Array
    v: Array
    a: Array
    z: Array
