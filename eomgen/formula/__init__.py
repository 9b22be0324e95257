"""Formulas as small trees, and curves: evaluation, recording on the tape, discontinuities and kinks."""

__all__ = [
    "discontinuities",
    "evaluate",
    "infix",
    "jumps",
    "law_values",
    "nodes",
    "piecewise",
    "prescribed_motion",
    "recording",
    "smoothing",
    "steepness",
    "undefined_laws",
    "words",
]
