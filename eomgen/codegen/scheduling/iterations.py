"""A loop found in a function -> the text of one turn, and where each turn finds and leaves its values.

The turn is scheduled as a function of its own whose inputs are what it reads from elsewhere. A place that moves by the same
step from turn to turn is counted, any other rule becomes a table.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Protocol, cast

from eomgen.codegen.program import Expression, Statement
from eomgen.codegen.scheduling.rerolling import Roll, operands
from eomgen.symbolic.map import record
from eomgen.symbolic.operations import Op
from eomgen.symbolic.tape import Ref, Tape

#: The block of a turn's inputs.
READ = "read"

#: Output number, component, sign, operation.
Left = tuple[int, int, int, int]
#: Position in the turn, output number, sign, component in each turn.
Column = tuple[int, int, int, list[int]]


@dataclass(frozen=True)
class Turn:
    """One turn.

    Attributes
    ----------
    kernel, results : the operations of the turn, whose inputs are the components of block ``read``, and what they give: ``given``
    read, given : expressions of the turn's number (see ``program.Statement``, kind ``repeat``)
    exports : positions in the turn of operations that the workspace keeps
    first : the place of the first one of turn 0; turn k keeps its n exports from ``first + n k`` on
    left : results that no rule covers; they are in the workspace
    """

    kernel: Tape
    results: tuple[Ref, ...]
    read: tuple[Expression, ...]
    given: tuple[Expression, ...]
    exports: tuple[int, ...]
    first: int
    left: tuple[Left, ...]


class Values(Protocol):
    """What a loop asks of the function that it is in."""

    def reserve(self, count: int) -> int:
        """Return the first of so many new places in the workspace."""

    def leaf(self, ref: Ref) -> Expression:
        """Return what stands for a value that all turns share."""

    def slot(self, node: int) -> int:
        """Return where the workspace has a value, putting it there if it has to."""


Stores = Mapping[int, Sequence[tuple[int, int, int]]]


def copies(expressions: Sequence[Expression], output: int, components: Sequence[int]) -> tuple[Any, ...] | None:
    """Return the data of a loop that stores constants, or places of the workspace, in an output; None for anything else."""
    minus = all(isinstance(item, tuple) and item[0] == "neg" for item in expressions)
    if minus:
        expressions = [cast("tuple[str, Expression]", item)[1] for item in expressions]
    if all(isinstance(item, tuple) and item[0] == "K" for item in expressions):
        read: Expression = ("numbers", tuple(cast("tuple[str, float]", item)[1] for item in expressions))
    elif all(isinstance(item, tuple) and item[0] == "w" for item in expressions):
        read = ("row", "w", *rule([cast("tuple[str, int]", item)[1] for item in expressions]))
    else:
        return None
    read = ("neg", read) if minus else read
    copied = Statement("out", (0, 0, ("in", READ, 0)))
    return len(components), (copied,), (read,), (("row", output, *rule(components)),)


def turn_of(tape: Tape, loop: Roll, read_outside: set[int], stores: Stores, values: Values) -> Turn:
    """Return one turn of a loop.

    Parameters
    ----------
    read_outside : operations that the rest of the function reads
    stores : where operations are stored: output number, component, sign
    """
    turns = loop.turns
    place = {node: (k, j) for k, turn in enumerate(turns) for j, node in enumerate(turn)}
    columns, left = _rows_of_outputs(turns, stores)
    kept = {j for turn in turns for j, node in enumerate(turn) if node in read_outside} | {place[item[3]][1] for item in left}
    for k, turn in enumerate(turns):
        reached = (place.get(abs(ref)) for node in turn for ref in operands(tape, node))
        kept |= {found[1] for found in reached if found is not None and found[0] != k}
    exports = tuple(sorted(kept))
    first = values.reserve(len(exports) * len(turns))
    row = {j: number for number, j in enumerate(exports)}
    kernel = Tape()
    known: list[Ref] = []
    read: list[Expression] = []
    inputs: dict[Expression, Ref] = {}

    def slot(node: int) -> int:
        if node in place:
            turn, position = place[node]
            return first + len(exports) * turn + row[position]
        return values.slot(node)

    for j in range(loop.period):
        label = tape.label(turns[0][j])
        if label and (not kernel.blocks or kernel.blocks[-1][1] != f"{label}, and so on"):
            kernel.blocks.append((len(kernel.op), f"{label}, and so on"))
        taken: list[Ref] = []
        for number, ref in enumerate(operands(tape, turns[0][j])):
            refs = [operands(tape, turn[j])[number] for turn in turns]
            turn_number, position = place.get(abs(ref), (-1, -1))
            if turn_number == 0 and abs(refs[-1]) in place and place[abs(refs[-1])] == (len(turns) - 1, position):
                taken.append(known[position] if ref > 0 else -known[position])
                continue
            if len(set(refs)) == 1 and (value := tape.value(ref)) is not None:
                taken.append(kernel.constant(value))
                continue
            expression = _read(tape, refs, values, slot)
            if expression not in inputs:
                inputs[expression] = kernel.input(READ, len(read))
                read.append(expression)
            taken.append(inputs[expression])
        known.append(record(kernel, tape.op[turns[0][j]], taken))

    given: list[Expression] = [("row", "w", first + row[j], len(exports)) for j in exports]
    results = [known[j] for j in exports]
    for j, output, sign, components in columns:
        given.append(("row", output, *rule(components)))
        results.append(sign * known[j])
    return Turn(kernel, tuple(results), tuple(read), tuple(given), exports, first, tuple(left))


def _rows_of_outputs(turns: Sequence[Sequence[int]], stores: Stores) -> tuple[list[Column], list[Left]]:
    """Return what all turns store alike, and the stores that are left."""
    columns: list[Column] = []
    left: list[Left] = []
    for j in range(len(turns[0])):
        of_turns = [sorted((number, sign, component) for number, component, sign in stores.get(turn[j], ())) for turn in turns]
        alike = [(number, sign) for number, sign, _ in of_turns[0]]
        if all([(number, sign) for number, sign, _ in found] == alike for found in of_turns):
            for position, (number, sign) in enumerate(alike):
                columns.append((j, number, sign, [found[position][2] for found in of_turns]))
        else:
            for turn, found in zip(turns, of_turns, strict=True):
                left += [(number, component, sign, turn[j]) for number, sign, component in found]
    return columns, left


def _read(tape: Tape, refs: Sequence[Ref], values: Values, slot: Callable[[int], int]) -> Expression:
    """Return what an operand is in turn k."""
    if len(set(refs)) == 1:
        return values.leaf(refs[0])
    minus = refs[0] < 0
    nodes = [abs(ref) for ref in refs]
    op = tape.op[nodes[0]]
    found: Expression
    if op is Op.CONST:
        return ("numbers", tuple((1.0 if ref > 0 else -1.0) * tape.constants[tape.a[abs(ref)]] for ref in refs))
    if op is Op.INPUT:
        symbols = [tape.inputs[tape.a[node]] for node in nodes]
        found = ("row", symbols[0].block, *rule([symbol.index for symbol in symbols]))
    else:
        found = ("row", "w", *rule([slot(node) for node in nodes]))
    return ("neg", found) if minus else found


def rule(places: Sequence[int]) -> tuple[object, ...]:
    """Return (start, step) where places are equally spaced, else one tuple of them all."""
    if len(places) == 1:
        return (places[0], 0)
    step = places[1] - places[0]
    if all(after - before == step for before, after in pairwise(places)):
        return (places[0], step)
    return (tuple(places),)


#: Copies of equally spaced places become a loop from this length on.
RUN_FROM = 4


def runs(places: Sequence[tuple[int, int]], shortest: int = RUN_FROM) -> Iterator[tuple[int, int, int, int, int]]:
    """Split pairs (to, from) into equally spaced runs: first to, first from, step of to, step of from, length."""
    start = 0
    while start < len(places):
        end = start + 1
        step = (0, 0)
        if end < len(places):
            step = (places[end][0] - places[start][0], places[end][1] - places[start][1])
            while end < len(places) and (places[end][0] - places[end - 1][0], places[end][1] - places[end - 1][1]) == step:
                end += 1
        length = end - start
        if length < shortest:
            end, length, step = start + 1, 1, (0, 0)
        yield (*places[start], *step, length)
        start = end
