"""URDF: its elements, and their conversion to a scene."""

__all__ = []
#: Open to the other formats.
WITHIN = ["conversion", "notes", "reading", "transmissions", "visuals"]
