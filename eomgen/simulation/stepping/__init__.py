"""A run as data, and its stepping: settings, inputs, events, the compiled stepper and its loop."""

#: Open to the other parts of ``simulation``.
WITHIN = ["controllers", "events"]

__all__ = [
    "chunks",
    "events",
    "inputs",
    "run",
    "settings",
    "states",
    "stepper",
    "time_grid",
]
