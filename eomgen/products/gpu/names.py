"""``CudaNames``: declarations of the C functions of a model as templates of C++20."""

from __future__ import annotations

from eomgen.codegen.targets.c.naming import CNames


class CudaNames(CNames):
    """Names of C with types of arrays that a call chooses.

    Functions with an argument ``EG_IN q`` or ``EG_OUT tau`` are templates: a kernel calls these with views of columns
    or rows of its arrays, a stepper with pointers. Statements are equal to the C's, but for sines and cosines of roads,
    which a thread computes again: its memory is slower.
    """

    #: Templates of steppers compute sines and cosines that all runs have in common, and keep no tables.
    computes_turns = True

    def input_type(self, block: str) -> str:
        """Return the declaration of an input argument: ``EG_IN q``."""
        return super().input_type(block) if block in ("p", "base", "t") else f"EG_IN {block}"

    def output_type(self, argument: str, *, restrict: bool = True) -> str:
        """Return the declaration of an array that a function fills: ``EG_OUT tau``."""
        return f"EG_OUT {argument}"
