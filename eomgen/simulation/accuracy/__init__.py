"""Discretisation error of a run: comparison runs, and the error estimate from their differences."""

__all__ = ["comparison_runs", "fastest_rates", "motion_size", "step_path"]
#: Open to the other parts of ``simulation``.
WITHIN = ["error_estimation"]
