"""Functions of the Taylor recurrence as parts of a Program, and the scales of rounding errors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from eomgen.codegen.program import OutputArray, ProgramFunction
from eomgen.codegen.scheduling.scheduler import NEST_LIMIT, PART_LIMIT, schedule
from eomgen.codegen.series.breakpoints import breakpoints_in_time, has_nodes
from eomgen.codegen.series.recurrence import NEXT, Recurrence, inverse_serves
from eomgen.symbolic.series import KEPT, LEFT, ORDER, PREVIOUS, RIGHT, SUMS
from eomgen.symbolic.tape import Ref, Tape
from eomgen.system.system import Discontinuity, System

#: Input blocks of both functions, in the order of their arguments.
START_BLOCKS = ("p", "t", "q", "v", "z", "u", "followed")
NEXT_BLOCKS = (*NEXT.values(), SUMS, LEFT, RIGHT, KEPT, PREVIOUS, ORDER)
#: Numbers in the widest vector; rows of products are filled up to whole ones.
LANES = 8


def series_functions(
    system: System, curve_numbers: dict[int, int]
) -> tuple[tuple[ProgramFunction, ...], dict[str, Any], tuple[Discontinuity, ...]]:
    """Return ``series_start``, ``series_next``, ``extent``, the driver's data, and the times at which a series ends.

    The driver's data are sizes, ``products``, ``kept``, ``previous``, and ``room`` of a row of products, and ``kinds``:
    which components of q and of v are angles, and which are lengths.

    Raises ModelError if the motion has no Taylor series.
    """
    recurrence = Recurrence(system, by_inverse=inverse_serves(system))
    breakpoints = breakpoints_in_time(recurrence.source, nodes=has_nodes(system))
    series, tape = recurrence.series, recurrence.series.tape
    per_next = tape.input(ORDER, 2)
    start: list[tuple[str, Sequence[Ref], str]] = [
        ("left_0", [term.value for term in series.left], "left factors of the products"),
        ("right_0", [term.value for term in series.right], "right factors"),
        ("kept_0", series.kept, "values used by coefficients of all orders"),
        ("previous_0", [term.value for term in series.previous], "slopes of functions of arguments linear in time"),
    ]
    later: list[tuple[str, Sequence[Ref], str]] = [
        ("left_k", [term.next for term in series.left], "coefficient k of the left factors, or k times it"),
        ("right_k", [term.next for term in series.right], "coefficient k of the right factors"),
        ("previous_k", [term.next for term in series.previous], "coefficient k of the slopes"),
    ]
    for block, terms in sorted(recurrence.rates.items()):
        start.append((f"{block}_1", [term.value for term in terms], f"rate of {block}"))
        coefficients = [tape.mul(per_next, term.next) for term in terms]
        later.append((f"{block}_next", coefficients, f"coefficient k + 1 of {block}"))
    functions = [
        program_function(
            tape, "series_start", "values at order 0, and coefficient 1", START_BLOCKS, start, curve_numbers
        ),
        program_function(
            tape, "series_next", "coefficient k + 1 from those before it", NEXT_BLOCKS, later, curve_numbers
        ),
    ]
    functions += extent_function(system, curve_numbers)
    room = -(-len(series.left) // LANES) * LANES
    needed = {
        "products": len(series.left),
        "kept": len(series.kept),
        "previous": len(series.previous),
        "room": room,
        "kinds": kinds(system),
    }
    return tuple(functions), needed, breakpoints


def extent_function(system: System, curve_numbers: dict[int, int]) -> list[ProgramFunction]:
    """Return the function of the size of the machine and of gravity, if a system has it."""
    if not system.extent:
        return []
    sizes = [("extent", system.extent, "size of the machine, m, and of gravity, m/s^2")]
    return [program_function(system.tape, "extent", "scales of rounding", ("p",), sizes, curve_numbers)]


def kinds(system: System) -> list[dict[str, Any]]:
    """Return the components of q and v of each kind that there is, ``angle`` and ``length``; quaternions are angles."""
    members: dict[str, tuple[list[int], list[int]]] = {"angle": ([], []), "length": ([], [])}
    for factor in system.factors:
        if factor.group == "R":
            of_v = of_q = list((system.angular or (True,) * system.nv)[factor.v])
        else:
            of_q, of_v = (
                [k < turning for k in range(size)] for turning, size in ((4, factor.q_size), (3, factor.v_size))
            )
        for k, turns in enumerate(of_q):
            members["angle" if turns else "length"][0].append(factor.q_start + k)
        for k, turns in enumerate(of_v):
            members["angle" if turns else "length"][1].append(factor.v_start + k)
    return [
        {"name": name, "q": q, "v": v, "q_adjacent": _adjacent(q), "v_adjacent": _adjacent(v)}
        for name, (q, v) in members.items()
        if v
    ]


def _adjacent(components: Sequence[int]) -> bool:
    return list(components) == list(range(components[0], components[0] + len(components)))


def program_function(
    tape: Tape,
    name: str,
    description: str,
    blocks: Sequence[str],
    outputs: Sequence[tuple[str, Sequence[Ref], str]],
    curve_numbers: dict[int, int],
) -> ProgramFunction:
    """Return a function of a Program from references on a tape; outputs: (label, references, description)."""
    present = [output for output in outputs if output[1]]
    made = schedule(
        tape,
        [refs for _, refs, _ in present],
        blocks,
        PART_LIMIT,
        NEST_LIMIT,
        None,
        curve_numbers,
        fill=False,
        reroll=False,
    )
    used = {block for part in made.parts for block in part.inputs}
    return ProgramFunction(
        name=name,
        description=description,
        inputs=tuple(block for block in blocks if block in used),
        outputs=tuple(OutputArray(label, label, (len(refs),), len(refs), text) for label, refs, text in present),
        parts=made.parts,
        workspace=made.workspace,
        operations=made.operations,
        counts={},
    )
