"""Results of runs and analyses: solutions, dense output, plots, tables, animations."""

__all__ = [
    "animation",
    "beam_curves",
    "beams_at_rest",
    "dense_output",
    "error_estimate",
    "events",
    "finding",
    "largest_section_loads",
    "linear_files",
    "plots",
    "rainflow",
    "sample_errors",
    "scenery",
    "section_loads",
    "section_plots",
    "shapes",
    "solution",
    "spectrum",
]
