"""Branches in the equations of a run (comparisons, signs, curves with jumps), and the sides on which states are."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.base.data import dataclass
from eomgen.formula.features import Feature
from eomgen.formula.nodes import ZERO
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.operations import CurveLike, InputSymbol, Op
from eomgen.symbolic.tape import Ref, Tape
from eomgen.system.system import System

#: Functions with jumps that move a run.
OF_RUNS = ("residual", "internal_rate")
_COMPARED = {Op.SIGN: "a sign", Op.LT: "a comparison", Op.LE: "a comparison"}
_KINKED = {Op.ABS: "an absolute value", Op.MIN: "a smallest value", Op.MAX: "a largest value"}

Values = Mapping[str, NDArray[Any]]


@dataclass(frozen=True)
class Branch:
    """An operation whose value may jump when its argument passes a number.

    Attributes
    ----------
    description : for messages: ``a sign in effort friction``
    symbols : the components of input blocks that the argument depends on
    """

    description: str
    symbols: frozenset[InputSymbol]


def _jumps(curve: CurveLike, derivative: int) -> Feature | None:
    """Return the arguments at which a derivative of a curve jumps, None if there are none."""
    places = sorted(x for x, order in curve.kinks() if order <= derivative)
    period = float(curve.breaks[-1] - curve.breaks[0]) if curve.outside == "periodic" else 0.0
    return Feature(ZERO, np.array(places), period) if places else None


class Branches:
    """The branches of a system's equations (comparisons, signs, curves with jumps), and the sides on which states are.

    Comparisons within loops over alike elements are left out.

    Parameters
    ----------
    system : with functions among ``OF_RUNS``, and outputs
    """

    def __init__(self, system: System) -> None:
        self._tape: Tape = system.tape
        self._equations: list[Ref] = [
            ref for name in OF_RUNS if name in system.functions for ref in system.functions[name].refs
        ]
        self._outputs = list(system.functions["outputs"].refs) if "outputs" in system.functions else []

    @cached_property
    def _found(self) -> list[tuple[Branch, tuple[Ref, ...], Feature | None]]:
        """Each branch with the references of the operands, and with the jumps of a curve (None for comparisons and
        signs)."""
        tape, result = self._tape, []
        for node in tape.live(self._equations):
            op, jumps = tape.op[node], None
            if op is Op.CURVE:
                jumps = _jumps(*tape.curves[tape.b[node]])
            if op not in _COMPARED and jumps is None:
                continue
            operands: tuple[Ref, ...] = (tape.a[node],) if jumps is not None else tape.operands(node)
            operation = _COMPARED.get(op) or f"the curve {tape.curves[tape.b[node]][0].name}"
            result.append((self._branch(operation, node, operands), operands, jumps))
        return result

    def _branch(self, operation: str, node: int, operands: tuple[Ref, ...]) -> Branch:
        label = self._tape.label(node)
        description = f"{operation} in {label}" if label else operation
        return Branch(description, frozenset(self._tape.depends_on(operands)))

    @property
    def branches(self) -> list[Branch]:
        """All branches; arrays of sides have a column for each."""
        return [branch for branch, *_ in self._found]

    def kinks(self, outputs: slice) -> list[Branch]:
        """Return the continuous operations with slopes that jump: absolute, smallest and largest values.

        Parameters
        ----------
        outputs : slice
            Components of the outputs that are looked at in addition to the equations.
        """
        tape = self._tape
        return [
            self._branch(_KINKED[tape.op[node]], node, tape.operands(node))
            for node in tape.live([*self._equations, *self._outputs[outputs]])
            if tape.op[node] in _KINKED
        ]

    def arguments(self, values: Values) -> NDArray[np.float64]:
        """Return the compared values, the first operand minus the second, (n, branches).

        Parameters
        ----------
        values : input blocks, (size,) or (n, size) each
        """
        refs = [ref for _, operands, _ in self._found for ref in (operands[0], operands[-1])]
        pairs = self._evaluated(refs, values).reshape(-1, len(self._found), 2)
        alone = [len(operands) == 1 for _, operands, _ in self._found]
        result: NDArray[np.float64] = np.where(alone, pairs[..., 0], pairs[..., 0] - pairs[..., 1])
        return result

    def sides(self, arguments: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return on which side of each branch the arguments (n, branches) are, (n, branches). -1, 0 or 1 for
        comparisons and signs; for a curve the number of jumps that the argument has passed."""
        result = np.sign(arguments)
        for column, (_, _, jumps) in enumerate(self._found):
            if jumps is not None:
                result[:, column] = jumps.sides(arguments[:, column])
        return result

    def equations(self, values: Values) -> NDArray[np.float64]:
        """Return the residual and the rates of internal states, (n, rows)."""
        return self._evaluated(self._equations, values)

    def _evaluated(self, refs: list[Ref], values: Values) -> NDArray[np.float64]:
        needed = {symbol.block for symbol in self._tape.depends_on(refs)} or {"p"}
        with np.errstate(all="ignore"):
            result = evaluate(self._tape, refs, {name: values[name] for name in needed})
        return np.atleast_2d(np.asarray(result, dtype=np.float64))
