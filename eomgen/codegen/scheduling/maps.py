"""Map on the tape -> loop of the Program: kernel as statements, constants and gather indices as tables.

In a function that runs a loop, its gathered inputs and its results lie in the workspace, in ranges of their own, so
that neither the length of the code nor the number of locals grows with the number of elements. Runs of equally spaced
places, the rule in meshes and chains, are copied by loops too. Elements that need no others are taken several at a
time, with a sum each, which compilers turn into vectors without changing the order of any sum.
"""

from __future__ import annotations

import math

from eomgen.codegen.program import ProgramLoop
from eomgen.codegen.scheduling.scheduler import RunLoop, schedule
from eomgen.codegen.scheduling.shortened import MOST_RANGES
from eomgen.codegen.scheduling.stretches import ranges
from eomgen.symbolic.map import KERNEL_BLOCKS, Map

#: Elements side by side if they depend only on constants and shared values: two vectors of four doubles.
_SIDE_BY_SIDE = 8


def _lanes(loop: Map) -> int:
    """Return the number of elements taken side by side: a divisor of their number, 1 if some need others."""
    alone = loop.sums and not (loop.gather or loop.last or loop.stacked)
    return math.gcd(loop.count, _SIDE_BY_SIDE) if alone else 1


def program_loop(run: RunLoop) -> ProgramLoop:
    """Return the Program's loop for a Map."""
    loop = run.loop
    position_of = {ref: position for position, ref in enumerate(loop.gathered)}
    slots = [ranges([position_of[ref] for ref in slot]) for slot in loop.gather]
    tabled = [slot for slot, result in zip(loop.gather, slots, strict=True) if len(result) > MOST_RANGES]
    results = (loop.sums, loop.last, loop.stacked)
    # a loop within would need a workspace, which the functions of Maps have none of
    kernel = schedule(loop.kernel, results, KERNEL_BLOCKS, part_limit=10**9, fill=False, reroll=False)
    return ProgramLoop(
        label=loop.label,
        count=loop.count,
        lanes=_lanes(loop),
        gathered=len(loop.gathered),
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
