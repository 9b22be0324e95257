"""MJCF, the format of MuJoCo: compiled by MuJoCo, and converted to a scene."""

__all__ = []
#: Open to the other formats.
WITHIN = ["draft"]
