"""A run as data, and its stepping: settings, inputs, events, the compiled stepper and its loop."""

#: Open to the other parts of ``simulation``.
WITHIN = [
    "angle_range",
    "chunks",
    "compiled_steps",
    "controllers",
    "events",
    "inputs",
    "lane_stepper",
    "run",
    "settings",
    "start_state",
    "states",
    "step_parts",
    "stepper",
    "taylor_output",
    "time_grid",
]
