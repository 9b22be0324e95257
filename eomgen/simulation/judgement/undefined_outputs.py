"""Outputs that have no value at some rows of a run."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from eomgen.base.arrays import Array
from eomgen.results.finding import Finding


def undefined_outputs(t: Array, outputs: Mapping[str, Array]) -> Finding | None:
    """Return a finding on outputs without a value at some rows; None if there are none."""
    described, first = [], math.inf
    for name, values in outputs.items():
        undefined = np.flatnonzero(~np.isfinite(values.reshape(len(t), -1)).all(axis=1))
        if len(undefined):
            first = min(first, float(t[undefined[0]]))
            described.append(f"{name} ({len(undefined)} of {len(t)} rows, from t = {t[undefined[0]]:.6g} s)")
    if not described:
        return None
    many = f"outputs {', '.join(described)} have" if len(described) > 1 else f"output {described[0]} has"
    hint = "a formula that has one: no division by 0, no root or logarithm of a negative number"
    return Finding(time=first, text=f"the {many} no value there", hint=hint)
