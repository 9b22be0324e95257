"""From a description to a compiled model: load, derive, generate, build; initial assembly and equilibrium start."""

__all__ = [
    "citations",
    "content",
    "front_end",
    "model",
    "pipeline",
    "saved_models",
    "step_operations",
]
