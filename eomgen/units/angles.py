"""Angles that look as if they were in degrees."""

from __future__ import annotations

import math


def several_turns(what: str, angle: float) -> str:
    """Return a note on an angle of more than a turn, in rad as a plain number; empty for less.

    ``what``: the thing with the angle, as a clause: ``the joint hinge starts at``.
    """
    if not 2.0 * math.pi < abs(angle) < math.inf:
        return ""
    turns = f"{what} {angle:.6g} rad, {abs(angle) / (2.0 * math.pi):.3g} turns"
    return f'{turns}: angles without a unit are radians, "30 deg" is in degrees'
