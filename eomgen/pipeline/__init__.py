"""From a description to a compiled model: load, derive, generate, build; initial assembly and equilibrium start."""

__all__ = ["content", "controllers", "file_kinds", "front_end", "model", "pipeline", "step_operations"]
