"""Reactions: wrenches transmitted by joints and constraints, from inverse dynamics and multipliers."""

__all__ = []
#: Open to the other parts of ``mechanics`` as well.
WITHIN = ["quantities", "transmitted"]
