"""Results of runs and analyses: solutions, dense output, plots, tables, animations."""

__all__ = [
    "animation",
    "dense_output",
    "error_estimate",
    "events",
    "linear_files",
    "plots",
    "scenery",
    "solution",
]
