"""Linear systems of implicit steps: sparse matrices, elimination order, stages and fronts."""

__all__ = ["matrix"]
#: Open to the other parts of ``integrators`` as well.
WITHIN = ["row_sums", "sample_matrices", "signs", "solver"]
