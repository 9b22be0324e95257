"""URDF: its elements, and their conversion to a scene."""

__all__ = []
