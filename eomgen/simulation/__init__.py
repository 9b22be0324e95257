"""Runs of a compiled model: settings, inputs, the compiled time loop, checkpoints, diagnosis."""

__all__ = [
    "automatic_method",
    "checkpoint",
    "option_types",
    "resume",
    "row_times",
    "run_model",
    "sensitivities",
    "side_by_side",
    "simulate",
    "start",
    "timing",
]
