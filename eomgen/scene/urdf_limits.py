"""Limits of a URDF as compliant stops, where they are asked for: the file says where a stop is, not how hard.

So a stop gives way by 0.01 rad or 1 mm under the joint's largest effort, and its damping over its stiffness is 0.01 s.
"""

from __future__ import annotations

from typing import Any

from eomgen.scene.urdf_elements import Joint

GIVE = {"revolute": 0.01, "prismatic": 0.001}  # rad, m
DAMPING_TIME = 0.01  # s


def stops_of(joint: Joint) -> dict[str, Any] | None:
    """Return the ``limits`` of a joint; None where the file gives no range, or no effort to measure a stop by."""
    limit = joint.limit
    if joint.type not in GIVE or joint.written_type == "continuous" or limit is None:
        return None
    if not limit.lower < limit.upper or limit.effort <= 0.0:
        return None
    stiffness = limit.effort / GIVE[joint.type]
    return {"lower": limit.lower, "upper": limit.upper, "stiffness": stiffness, "damping": DAMPING_TIME * stiffness}
