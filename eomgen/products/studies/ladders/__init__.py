"""Ladders of extreme conditions over a scene: cells that hold, that are reported, and that fail."""

__all__ = ["result", "study"]
#: Open to the other parts of ``studies``.
WITHIN = ["register", "result"]
