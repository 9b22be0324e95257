"""Rotations and mass properties as numbers, independent of scenes."""

__all__ = ["rotations"]
#: Open to the other parts of ``scene`` as well.
WITHIN = ["inertia"]
