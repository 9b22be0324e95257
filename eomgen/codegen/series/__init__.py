"""Recurrences of Taylor coefficients, and the breakpoints at which a series must end."""

__all__ = []
#: Open to the other parts of ``codegen`` as well.
WITHIN = ["functions"]
