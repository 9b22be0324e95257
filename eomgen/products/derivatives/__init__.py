"""Derivatives of whole runs, consistent with the discrete steps: tangents, adjoints, their functionals."""

__all__ = ["crossings", "functionals", "linearise", "run_sensitivities", "stationary_run"]
