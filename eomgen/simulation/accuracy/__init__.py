"""Discretisation error of a run: comparison runs, and the error estimate from their differences."""

__all__ = ["motion_size"]
#: Open to the other parts of ``simulation``.
WITHIN = ["error_estimation", "motion_size", "richardson", "step_path", "unseen_events", "unseen_laws"]
