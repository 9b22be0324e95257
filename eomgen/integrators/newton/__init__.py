"""The linear systems of implicit steps: sparse matrices, their order of elimination, its stages and fronts."""

__all__ = ["matrix"]
#: Open to the other parts of ``integrators`` as well.
WITHIN = ["samples", "solver"]
