"""The order of statements: plans, loops found in repeats and loops of the tape, the assembly of matrices."""
