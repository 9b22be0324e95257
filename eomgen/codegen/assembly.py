"""Assembly of a large iteration matrix, composed on a tape from the solver's terms: what repeats becomes loops here too."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

from eomgen.codegen.schedule import Schedule, schedule
from eomgen.integrators.iteration_matrix import WEIGHTS
from eomgen.symbolic.tape import ZERO, Ref, Tape

#: What the assembly reads: weights, the numbers of the partials, the blocks of T, the nonzeros of B at the start of the step.
BLOCKS = ("weights", "numbers", "tangents", "jacobian")
#: Kinds of solvers whose matrix is assembled this way; that of small ones is written out entry by entry.
LOOPED = ("tables", "fronts")
_ONE = WEIGHTS.index("one")


def assembly(solver: Mapping[str, Any]) -> Schedule:
    """Return the statements that fill the entries of the matrix, in the order in which they are stored.

    Parameters
    ----------
    solver : ``Program.method["solver"]``
        ``moved`` rows of products, ``entries`` with ``linear`` and ``products`` terms: ``integrators.iteration_matrix.Terms``
    """
    tape = Tape()
    first = int(solver["numbers"])

    @cache
    def number(k: int) -> Ref:
        if k < first:
            return tape.input("numbers", k)
        total = ZERO
        for position, tangent in solver["moved"][k - first]:
            total = tape.add(total, tape.mul(tape.input("numbers", position), tape.input("tangents", tangent)))
        return total

    def weighted(weight: int, value: Ref) -> Ref:
        return value if weight == _ONE else tape.mul(tape.input("weights", weight), value)

    entries = []
    for entry in solver["entries"]:
        total = ZERO
        for weight, k in entry["linear"]:
            total = tape.add(total, weighted(weight, number(k)))
        sums: dict[int, Ref] = {}
        for weight, k, nonzero in entry["products"]:
            product = tape.mul(number(k), tape.input("jacobian", nonzero))
            sums[weight] = tape.add(sums.get(weight, ZERO), product)
        for weight, value in sums.items():
            total = tape.sub(total, weighted(weight, value))
        entries.append(total)
    return schedule(tape, [entries], BLOCKS, part_limit=10**9)
