"""Assembly of a large iteration matrix: entries that are made the same way are made by one loop, however many there are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from eomgen.codegen.program import Expression, Statement
from eomgen.codegen.scheduling.iterations import READ, rule
from eomgen.codegen.scheduling.scheduler import schedule
from eomgen.integrators.newton.matrix import WEIGHTS
from eomgen.symbolic.tape import ZERO, Ref, Tape

#: Kinds of solvers whose matrix is assembled this way; that of small ones is written out entry by entry.
LOOPED = ("tables", "fronts")
_ONE = WEIGHTS.index("one")


@dataclass(frozen=True)
class Assembly:
    """Loops over blocks ``weights``, ``numbers``, ``tangents`` and ``jacobian``; the entries are output 0."""

    statements: tuple[Statement, ...]
    workspace: int


def assembly(solver: Mapping[str, Any]) -> Assembly:
    """Return the loops that fill the entries of the matrix.

    Parameters
    ----------
    solver : ``Program.method["solver"]``
        ``moved`` rows of products, ``entries`` with ``linear`` and ``products`` terms: ``integrators.iteration_matrix.Terms``
    """
    first = int(solver["numbers"])

    def source(number: int) -> tuple[str, int]:
        return ("numbers", number) if number < first else ("w", number - first)

    loops = _Loops()
    for place, row in enumerate(solver["moved"]):
        reads = [item for number, tangent in row for item in (("numbers", number), ("tangents", tangent))]
        loops.add(("moved", len(row)), reads, ("w", place))
    for place, entry in enumerate(solver["entries"]):
        linear, products = entry["linear"], sorted(entry["products"])
        reads = [source(number) for _, number in linear]
        reads += [item for _, number, nonzero in products for item in (source(number), ("jacobian", nonzero))]
        blocks = tuple(block for block, _ in reads)
        shape = ("entry", tuple(weight for weight, _ in linear), tuple(weight for weight, _, _ in products), blocks)
        loops.add(shape, reads, (0, place))
    return Assembly(tuple(loops.statements()), len(solver["moved"]))


class _Loops:
    """Values by how they are made: what each of them reads, and where it goes."""

    def __init__(self) -> None:
        self.groups: dict[tuple[Any, ...], list[tuple[Sequence[tuple[str, int]], tuple[Any, int]]]] = {}

    def add(self, shape: tuple[Any, ...], reads: Sequence[tuple[str, int]], target: tuple[Any, int]) -> None:
        self.groups.setdefault(shape, []).append((reads, target))

    def statements(self) -> list[Statement]:
        """Return one loop for each shape."""
        result = []
        for shape, members in self.groups.items():
            read: list[Expression] = [
                ("row", column[0][0], *rule([place for _, place in column]))
                for column in zip(*(reads for reads, _ in members), strict=True)
            ]
            tape = Tape()
            total = _sum_of_products(tape, shape[1]) if shape[0] == "moved" else _entry(tape, shape[1], shape[2], read)
            made = schedule(tape, [[total]], (READ,), part_limit=10**9, fill=False, roll=False)
            target: Expression = ("row", members[0][1][0], *rule([place for _, (_, place) in members]))
            result.append(Statement("repeat", (len(members), made.parts[0].statements, tuple(read), (target,))))
        return result


def _sum_of_products(tape: Tape, count: int) -> Ref:
    total = ZERO
    for k in range(count):
        total = tape.add(total, tape.mul(tape.input(READ, 2 * k), tape.input(READ, 2 * k + 1)))
    return total


def _entry(tape: Tape, linear: Sequence[int], products: Sequence[int], read: list[Expression]) -> Ref:
    """Return sum of weight number - sum of weight (number nonzero of B); the weights are read behind everything else."""
    place: dict[int, Ref] = {}

    def weighted(weight: int, value: Ref) -> Ref:
        if weight == _ONE:
            return value
        if weight not in place:
            place[weight] = tape.input(READ, len(read))
            read.append(("in", "weights", weight))
        return tape.mul(place[weight], value)

    total = ZERO
    for k, weight in enumerate(linear):
        total = tape.add(total, weighted(weight, tape.input(READ, k)))
    sums: dict[int, Ref] = {}
    for k, weight in enumerate(products):
        number = len(linear) + 2 * k
        product = tape.mul(tape.input(READ, number), tape.input(READ, number + 1))
        sums[weight] = tape.add(sums.get(weight, ZERO), product)
    for weight, value in sums.items():
        total = tape.sub(total, weighted(weight, value))
    return total
