"""Formulas at points where an operation is singular, with derivatives from one-sided differences by mpmath.

Formulas are Python expressions, so that mpmath evaluates them, a branch that is not taken never.
"""

from __future__ import annotations

from collections.abc import Callable
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


_BELOW, _CENTRE = -1, None
EDGES = (
    # branches that are not taken
    EdgeFormula("max(-x, 0)**1.5", 0.05),
    EdgeFormula("max(-x, 0)**2.5", 0.05),
    EdgeFormula("max(-x, 0)**0.5", 0.05),
    EdgeFormula("y*max(x, 0)**1.5", -0.05),
    EdgeFormula("max(x, 0)**y", -0.2, 1.5),
    EdgeFormula("max(x, 0)**y", -0.2, 0.5),
    EdgeFormula("sqrt(x) if x > 0 else 0", -1.0),
    EdgeFormula("sqrt(x)*y if x > 0 else y**2", -1.0),
    EdgeFormula("1/x if x > 1 else 0", 0.0),
    EdgeFormula("y/x if x > 0 else y", 0.0, 0.3, side=_BELOW),
    EdgeFormula("1/sqrt(x) if x > 1 else 1", 0.0),
    EdgeFormula("x**(-1.5) if x > 1 else x", 0.0),
    EdgeFormula("log(x) if x > 1 else x**2", 0.0),
    EdgeFormula("x*log(x) if x > 0 else 0", -0.5),
    EdgeFormula("asin(x) if abs(x) < 1 else 0", 2.0),
    EdgeFormula("acos(x) if abs(x) < 1 else 1 - x", 1.5),
    EdgeFormula("sin(x)/x if abs(x) > 1e-3 else 1 - x**2/6", 0.0),
    EdgeFormula("(1 - cos(x))/x**2 if abs(x) > 1e-3 else 0.5 - x**2/24", 0.0),
    EdgeFormula("exp(-1/x) if x > 0 else 0", 0.0),
    EdgeFormula("exp(-1/x**2) if x*x > 0 else 0", 0.0),
    EdgeFormula("log(1 + exp(x)) if x < 30 else x", 1000.0),
    EdgeFormula("x**0.5 if x > 0 else -(-x)**0.5", 0.25),
    EdgeFormula("x**0.5 if x > 0 else -(-x)**0.5", -0.25),
    EdgeFormula("sqrt(x - 1) if x > 1 else (sqrt(-x - 1) if x < -1 else 0)", 0.2),
    EdgeFormula("(sqrt(x) if x > 0 else 0) + (y*sqrt(x) if x > 1 else y)", -0.3),
    EdgeFormula("sqrt(y - x) if y > x and x > 0 else x*y", 0.7, 0.5),
    EdgeFormula("atan2(y, x) if x > 0 else x*y", 0.0, 0.0, side=_BELOW),
    EdgeFormula("y/(x - 1) if not x < 2 else x", 1.0),
    # clipped numbers
    EdgeFormula("sqrt(max(0, x))", -0.3),
    EdgeFormula("sqrt(max(x, 0)*y)", -0.3),
    EdgeFormula("sqrt(2*max(x, 0)/y)", -0.3),
    EdgeFormula("y*sqrt(max(0, 1 - x**2))", 1.5),
    EdgeFormula("sqrt(1 - min(1, x*x))", 2.0),
    EdgeFormula("acos(max(-1, min(1, x)))", 1.7),
    EdgeFormula("asin(max(-1, min(1, x*y)))", 3.0, 2.0),
    EdgeFormula("sqrt(max(0, x) + max(0, y))", -0.3, -0.2),
    EdgeFormula("sqrt(max(0, x)**2 + max(0, -y)**2)", -0.3, 0.2),
    EdgeFormula("max(x, 0)**1.5", 0.0, side=_BELOW),
    EdgeFormula("sqrt(max(x, 0))", 0.0, side=_BELOW),
    EdgeFormula("sqrt(max(0, x))*x", 0.0, side=_BELOW),
    EdgeFormula("asin(min(1, x))", 1.0, side=1),
    EdgeFormula("max(x, 0)**2", 0.0, side=_BELOW),
    # norms and absolute values
    EdgeFormula("sqrt(x**2)", 0.0, side=_CENTRE),
    EdgeFormula("sqrt(x*x + y*y)", 0.0, 0.0, side=_CENTRE),
    EdgeFormula("sqrt(x*x + y*y)", 0.0, 0.3),
    EdgeFormula("(x**2 + y**2)**0.5*y", 0.0, 0.0, side=_CENTRE),
    EdgeFormula("x*sqrt(x**2)", 0.0, side=_CENTRE),
    EdgeFormula("-0.3*x*sqrt(x**2 + y**2 + x**2)", 0.0, 0.0, side=_CENTRE),
    EdgeFormula("x*sqrt(x**2 + y**2)", 0.0, 3.0),
    EdgeFormula("sqrt(sqrt(x**2)**2 + y**2)", 0.0, 0.0, side=_CENTRE),
    EdgeFormula("sqrt((x - 1)**2 + y**2)", 1.0, 0.0, side=_CENTRE),
    EdgeFormula("sqrt(sin(x)**2)", 0.0, side=_CENTRE),
    EdgeFormula("y*sqrt(3*x**2/2)", 0.0, side=_CENTRE),
    EdgeFormula("sqrt(x**4)", 0.0),
    EdgeFormula("abs(x)*x", 0.0, side=_CENTRE),
    EdgeFormula("abs(x)**3", 0.0),
    EdgeFormula("abs(x)**2.2", 0.0, side=_CENTRE),
    EdgeFormula("(x**2)**1.5", 0.0),
    EdgeFormula("sqrt(abs(x)*abs(x))", 0.0, side=_CENTRE),
    EdgeFormula("sqrt(x**2) - y*sqrt(x**2 + y**2)", 0.0, 0.0, side=_CENTRE),
    # powers
    EdgeFormula("x**y", 0.0, 1.0, side=1),
    EdgeFormula("x**y", 0.0, 2.0, side=1),
    EdgeFormula("x**y", 0.0, 3.0, side=1),
    EdgeFormula("x**2.5", 0.0, side=1),
)
