"""Runs of a compiled model: settings, inputs, the compiled time loop, checkpoints, diagnosis."""

__all__ = [
    "accuracy",
    "automatic_method",
    "checkpoint",
    "floquet",
    "judgement",
    "motions",
    "option_types",
    "row_times",
    "run_model",
    "side_by_side",
    "simulate",
    "start",
    "stepping",
    "timing",
]
