"""Scheduling of statements: plans, few live values, rerolled loops, Maps, assembly of matrices."""

__all__ = ["scheduler"]
#: Open to the other parts of ``codegen`` as well.
WITHIN = ["bodies", "joining", "matrix_loops", "program_loops", "rerolling", "scheduler", "sharing", "stretches"]
