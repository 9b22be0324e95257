"""Angles that look as if they were in degrees."""

from __future__ import annotations

import math


def several_turns(joint: str, angle: float) -> str:
    """Return a note on a joint that starts at more than a turn, in rad as a plain number; empty for less."""
    if not abs(angle) > 2.0 * math.pi:
        return ""
    what = f"the joint {joint} starts at {angle:.6g} rad, {abs(angle) / (2.0 * math.pi):.3g} turns"
    return f'{what}: angles without a unit are radians, "30 deg" is in degrees'
