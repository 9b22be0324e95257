"""A run as data, and its stepping: settings, inputs, events, the compiled stepper and its loop."""

#: Open to the other parts of ``simulation``.
WITHIN = [
    "angle_range",
    "compiled_steps",
    "controllers",
    "events",
    "step_parts",
    "taylor_output",
]

__all__ = [
    "chunks",
    "inputs",
    "lane_stepper",
    "run",
    "settings",
    "start_state",
    "states",
    "stepper",
    "time_grid",
]
