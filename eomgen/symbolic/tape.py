"""The tape: an append-only, hash-consed list of operations on which all equations are recorded.

A *reference* is a nonzero integer: ``n`` is node n, ``-n`` its negative. Negation therefore has no cost, commutes
through products by itself, and reaches the C code only if a sum or an output absorbs it. Rules are local (0, 1,
sign, constant folding, order of commutative operands), so building is linear in the number of operations and
deterministic.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import reduce
from operator import or_
from typing import Any

from eomgen.base.data import dataclass, field
from eomgen.symbolic.operations import EVEN, FOLD, FOLD_TWO, LEAVES, ODD, UNARY, Counts, CurveLike, InputSymbol, Op, Ref

__all__ = ["LEAVES", "ONE", "UNARY", "ZERO", "Counts", "InputSymbol", "Op", "Ref", "Tape", "dot"]

ZERO: Ref = 1
ONE: Ref = 2
#: Second operand of constants with an unspecified value (``Tape.generic``); other constants have 0.
GENERIC = 1
#: Number of a node's operands that are references, by operation; results of Maps have the gathered references.
ARITY = [
    {Op.SELECT: 3, Op.CURVE: 1, **dict.fromkeys({Op.MAP, *LEAVES}, 0), **dict.fromkeys(UNARY, 1)}.get(op, 2)
    for op in [Op.CONST, *Op]
]
#: Operations that may vanish in the first power of their operand.
_FIRST_ORDER = frozenset({Op.ABS, Op.MAX, Op.MIN, Op.SQRT})
#: Operations as globals: looking a member up in an enumeration takes five times as long.
_ADD, _SUB, _MUL, _DIV, _CONST, _INPUT, _MAP, _CURVE, _SELECT = (
    Op.ADD,
    Op.SUB,
    Op.MUL,
    Op.DIV,
    Op.CONST,
    Op.INPUT,
    Op.MAP,
    Op.CURVE,
    Op.SELECT,
)


@dataclass
class Tape:
    """An append-only list of nodes.

    Attributes
    ----------
    op, a, b, c : lists, one entry per node (index 0 is unused)
        Operation code and operand references; for CONST ``a`` indexes ``constants``, for INPUT ``inputs``.
    blocks : list of (first node, label)
        Physical meaning of the nodes from here on; becomes comments in the C.
    names : dict
        Name of a node in the field, used for local variables in C; names are unique.
    reciprocals : bool
        Whether x/y is recorded as x (1/y), so that divisions by one number are one: derivatives of powers of distances
        divide by each three times. Overflow in 1/y then gives inf or nan.
    maps : list of Map and Call
        Loops over elements with the same operations (``map.py``), and calls of external functions (``external.py``).
    curves : list of (curve, derivative)
        Functions of one number given by tables, and the order of the derivative.
    instances : dict
        Results of subgraphs recorded repeatedly from the same references, by kind and references.
    converged : set
        Nodes with the value of a converged iteration. Derivatives take these nodes as constants: each further step that
        is recorded from these nodes on has the derivatives of the result to an order more.
    lengths : set
        Roots that are not 0 wherever the equations have a value, since values are divided by them.
    conditions : dict
        Of derivatives that are zero unless a number is not zero: these numbers by node (``branches``).
    unbounded : list
        Whether a node's value may be infinite, or not a number, at finite inputs, as far as asked for.
    """

    op: list[Op] = field(default_factory=list)
    a: list[int] = field(default_factory=list)
    b: list[int] = field(default_factory=list)
    c: list[int] = field(default_factory=list)
    constants: list[float] = field(default_factory=list)
    inputs: list[InputSymbol] = field(default_factory=list)
    blocks: list[tuple[int, str]] = field(default_factory=list)
    names: dict[int, str] = field(default_factory=dict)
    reciprocals: bool = False
    maps: list[object] = field(default_factory=list)
    curves: list[tuple[CurveLike, int]] = field(default_factory=list)
    instances: dict[tuple[object, ...], tuple[Ref, ...]] = field(default_factory=dict, repr=False)
    converged: set[int] = field(default_factory=set, repr=False)
    lengths: set[int] = field(default_factory=set, repr=False)
    conditions: dict[int, Ref] = field(default_factory=dict, repr=False)
    unbounded: list[bool] = field(default_factory=list, repr=False)
    _known: dict[tuple[int, ...], int] = field(default_factory=dict, repr=False)
    _constant_ids: dict[float, int] = field(default_factory=dict, repr=False)
    _generic: dict[tuple[object, ...], int] = field(default_factory=dict, repr=False)
    _input_ids: dict[InputSymbol, int] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        self._append(_CONST, 0, 0, 0)  # index 0 stays unused, so that a sign can be carried by the reference
        self.constants.append(math.nan)
        self.constant(0.0)
        self.constant(1.0)

    # -- leaves ---------------------------------------------------------------------------------------------------

    def constant(self, value: float) -> Ref:
        """Return the reference of a constant. Raises OverflowError for an infinite one, ValueError for NaN."""
        if math.isinf(value):
            raise OverflowError(f"a constant of a tape must be finite, not {value}")
        if not math.isfinite(value):
            raise ValueError(f"a constant of a tape must be finite, not {value}")
        magnitude = abs(float(value))
        node = self._constant_ids.get(magnitude)
        if node is None:
            node = self._append(_CONST, len(self.constants), 0, 0)
            self.constants.append(magnitude)
            self._constant_ids[magnitude] = node
        return -node if value < 0 else node

    def generic(self, value: float, *key: object) -> Ref:
        """Return the reference of a constant that is recorded as a number of any value would be.

        Zeros, ones and signs of such constants are not simplified, so that one recording is valid for many equal parts
        with different numbers. Products and sums of such constants are such constants.

        Parameters
        ----------
        key : identity of the number; constants of equal keys and value are one, constants without a key are distinct
        """
        known = (value, *key) if key else (len(self.constants),)
        node = self._generic.get(known)
        if node is None:
            node = self._generic[known] = self._append(_CONST, len(self.constants), GENERIC, 0)
            self.constants.append(float(value))
        return node

    def copied_constant(self, source: Tape, node: int) -> Ref:
        """Return the reference of a constant that is a node of another tape."""
        if source is self:
            return node
        value = source.constants[source.a[node]]
        return self.generic(value) if source.b[node] == GENERIC else self.constant(value)

    def input(self, block: str, index: int = 0) -> Ref:
        """Return the reference of component ``index`` of an input block."""
        symbol = InputSymbol(block, index)
        node = self._input_ids.get(symbol)
        if node is None:
            node = self._append(_INPUT, len(self.inputs), 0, 0)
            self.inputs.append(symbol)
            self._input_ids[symbol] = node
        return node

    def value(self, ref: Ref) -> float | None:
        """Return the number of a constant reference; None for other references, and for generic constants."""
        node = abs(ref)
        if self.op[node] is not _CONST or self.b[node] == GENERIC:
            return None
        magnitude = self.constants[self.a[node]]
        return -magnitude if ref < 0 else magnitude

    def number(self, ref: Ref) -> float | None:
        """Return the number of a constant reference, also of a generic constant; None for other references."""
        return self._number(ref) if self.op[abs(ref)] is _CONST else None

    def symbol(self, ref: Ref) -> InputSymbol | None:
        """Return the input of a reference, or None."""
        node = abs(ref)
        return self.inputs[self.a[node]] if self.op[node] is _INPUT else None

    # -- arithmetic -----------------------------------------------------------------------------------------------

    def add(self, x: Ref, y: Ref) -> Ref:
        """Return the reference of x + y, simplified for zeros and equal or opposite operands, and folded for two
        constants."""
        if abs(x) == ZERO:  # -ZERO results from negated references
            return y if abs(y) != ZERO else ZERO
        if abs(y) == ZERO:
            return x
        if x == -y:
            return ZERO
        if x == y:
            return self.mul(self.constant(2.0), x)
        op = self.op
        if op[abs(x)] is _CONST and op[abs(y)] is _CONST:
            return self._fold(_ADD, x, y, self._number(x) + self._number(y))
        first, second = (x, y) if abs(x) < abs(y) else (y, x)
        if first > 0:
            return self._node(_ADD, first, second) if second > 0 else self._node(_SUB, first, -second)
        return -self._node(_ADD, -first, -second) if second < 0 else -self._node(_SUB, -first, second)

    def sub(self, x: Ref, y: Ref) -> Ref:
        return self.add(x, -y) if y != ZERO else x

    def mul(self, x: Ref, y: Ref) -> Ref:
        """Return the reference of x y, simplified for 0, 1 and signs, folded for constants, also in y = c z."""
        if x < 0 or y < 0:
            product = self.mul(abs(x), abs(y))
            return -product if (x < 0) != (y < 0) and product != ZERO else product
        if ZERO in (x, y):
            return ZERO
        if x == ONE:
            return y
        if y == ONE:
            return x
        op_x, op_y = self.op[x], self.op[y]
        if op_x is not _CONST and op_y is not _CONST:
            return self._node(_MUL, x, y) if x < y else self._node(_MUL, y, x)
        if op_x is _CONST and op_y is _CONST:
            return self._fold(_MUL, x, y, self._number(x) * self._number(y))
        if op_y is _CONST:
            x, y, op_y = y, x, op_x
        if op_y is _MUL and self.op[self.a[y]] is _CONST:
            factor = self.a[y]
            return self.mul(self._fold(_MUL, x, factor, self._number(x) * self._number(factor)), self.b[y])
        return self._node(_MUL, x, y)

    def div(self, x: Ref, y: Ref) -> Ref:
        """Return x / y, folded if both are constants. Raises ZeroDivisionError if y is the constant 0."""
        if y == ZERO:
            raise ZeroDivisionError("division by a value that is zero by structure")
        if y < 0:
            return self._negative(self.div(x, -y))
        if x < 0:
            return self._negative(self.div(-x, y))
        if x == ZERO or y == ONE:
            return x
        if x == y:
            return ONE
        if self.op[y] is _CONST:
            if self.op[x] is _CONST:
                return self._fold(_DIV, x, y, self._number(x) / self._number(y))
            return self.mul(self._fold(_DIV, ONE, y, 1.0 / self._number(y)), x)
        if self.reciprocals and x != ONE:
            return self.mul(x, self._node(_DIV, ONE, y))
        return self._node(_DIV, x, y)

    def call(self, op: Op, x: Ref, y: Ref = 0) -> Ref:
        """Record a function of one or two arguments, folded for constants, and return the reference. Raises ValueError
        for a constant outside the function's domain."""
        if op in UNARY:
            number = self.value(x)
            if number is not None:
                return self.constant(FOLD[op](number))
            if op is Op.SQRT and x > 0 and self.op[x] is _MUL and self.a[x] == self.b[x] == flat_zero(self, self.a[x]):
                return self.a[x]  # the root of the square of a number that is never negative
            if x < 0 and op in ODD:
                return -self._node(op, -x)
            return self._node(op, abs(x) if op in EVEN else x)
        if op is Op.POW:
            return self._power(x, y)
        first, second = self.value(x), self.value(y)
        if first is not None and second is not None:
            return self.constant(FOLD_TWO[op](first, second))
        if op in (Op.MIN, Op.MAX):
            if x == y:
                return x
            x, y = (x, y) if x < y else (y, x)
        return self._node(op, x, y)

    def select(self, condition: Ref, then: Ref, otherwise: Ref) -> Ref:
        """Return the reference of a choice: ``then`` if the condition is not zero, else ``otherwise``; both are always
        evaluated. For a constant condition or equal branches it is the branch itself."""
        if then == otherwise:
            return then
        number = self.value(condition)
        if number is not None:
            return then if number != 0.0 else otherwise
        return self._node(_SELECT, condition, then, otherwise)

    def map_result(self, map_number: int, result: int) -> Ref:
        """Return the reference of one scalar result of a Map that is on this tape."""
        return self._node(_MAP, map_number, result)

    def curve(self, curve: CurveLike, derivative: int, x: Ref) -> Ref:
        """Return a derivative (0: the value) of a curve at x. Raises ValueError if a constant x is outside of the
        curve."""
        number = self.value(x)
        if number is not None:
            return self.constant(float(curve(number, derivative)))
        position = next(
            (k for k, (candidate, order) in enumerate(self.curves) if candidate is curve and order == derivative), None
        )
        if position is None:
            position = len(self.curves)
            self.curves.append((curve, derivative))
        return self._node(_CURVE, x, position)

    def root_slope(self, x: Ref, root: Ref) -> Ref:
        """Return the slope 1 / (2 root) of the square root ``root`` of x, a reference: 0 if ``flat_zero(x)`` is known
        and 0, and infinite at other zeros and for roots in ``lengths``."""
        half = self.constant(0.5)
        return self.div(half, root) if root in self.lengths else quotient(self, half, root, x)

    def power(self, x: Ref, exponent: int) -> Ref:
        """Return x to an integer exponent, which may be negative, by repeated squaring."""
        if exponent < 0:
            return self.div(ONE, self.power(x, -exponent))
        result, square = ONE, x
        while exponent:
            if exponent & 1:
                result = self.mul(result, square)
            exponent >>= 1
            if exponent:
                square = self.mul(square, square)
        return result

    def _power(self, x: Ref, y: Ref) -> Ref:
        base, exponent = self.value(x), self.value(y)
        if exponent is not None:
            if exponent == int(exponent) and abs(exponent) <= 64:
                return self.power(x, int(exponent))
            if exponent == 0.5:
                return self.call(Op.SQRT, x)
            if base is not None:
                return self.constant(math.pow(base, exponent))
        return self._node(Op.POW, x, y)

    # -- structure ------------------------------------------------------------------------------------------------

    @contextmanager
    def block(self, label: str) -> Iterator[None]:
        """Name the physical meaning of the operations recorded inside."""
        previous = self.blocks[-1][1] if self.blocks else ""
        self.blocks.append((len(self.op), label))
        yield
        self.blocks.append((len(self.op), previous))

    def name(self, ref: Ref, text: str) -> None:
        """Name the operation of a reference (not a leaf), ``minus_text`` if the reference is negative; the first name
        stays."""
        if self.op[abs(ref)] in LEAVES or abs(ref) in self.names:
            return
        negative = text.removeprefix("minus_") if text.startswith("minus_") else f"minus_{text}"
        self.names[abs(ref)] = text if ref > 0 else negative

    def operands(self, node: int) -> tuple[int, ...]:
        """Return the operand references of a node; leaves have none; for results of a Map, the references that the Map
        gathers."""
        op = self.op[node]
        count = ARITY[op]
        if count == 2:
            return (self.a[node], self.b[node])
        if count == 1:
            return (self.a[node],)
        if count == 3:
            return (self.a[node], self.b[node], self.c[node])
        # maps hold Map, which knows Tape
        return tuple(self.maps[self.a[node]].references) if op is _MAP else ()  # type: ignore[attr-defined]

    def live(self, outputs: Iterable[Ref]) -> list[int]:
        """Return the numbers of all nodes that the outputs depend on, outputs included, in ascending order."""
        needed = bytearray(len(self.op))
        gathered_maps: set[int] = set()
        for ref in set(outputs):  # whole matrices have many zeros
            needed[abs(ref)] = 1
        op, a, b, c = self.op, self.a, self.b, self.c
        nodes: list[int] = []
        node = needed.rfind(1, 1)
        while node > 0:  # operands precede their operations
            nodes.append(node)
            count = ARITY[op[node]]
            if count == 2:
                needed[abs(a[node])] = 1
                needed[abs(b[node])] = 1
            elif count == 1:
                needed[abs(a[node])] = 1
            elif count == 3:
                needed[abs(a[node])] = needed[abs(b[node])] = needed[abs(c[node])] = 1
            elif op[node] is _MAP and a[node] not in gathered_maps:
                gathered_maps.add(a[node])  # results of a Map have the same operands: one visit keeps this linear
                for ref in self.operands(node):
                    needed[abs(ref)] = 1
            node = needed.rfind(1, 1, node)
        nodes.reverse()
        return nodes

    def depends_on(self, outputs: Iterable[Ref]) -> set[InputSymbol]:
        """Return the input symbols that the outputs depend on by structure."""
        return {self.inputs[self.a[node]] for node in self.live(outputs) if self.op[node] is _INPUT}

    def blocks_read(self, outputs: Mapping[str, Sequence[Ref]]) -> dict[str, set[str]]:
        """Return the names of the input blocks on which groups of outputs depend by structure, by name of the group.

        Parameters
        ----------
        outputs : mapping
            References of each group by the group's name.
        """
        bits = {block: 1 << index for index, block in enumerate(dict.fromkeys(symbol.block for symbol in self.inputs))}
        a, b = self.a, self.b
        reads = [0] * len(self.op)
        of_maps: dict[int, int] = {}
        for node, op in enumerate(self.op):
            count = ARITY[op]
            if count == 2:
                reads[node] = reads[abs(a[node])] | reads[abs(b[node])]
            elif count == 1:
                reads[node] = reads[abs(a[node])]
            elif op is _INPUT:
                reads[node] = bits[self.inputs[a[node]].block]
            elif op is _MAP and a[node] in of_maps:
                reads[node] = of_maps[a[node]]
            elif op not in LEAVES:
                for ref in self.operands(node):
                    reads[node] |= reads[abs(ref)]
                if op is _MAP:
                    of_maps[a[node]] = reads[node]
        read = {name: reduce(or_, {reads[abs(ref)] for ref in refs}, 0) for name, refs in outputs.items()}
        return {name: {block for block, bit in bits.items() if bit & mask} for name, mask in read.items()}

    def counts(self, outputs: Iterable[Ref]) -> Counts:
        """Return the operation counts of outputs: a Map's kernel once per element, operations shared by Maps once."""
        total = Counts()
        live = self.live(outputs)
        tally = Counter([self.op[node] for node in live])
        # Maps, which know Tape
        maps: dict[int, Any] = {self.a[node]: self.maps[self.a[node]] for node in live if self.op[node] is _MAP}
        del tally[_MAP]
        for loop, _ in next(iter(maps.values())).together(maps) if maps else ():
            total = total + loop.counts()
        functions = sum(tally[op] for op in UNARY) + tally[Op.POW] + tally[Op.ATAN2] + tally[_CURVE]
        selections = tally[Op.MIN] + tally[Op.MAX] + tally[Op.LT] + tally[Op.LE] + tally[_SELECT]
        statements = sum(count for op, count in tally.items() if op not in LEAVES)
        return total + Counts(tally[_ADD] + tally[_SUB], tally[_MUL], tally[_DIV], functions, selections, statements)

    def label(self, node: int) -> str:
        """Return the physical meaning under which a node was recorded."""
        return self.label_range(node)[2]

    def label_range(self, node: int) -> tuple[int, int, str]:
        """Return (first node, node after the last, label) of the range of nodes that have the label of a node."""
        position = bisect_right(self.blocks, (node, "\U0010ffff")) - 1
        end = self.blocks[position + 1][0] if position + 1 < len(self.blocks) else len(self.op)
        begin, label = self.blocks[position] if position >= 0 else (0, "")
        return begin, end, label

    # -- internals ------------------------------------------------------------------------------------------------

    def _number(self, ref: Ref) -> float:
        magnitude = self.constants[self.a[abs(ref)]]
        return -magnitude if ref < 0 else magnitude

    def _fold(self, op: Op, x: Ref, y: Ref, value: float) -> Ref:
        """Return the constant computed from two constants, generic if an operand is generic."""
        if GENERIC in (self.b[abs(x)], self.b[abs(y)]):
            return self.generic(value, op, x, y)
        return self.constant(value)

    def _negative(self, ref: Ref) -> Ref:
        return ref if ref == ZERO else -ref

    def _append(self, op: Op, a: int, b: int, c: int) -> int:
        self.op.append(op)
        self.a.append(a)
        self.b.append(b)
        self.c.append(c)
        return len(self.op) - 1

    def _node(self, op: Op, a: int, b: int = 0, c: int = 0) -> int:
        key = (op, a, b, c)
        node = self._known.get(key)
        if node is None:
            node = self._known[key] = self._append(op, a, b, c)
        return node


def dot(tape: Tape, x: Sequence[Ref], y: Sequence[Ref]) -> Ref:
    """Return the inner product of two sequences of references."""
    total = ZERO
    for first, second in zip(x, y, strict=True):
        total = tape.add(total, tape.mul(first, second))
    return total


def record(tape: Tape, op: Op, operands: Sequence[Ref]) -> Ref:
    """Record an operation by its code on the operands, and return the reference; not for leaves, Maps and curves."""
    return _RECORDED[op](tape, *operands) if op in _RECORDED else tape.call(op, *operands)


#: Operations with rules of their own.
_RECORDED: Mapping[Op, Callable[..., Ref]] = {
    _ADD: Tape.add,
    _SUB: Tape.sub,
    _MUL: Tape.mul,
    _DIV: Tape.div,
    _SELECT: Tape.select,
}


def record_node(tape: Tape, source: Tape, node: int, operands: Sequence[Ref]) -> Ref:
    """Record the operation of a node of a source tape, which is not a leaf, loop or call, on operands of ``tape``, and
    return the reference."""
    if source.op[node] is _CURVE:
        return tape.curve(*source.curves[source.b[node]], operands[0])
    return record(tape, source.op[node], operands)


# -- edges of domains: see ``edges`` -----------------------------------------------------------------------------------


def flat_zero(tape: Tape, x: Ref) -> Ref | None:
    """Return the reference of a number that is zero only if x and all first derivatives of x are zero; None if none is
    known. Squares, absolute values, max(0, y) and min(0, y), which are 0 beyond the edge, and sums, products and roots
    of such numbers have one by their structure. The number is never negative."""
    node = abs(x)
    op, a, b = tape.op[node], tape.a[node], tape.b[node]
    if op in (Op.ADD, Op.SUB):
        return _flat_sum(tape, node)
    if op is Op.MUL:
        return _flat_product(tape, node)
    if op is Op.ABS or (op is Op.MAX and ZERO in (a, b)):
        return node
    if op is Op.MIN and ZERO in (a, b):
        return -node
    if op in (Op.DIV, Op.POW):
        return flat_zero(tape, a)
    if op is Op.SQRT:
        return node if flat_zero(tape, a) == a else flat_zero(tape, a)
    if op is Op.SELECT:
        branches = [ZERO if ref == ZERO else flat_zero(tape, ref) for ref in (b, tape.c[node])]
        if branches == [None, None]:
            return None
        then, otherwise = (ONE if ref is None else ref for ref in branches)
        return tape.select(a, then, otherwise)
    return None


def _flat_product(tape: Tape, node: Ref) -> Ref | None:
    """Return the result of ``flat_zero`` for a product node."""
    a, b = tape.a[node], tape.b[node]
    if a == b:  # a root of a fourth power has second derivatives, which a selected slope would not have
        return node if tape.op[a] in _FIRST_ORDER or flat_zero(tape, a) is None else None
    second = flat_zero(tape, b)
    if tape.op[a] is Op.CONST:
        return node if second == b and tape.value(a) is not None else second
    first = flat_zero(tape, a)
    if first is None or second is None:
        return second if first is None else first
    return node if (first, second) == (a, b) else tape.mul(first, second)


def _flat_sum(tape: Tape, node: Ref) -> Ref | None:
    """Return the result of ``flat_zero`` for a sum or difference; None if it is None for one of the terms. Iterative,
    since sums may have many terms."""
    terms, pending, positive = list[Ref](), [node], True
    while pending:
        ref = pending.pop()
        if tape.op[abs(ref)] in (Op.ADD, Op.SUB):
            first, second = tape.operands(abs(ref))
            second = -second if tape.op[abs(ref)] is Op.SUB else second
            pending += [second, first] if ref > 0 else [-second, -first]
            continue
        flat = flat_zero(tape, ref)
        if flat is None:
            return None
        positive = positive and flat == ref
        terms.append(flat)
    if positive:
        return node
    total = ZERO
    for term in terms:
        total = tape.add(total, term)
    return total


def quotient(tape: Tape, numerator: Ref, divisor: Ref, x: Ref) -> Ref:
    """Record numerator / divisor; 0 if ``flat_zero`` of x is known and 0, and infinite or not a number at other zeros.
    The divisor must be 0 only with x."""
    flat = flat_zero(tape, x)
    if flat is None:
        return tape.div(numerator, divisor)
    regular = tape.call(Op.LT, ZERO, flat)
    return tape.select(regular, tape.div(numerator, tape.select(regular, divisor, ONE)), ZERO)
