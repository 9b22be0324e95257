"""Functions that give Taylor coefficients order by order, and where their pieces meet."""

__all__ = []
#: Open to the other parts of ``codegen`` as well.
WITHIN = ["functions"]
