"""Sparse partials of long recursions: named intermediates are kept as unknowns and not eliminated.

The Jacobian of y = f(x, s(x)) with s given step by step is dense, but the pair (y, definitions of s) has a sparse one:
each step of a recursion knows only its neighbour. Eliminating the intermediates again in a good order is the
linear-time recursion (Griewank and Walther 2008, chapter 9: the extended system).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from eomgen.symbolic.calculus.loops import map_partials
from eomgen.symbolic.calculus.partials import Seeds, forward_partials, node_tangent, seeds_by_node
from eomgen.symbolic.calculus.tangents import Tangent, signed_tangent
from eomgen.symbolic.operations import LEAVES, Op
from eomgen.symbolic.tape import ONE, Ref, Tape


def cut_partials(
    tape: Tape, outputs: Sequence[Ref], seeds: Seeds, cuts: Iterable[Ref], first: int
) -> tuple[list[Tangent], list[Tangent], list[int]]:
    """Differentiate outputs with some nodes held as unknowns, and the definitions of those nodes.

    Parameters
    ----------
    cuts : references of operations; leaves, repetitions and operations that no output depends on are skipped
    first : direction of the first cut that is used; they are numbered in the order of the tape

    Returns
    -------
    tangents of the outputs, and of the definitions of the used cuts, and these cuts' nodes

    Notes
    -----
    With s the cut nodes and s = g(x, s) their definitions, the results are rows of [f_x, f_s] and [g_x, g_s]. Results
    of Maps are not cut.
    """
    wanted = {abs(ref) for ref in cuts}
    seeded = seeds_by_node(tape, seeds)
    tangents: dict[int, Tangent] = {}
    definitions: list[Tangent] = []
    used: list[int] = []
    maps: dict[int, list[Tangent]] = {}
    for node in tape.live(outputs):
        if node in seeded:
            tangents[node] = seeded[node]
            continue
        op = tape.op[node]
        if op in LEAVES:
            continue
        if op is Op.MAP:
            number = tape.a[node]
            if number not in maps:
                maps[number] = map_partials(tape, number, tangents, forward_partials)
            if tangent := maps[number][tape.b[node]]:
                tangents[node] = tangent
            continue
        tangent = node_tangent(tape, node, op, tangents)
        if tangent and node in wanted:
            tangents[node] = {first + len(definitions): ONE}
            definitions.append(tangent)
            used.append(node)
        elif tangent:
            tangents[node] = tangent
    return [signed_tangent(tangents, ref) for ref in outputs], definitions, used
