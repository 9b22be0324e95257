"""Functions for accelerations and their rates at one state, for Hermite steps, which take no higher coefficients of the
motion.

The recurrence at k = 1 with empty inner sums is one function, without storage between order 0 and 1. Steps evaluate it
several times at the same time, so the part of time, inputs and parameters alone is a separate function: a road of many
harmonics is nearly all of the work.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from eomgen.codegen.program import ProgramFunction
from eomgen.codegen.series.functions import (
    breakpoints_in_time,
    extent_function,
    has_nodes,
    kinds,
    program_function,
    refuse_external,
)
from eomgen.codegen.series.recurrence import NEXT, Recurrence, inverse_serves
from eomgen.symbolic.map import splice
from eomgen.symbolic.operations import LEAVES, InputSymbol, Op
from eomgen.symbolic.series import KEPT, LEFT, ORDER, PREVIOUS, RIGHT, SUMS
from eomgen.symbolic.tape import ONE, ZERO, Ref, Tape
from eomgen.system.system import System

#: Input blocks that are constant in all evaluations at one time, and the block of the results from these blocks.
OF_TIME, HELD = ("p", "t", "u", "followed"), "held"
BLOCKS = ("p", "t", "q", "v", "z", "u", "followed", HELD)
#: The least part of all operations that is worth a separate function.
WORTHWHILE = 0.1


def rate_functions(system: System, curve_numbers: dict[int, int]) -> tuple[tuple[ProgramFunction, ...], dict[str, Any]]:
    """Return ``series_rates``, ``series_of_time`` if worth a function, ``extent``, and the driver's data.

    ``series_rates`` gives the rate and half the second rate of each block of the state; ``held``: the number of values
    from ``series_of_time``.

    Raises ModelError if accelerations have no rates.
    """
    refuse_external(system)
    recurrence = Recurrence(system, by_inverse=inverse_serves(system))
    breakpoints_in_time(recurrence.source, analytic=False, nodes=has_nodes(system))
    tape, blocks, outputs = _recorded(recurrence)
    early = _of_time(tape, outputs)
    held = _frontier(tape, outputs, early)
    description = "rates of the state, and half its second rates"
    functions = []
    if len(early) >= WORTHWHILE * sum(tape.op[node] not in LEAVES for node in tape.live(outputs)) and held:
        of_time = "values that depend on time, inputs and parameters alone"
        functions.append(
            program_function(tape, "series_of_time", of_time, OF_TIME, [(HELD, held, "of series_rates")], curve_numbers)
        )
        late = Tape()
        outputs = splice(late, tape, outputs, {}, known={node: late.input(HELD, k) for k, node in enumerate(held)})
        tape = late
    else:
        held = []
    given, first = [], 0
    for label, size, text in blocks:
        given.append((label, outputs[first : first + size], text))
        first += size
    functions.insert(0, program_function(tape, "series_rates", description, BLOCKS, given, curve_numbers))
    functions += extent_function(system, curve_numbers)
    return tuple(functions), {"products": 0, "previous": 0, "room": 0, HELD: len(held), "kinds": kinds(system)}


def _recorded(recurrence: Recurrence) -> tuple[Tape, list[tuple[str, int, str]], list[Ref]]:
    """Return a tape with the rates and half the second rates, the arrays (name, size, meaning), and references."""
    series, rates = recurrence.series, sorted(recurrence.rates.items())
    source, tape = series.tape, Tape()
    values = {
        LEFT: [term.value for term in series.left],
        RIGHT: [term.value for term in series.right],
        KEPT: series.kept,
        PREVIOUS: [term.value for term in series.previous],
        **{NEXT[block]: [term.value for term in terms] for block, terms in rates},
    }
    bindings = {InputSymbol(NEXT["t"], 0): ONE} | {InputSymbol(ORDER, place): ONE for place in (0, 1, 3)}
    bindings |= {InputSymbol(SUMS, number): ZERO for number in range(len(series.left))}
    copied = iter(splice(tape, source, [ref for refs in values.values() for ref in refs], {}))
    for block, refs in values.items():
        bindings |= {InputSymbol(block, number): next(copied) for number in range(len(refs))}
    half = tape.constant(0.5)
    blocks, outputs = [], []
    for block, terms in rates:
        first = [bindings[InputSymbol(NEXT[block], number)] for number in range(len(terms))]
        second = splice(tape, source, [term.next for term in terms], bindings)
        blocks += [(f"{block}_1", len(terms), f"rate of {block}"), (f"{block}_2", len(terms), "half its rate")]
        outputs += [*first, *(tape.mul(half, ref) for ref in second)]
    return tape, blocks, outputs


def _of_time(tape: Tape, outputs: Sequence[Ref]) -> set[int]:
    """Return the operations that depend on ``OF_TIME`` alone."""
    result: set[int] = set()
    for node in tape.live(outputs):
        if tape.op[node] not in LEAVES and all(_is_early(tape, abs(ref), result) for ref in tape.operands(node)):
            result.add(node)
    return result


def _is_early(tape: Tape, node: int, early: set[int]) -> bool:
    symbol = tape.symbol(node)
    return node in early or tape.op[node] is Op.CONST or (symbol is not None and symbol.block in OF_TIME)


def _frontier(tape: Tape, outputs: Iterable[Ref], early: set[int]) -> list[int]:
    """Return the operations of time that are outputs or that other operations read, in order."""
    read = {abs(ref) for ref in outputs}
    for node in tape.live(outputs):
        if node not in early:
            read |= {abs(ref) for ref in tape.operands(node)}
    return sorted(read & early)
