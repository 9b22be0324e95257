"""A small file of fields, as data that tests change."""

from __future__ import annotations

import copy
from typing import Any

BASE: dict[str, Any] = {
    "format": 1,
    "kind": "hamiltonian",
    "name": "small",
    "mesh": {"cells": [8, 6, 5], "length": [40.0, 30.0, 25.0], "unit": "m"},
    "parameters": {"mean": 0.7, "radius": 4.0},
    "operators": {"s": {"power": "300*exp(-(radius*k)**2)"}},
    "truth": {"seed": 3},
    "data": {"counts": {"poisson": "mean*exp(s - s_variance/2)"}},
    "cell": {"energy": "exp(e) - counts*e", "where": {"e": "log(mean) + s - s_variance/2"}},
    "sampling": {"chains": 2, "warm_up": 6, "samples": 10, "watched": 20, "bins": 3},
}


def changed(**changes: Any) -> dict[str, Any]:
    """Return the data with entries in place of others, by keys with __ for dots; None takes one out."""
    made = copy.deepcopy(BASE)
    for key, value in changes.items():
        *path, last = key.split("__")
        table = made
        for part in path:
            table = table.setdefault(part, {})
        if value is None:
            del table[last]
        else:
            table[last] = value
    return made
