"""Angles that look as if they were in degrees."""

from __future__ import annotations

import math


def several_turns(subject: str, angle: float) -> str:
    """Return a note on an angle of more than a turn, in rad as a plain number; empty for less.

    ``subject``: clause that names the angle: ``the joint hinge starts at``.
    """
    if not 2.0 * math.pi < abs(angle) < math.inf:
        return ""
    turns = f"{subject} {angle:.6g} rad, {abs(angle) / (2.0 * math.pi):.3g} turns"
    return f'{turns}: angles without a unit are radians, "30 deg" is in degrees'
