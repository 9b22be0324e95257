"""From a description to a compiled model: load, derive, generate, build; initial assembly and equilibrium start."""

__all__ = ["controllers", "hamiltonians", "pipeline", "step_operations"]
