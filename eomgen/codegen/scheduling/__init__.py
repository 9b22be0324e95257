"""Scheduling of statements: plans, few live values, rerolled loops, Maps, assembly of matrices."""

__all__ = ["few_live", "scheduler"]
#: Open to the other parts of ``codegen`` as well.
WITHIN = ["bodies", "matrix_loops", "program_loops", "rerolling", "scheduler", "sharing", "stretches"]
