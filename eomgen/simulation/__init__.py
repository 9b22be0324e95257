"""Runs of a compiled model: settings, inputs, the compiled time loop, checkpoints, diagnosis."""

__all__ = [
    "accuracy",
    "automatic_method",
    "checkpoint",
    "judgement",
    "motions",
    "option_types",
    "run_model",
    "simulate",
    "start",
    "stepping",
    "timing",
]
