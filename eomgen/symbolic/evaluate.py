"""Evaluation of a tape without code generation: on NumPy arrays, in batches and for complex steps (Squire and Trapp
1998), or by the operations of any kind of number."""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eomgen.base.data import dataclass
from eomgen.symbolic.external import Call, call_values
from eomgen.symbolic.operations import ELEMENTARY, NAMES, InputSymbol, Op
from eomgen.symbolic.tape import Ref, Tape

if TYPE_CHECKING:
    from eomgen.symbolic.map import Map


#: Stands for the operation of a negative reference.
_NEGATIVE = 0
#: Operations as globals: looking a member up in an enumeration takes five times as long.
_CONST, _INPUT, _MAP, _CURVE = Op.CONST, Op.INPUT, Op.MAP, Op.CURVE


@dataclass(frozen=True)
class Arithmetic:
    """Operations of a tape for one kind of number: one function per Op, and the conversion of constants.

    ``side_by_side``: a pair of functions; the first packs k numbers per slot into one value on which operations act
    elementwise, the second unpacks a value computed with such values; without the pair, the elements of a
    Map are taken one after the other. ``call`` gives the results of a call of an external function.
    """

    rules: Mapping[Op, Callable[..., Any]]
    constant: Callable[[float], Any]
    side_by_side: Callable[[Sequence[Sequence[Any]]], tuple[list[Any], Callable[[Any], Any]]] | None = None
    call: Callable[[Call, Sequence[Any]], list[Any]] = call_values


def side_by_side(
    shape: tuple[int, ...], dtype: Any, slots: Sequence[Sequence[Any]]
) -> tuple[list[Any], Callable[[Any], Any]]:
    """Return one array for each slot, with its numbers as rows, and the function that gives as many rows as results. As
    ``side_by_side`` in an Arithmetic with arrays."""
    count = len(slots[0]) if slots else 0
    together = []
    for slot in slots:
        array = np.empty((count, *shape), dtype)
        for element, number in enumerate(slot):
            array[element] = number
        together.append(array)
    return together, lambda result: np.broadcast_to(result, (count, *shape))


class Evaluation:
    """References of a tape, prepared for repeated evaluation with any kind of number. Only nodes that the references
    need are visited, in order, without recursion. A Map runs element by element. A reference that occurs many times, as
    the zeros of a matrix with few entries do, is evaluated once."""

    def __init__(self, tape: Tape, refs: Iterable[Ref]) -> None:
        """Collect the live operations as steps with slots of their operands."""
        self.tape = tape
        place_of: dict[Ref, int] = {}
        self._places = [place_of.setdefault(ref, len(place_of)) for ref in refs]
        slots: dict[Ref, int] = {}
        self._slots = slots
        #: Operation, node, slots of the operands, kernel of a Map.
        self._steps: list[tuple[int, int, tuple[int, ...], Any]] = []
        gathered: set[int] = set()
        for node in tape.live(place_of):
            op, number, kernel = tape.op[node], tape.a[node], None
            operands: tuple[int, ...] = ()
            if op is not _MAP:
                operands = tuple([slots[ref] if ref in slots else self._slot(ref) for ref in tape.operands(node)])
            elif number not in gathered:  # results of a Map have the same operands: one visit keeps this linear
                gathered.add(number)
                repetition = cast("Map | Call", tape.maps[number])
                for ref in repetition.references:
                    self._slot(ref)
                if not isinstance(repetition, Call):
                    kernel = Evaluation(repetition.kernel, repetition.kernel_refs)
            slots[node] = len(self._steps)
            self._steps.append((op, node, operands, kernel))
        self._wanted = [self._slot(ref) for ref in place_of]

    def _slot(self, ref: Ref) -> int:
        """Return the slot of a reference; the negative of a node gets a slot at first use."""
        if ref not in self._slots:
            self._slots[ref] = len(self._steps)
            self._steps.append((_NEGATIVE, -ref, (self._slots[-ref],), None))
        return self._slots[ref]

    def run(
        self, leaf: Callable[[InputSymbol], Any], arithmetic: Arithmetic, visit: Callable[[int, Any], Any] | None = None
    ) -> list[Any]:
        """Return the values of the references, in order. ``leaf`` returns the value of an input symbol. ``visit`` is
        called with the node and the value of every operation, and returns the value for further operations."""
        result = self._distinct(leaf, arithmetic, visit)
        return [result[position] for position in self._places]

    def _distinct(
        self, leaf: Callable[[InputSymbol], Any], arithmetic: Arithmetic, visit: Callable[[int, Any], Any] | None = None
    ) -> list[Any]:
        """Return the values of the distinct references, by first occurrence; arguments are as of ``run``."""
        tape, slots = self.tape, self._slots
        rules: dict[int, Callable[..., Any]] = {int(op): rule for op, rule in arithmetic.rules.items()}
        values: list[Any] = []
        of_maps: dict[int, list[Any]] = {}

        def value(ref: Ref) -> Any:
            return values[slots[ref]]

        for op, node, operands, kernel in self._steps:
            rule, number = rules.get(op), tape.a[node]
            if rule is not None:
                more = tape.curves[tape.b[node]] if op == _CURVE else ()
                result = rule(*[values[slot] for slot in operands], *more)
                values.append(result if visit is None else visit(node, result))
            elif op == _NEGATIVE:
                values.append(-values[operands[0]])
            elif op == _CONST:
                values.append(arithmetic.constant(tape.constants[number]))
            elif op == _INPUT:
                values.append(leaf(tape.inputs[number]))
            else:
                if number not in of_maps:
                    repetition = cast("Map | Call", tape.maps[number])
                    if isinstance(repetition, Call):
                        of_maps[number] = arithmetic.call(repetition, [value(ref) for ref in repetition.operands])
                    else:
                        of_maps[number] = _run_map(repetition, kernel, value, arithmetic)
                values.append(of_maps[number][tape.b[node]])
        return [values[slot] for slot in self._wanted]

    def on_arrays(self, inputs: Mapping[str, ArrayLike]) -> NDArray[Any]:
        """Return the values over NumPy arrays, (..., references), as ``evaluate`` does."""
        arrays: dict[str, NDArray[Any]] = {}
        for name, value in inputs.items():
            array = np.asarray(value)
            array = array if np.issubdtype(array.dtype, np.inexact) else array.astype(np.float64)
            arrays[name] = array[np.newaxis] if array.ndim == 0 else array
        shape = np.broadcast_shapes(*(array.shape[:-1] for array in arrays.values()))
        dtype = np.result_type(*(array.dtype for array in arrays.values())) if arrays else np.dtype(np.float64)

        def leaf(symbol: InputSymbol) -> Any:
            size = arrays[symbol.block].shape[-1] if symbol.block in arrays else 0
            check_component(symbol, size)
            return arrays[symbol.block][..., symbol.index][()]

        results = self._distinct(leaf, Arithmetic(_NUMPY_RULES, dtype.type, partial(side_by_side, shape, dtype)))
        output = np.empty((*shape, len(results)), dtype)
        for position, result in enumerate(results):
            output[..., position] = result
        return output if len(results) == len(self._places) else output[..., self._places]


def run(
    tape: Tape,
    refs: Iterable[Ref],
    leaf: Callable[[InputSymbol], Any],
    arithmetic: Arithmetic,
    visit: Callable[[int, Any], Any] | None = None,
) -> list[Any]:
    """Evaluate references of a tape once with any kind of number, and return the values; see ``Evaluation.run``."""
    return Evaluation(tape, refs).run(leaf, arithmetic, visit)


def _run_map(repetition: Map, kernel: Evaluation, value: Callable[[Ref], Any], arithmetic: Arithmetic) -> list[Any]:
    """Return the results of a Map in order: sums, final carries, rows of each element. ``value`` returns the value of
    an outer reference. Elements are evaluated side by side if the arithmetic can and the Map has no carries, else one
    after the other."""
    shared = [value(ref) for ref in repetition.shared]
    if arithmetic.side_by_side is not None and (repetition.elements or repetition.gather) and not repetition.last:
        return _run_at_once(repetition, kernel, shared, value, arithmetic, arithmetic.side_by_side)
    carry = [value(ref) for ref in repetition.initial]
    sums = [arithmetic.constant(0.0) for _ in repetition.sums]
    stacked: list[Any] = []
    for element in range(repetition.count):
        blocks = {
            "element": [arithmetic.constant(column[element]) for column in repetition.elements],
            "shared": shared,
            "gather": [value(slot[element]) for slot in repetition.gather],
            "carry": carry,
        }
        terms, carry, rows = repetition.split_kernel(kernel.run(_leaves(blocks), arithmetic))
        sums = [total + term for total, term in zip(sums, terms, strict=True)]
        stacked += rows
    return [*sums, *carry, *stacked]


def _run_at_once(
    repetition: Map,
    kernel: Evaluation,
    shared: Sequence[Any],
    value: Callable[[Ref], Any],
    arithmetic: Arithmetic,
    side_by_side: Callable[[Sequence[Sequence[Any]]], tuple[list[Any], Callable[[Any], Any]]],
) -> list[Any]:
    """Return the results of a Map without carries, with all elements evaluated side by side: sums, then the rows of
    each element in turn. Sums are added in the order of the elements. The Map must have ``elements`` or ``gather``."""
    constants = [[arithmetic.constant(number) for number in column] for column in repetition.elements]
    gathered = [[value(ref) for ref in slot] for slot in repetition.gather]
    together, apart = side_by_side([*constants, *gathered])
    blocks = {"element": together[: len(constants)], "shared": shared, "gather": together[len(constants) :]}
    results = [apart(result) for result in kernel.run(_leaves(blocks), arithmetic)]
    terms, _, rows = repetition.split_kernel(results)
    sums = [arithmetic.constant(0.0) for _ in repetition.sums]
    for k, parts in enumerate(terms):
        for element in range(repetition.count):
            sums[k] = sums[k] + parts[element]
    return [*sums, *(row[element] for element in range(repetition.count) for row in rows)]


def _leaves(blocks: Mapping[str, Sequence[Any]]) -> Callable[[InputSymbol], Any]:
    return lambda symbol: blocks[symbol.block][symbol.index]


def evaluate(tape: Tape, refs: Sequence[Ref], inputs: Mapping[str, ArrayLike]) -> NDArray[Any]:
    """Evaluate references over NumPy arrays.

    Parameters
    ----------
    tape, refs
        Outputs to evaluate.
    inputs : mapping from block name to array (..., size)
        A number stands for a block of size 1. Leading axes broadcast. Integers become doubles, other types are kept.

    Returns
    -------
    array (..., len(refs))
        With complex inputs, ABS, SIGN, MIN, MAX, LT, LE and SELECT decide on real parts, and ATAN2 is the analytic
        function, as complex-step differentiation requires. Outside a function's domain the result is NumPy's nan, with
        a warning of NumPy.

    Raises
    ------
    ValueError
        When a block is missing or too short, with the name of the block.
    """
    return Evaluation(tape, refs).on_arrays(inputs)


def check_component(symbol: InputSymbol, size: int) -> None:
    """Raise ValueError if an input block of a given size lacks the component of a symbol."""
    if symbol.index >= size:
        raise ValueError(
            f"the tape needs component {symbol.index} of input block '{symbol.block}', which has {size}; "
            f"try: pass inputs['{symbol.block}'] with at least {symbol.index + 1} numbers"
        )


def _numpy_sign(x: Any) -> Any:
    return np.sign(np.real(x))


def _numpy_atan2(y: Any, x: Any) -> Any:
    if not (np.iscomplexobj(x) or np.iscomplexobj(y)):
        return np.arctan2(y, x)
    steep = np.abs(np.real(y)) > np.abs(np.real(x))
    denominator = np.where(steep, y, x)
    ratio = np.arctan(np.where(steep, -x, y) / np.where(denominator == 0, 1, denominator))
    # arctan of a ratio of at most 1, plus the constant of the real arctan2's quadrant: no imaginary part is absorbed
    behind = np.where(np.real(x) < 0, np.copysign(np.pi, np.real(y)), 0.0)
    return ratio + np.where(steep, np.copysign(np.pi / 2, np.real(y)), behind)


#: The operations that Python's operators are.
ARITHMETIC = {Op.ADD: operator.add, Op.SUB: operator.sub, Op.MUL: operator.mul, Op.DIV: operator.truediv}
_NUMPY_RULES: dict[Op, Callable[..., Any]] = {
    **ARITHMETIC,
    **{op: getattr(np, row.numpy or NAMES[op]) for op, row in ELEMENTARY.items()},
    Op.POW: np.power,
    Op.ATAN2: _numpy_atan2,
    Op.ABS: lambda x: _numpy_sign(x) * x,
    Op.SIGN: _numpy_sign,
    Op.MIN: lambda x, y: np.where((np.real(x) <= np.real(y)) | np.isnan(x), x, y),
    Op.MAX: lambda x, y: np.where((np.real(y) <= np.real(x)) | np.isnan(x), x, y),
    Op.LT: lambda x, y: np.where(np.isnan(x) | np.isnan(y), np.nan, np.real(x) < np.real(y)),
    Op.LE: lambda x, y: np.where(np.isnan(x) | np.isnan(y), np.nan, np.real(x) <= np.real(y)),
    Op.SELECT: lambda condition, x, y: np.where(np.isnan(condition), np.nan, np.where(np.real(condition) != 0.0, x, y)),
    Op.CURVE: lambda x, curve, derivative: curve(x, derivative),
}
