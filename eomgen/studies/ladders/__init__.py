"""Ladders of extreme conditions over a scene: what holds, what is said, and what fails."""

__all__ = []
#: Open to the other parts of ``studies``.
WITHIN = ["result", "study", "register", "verdicts"]
