"""From a description to a compiled model: load, derive, generate, build, and the start that a scene asks for."""

__all__ = ["pipeline"]
