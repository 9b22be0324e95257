"""Runs of a compiled model: settings, inputs, the compiled time loop, checkpoints, what may be wrong with a run."""

__all__ = ["checkpoint", "resume", "simulate"]
