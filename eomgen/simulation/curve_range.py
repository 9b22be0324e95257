"""Curves that a run has left: those that have no value beyond their points, at the arguments of a state."""

from __future__ import annotations

from collections.abc import Mapping

from eomgen.scene.formula.discontinuities import applications
from eomgen.scene.formula.evaluate import evaluate
from eomgen.scene.formula.nodes import Symbol
from eomgen.scene.formula.piecewise import EDGE, Curve
from eomgen.scene.formulas_of_forces import formulas_of_forces
from eomgen.scene.scene import Scene


def left_curves(scene: Scene, values: Mapping[tuple[str, str, int], float]) -> str:
    """Return which curves are asked beyond their points, and where; empty where none is known to be.

    ``values`` are numbers by kind, name and index of a symbol; arguments that need others are left out.
    """

    def value_of(symbol: Symbol) -> float:
        try:
            return values[symbol.kind, symbol.name, symbol.index]
        except KeyError:
            raise ArithmeticError(f"{symbol.kind} {symbol.name}") from None

    found: dict[str, str] = {}
    formulas = [item.formula for item in scene.inputs if item.formula is not None]
    for formula in (*formulas, *(formula for formula, _ in formulas_of_forces(scene))):
        for used in applications(formula):
            curve = used.curve
            if not isinstance(curve, Curve) or curve.outside != "error":
                continue
            try:
                at = evaluate(used.argument, value_of)
            except ArithmeticError:
                continue
            margin = EDGE * (curve.end - curve.start)
            if not curve.start - margin <= at <= curve.end + margin:
                points = f"has points from {curve.start:.9g} to {curve.end:.9g}"
                found.setdefault(curve.name, f"{curve.name} {points} and is asked at {at:.9g}")
    return " and ".join(found.values())
