"""URDF: its elements, and the scene that they become."""

__all__ = ["source"]
