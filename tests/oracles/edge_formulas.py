"""Formulas at points where an operation is singular, with derivatives from one-sided differences by mpmath.

Formulas are Python expressions, so that mpmath evaluates them, a branch that is not taken never.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import mpmath

_FUNCTIONS = {
    name: getattr(mpmath, name) for name in ("sqrt", "sin", "cos", "tan", "asin", "acos", "atan2", "exp", "log", "sign")
} | {"min": min, "max": max, "abs": abs}


class EdgeFormula(NamedTuple):
    """A formula of x and y at a point.

    ``side``: 0 if derivatives from both sides are equal; -1 or 1 for the side whose derivatives are meant, as beyond
    the edge of a clipped number; None at a kink, where the mean of both sides is meant.
    """

    text: str
    x: float
    y: float = 0.5
    side: int | None = 0

    def derivatives(self) -> tuple[float, float, float]:
        """Return d/dx, d/dy and d2/dx2."""
        with mpmath.workdps(60):
            along_x = [_derivative(lambda x: self.value(x, mpmath.mpf(self.y)), self.x, k, self.side) for k in (1, 2)]
            along_y = _derivative(lambda y: self.value(mpmath.mpf(self.x), y), self.y, 1, self.side)
        return float(along_x[0]), float(along_y), float(along_x[1])

    def value(self, x: Any, y: Any) -> Any:
        """Return the value for mpmath numbers."""
        return mpmath.mpf(eval(self.text, {"__builtins__": {}}, {**_FUNCTIONS, "x": x, "y": y}))


def _derivative(function: Callable[[Any], Any], x: float, order: int, side: int | None) -> Any:
    sides = [
        mpmath.diff(function, mpmath.mpf(x), order, direction=direction) for direction in ((side,) if side else (-1, 1))
    ]
    if side == 0:
        assert abs(sides[0] - sides[1]) <= 1e-9 * (1.0 + abs(sides[0])), (sides, x, order)
    return sum(sides) / len(sides)


_SIDES = {"below": -1, "above": 1, "centre": None}


def _read(line: str) -> EdgeFormula:
    text, _, values = line.partition(" ; ")
    x, *more = values.split()
    return EdgeFormula(text, float(x), *map(float, more[:1]), *(_SIDES[side] for side in more[1:]))


EDGES = tuple(
    _read(line)
    for line in Path(__file__).with_suffix(".txt").read_text(encoding="utf-8").splitlines()
    if not line.startswith("#")
)
