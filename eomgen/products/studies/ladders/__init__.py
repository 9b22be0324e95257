"""Ladders of extreme conditions over a scene: cells that hold, that are reported, and that fail."""

__all__ = []
#: Open to the other parts of ``studies``.
WITHIN = ["result", "study", "register", "verdicts"]
