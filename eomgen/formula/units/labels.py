"""Values with units from Python, such as ``300 mm`` for a parameter, converted to the unit of its label; angles that
look as if they were in degrees."""

from __future__ import annotations

import math
from collections.abc import Collection

from eomgen.base.messages import shown
from eomgen.errors import Problem, UsageError
from eomgen.formula.units.conversion import to_si, to_unit
from eomgen.formula.units.parser import UnitError, is_quantity, read_quantity, read_unit


def several_turns(subject: str, angle: float) -> str:
    """Return a note on an angle of more than a turn, in rad as a plain number; empty for less.

    ``subject``: clause that names the angle: ``the joint hinge starts at``.
    """
    if not 2.0 * math.pi < abs(angle) < math.inf:
        return ""
    turns = f"{subject} {angle:.6g} rad, {abs(angle) / (2.0 * math.pi):.3g} turns"
    return f'{turns}: angles without a unit are radians, "30 deg" is in degrees [W0027]'


def in_label(where: str, text: str, label: str) -> float:
    """Return the number that a text such as "300 mm" is in the unit of a label; in SI if the label is empty.

    Parameters
    ----------
    where : str
        Argument or option with the text, for messages.

    Raises
    ------
    UsageError
        For a text that is not a number with a unit, or of another dimension than the label, or a label that is not a
        unit.
    """
    if not is_quantity(text):
        raise UsageError(
            Problem(where, f"{shown(text)} is neither a number nor a number with a unit [E0244]", '0.25 or "250 mm"')
        )
    try:
        return number_in_label(text, label)[0]
    except UnitError as error:
        raise UsageError(Problem(where, error.what, error.hint)) from None


def number_in_label(text: str, label: str, known: Collection[str] = ()) -> tuple[float, str]:
    """Return the number of a text such as "300 mm" in the unit of a label, and that unit; in SI if the label is empty.
    ``known`` are names that no unit in the text may have.

    Raises
    ------
    UnitError
        Also for a label that is not a unit: such a label could mean anything.
    """

    quantity = read_quantity(text, known)
    if not label.strip():
        return to_si(quantity)
    try:
        read_unit(label)
    except UnitError:
        fault = f"its label {shown(label)} in the scene is not a unit that numbers could be converted to [E0305]"
        raise UnitError(fault, "a plain number") from None
    return to_unit(quantity, label), label
