"""From a description to a compiled model: load, derive, generate, build; initial assembly and equilibrium start."""

__all__ = [
    "citations",
    "content",
    "documents",
    "front_end",
    "generation",
    "methods",
    "model",
    "pipeline",
    "requests",
    "saved_models",
    "step_operations",
]
