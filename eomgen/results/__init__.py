"""Results of runs and analyses: solutions, dense output, plots, tables, animations."""

__all__ = [
    "animation",
    "dense_output",
    "error_estimate",
    "events",
    "figures",
    "linear_files",
    "linear_plots",
    "plots",
    "scenery",
    "solution",
]
