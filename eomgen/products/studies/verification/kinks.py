"""Detection of kinks and jumps that invalidate finite differences, and the formulas that cause them.

A derivative on one side is the common value of complex steps and the closed form there, and these must agree.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from eomgen.products.studies.verification.claims.claim import Claim
from eomgen.products.studies.verification.differences import Differences
from eomgen.products.studies.verification.engines import Array, Blocks, Engine, moved
from eomgen.products.studies.verification.tolerances import BARS, Sizes
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.operations import Op
from eomgen.symbolic.tape import Ref
from eomgen.system.system import System

#: Error bars above this part of a state's size: differences are inconclusive there.
NO_DIGITS = 1e-2
#: Directions of a state that are looked along for kinks.
_LOOKED_AT = 64
#: Distance of a kink at which differences have no digits because of it.
_CLOSE = 1e-8
#: Formulas that are named, of many at once.
_NAMED = 4


class Remarks:
    """Remarks on a closed form, each with the states that it applies to."""

    def __init__(self) -> None:
        self._states: dict[tuple[str, str], dict[str, None]] = {}

    def add(self, state: str, remark: str, of: str = "") -> None:
        """Note a remark at a state, and the formula at fault, if any."""
        self._states.setdefault((remark, of), {})[state] = None

    @property
    def texts(self) -> tuple[str, ...]:
        """One sentence for each remark and its states; of many formulas the first are named."""
        alike: dict[tuple[str, tuple[str, ...]], list[str]] = {}
        for (remark, of), where in self._states.items():
            alike.setdefault((remark, tuple(where)), []).append(of)
        texts = []
        for (remark, states), formulas in alike.items():
            more = f" and {len(formulas) - _NAMED} more" if len(formulas) > _NAMED else ""
            named = f" ({', '.join(formulas[:_NAMED])}{more})" if formulas[0] else ""
            texts.append(f"{remark} at {', '.join(states)}{named}")
        return tuple(texts)


def non_smooth_entries(
    claim: Claim,
    engine: Engine,
    operations: NonSmoothOperations,
    state: Blocks,
    names: tuple[str, ...],
    value: Array,
    finite: Array,
    found: Differences,
    sizes: Sizes,
    remarks: Remarks,
) -> Array:
    """Return the entries near a kink or jump of a formula (S, R, C) that affects differences, and remark the
    formula."""
    with np.errstate(all="ignore"):
        off = np.abs(found.best - value) > BARS * found.bar + sizes.differences
    vague = finite & ~(found.bar <= NO_DIGITS * sizes.state)
    odd = off | vague | found.kink
    non_smooth = np.zeros(value.shape, bool)
    if not odd.any() or claim.directions is None:
        return non_smooth
    rates = claim.directions(state)
    count = max(rate.shape[-2] for rate in rates.values())
    for k in np.flatnonzero(odd.any(axis=(-2, -1))):
        here = {name: array[k] for name, array in state.items()}
        seen: dict[tuple[int, float], list[str]] = {}
        for row, column in np.argwhere(odd[k]):
            at = (k, row, column)
            step = float(found.step[at] if off[at] else found.kink_step[at] if found.kink[at] else _CLOSE)
            decided: list[str] = []
            for direction in [int(column)] if claim.combine is None else range(count):
                if (direction, step) not in seen and len(seen) < _LOOKED_AT:
                    seen[direction, step] = _decided(operations, engine, here, rates, int(k), direction, step)
                decided += seen.get((direction, step), [])
            non_smooth[at] = bool(decided)
            for operation in decided:
                remarks.add(names[k], "not smooth", operation)
        if (vague[k] & ~non_smooth[k]).any():
            remarks.add(names[k], "differences have no digits")
    return non_smooth


def _decided(
    operations: NonSmoothOperations,
    engine: Engine,
    here: Blocks,
    rates: Blocks,
    state: int,
    direction: int,
    step: float,
) -> list[str]:
    """Return the operations that take another branch a step before or after a state."""
    along = {}
    for name, rate in rates.items():
        of_state = rate[state] if rate.ndim == 3 else rate
        along[name] = of_state[min(direction, len(of_state) - 1)]
    return operations.decisions([moved(engine, here, along, -step), here, moved(engine, here, along, step)])


_BY_SIGN = {Op.ABS: "abs", Op.SIGN: "sign", Op.SELECT: "select"}
_BY_ORDER = {Op.MIN: "min", Op.MAX: "max", Op.LT: "comparison", Op.LE: "comparison"}  # a > b is b < a on the tape
#: Functions whose derivative is unbounded at some argument inside their domain or at its edge, and that argument's
#: distance.
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
class NonSmoothOperations:
    """Operations of some functions by node, each with its name and its operands."""

    system: System
    functions: tuple[str, ...]

    def decisions(self, states: Sequence[Blocks]) -> list[str]:
        """Return the operations that take different branches at the given states, as text.

        Parameters
        ----------
        states : of mappings from block to array (size,)
        """
        tape = self.system.tape
        nodes = [(node, op) for node, op in self._live() if op in _BY_SIGN or op in _BY_ORDER or op is Op.CURVE]
        values = [self._operands(nodes, state) for state in states]
        result: list[str] = []
        for number, (node, op) in enumerate(nodes):
            taken = [
                _decision(op, operands[number], self._breaks(node) if op is Op.CURVE else None) for operands in values
            ]
            if any(decision != taken[0] for decision in taken):
                operation = (
                    f"curve {tape.curves[tape.b[node]][0].name}"
                    if op is Op.CURVE
                    else _BY_SIGN.get(op) or _BY_ORDER[op]
                )
                result.append(f"{operation} in {tape.label(node) or 'the scene'}")
        return list(dict.fromkeys(result))

    def kinks_and_jumps(self) -> list[str]:
        """Return the operations that have a kink or jump somewhere, near a state or not, as text; curves apart."""
        result = [
            (_BY_SIGN.get(op) or _BY_ORDER[op], node) for node, op in self._live() if op in _BY_SIGN or op in _BY_ORDER
        ]
        return list(
            dict.fromkeys(f"{operation} in {self.system.tape.label(node) or 'the scene'}" for operation, node in result)
        )

    def singular(self, state: Blocks) -> list[str]:
        """Return the functions whose derivative is unbounded at their argument, as text."""
        tape = self.system.tape
        nodes = [(node, op) for node, op in self._live() if op in _UNBOUNDED]
        result = []
        for (node, op), operands in zip(nodes, self._operands(nodes, state), strict=True):
            name, distance = _UNBOUNDED[op]
            if not float(distance(operands[0], operands[-1])) > 1e-12:
                result.append(f"{name} in {tape.label(node) or 'the scene'}")
        return list(dict.fromkeys(result))

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
