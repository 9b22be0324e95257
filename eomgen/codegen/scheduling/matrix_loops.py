"""Loops over sparse matrices: assembly of the iteration matrix, and products with vectors, by statements or by one loop
per kind of entry."""

from __future__ import annotations

import functools
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from eomgen.base.data import dataclass
from eomgen.codegen.program import Expression, Statement
from eomgen.codegen.scheduling.rerolling import READ, rule
from eomgen.codegen.scheduling.scheduler import schedule
from eomgen.codegen.scheduling.stretches import repeat_statements
from eomgen.integrators.newton.matrix import WEIGHTS
from eomgen.symbolic.tape import ZERO, Ref, Tape

#: Kinds of solvers with a matrix assembled by loops.
_LOOPED = ("tables", "fronts")
_ONE = WEIGHTS.index("one")


@dataclass(frozen=True)
class MatrixAssembly:
    """Statements over blocks ``weights``, ``numbers``, ``tangents`` and ``jacobian``; the entries are output 0.

    Products with T go into the workspace, in loops, or after the other numbers, which are then output 1.
    """

    statements: tuple[Statement, ...]
    looped: bool
    workspace: int


def with_assembly(solver: Mapping[str, Any]) -> dict[str, Any]:
    """Return ``Program.method["solver"]`` with the key ``assembly``, a MatrixAssembly, in place of the terms of each
    entry. The keys ``moved``, ``entries`` and, for fronts, ``places`` are removed. Other solvers are copied."""
    if solver["kind"] not in _LOOPED:
        return dict(solver)
    without = {"moved", "entries", *(["places"] if solver["kind"] == "fronts" else [])}
    return {**{key: value for key, value in solver.items() if key not in without}, "assembly": assembly(solver)}


def in_loops(method: Mapping[str, Any]) -> dict[str, Any]:
    """Return ``Program.method`` with loops over tables in place of an assembly and an elimination that are written out,
    if the elimination has both: the same operations in a fifth of the text."""
    solver = method.get("solver", {})
    data = solver.get("elimination", {})
    if "unrolled" not in data or "kind_of" not in data:
        return dict(method)
    without = {key: value for key, value in data.items() if key != "unrolled"}
    return {**method, "solver": {**solver, "kind": "tables", "elimination": without}}


def assembly(solver: Mapping[str, Any]) -> MatrixAssembly:
    """Return the statements that fill the entries of the iteration matrix: loops, for small solvers one by one.

    Parameters
    ----------
    solver : ``Program.method["solver"]``
        ``moved`` rows of products, ``entries`` with ``linear`` and ``products`` terms:
        ``integrators.newton.matrix.Terms``; or an existing assembly, which is returned
    """
    if isinstance(made := solver.get("assembly"), MatrixAssembly):
        return made
    if solver["kind"] not in _LOOPED:
        return MatrixAssembly(tuple(_written_out(solver)), False, 0)
    first = int(solver["numbers"])

    def source(number: int) -> tuple[str, int]:
        return ("numbers", number) if number < first else ("w", number - first)

    groups: _Groups = defaultdict(list)
    for number_of_entry, row in enumerate(solver["moved"]):
        reads = [item for number, tangent in row for item in (("numbers", number), ("tangents", tangent))]
        groups["moved", len(row)].append((reads, ("w", number_of_entry)))
    for number_of_entry, entry in enumerate(solver["entries"]):
        linear, products = entry["linear"], sorted(entry["products"])
        reads = [source(number) for _, number in linear]
        reads += [item for _, number, nonzero in products for item in (source(number), ("jacobian", nonzero))]
        blocks = tuple(block for block, _ in reads)
        shape = ("entry", tuple(weight for weight, _ in linear), tuple(weight for weight, _, _ in products), blocks)
        groups[shape].append((reads, (0, number_of_entry)))
    return MatrixAssembly(tuple(_loops(groups)), True, len(solver["moved"]))


def _written_out(solver: Mapping[str, Any]) -> list[Statement]:
    """Return one statement for each product with T and for each entry."""

    def product(factor: Expression, block: str, number: int) -> Expression:
        return ("MUL", factor, ("in", block, number))

    def apply_weight(weight: int, value: Expression) -> Expression:
        return value if weight == _ONE else ("MUL", ("in", "weights", weight), value)

    def total(summands: Sequence[Expression]) -> Expression:
        return functools.reduce(lambda left, right: ("ADD", left, right), summands)

    result = []
    for slot, row in enumerate(solver["moved"], solver["numbers"]):
        moved = total([product(("in", "numbers", number), "tangents", tangent) for number, tangent in row])
        result.append(Statement("out", (1, slot, moved)))
    for slot, entry in enumerate(solver["entries"]):
        parts = [apply_weight(weight, ("in", "numbers", number)) for weight, number in entry["linear"]]
        value: Expression | None = total(parts) if parts else None
        for weight in sorted({weight for weight, _, _ in entry["products"]}):
            chosen = [(number, nonzero) for of, number, nonzero in entry["products"] if of == weight]
            terms = [product(("in", "numbers", number), "jacobian", nonzero) for number, nonzero in chosen]
            if value is not None:
                value = ("SUB", value, apply_weight(weight, total(terms)))
            elif weight == _ONE:
                value = ("neg", total(terms))
            else:
                value = ("MUL", ("neg", ("in", "weights", weight)), total(terms))
        result.append(Statement("out", (0, slot, ("K", 0.0) if value is None else value)))
    return result


#: Entries of a matrix by the operations of their computation (shape), each with operands and target.
_Groups = dict[tuple[Any, ...], list[tuple[Sequence[tuple[str, int]], tuple[Any, int]]]]


def _loops(groups: _Groups) -> Iterator[Statement]:
    """Yield the ``repeat`` statements of all groups: one loop or a few for each shape, in order."""
    for shape, members in groups.items():
        read: list[Expression] = [
            ("row", column[0][0], *rule([index for _, index in column]))
            for column in zip(*(reads for reads, _ in members), strict=True)
        ]
        tape = Tape()
        total = _sum_of_products(tape, shape[1]) if shape[0] == "moved" else _entry(tape, shape[1], shape[2], read)
        made = schedule(tape, [[total]], (READ,), part_limit=10**9, fill=False, reroll=False)
        target: Expression = ("row", members[0][1][0], *rule([index for _, (_, index) in members]))
        data = repeat_statements(len(members), made.parts[0].statements, read, (target,))
        yield from (Statement("repeat", item) for item in data)


def _sum_of_products(tape: Tape, count: int) -> Ref:
    total = ZERO
    for k in range(count):
        total = tape.add(total, tape.mul(tape.input(READ, 2 * k), tape.input(READ, 2 * k + 1)))
    return total


def _entry(tape: Tape, linear: Sequence[int], products: Sequence[int], read: list[Expression]) -> Ref:
    """Return the tape reference of a matrix entry, sum_k w_k n_k - sum_k w_k (n_k B_k). ``linear`` and ``products`` are
    the numbers of the weights w of the summands; n and B are the inputs of block ``READ`` in the order of ``read``, to
    which the expressions of the weights are appended."""
    inputs: dict[int, Ref] = {}

    def apply_weight(weight: int, value: Ref) -> Ref:
        if weight == _ONE:
            return value
        if weight not in inputs:
            inputs[weight] = tape.input(READ, len(read))
            read.append(("in", "weights", weight))
        return tape.mul(inputs[weight], value)

    total = ZERO
    for k, weight in enumerate(linear):
        total = tape.add(total, apply_weight(weight, tape.input(READ, k)))
    sums: dict[int, Ref] = {}
    for k, weight in enumerate(products):
        number = len(linear) + 2 * k
        product = tape.mul(tape.input(READ, number), tape.input(READ, number + 1))
        sums[weight] = tape.add(sums.get(weight, ZERO), product)
    for weight, value in sums.items():
        total = tape.sub(total, apply_weight(weight, value))
    return total


def added_products(terms: Sequence[tuple[int, int, int]], gain: str = "") -> tuple[Statement, ...]:
    """Return loops that add matrix times vector to output 0; empty if tables are as short.

    The loops read ``right``, the initial value, ``numbers``, the matrix entries, and ``vector``.

    Parameters
    ----------
    terms : row, number and column of each nonzero, in the order of additions
    gain : the block of a factor; with a factor, products are subtracted
    """
    rows, numbers, columns = (rule([term[k] for term in terms]) for k in range(3))
    read: list[Expression] = [("row", "right", *rows), ("row", "numbers", *numbers), ("row", "vector", *columns)]
    right, number, component, factor = (("in", READ, k) for k in range(4))
    value: Expression = ("ADD", right, ("MUL", number, component))
    if gain:
        read.append(("in", gain, 0))
        value = ("SUB", right, ("MUL", ("MUL", factor, number), component))
    loops = repeat_statements(len(terms), (Statement("out", (0, 0, value)),), read, (("row", 0, *rows),))
    is_table = len(loops) == 1 and any(isinstance(item, tuple) and len(item) == 3 for item in loops[0][2][:3])
    return () if is_table else tuple(Statement("repeat", data) for data in loops)
