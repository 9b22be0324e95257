"""Derivatives of whole runs, consistent with the discrete steps: tangents, adjoints, their functionals."""

__all__ = ["linearise", "run_sensitivities"]
