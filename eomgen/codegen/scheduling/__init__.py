"""The order of statements: plans, loops found in repeats and loops of the tape, the assembly of matrices."""

__all__ = []
#: Open to the other parts of ``codegen`` as well.
WITHIN = ["maps", "matrix_assembly", "scheduler"]
