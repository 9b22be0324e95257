"""Body of a rerolled loop, and the indices at which each iteration reads and stores its values.

The body is scheduled as a function of its own; its inputs are the values that it reads from outside the iteration.
Equally spaced indices become start + step k, all others a table.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any, Protocol, cast

from eomgen.base.data import dataclass
from eomgen.codegen.program import Expression, Statement
from eomgen.codegen.scheduling.rerolling import RerolledLoop, operands
from eomgen.symbolic.map import record
from eomgen.symbolic.operations import Op
from eomgen.symbolic.tape import Ref, Tape

#: The block of an iteration's inputs.
READ = "read"

#: Output number, component, sign, operation.
Unmatched = tuple[int, int, int, int]
#: Position in the iteration, output number, sign, component in each iteration.
Column = tuple[int, int, int, list[int]]


@dataclass(frozen=True)
class Iteration:
    """One iteration.

    Attributes
    ----------
    kernel, results : operations of the body, with inputs in block ``read``, and the references stored to ``given``
    read, given : expressions of the iteration number (see ``program.Statement``, kind ``repeat``)
    exports : positions in the body of operations that are stored in the workspace
    first : workspace index of the first export of iteration 0; the n exports of iteration k start at ``first + n k``
    unmatched : outputs that not all iterations store alike; they are copied from the workspace
    """

    kernel: Tape
    results: tuple[Ref, ...]
    read: tuple[Expression, ...]
    given: tuple[Expression, ...]
    exports: tuple[int, ...]
    first: int
    unmatched: tuple[Unmatched, ...]


class Values(Protocol):
    """The services of the enclosing function that a loop uses."""

    def reserve(self, count: int) -> int:
        """Return the first index of ``count`` new workspace entries."""

    def leaf(self, ref: Ref) -> Expression:
        """Return the expression of a value that all iterations share."""

    def slot(self, node: int) -> int:
        """Return the workspace index of a value, which is stored there if it is not yet."""


Stores = Mapping[int, Sequence[tuple[int, int, int]]]


def copies(expressions: Sequence[Expression], output: int, components: Sequence[int]) -> tuple[Any, ...] | None:
    """Return the data of a loop that copies constants, workspace entries or one input block's entries to an output.

    None for other expressions.
    """
    minus = all(isinstance(item, tuple) and item[0] == "neg" for item in expressions)
    if minus:
        expressions = [cast("tuple[str, Expression]", item)[1] for item in expressions]
    if all(isinstance(item, tuple) and item[0] == "K" for item in expressions):
        read: Expression = ("numbers", tuple(cast("tuple[str, float]", item)[1] for item in expressions))
    elif all(isinstance(item, tuple) and item[0] == "w" for item in expressions):
        read = ("row", "w", *rule([cast("tuple[str, int]", item)[1] for item in expressions]))
    elif len({item[:2] if isinstance(item, tuple) else () for item in expressions}) == 1 and expressions[0][0] == "in":  # type: ignore[index]  # of tuples alone
        read = (
            "row",
            cast("tuple[str, str]", expressions[0])[1],
            *rule([cast("tuple[str, str, int]", item)[2] for item in expressions]),
        )
    else:
        return None
    read = ("neg", read) if minus else read
    copied = Statement("out", (0, 0, ("in", READ, 0)))
    return len(components), (copied,), (read,), (("row", output, *rule(components)),)


def loop_iteration(tape: Tape, loop: RerolledLoop, read_outside: set[int], stores: Stores, values: Values) -> Iteration:
    """Return the body of a loop and the rules of its indices.

    Parameters
    ----------
    read_outside : operations that the rest of the function reads
    stores : places of stored operations: output number, component, sign
    """
    iterations = loop.iterations
    position_of = {node: (k, j) for k, iteration in enumerate(iterations) for j, node in enumerate(iteration)}
    columns, unmatched = _rows_of_outputs(iterations, stores)
    kept = {j for iteration in iterations for j, node in enumerate(iteration) if node in read_outside} | {
        position_of[item[3]][1] for item in unmatched
    }
    for k, iteration in enumerate(iterations):
        reached = (position_of.get(abs(ref)) for node in iteration for ref in operands(tape, node))
        kept |= {item_of[1] for item_of in reached if item_of is not None and item_of[0] != k}
    exports = tuple(sorted(kept))
    first = values.reserve(len(exports) * len(iterations))
    row = {j: number for number, j in enumerate(exports)}
    kernel = Tape()
    known: list[Ref] = []
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
        for number, ref in enumerate(operands(tape, iterations[0][j])):
            refs = [operands(tape, iteration[j])[number] for iteration in iterations]
            iteration_number, position = position_of.get(abs(ref), (-1, -1))
            if (
                iteration_number == 0
                and abs(refs[-1]) in position_of
                and position_of[abs(refs[-1])] == (len(iterations) - 1, position)
            ):
                taken.append(known[position] if ref > 0 else -known[position])
                continue
            if len(set(refs)) == 1 and (value := tape.number(ref)) is not None:
                taken.append(kernel.constant(value))
                continue
            expression = _read(tape, refs, values, slot)
            if expression not in inputs:
                inputs[expression] = kernel.input(READ, len(read))
                read.append(expression)
            taken.append(inputs[expression])
        known.append(record(kernel, tape.op[iterations[0][j]], taken))

    given: list[Expression] = [("row", "w", first + row[j], len(exports)) for j in exports]
    results = [known[j] for j in exports]
    for j, output, sign, components in columns:
        given.append(("row", output, *rule(components)))
        results.append(sign * known[j])
    return Iteration(kernel, tuple(results), tuple(read), tuple(given), exports, first, tuple(unmatched))


def _rows_of_outputs(iterations: Sequence[Sequence[int]], stores: Stores) -> tuple[list[Column], list[Unmatched]]:
    """Return the outputs that all iterations store alike, and the others."""
    columns: list[Column] = []
    unmatched: list[Unmatched] = []
    for j in range(len(iterations[0])):
        by_iteration = [
            sorted((number, sign, component) for number, component, sign in stores.get(iteration[j], ()))
            for iteration in iterations
        ]
        alike = [(number, sign) for number, sign, _ in by_iteration[0]]
        if all([(number, sign) for number, sign, _ in stored] == alike for stored in by_iteration):
            for position, (number, sign) in enumerate(alike):
                columns.append((j, number, sign, [stored[position][2] for stored in by_iteration]))
        else:
            for iteration, stored in zip(iterations, by_iteration, strict=True):
                unmatched += [(number, component, sign, iteration[j]) for number, sign, component in stored]
    return columns, unmatched


def _read(tape: Tape, refs: Sequence[Ref], values: Values, slot: Callable[[int], int]) -> Expression:
    """Return an operand as an expression of the iteration number k."""
    if len(set(refs)) == 1:
        return values.leaf(refs[0])
    minus = refs[0] < 0
    nodes = [abs(ref) for ref in refs]
    op = tape.op[nodes[0]]
    expression: Expression
    if op is Op.CONST:
        return ("numbers", tuple((1.0 if ref > 0 else -1.0) * tape.constants[tape.a[abs(ref)]] for ref in refs))
    if op is Op.INPUT:
        symbols = [tape.inputs[tape.a[node]] for node in nodes]
        expression = ("row", symbols[0].block, *rule([symbol.index for symbol in symbols]))
    else:
        expression = ("row", "w", *rule([slot(node) for node in nodes]))
    return ("neg", expression) if minus else expression


def rule(indices: Sequence[int]) -> tuple[object, ...]:
    """Return (start, step) for equally spaced indices, else a tuple that holds the tuple of all."""
    if len(indices) == 1:
        return (indices[0], 0)
    step = indices[1] - indices[0]
    if all(after - before == step for before, after in pairwise(indices)):
        return (indices[0], step)
    return (tuple(indices),)


#: Least number of copies with equally spaced indices that become a loop.
RUN_FROM = 4


def runs(pairs: Sequence[tuple[int, int]], shortest: int = RUN_FROM) -> Iterator[tuple[int, int, int, int, int]]:
    """Split pairs (to, from) into equally spaced runs: first to, first from, step of to, step of from, length."""
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
