"""Results of runs and analyses: solutions, dense output, plots, tables, animations."""

__all__ = [
    "animation",
    "dense_output",
    "error_estimate",
    "events",
    "finding",
    "largest_section_loads",
    "linear_files",
    "plots",
    "scenery",
    "section_plots",
    "solution",
]
