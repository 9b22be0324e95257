"""Modes of random processes as splines: tables in formulas, and in C."""

from __future__ import annotations

import math

import numpy as np

from eomgen.formula.curves import Curve
from eomgen.products.reliability.random_processes import Expansion

#: Points of a table for each wave of its mode, and the least of them.
_POINTS, _FEWEST = 8, 32
#: Most points of a table.
_MOST_POINTS = 4096
#: Error of a table, measured by the largest value of all modes; the same by the standard deviation that is left out.
_TABLE_ERROR, _OF_THE_REST = 1e-6, 1e-4


def mode_tables(name: str, expansion: Expansion, start: float) -> tuple[Curve, ...]:
    """Return the modes as splines over x from ``start`` on, each through as many points as its error requires: modes of
    short waves have small values, and need less accuracy relative to them."""
    count, points = len(expansion.eigenvalues), _FEWEST
    result: dict[int, Curve] = {}
    allowed = max(_TABLE_ERROR, _OF_THE_REST * math.sqrt(max(1.0 - float(expansion.captured[-1]), 0.0)))
    highest = 0.0
    while len(result) < count:
        x = np.linspace(0.0, expansion.duration, points + 1)
        between = 0.5 * (x[1:] + x[:-1])
        y, exact = expansion.modes(x), expansion.modes(between)
        highest = max(highest, float(np.max(np.abs(y))))
        last = 2 * points > _MOST_POINTS
        for k in range(count):
            # mode k has about k / 2 waves: fewer points than these may meet it by chance
            if k in result or (points < _POINTS * (k + 1) // 2 and not last):
                continue
            spline = Curve(f"{name} mode {k + 1}", start + x, y[k], smooth_ends=True)
            error = float(np.max(np.abs(spline(start + between) - exact[k])))
            if last or error <= allowed * highest:
                result[k] = spline
        points *= 2
    return tuple(result[k] for k in range(count))
