"""Values that a scene needs and a URDF does not give: stiffness of stops, and the speed below which joints stick."""

from __future__ import annotations

from typing import Any

from eomgen.scene.sources.urdf.reading import Joint

#: How far a stop gives way to the effort of its joint, by unit of the coordinate.
GIVE = {"rad": 0.01, "m": 0.001}
#: Damping of a stop over its stiffness, s.
DAMPING_TIME = 0.01
#: Speed well below which a joint with friction counts as sticking, by unit of the coordinate, per second.
STICKING = {"rad": 0.01, "m": 0.001}


def stops_of(joint: Joint) -> dict[str, Any] | None:
    """Return the ``limits`` of a joint; None if the file gives no range, or no effort to measure a stop by."""
    limit = joint.limit
    if joint.unit not in GIVE or joint.written_type == "continuous" or limit is None:
        return None
    if not limit.lower < limit.upper or limit.effort <= 0.0:
        return None
    stiffness = limit.effort / GIVE[joint.unit]
    return {"lower": limit.lower, "upper": limit.upper, "stiffness": stiffness, "damping": DAMPING_TIME * stiffness}


def friction_of(joint: Joint) -> dict[str, Any] | None:
    """Return the ``friction`` of a joint; None for no friction, a negative one, or a joint of several coordinates."""
    if joint.unit not in STICKING or joint.friction <= 0.0:
        return None
    return {"coulomb": joint.friction, "velocity": STICKING[joint.unit]}
