"""Loops of a Program: a Map on the tape becomes the statements of its kernel, with tables for constants and gathered
places."""

from __future__ import annotations

import math

from eomgen.codegen.program import WIDEST, ProgramLoop
from eomgen.codegen.scheduling.bodies import RunLoop
from eomgen.codegen.scheduling.scheduler import schedule
from eomgen.codegen.scheduling.stretches import MOST_RANGES, ranges
from eomgen.symbolic.map import KERNEL_BLOCKS, Map


def _lanes(loop: Map) -> int:
    """Return the number of elements taken side by side: a divisor of the number of elements, 1 if elements depend on
    other elements or gathered values."""
    alone = loop.sums and not (loop.gather or loop.last or loop.stacked)
    return math.gcd(loop.count, WIDEST) if alone else 1


def program_loop(run: RunLoop) -> ProgramLoop:
    """Return the Program's loop for a Map and additions: kernel as statements, places as ranges or tables."""
    loop = run.loop
    position_of = {ref: position for position, ref in enumerate(loop.references)}
    slots = [ranges([position_of[ref] for ref in slot]) for slot in loop.gather]
    tabled = [slot for slot, result in zip(loop.gather, slots, strict=True) if len(result) > MOST_RANGES]
    results = (loop.sums, loop.last, loop.stacked)
    # a loop within would need a workspace, which the functions of Maps have none of
    kernel = schedule(loop.kernel, results, KERNEL_BLOCKS, part_limit=10**9, fill=False, reroll=False)
    return ProgramLoop(
        label=loop.label,
        count=loop.count,
        lanes=_lanes(loop),
        gathered=len(loop.references),
        results=0 if run.additions else loop.size,
        constants=loop.elements,
        index=tuple(tuple(result) if len(result) <= MOST_RANGES else () for result in slots),
        places=tuple(tuple(position_of[slot[element]] for slot in tabled) for element in range(loop.count))
        if tabled
        else (),
        shared=tuple(position_of[ref] for ref in loop.shared),
        initial=tuple(position_of[ref] for ref in loop.initial),
        sums=len(loop.sums),
        stacked=len(loop.stacked),
        statements=kernel.parts[0].statements,
        reads=kernel.parts[0].inputs,
        additions=run.additions,
        outputs=run.outputs,
    )
