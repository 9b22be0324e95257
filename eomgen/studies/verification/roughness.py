"""Where a scene's formulas are not smooth: decisions that change within a step, and functions whose derivative is unbounded.

Read off the tape: the operations behind a function say where it may bend, and their operands say whether it does so here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from eomgen.studies.verification.engines import Array, Blocks
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.tape import Op, Ref
from eomgen.system.system import System

_BY_SIGN = {Op.ABS: "abs", Op.SIGN: "sign", Op.SELECT: "select"}
_BY_ORDER = {Op.MIN: "min", Op.MAX: "max", Op.LT: "comparison", Op.LE: "comparison"}  # a > b is b < a on the tape
#: Functions whose derivative is unbounded at some argument inside their domain or at its edge, and that argument's distance.
_UNBOUNDED: dict[Op, tuple[str, Callable[[Array, Array], Array]]] = {
    Op.SQRT: ("sqrt", lambda x, _: np.abs(x)),
    Op.POW: ("power", lambda x, _: np.abs(x)),
    Op.LOG: ("log", lambda x, _: np.abs(x)),
    Op.ASIN: ("asin", lambda x, _: np.abs(np.abs(x) - 1.0)),
    Op.ACOS: ("acos", lambda x, _: np.abs(np.abs(x) - 1.0)),
    Op.ATAN2: ("atan2", np.hypot),
    Op.DIV: ("division", lambda _, y: np.abs(y)),
}


@dataclass(frozen=True)
class Rough:
    """Operations of some functions by node, each with its name and its operands."""

    system: System
    functions: tuple[str, ...]

    def decisions(self, states: Sequence[Blocks]) -> list[str]:
        """Return what is decided in another way in one of the states than in another, in words.

        Parameters
        ----------
        states : of mappings from block to array (size,)
        """
        tape = self.system.tape
        nodes = [(node, op) for node, op in self._live() if op in _BY_SIGN or op in _BY_ORDER or op is Op.CURVE]
        values = [self._operands(nodes, state) for state in states]
        found: list[str] = []
        for number, (node, op) in enumerate(nodes):
            taken = [_decision(op, operands[number], self._breaks(node) if op is Op.CURVE else None) for operands in values]
            if any(decision != taken[0] for decision in taken):
                what = f"curve {tape.curves[tape.b[node]][0].name}" if op is Op.CURVE else _BY_SIGN.get(op) or _BY_ORDER[op]
                found.append(f"{what} in {tape.label(node) or 'the scene'}")
        return list(dict.fromkeys(found))

    def corners(self) -> list[str]:
        """Return all that may bend or jump somewhere, whether or not a state is near, in words; tables apart."""
        found = [(_BY_SIGN.get(op) or _BY_ORDER[op], node) for node, op in self._live() if op in _BY_SIGN or op in _BY_ORDER]
        return list(dict.fromkeys(f"{what} in {self.system.tape.label(node) or 'the scene'}" for what, node in found))

    def singular(self, state: Blocks) -> list[str]:
        """Return functions that are at an argument where their derivative is not bounded, in words."""
        tape = self.system.tape
        nodes = [(node, op) for node, op in self._live() if op in _UNBOUNDED]
        found = []
        for (node, op), operands in zip(nodes, self._operands(nodes, state), strict=True):
            name, distance = _UNBOUNDED[op]
            if not float(distance(operands[0], operands[-1])) > 1e-12:
                found.append(f"{name} in {tape.label(node) or 'the scene'}")
        return list(dict.fromkeys(found))

    def _live(self) -> Iterator[tuple[int, Op]]:
        tape = self.system.tape
        refs = [ref for name in self.functions for ref in self.system.functions[name].refs]
        yield from ((node, tape.op[node]) for node in tape.live(refs))

    def _operands(self, nodes: Sequence[tuple[int, Op]], state: Blocks) -> list[Array]:
        """Return the values of the operands of each node, first and last of them (SELECT: its condition)."""
        tape, refs = self.system.tape, list[Ref]()
        for node, op in nodes:
            operands = (tape.a[node],) if op is Op.CURVE else tape.operands(node)
            refs += [operands[0], operands[0] if op is Op.SELECT else operands[-1]]
        if not refs:
            return []
        needed = {symbol.block for symbol in tape.depends_on(refs)} or {"q"}
        with np.errstate(all="ignore"):
            values = evaluate(tape, refs, {name: state[name] for name in needed})
        return list(values.reshape(-1, 2))

    def _breaks(self, node: int) -> Array:
        tape = self.system.tape
        return np.asarray(tape.curves[tape.b[node]][0].breaks)


def _decision(op: Op, operands: Array, breaks: Array | None) -> float:
    if breaks is not None:
        return float(np.searchsorted(breaks, operands[0], side="right"))
    if op in _BY_SIGN:
        return float(np.sign(operands[0]))
    return float(np.sign(operands[0] - operands[1]))
