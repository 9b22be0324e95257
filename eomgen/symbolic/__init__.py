"""Kernels, the tape, and calculus on tapes. Knows no mechanics."""

__all__ = [
    "calculus", "evaluate", "kernel", "map", "operations", "periodic", "reading", "rotation", "scalar", "series",
    "tape",
]  # fmt: skip
