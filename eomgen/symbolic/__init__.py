"""Symbolic core without mechanics: kernels, the tape, evaluation, series, calculus on tapes."""

__all__ = [
    "calculus",
    "evaluate",
    "external",
    "kernel",
    "latency",
    "map",
    "operations",
    "periodic",
    "reading",
    "rotation",
    "scalar",
    "series",
    "summation",
    "symbolic_kernel",
    "tape",
    "zeros",
]  # fmt: skip  # a table
