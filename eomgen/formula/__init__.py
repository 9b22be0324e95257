"""Formulas as small trees, and curves: evaluation, recording on the tape, discontinuities and kinks."""

__all__ = [
    "curves",
    "discontinuities",
    "evaluate",
    "features",
    "infix",
    "jumps",
    "law_values",
    "nodes",
    "pattern",
    "prescribed_motion",
    "recording",
    "rough_operations",
    "smoothing",
    "steepness",
    "substitution",
    "undefined_laws",
    "units",
    "words",
]
