"""Kernels: a law in a handful of operations with named arguments, instantiated on a tape.

Laws are derived with SymPy, once and small (``symbolic_kernel``); the tape composes them. A kernel never sees a whole
equation, and does without SymPy.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property, reduce

from eomgen.symbolic.operations import Op
from eomgen.symbolic.scalar import Algebra, Scalar
from eomgen.symbolic.tape import Ref


class Kernel:
    """Operations on named symbols.

    Attributes
    ----------
    steps : str
        Operations in order, with commas between: a symbol, a number, or an operation and the places of its operands
        among earlier steps, as ``add 0 1 2``, ``pow 2 3``, ``sqrt 4``; functions by name in ``Op``. Order and operands
        determine the recorded operations.
    results : tuple of int
        The steps whose values the kernel returns, in order.
    """

    def __init__(self, steps: str, results: tuple[int, ...]) -> None:
        self.steps = steps
        self.results = results

    @cached_property
    def _operations(self) -> list[tuple[str, list[int]]]:
        """The first word and the places of the operands of each step."""
        words = (step.split() for step in self.steps.split(","))
        return [(word, [int(index) for index in places]) for word, *places in words]

    @cached_property
    def _symbols(self) -> list[str]:
        return [word for word, places in self._operations if not places and word[0].isalpha()]

    def instantiate(self, algebra: Algebra, values: Mapping[str, Scalar]) -> list[Scalar]:
        """Record the kernel on the algebra's tape, and return the results; the same symbols are recorded once.

        Parameters
        ----------
        values : mapping from symbol name to Scalar
            Raises KeyError for a symbol of the kernel that has none.
        """
        tape = algebra.tape
        instance = (self, *(values[name].ref for name in self._symbols))
        if instance not in tape.instances:
            refs: list[Ref] = []
            for word, places in self._operations:
                operands = [refs[index] for index in places]
                if word == "add":
                    refs.append(reduce(tape.add, operands))
                elif word == "mul":
                    refs.append(reduce(tape.mul, operands))
                elif operands:
                    refs.append(tape.call(Op[word.upper()], *operands))
                else:
                    refs.append(values[word].ref if word in values else tape.constant(float(word)))
            tape.instances[instance] = tuple(refs[index] for index in self.results)
        return [Scalar(tape, ref) for ref in tape.instances[instance]]
