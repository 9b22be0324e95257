"""Results of runs and analyses: solutions, dense output, plots, tables, poses."""

__all__ = [
    "dense_output",
    "error_estimate",
    "events",
    "finding",
    "plots",
    "poses",
    "recorded",
    "solution",
]
