"""The laws of motion of a scene, which something must follow: drives of constraints, and the motion of the base."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from eomgen.scene.formula.evaluate import symbols
from eomgen.scene.formula.nodes import Application, Formula, Number, Operation
from eomgen.scene.scene import Scene
from eomgen.text import key_of

#: Operations that are as smooth as what they are made of.
_SMOOTH = frozenset({"add", "sub", "mul", "neg", "sin", "cos", "sinh", "cosh", "tanh", "exp", "atan"})


class Law(NamedTuple):
    """A formula of time that something must follow, with its key in the scene, what it says in words, and its unit."""

    key: str
    what: str
    unit: str
    formula: Formula


def laws_of(scene: Scene) -> Iterator[Law]:
    """Yield the laws of a scene: drives of constraints, position and rotation of the base."""
    for constraint in scene.constraints:
        if constraint.drive is not None:
            what, unit = ("angle", "rad") if constraint.type == "revolute" else ("travel", "m")
            yield Law(key_of("constraints", constraint.name, "drive"), f"driven {what}", unit, constraint.drive)
    if scene.base is not None:
        for place, formula in enumerate(scene.base.position):
            yield Law(key_of("base", "position", place), "position of the base", "m", formula)
        for place, rotation in enumerate(scene.base.rotations):
            yield Law(key_of("base", "rotation", place, "angle"), "angle of the base", "rad", rotation.angle)


def smooth(formula: Formula) -> bool:
    """Tell whether a formula of time and its rate can have no jump, by the operations and curves that it is made of alone."""
    if constant(formula) or not isinstance(formula, Operation | Application):
        return True
    if isinstance(formula, Application):  # a spline's third derivative jumps at its ends
        kinks = [order for _, order in formula.curve.kinks()]
        return formula.derivative <= 1 and min(kinks, default=3) - formula.derivative >= 2 and smooth(formula.argument)
    first, second = formula.arguments[0], formula.arguments[-1]
    if formula.name == "div":
        return smooth(first) and constant(second)
    if formula.name == "pow":
        return smooth(first) and isinstance(second, Number) and second.value >= 0.0 and second.value.is_integer()
    return formula.name in _SMOOTH and all(smooth(item) for item in formula.arguments)


def constant(formula: Formula) -> bool:
    """Tell whether a formula of time is one of parameters only."""
    return all(symbol.kind != "time" for symbol in symbols(formula))
