"""Standard normal variables by seed: the same on every machine, and the first ones the same however many follow."""

from __future__ import annotations

import random
from statistics import NormalDist

import numpy as np

from eomgen.base.arrays import Array

_NORMAL = NormalDist()
#: Under which name waves have their variables.
WAVES = "waves"


def standard_normals(seed: int, count: int, name: str = "") -> Array:
    """Return independent standard normal variables, (count,), of a seed from 0 on and of a process's name, so that
    processes of the same seed are independent of one another."""
    generator = random.Random(f"{seed} {name}")
    # quantiles of the middles of 2^53 equal cells, so that neither 0 nor 1 is among them
    return np.array([_NORMAL.inv_cdf((generator.getrandbits(52) + 0.5) * 2.0**-52) for _ in range(count)])
