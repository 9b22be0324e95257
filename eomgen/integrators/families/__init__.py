"""Families of integration methods as data with order conditions that are checked when a method is made."""

__all__ = ["generalized_alpha", "taylor"]
#: Open to the other parts of ``integrators`` as well.
WITHIN = ["coefficients", "family", "hermite", "partitioned", "runge_kutta"]
