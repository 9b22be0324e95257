"""``CudaNames``: declarations of the C functions of a model as templates of C++20."""

from __future__ import annotations

from eomgen.codegen.targets.c.naming import CNames


class CudaNames(CNames):
    """Names of C with types of arrays that a call chooses.

    Functions with an argument ``EG_IN q`` or ``EG_OUT tau`` are templates: a kernel calls these with views of columns
    or rows of its arrays, a stepper with pointers. Statements are equal to the C, except sines and cosines of roads:
    they come from a table that threads share or, without one, are computed again, since a thread's memory is slower.
    """

    keeps_turns = False
    called, in_large, elementary = "EG_CALLED ", "EG_IN_LARGE ", "EG_CALLED"

    def input_type(self, block: str) -> str:
        """Return the declaration of an input argument: ``EG_IN q``."""
        return super().input_type(block) if block in ("p", "base", "t") else f"EG_IN {block}"

    def output_type(self, argument: str, *, real: str = "real", restrict: bool = True) -> str:
        """Return the declaration of an array that a function fills: ``EG_OUT tau``."""
        return f"EG_OUT {argument}"
