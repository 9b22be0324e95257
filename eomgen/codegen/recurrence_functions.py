"""The two functions of a motion's Taylor coefficients as parts of a Program."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from eomgen.codegen.corners import corners_in_time
from eomgen.codegen.program import OutputArray, ProgramFunction
from eomgen.codegen.recurrence import NEXT, Recurrence
from eomgen.codegen.schedule import NEST_LIMIT, PART_LIMIT, schedule
from eomgen.symbolic.series import KEPT, LEFT, ORDER, RIGHT, SUMS
from eomgen.symbolic.tape import Ref, Tape
from eomgen.system import Discontinuity, System

#: Input blocks of both functions, in the order of their arguments.
START_BLOCKS = ("p", "t", "q", "v", "z", "u", "followed")
NEXT_BLOCKS = (*NEXT.values(), SUMS, LEFT, RIGHT, KEPT, ORDER)
#: Numbers in a vector; rows of products are filled up to whole ones.
LANES = 8


def series_functions(
    system: System, curve_numbers: dict[int, int]
) -> tuple[tuple[ProgramFunction, ...], dict[str, Any], tuple[Discontinuity, ...]]:
    """Return ``series_start`` and ``series_next``, the sizes that a driver needs, and the times at which a series ends.

    Sizes are ``products``, ``kept``, and ``room`` of a row of products.

    Raises ModelError where the motion has no Taylor series.
    """
    recurrence = Recurrence(system, by_inverse={"mass", "residual"} <= set(system.functions))
    corners = corners_in_time(recurrence.source)
    series, tape = recurrence.series, recurrence.series.tape
    per_next = tape.input(ORDER, 2)
    start: list[tuple[str, Sequence[Ref], str]] = [
        ("left_0", [term.value for term in series.left], "left factors of the products"),
        ("right_0", [term.value for term in series.right], "right factors"),
        ("kept_0", series.kept, "what coefficients of all orders need"),
    ]
    later: list[tuple[str, Sequence[Ref], str]] = [
        ("left_k", [term.next for term in series.left], "coefficient k of the left factors, or k times it"),
        ("right_k", [term.next for term in series.right], "coefficient k of the right factors"),
    ]
    for block, terms in sorted(recurrence.rates.items()):
        start.append((f"{block}_1", [term.value for term in terms], f"rate of {block}"))
        coefficients = [tape.mul(per_next, term.next) for term in terms]
        later.append((f"{block}_next", coefficients, f"coefficient k + 1 of {block}"))
    functions = (
        _function(tape, "series_start", "values at order 0, and coefficient 1", START_BLOCKS, start, curve_numbers),
        _function(tape, "series_next", "coefficient k + 1 from those before it", NEXT_BLOCKS, later, curve_numbers),
    )
    room = -(-len(series.left) // LANES) * LANES
    return functions, {"products": len(series.left), "kept": len(series.kept), "room": room, "lanes": LANES}, corners


def _function(
    tape: Tape, name: str, description: str, blocks: Sequence[str], outputs: Sequence[tuple[str, Sequence[Ref], str]],
    curve_numbers: dict[int, int],
) -> ProgramFunction:  # fmt: skip
    present = [output for output in outputs if output[1]]
    made = schedule(
        tape, [refs for _, refs, _ in present], blocks, PART_LIMIT, NEST_LIMIT, {}, curve_numbers, fill=False, roll=False
    )
    used = {block for part in made.parts for block in part.inputs}
    return ProgramFunction(
        name=name, description=description, inputs=tuple(block for block in blocks if block in used),
        outputs=tuple(OutputArray(label, label, (len(refs),), len(refs), text) for label, refs, text in present),
        parts=made.parts, workspace=made.workspace, operations=made.operations,
        counts={},
    )  # fmt: skip
