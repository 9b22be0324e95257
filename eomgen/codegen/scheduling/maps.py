"""Map on the tape -> loop of the Program: kernel as statements, constants and gather indices as tables.

In a function that runs a loop, both what it gathers and what it gives lie in the workspace, in ranges of their own, so
that neither the length of the code nor the number of locals grows with the number of elements. Runs of equally spaced
places, the rule in meshes and chains, are copied by loops too.
"""

from __future__ import annotations

from typing import cast

from eomgen.codegen.program import ProgramLoop
from eomgen.codegen.scheduling.scheduler import schedule
from eomgen.symbolic.map import KERNEL_BLOCKS, Map
from eomgen.symbolic.tape import Tape


def program_loop(tape: Tape, number: int) -> ProgramLoop:
    """Return the Program's loop for Map ``number`` of a tape."""
    loop = cast("Map", tape.maps[number])
    place = {ref: position for position, ref in enumerate(loop.gathered)}
    kernel = schedule(loop.kernel, (loop.sums, loop.last, loop.stacked), KERNEL_BLOCKS, part_limit=10**9, fill=False)
    return ProgramLoop(
        label=loop.label,
        count=loop.count,
        gathered=len(loop.gathered),
        results=loop.size,
        constants=tuple(zip(*loop.elements, strict=True)) if loop.elements else (),
        index=(
            tuple(tuple(place[slot[element]] for slot in loop.gather) for element in range(loop.count))
            if loop.gather
            else ()
        ),
        shared=tuple(place[ref] for ref in loop.shared),
        initial=tuple(place[ref] for ref in loop.initial),
        sums=len(loop.sums),
        stacked=len(loop.stacked),
        statements=kernel.parts[0].statements,
        reads=kernel.parts[0].inputs,
    )
