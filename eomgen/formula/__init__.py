"""Formulas as small trees, and curves: evaluation, recording on the tape, where they jump or bend."""

__all__ = ["discontinuities", "evaluate", "jumps", "nodes", "piecewise", "prescribed_motion", "recording", "words"]
