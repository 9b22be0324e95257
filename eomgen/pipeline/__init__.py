"""From a description to a compiled model: load, derive, generate, build; initial assembly and equilibrium start."""

__all__ = ["content", "controllers", "front_end", "hamiltonians", "model", "pipeline", "step_operations"]
