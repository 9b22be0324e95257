"""Results of runs and analyses: solutions, dense output, plots, tables, animations."""

__all__ = ["animation", "dense_output", "linear_files", "linear_plots", "plots", "scenery", "solution"]
