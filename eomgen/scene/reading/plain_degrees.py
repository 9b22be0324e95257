"""Angles in formulas that look as if they were in degrees: ``sin(30)``."""

from __future__ import annotations

from collections.abc import Iterator

from eomgen.formula.nodes import Application, Formula, Number, Operation

#: Whole numbers from which on an angle is more than a turn.
_TURN = 7.0
_OF_ANGLES = ("sin", "cos", "tan")


def plain_degrees(formula: Formula) -> list[str]:
    """Return a note on each sine, cosine and tangent of a whole number of more than a turn."""
    return list(dict.fromkeys(_noted(formula)))


def _noted(formula: Formula) -> Iterator[str]:
    if isinstance(formula, Application):
        yield from _noted(formula.argument)
    if not isinstance(formula, Operation):
        return
    for argument in formula.arguments:
        angle = argument.value if formula.name in _OF_ANGLES and isinstance(argument, Number) else 0.0
        if abs(angle) >= _TURN and angle.is_integer():
            call = f"{formula.name}({angle:.0f}"
            yield f"{call}) takes {angle:.0f} rad, for angles in formulas are radians; {call} * pi / 180) takes degrees"
        yield from _noted(argument)
