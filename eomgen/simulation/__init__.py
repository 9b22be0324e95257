"""Runs of a compiled model: settings, inputs, the compiled time loop, checkpoints, diagnosis."""

__all__ = [
    "accuracy",
    "checkpoint",
    "judgement",
    "option_types",
    "request",
    "resume",
    "run_model",
    "simulate",
    "start",
    "stepping",
    "timing",
]
