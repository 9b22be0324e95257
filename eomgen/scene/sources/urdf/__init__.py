"""URDF: its elements, and their conversion to a scene."""

__all__ = ["source"]
#: Open to the other sources as well.
WITHIN = ["conversion", "notes", "reading", "source", "transmissions", "visuals"]
