"""MJCF, the format of MuJoCo: compiled by MuJoCo, and converted to a scene."""

__all__ = []
