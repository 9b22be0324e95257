"""Loop rerolling: repeated sequences of operations on the tape, as in chains of identical bodies, become loops with
a body and indices of each iteration.

Recursions over bodies record the same operations for each body in turn. If a sequence of operation codes repeats
with some period, one period becomes the body of a loop. Operands within the same iteration are locals, all others are
workspace or array entries at looked-up indices. Repeats are found by hashes of windows (Karp and Rabin 1987).

The body is scheduled as a separate function; its inputs are the values that it reads from outside the iteration.
Equally spaced indices become start + step k, all others a table.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from itertools import chain, groupby, pairwise
from operator import itemgetter
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from eomgen.base.data import dataclass
from eomgen.codegen.program import Expression, Statement
from eomgen.codegen.scheduling.stretches import FEWEST, repetitions
from eomgen.symbolic.operations import Op
from eomgen.symbolic.tape import ARITY, Ref, Tape, record
from eomgen.system.system import INPUT_BLOCKS, WHOLE, Sample

#: Least number of operations that a loop removes from the text.
MINIMUM_SAVED = 150

#: Input blocks that are not arrays: structs and a number, with components that a loop cannot index.
UNINDEXED = frozenset({"p", "t", "base"})
#: Input blocks of a model's functions that a loop can index.
_ARRAYS = frozenset(INPUT_BLOCKS) - UNINDEXED
#: Operations as globals: looking a member up in an enumeration takes five times as long.
_CONST, _INPUT, _MAP, _CURVE, _SIN, _COS = Op.CONST, Op.INPUT, Op.MAP, Op.CURVE, Op.SIN, Op.COS


@dataclass(frozen=True)
class RerolledLoop:
    """A loop; ``iterations[k][j]`` is the tape node of operation j in iteration k."""

    iterations: tuple[tuple[int, ...], ...]

    @property
    def period(self) -> int:
        return len(self.iterations[0])


def find_loops(tape: Tape, live: Sequence[int], sample: Sample = WHOLE) -> list[RerolledLoop]:
    """Return the loops in a sequence of live tape nodes, in order and disjoint; no loop contains the result of a Map.

    Sines and cosines of inputs are left out, since other loops compute these.

    Parameters
    ----------
    sample : the longer scene for which the saved operations are judged, if the tape belongs to a shorter sample
    """
    loops = []

    def judge(_: int, period: int, length: int) -> tuple[int, int]:
        iterations = length // period + 1
        saved = (sample.iterations(iterations) - 1) * period
        return iterations, saved if saved >= MINIMUM_SAVED else 0

    for is_map, nodes in groupby(live, lambda node: tape.op[node] is _MAP):
        if is_map:
            continue
        fixed = [node for node in nodes if not is_circular(tape, node)]
        for start, period, iterations in sorted(repetitions(_codes(tape, fixed), (24,), judge)):
            groups = [tuple(fixed[start + k * period : start + (k + 1) * period]) for k in range(iterations)]
            loop = _consistent(tape, groups, sample)
            if loop is not None:
                loops.append(loop)
    return loops


def is_circular(tape: Tape, node: int) -> bool:
    """Return whether a node is a sine or cosine of an input; one loop evaluates all sines and cosines of inputs."""
    return tape.op[node] in (_SIN, _COS) and tape.op[abs(tape.a[node])] is _INPUT


def _codes(tape: Tape, nodes: Sequence[int]) -> NDArray[np.uint64]:
    """Return an integer for each operation, (len(nodes),). Integers are equal for operations with equal operation code
    and with operands of equal signs and kinds: number, input block (for scalars and structs the component, too) or
    other value."""
    numbers: dict[tuple[object, ...], int] = {}

    def kind(ref: Ref) -> object:
        node = abs(ref)
        op = tape.op[node]
        if op is _CONST:
            return "number"
        if op is _INPUT:
            symbol = tape.inputs[tape.a[node]]
            return (symbol.block if symbol.block in _ARRAYS else symbol, ref < 0)
        return ref < 0

    def key(node: int) -> tuple[object, ...]:
        curve = node if tape.op[node] is _CURVE else 0  # the number of a curve is not an operand
        return (tape.op[node], curve, *map(kind, tape.operands(node)))

    return np.array([numbers.setdefault(key(node), len(numbers)) for node in nodes], dtype=np.uint64)


def _consistent(tape: Tape, iterations: Sequence[tuple[int, ...]], sample: Sample) -> RerolledLoop | None:
    """Return the loop of the longest run of iterations around the middle one whose local operands are at equal
    positions. ``iterations`` holds the nodes of each candidate iteration. None if the run has fewer than
    ``FEWEST`` iterations or saves fewer than ``MINIMUM_SAVED`` operations in the longer scene
    ``sample``."""
    alike = _alike(tape, np.array(iterations, dtype=np.int64))
    first = last = len(iterations) // 2
    while first > 0 and alike[first - 1]:
        first -= 1
    while last + 1 < len(iterations) and alike[last + 1]:
        last += 1
    kept = iterations[first : last + 1]
    saved = (sample.iterations(len(kept)) - 1) * len(kept[0])
    return RerolledLoop(tuple(kept)) if len(kept) >= FEWEST and saved >= MINIMUM_SAVED else None


def _alike(tape: Tape, nodes: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return for each iteration, shape (count,), whether operands within the iteration are at the same positions as in
    the middle iteration. ``nodes`` are the tape nodes, (count, period); operands from outside do not count."""
    count, period = nodes.shape
    low = int(nodes.min())
    position = np.full(int(nodes.max()) - low + 1, -1, dtype=np.int64)
    position[nodes - low] = np.arange(count * period).reshape(count, period)
    arity = np.array([ARITY[tape.op[node]] for node in nodes[0]])
    result = np.ones(count, dtype=bool)
    flat = nodes.ravel().tolist()
    for number, column in enumerate((tape.a, tape.b, tape.c)):
        taken = arity > number
        if not np.any(taken):
            break
        refs = np.abs(np.array([column[node] for node in flat], dtype=np.int64).reshape(count, period)[:, taken])
        inside = (refs >= low) & (refs < low + len(position))
        at = np.where(inside, position[np.where(inside, refs - low, 0)], -1)
        local = np.where(at // period == np.arange(count)[:, np.newaxis], at % period, -1)
        result &= np.all(local == local[count // 2], axis=1)
    return result


#: The block of an iteration's inputs.
READ = "read"

#: Output number, component, sign, operation.
Unmatched = tuple[int, int, int, int]
#: Position in the iteration, output number, sign, component in each iteration.
Column = tuple[int, int, int, list[int]]


@dataclass(frozen=True)
class Iteration:
    """The body of a rerolled loop, with the rules by which inputs and results depend on the number of the iteration.

    Attributes
    ----------
    kernel, results : operations of the body, with inputs in block ``read``, and the references stored to ``given``
    read, given : expressions of the iteration number (see ``program.Statement``, kind ``repeat``)
    exports : positions in the body of operations that are stored in the workspace
    first : workspace index of the first export of iteration 0; the n exports of iteration k start at ``first + n k``
    unmatched : outputs not stored alike by all iterations, which are copied from the workspace
    """

    kernel: Tape
    results: tuple[Ref, ...]
    read: tuple[Expression, ...]
    given: tuple[Expression, ...]
    exports: tuple[int, ...]
    first: int
    unmatched: tuple[Unmatched, ...]


class LoopServices(Protocol):
    """The services of the enclosing function that a loop uses, as of ``Scheduler``."""

    def reserve(self, count: int) -> int: ...
    def leaf(self, ref: Ref) -> Expression: ...
    def slot(self, node: int) -> int: ...


Stores = Mapping[int, Sequence[tuple[int, int, int]]]


def copies(expressions: Sequence[Any], output: int | Literal["w"], components: Sequence[int]) -> Any:
    """Return the data of a ``repeat`` statement that copies values to components of output number ``output``, or of
    the workspace.
    ``expressions`` are the values, one for each of ``components``: all constants, all workspace slots, or all
    components of one input block, without or all with a minus. None for other or mixed expressions."""
    if minus := all(isinstance(item, tuple) and item[0] == "neg" for item in expressions):
        expressions = [item for _, item in expressions]
    heads = {item[:-1] if isinstance(item, tuple) else () for item in expressions}
    if len(heads) > 1 or not (head := heads.pop()) or head[0] not in ("K", "w", "in"):
        return None
    last = [item[-1] for item in expressions]
    read = ("numbers", tuple(last)) if head == ("K",) else ("row", head[-1], *rule(last))
    copied = Statement("out", (0, 0, ("in", READ, 0)))
    return (len(components), (copied,), (("neg", read) if minus else read,), (("row", output, *rule(components)),))


def loop_iteration(
    tape: Tape, loop: RerolledLoop, read_outside: set[int], stores: Stores, values: LoopServices
) -> Iteration:
    """Return the body of a loop and the rules of its indices; workspace for the exports is reserved by ``values``.

    Parameters
    ----------
    read_outside : operations that the rest of the function reads
    stores : places of stored operations: output number, component, sign
    values : the function that contains the loop, for slots and expressions of values from outside the loop
    """
    iterations = loop.iterations
    position_of = {node: (k, j) for k, iteration in enumerate(iterations) for j, node in enumerate(iteration)}
    columns, left = match_stores(iterations, stores)
    unmatched = [item for _, item in sorted(chain.from_iterable(left), key=itemgetter(0))]
    exports = _exports(tape, iterations, position_of, read_outside.union(node for *_, node in unmatched))
    first = values.reserve(len(exports) * len(iterations))
    row = {j: number for number, j in enumerate(exports)}
    kernel = Tape()
    kernel_refs: list[Ref] = []
    read: list[Expression] = []
    inputs: dict[Expression, Ref] = {}

    def slot(node: int) -> int:
        if node in position_of:
            iteration, position = position_of[node]
            return first + len(exports) * iteration + row[position]
        return values.slot(node)

    for j in range(loop.period):
        label = tape.label(iterations[0][j])
        if label and (not kernel.blocks or kernel.blocks[-1][1] != f"{label}, and so on"):
            kernel.blocks.append((len(kernel.op), f"{label}, and so on"))
        taken: list[Ref] = []
        for number, ref in enumerate(tape.operands(iterations[0][j])):
            refs = [tape.operands(iteration[j])[number] for iteration in iterations]
            if (position := _position_within(refs, position_of)) is not None:
                taken.append(kernel_refs[position] if ref > 0 else -kernel_refs[position])
            elif len(set(refs)) == 1 and (value := tape.number(ref)) is not None:
                taken.append(kernel.constant(value))
            else:
                expression = _read(tape, refs, values, slot)
                if expression not in inputs:
                    inputs[expression] = kernel.input(READ, len(read))
                    read.append(expression)
                taken.append(inputs[expression])
        kernel_refs.append(record(kernel, tape.op[iterations[0][j]], taken))

    targets: list[Expression] = [("row", "w", first + row[j], len(exports)) for j in exports]
    results = [kernel_refs[j] for j in exports]
    for j, output, sign, components in columns:
        targets.append(("row", output, *rule(components)))
        results.append(sign * kernel_refs[j])
    return Iteration(kernel, tuple(results), tuple(read), tuple(targets), exports, first, tuple(unmatched))


#: From an operation of a loop to its iteration and its position there.
_Positions = Mapping[int, tuple[int, int]]


def _exports(
    tape: Tape, iterations: Sequence[Sequence[int]], position_of: _Positions, read_outside: Collection[int]
) -> tuple[int, ...]:
    """Return the positions of the operations that other iterations or the rest of the function read."""
    kept: set[int] = set()
    for k, iteration in enumerate(iterations):
        kept.update(j for j, node in enumerate(iteration) if node in read_outside)
        reached = (position_of.get(abs(ref), (k, 0)) for node in iteration for ref in tape.operands(node))
        kept.update(position for number, position in reached if number != k)
    return tuple(sorted(kept))


def _position_within(refs: Sequence[Ref], position_of: _Positions) -> int | None:
    """Return the position of an operand, one reference for each iteration, that the iteration computes itself; None
    for others."""
    number, position = position_of.get(abs(refs[0]), (-1, -1))
    return position if number == 0 and position_of.get(abs(refs[-1])) == (len(refs) - 1, position) else None


def match_stores(
    repeats: Sequence[Sequence[int]], stores: Stores
) -> tuple[list[Column], list[list[tuple[int, Unmatched]]]]:
    """Return the stores to outputs that all repeats of some operations make alike, and for each repeat the others with
    their positions. ``repeats`` are the nodes of each repeat. Stores are alike if the operation at one position goes to
    the same output with the same sign in all repeats; the component may vary."""
    columns: list[Column] = []
    left: list[list[tuple[int, Unmatched]]] = [[] for _ in repeats]
    for j in range(len(repeats[0])):
        stored = [
            sorted((number, sign, component) for number, component, sign in stores.get(nodes[j], ()))
            for nodes in repeats
        ]
        if len({tuple(item[:2] for item in items) for items in stored}) == 1:
            for index, (number, sign, _) in enumerate(stored[0]):
                columns.append((j, number, sign, [items[index][2] for items in stored]))
            continue
        for others, nodes in zip(left, repeats, strict=True):
            others += [(j, (*store, nodes[j])) for store in stores.get(nodes[j], ())]
    return columns, left


def _read(tape: Tape, refs: Sequence[Ref], values: LoopServices, slot: Callable[[int], int]) -> Expression:
    """Return an operand of all iterations as an expression of the iteration number k. ``refs`` is the operand in each
    iteration; ``slot`` gives the workspace index of a node. Equal references give the expression of the shared value;
    constants a table; inputs and workspace values a row of indices."""
    if len(set(refs)) == 1:
        return values.leaf(refs[0])
    if tape.op[abs(refs[0])] is Op.CONST:
        return ("numbers", tuple((1.0 if ref > 0 else -1.0) * tape.constants[tape.a[abs(ref)]] for ref in refs))
    if tape.op[abs(refs[0])] is Op.INPUT:
        symbols = [tape.inputs[tape.a[abs(ref)]] for ref in refs]
        row = ("row", symbols[0].block, *rule([symbol.index for symbol in symbols]))
    else:
        row = ("row", "w", *rule([slot(abs(ref)) for ref in refs]))
    return ("neg", row) if refs[0] < 0 else row


def rule(indices: Sequence[int]) -> tuple[object, ...]:
    """Return (start, step) for equally spaced indices, (index, 0) for one, else ((index, index, ...),), a table."""
    if len(indices) == 1:
        return (indices[0], 0)
    step = indices[1] - indices[0]
    if all(after - before == step for before, after in pairwise(indices)):
        return (indices[0], step)
    return (tuple(indices),)


def runs(pairs: Sequence[tuple[int, int]], shortest: int = FEWEST) -> Iterator[tuple[int, int, int, int, int]]:
    """Yield equally spaced runs of pairs (to, from): first to, first from, step of to, step of from, length. Runs of
    fewer than ``shortest`` pairs are yielded pair by pair, with steps 0 and length 1."""
    start = 0
    while start < len(pairs):
        end = start + 1
        step = (0, 0)
        if end < len(pairs):
            step = (pairs[end][0] - pairs[start][0], pairs[end][1] - pairs[start][1])
            while end < len(pairs) and (pairs[end][0] - pairs[end - 1][0], pairs[end][1] - pairs[end - 1][1]) == step:
                end += 1
        length = end - start
        if length < shortest:
            end, length, step = start + 1, 1, (0, 0)
        yield (*pairs[start], *step, length)
        start = end
