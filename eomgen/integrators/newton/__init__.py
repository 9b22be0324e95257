"""Linear systems of implicit steps: sparse matrices, elimination order, stages and fronts."""

__all__ = ["matrix", "row_sums"]
#: Open to the other parts of ``integrators`` as well.
WITHIN = ["sample_matrices", "signs", "solver"]
