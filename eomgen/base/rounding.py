"""Levels below which relative differences are rounding: one scale in place of a threshold of each module.

A module has a tolerance of its own only if the number decides more than whether two values are equal.
"""

#: Sums and products of a few hundred terms in double precision.
SUMMED = 1e-12
#: Results of long computations: solved equations, eigenvalues, rows of a run, times as sums of steps.
COMPUTED = 1e-9
#: Numbers that users and programs write with about seven digits.
WRITTEN = 1e-6
