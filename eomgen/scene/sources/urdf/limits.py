"""Limits of a URDF as compliant stops, and its dry friction, where they are asked for.

The file says where a stop is, not how hard: it gives way by 0.01 rad or 1 mm under the joint's largest effort, and its damping
over its stiffness is 0.01 s. Friction is regularised at 0.01 rad/s or 1 mm/s.
"""

from __future__ import annotations

from typing import Any

from eomgen.scene.sources.urdf.elements import Joint

GIVE = {"revolute": 0.01, "prismatic": 0.001}  # rad, m
DAMPING_TIME = 0.01  # s
STICKING = {"revolute": 0.01, "prismatic": 0.001}  # rad/s, m/s


def stops_of(joint: Joint) -> dict[str, Any] | None:
    """Return the ``limits`` of a joint; None where the file gives no range, or no effort to measure a stop by."""
    limit = joint.limit
    if joint.type not in GIVE or joint.written_type == "continuous" or limit is None:
        return None
    if not limit.lower < limit.upper or limit.effort <= 0.0:
        return None
    stiffness = limit.effort / GIVE[joint.type]
    return {"lower": limit.lower, "upper": limit.upper, "stiffness": stiffness, "damping": DAMPING_TIME * stiffness}


def friction_of(joint: Joint) -> dict[str, Any] | None:
    """Return the ``friction`` of a joint; None where the file gives none, or a negative one, or several coordinates."""
    if joint.type not in STICKING or joint.friction <= 0.0:
        return None
    return {"coulomb": joint.friction, "velocity": STICKING[joint.type]}
