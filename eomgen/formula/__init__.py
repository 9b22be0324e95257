"""Formulas as small trees, and curves: evaluation, recording on the tape, discontinuities and kinks."""

__all__ = [
    "curves",
    "discontinuities",
    "evaluate",
    "features",
    "integration",
    "motion_faults",
    "nodes",
    "prescribed_motion",
    "recording",
    "substitution",
    "units",
    "words",
]
