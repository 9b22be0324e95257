"""Derivatives of whole runs, consistent with the discrete steps: tangents, adjoints, their functionals."""

__all__ = ["functionals", "linearise", "run_sensitivities", "stationary_run"]
