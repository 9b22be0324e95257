"""How far a run is from the motion that its equations have: comparison runs, and what their differences say."""

#: Open to the other parts of ``simulation``.
WITHIN = ["error_estimation", "motion_size", "step_rows", "unseen_events", "unseen_laws"]
