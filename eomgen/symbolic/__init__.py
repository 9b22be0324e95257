"""Symbolic core without mechanics: kernels, the tape, evaluation, series, calculus on tapes."""

__all__ = [
    "calculus", "evaluate", "kernel", "map", "operations", "periodic", "reading", "rotation", "scalar", "series",
    "tape",
]  # fmt: skip  # a table
