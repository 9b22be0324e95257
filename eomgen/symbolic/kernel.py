"""Kernels: a law in a handful of operations with named arguments, instantiated on a tape.

Laws are derived with SymPy, once and small (``symbolic_kernel``); the tape composes them. A kernel never sees a whole
equation, and does without SymPy.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import reduce

from eomgen.symbolic.operations import Op
from eomgen.symbolic.scalar import Algebra, Scalar
from eomgen.symbolic.tape import Ref, Tape

#: ``("symbol", name)``, ``("number", value)``, or an operation and the indices of operands among earlier steps:
#: ``("add", 0, 1, 2)``, ``("mul", 0, 1)``, ``("pow", 2, 3)``, ``("sqrt", 4)``; functions by name in ``Op``.
Step = tuple[str | int | float, ...]
_Rule = Callable[[Tape, Mapping[str, Scalar], Sequence[Ref]], Ref]


class Kernel:
    """Operations on named symbols.

    Attributes
    ----------
    steps : tuple of Step
        Operations in order; order and operands determine the recorded operations.
    results : tuple of int
        The steps whose values the kernel returns, in order.
    """

    __slots__ = ("_names", "_recorded", "results", "steps")

    def __init__(self, steps: tuple[Step, ...], results: tuple[int, ...]) -> None:
        self.steps = steps
        self.results = results
        self._names = [str(step[1]) for step in steps if step[0] == "symbol"]
        self._recorded: list[_Rule | tuple[bool, int, int]] | None = None

    def instantiate(self, algebra: Algebra, values: Mapping[str, Scalar]) -> list[Scalar]:
        """Record the kernel on the algebra's tape, and return the results; the same symbols are recorded once.

        Parameters
        ----------
        values : mapping from symbol name to Scalar
            Raises KeyError for a symbol of the kernel that has none.
        """
        tape = algebra.tape
        instance = (self, *(values[name].ref for name in self._names))
        if instance not in tape.instances:
            if self._recorded is None:
                self._recorded = [_step_rule(step) for step in self.steps]
            refs: list[Ref] = []
            add, mul = tape.add, tape.mul
            for step in self._recorded:
                if isinstance(step, tuple):
                    is_sum, left, right = step
                    refs.append(add(refs[left], refs[right]) if is_sum else mul(refs[left], refs[right]))
                else:
                    refs.append(step(tape, values, refs))
            tape.instances[instance] = tuple(refs[index] for index in self.results)
        return [Scalar(tape, ref) for ref in tape.instances[instance]]


def _step_rule(step: Step) -> _Rule | tuple[bool, int, int]:
    """Return the function that records a step, called with the tape, the symbols' values and the references of earlier
    steps. For a sum or product of two operands: (whether it is a sum, position of the first operand, position of the
    second)."""
    kind, *operands = step
    if kind == "symbol":
        name = str(operands[0])
        return lambda tape, values, refs: values[name].ref
    if kind == "number":
        number = float(operands[0])
        return lambda tape, values, refs: tape.constant(number)
    places = [int(index) for index in operands]
    if kind in ("add", "mul") and len(places) == 2:
        return kind == "add", places[0], places[1]
    if kind == "add":
        return lambda tape, values, refs: reduce(tape.add, [refs[index] for index in places])
    if kind == "mul":
        return lambda tape, values, refs: reduce(tape.mul, [refs[index] for index in places])
    op = Op[str(kind).upper()]
    return lambda tape, values, refs: tape.call(op, *(refs[index] for index in places))
