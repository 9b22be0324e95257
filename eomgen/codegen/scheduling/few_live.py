"""Parts of a function with few live values, for processors on which a value that waits in memory is dear: a GPU has
registers for about 110 numbers of a thread, and values beyond them move through memory for each thread.

Each part computes some outputs, and values of earlier parts again, except for values that are cheaper to read from the
workspace, which a minimum cut finds. Within a part, the best of three orders is taken: the recorded
paragraphs, and depth first with the deepest or the largest operand first (as Sethi and Ullman 1970 for trees).
Operations and operands stay the same, so results have the same bits.
"""

from __future__ import annotations

from bisect import bisect_right
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence, Set
from itertools import chain

from eomgen.base.data import dataclass
from eomgen.codegen.scheduling.plan import Plan
from eomgen.symbolic.operations import UNARY, Op
from eomgen.symbolic.tape import Ref

#: Cost of operations other than sums and products, in operations.
_COSTS: Mapping[Op, int] = {Op.DIV: 8, **dict.fromkeys((*UNARY, Op.POW, Op.ATAN2, Op.CURVE), 20), Op.ABS: 1}


def most_live(steps: Sequence[tuple[Sequence[int], Sequence[int]]]) -> int:
    """Return the largest number of values that are made and read later, or made at the moment. ``steps`` are the values
    that are read and the values that are made."""
    last = {value: number for number, (reads, _) in enumerate(steps) for value in reads}
    ends = Counter(last[value] for _, made in steps for value in made if value in last)
    live = most = 0
    for number, (_, made) in enumerate(steps):
        live -= ends[number]
        most = max(most, live + len(made))
        live += sum(value in last for value in made)
    return most


@dataclass(frozen=True)
class LivePart:
    """Operations of a part in order, the operations whose results it reads from the workspace, and the largest number
    of live values. Operations are entries of ``Plan.order``."""

    order: tuple[int, ...]
    given: frozenset[int]
    live: int


def split_by_live_values(plan: Plan, outputs: Sequence[Sequence[Ref]], limit: int, price: int = 84) -> list[LivePart]:
    """Return parts of a function with at most ``limit`` live values; more if one output needs more.

    Outputs are taken in the order of the plan, as many for a part as the limit allows. A value in the workspace costs
    as much as ``price`` operations: 84 take as long as to write a number to the memory of a GPU and to read it (H100:
    16 bytes at 3.0 TB/s, 15.8e12 operations per second).
    """
    graph = _Graph(plan)
    roots = sorted({graph.place[abs(ref)] for ref in chain.from_iterable(outputs) if abs(ref) in graph.place})
    parts: list[LivePart] = []
    known: set[int] = set()
    while roots or not parts:
        given = graph.cheapest_inputs(roots, known, price) if known else frozenset[int]()
        parts.append(_longest_part(graph, roots, given, limit))
        known.update(parts[-1].order)
        roots = [root for root in roots if root not in known]
    nodes = plan.order
    return [LivePart(tuple(nodes[k] for k in p.order), frozenset(nodes[k] for k in p.given), p.live) for p in parts]


def _longest_part(graph: _Graph, roots: Sequence[int], given: frozenset[int], limit: int) -> LivePart:
    """Return the part of the first roots with at most ``limit`` live values, or as many as the first root needs."""
    part = graph.best_order(roots, given)
    if part.live <= limit:
        return part
    most = max(limit, graph.best_order(roots[:1], given).live)
    counts = range(2, len(roots))
    more = bisect_right(counts, most, key=lambda count: graph.best_order(roots[:count], given).live)
    return graph.best_order(roots[: 1 + more], given)


class _Graph:
    """Operations of a plan by their places in ``Plan.order``: operands, number of results, costs.

    Attributes
    ----------
    place : the place of each operation, also of operations that are computed together with an earlier one
    """

    def __init__(self, plan: Plan) -> None:
        """Collect the operands and costs of all operations of the plan."""
        tape, groups = plan.tape, [plan.group(node) for node in plan.order]
        self.place = {node: k for k, group in enumerate(groups) for node in group}
        self.results = [len(group) for group in groups]
        self.costs = [sum(_COSTS.get(tape.op[node], 1) for node in group) for group in groups]
        self.operands = [
            sorted({self.place[abs(ref)] for node in group for ref in tape.operands(node) if abs(ref) in self.place})
            for group in groups
        ]

    def best_order(self, roots: Sequence[int], given: frozenset[int]) -> LivePart:
        """Return the order with the fewest live values of the operations that the roots need and that are not given."""
        orders = [tuple(order) for order in self._orders(roots, given)]
        return min((LivePart(order, given, self._live(order)) for order in orders), key=lambda part: part.live)

    def _orders(self, roots: Sequence[int], given: Set[int]) -> Iterator[list[int]]:
        needed = sorted(self._cone(roots, given))
        yield needed
        depth, below = dict.fromkeys(given, 0), dict.fromkeys(given, 0)
        for bit, k in enumerate(needed):
            depth[k], below[k] = 1, 1 << bit  # a bit for each operation below
            for operand in self.operands[k]:
                depth[k] = max(depth[k], 1 + depth[operand])
                below[k] |= below[operand]
        size = {k: bits.bit_count() for k, bits in below.items()}
        yield self._depth_first(roots, given, lambda k: (depth[k], k))
        yield self._depth_first(roots, given, lambda k: (size[k], k))

    def _depth_first(self, roots: Sequence[int], given: Set[int], key: Callable[[int], tuple[int, int]]) -> list[int]:
        done, order = set(given), list[int]()
        for root in roots:
            path = [root]
            while path:
                missing = [operand for operand in self.operands[path[-1]] if operand not in done]
                if missing and path[-1] not in done:
                    path.append(max(missing, key=key))
                    continue
                last = path.pop()
                if last not in done:
                    done.add(last)
                    order.append(last)
        return order

    def _cone(self, roots: Sequence[int], given: Set[int]) -> set[int]:
        needed, pending = set[int](), list(roots)
        while pending:
            k = pending.pop()
            if k not in needed and k not in given:
                needed.add(k)
                pending += self.operands[k]
        return needed

    def _live(self, order: Sequence[int]) -> int:
        return most_live([(self.operands[k], [k] * self.results[k]) for k in order])

    def cheapest_inputs(self, roots: Sequence[int], known: Set[int], price: int) -> frozenset[int]:
        """Return the known operations whose results are better read from memory, for the least cost of all reads and
        operations that the roots need: a minimum cut. An operation is computed, with all its operands, or read."""
        import numpy as np  # noqa: PLC0415  # SciPy takes longer to import than most functions to schedule
        from scipy.sparse import csr_array  # noqa: PLC0415
        from scipy.sparse.csgraph import breadth_first_order, maximum_flow  # noqa: PLC0415

        needed = sorted(self._cone(roots, frozenset()))
        wanted = {k: 2 * n for n, k in enumerate(needed)}  # vertices: is wanted, is computed (the next number)
        source, sink, endless = 2 * len(needed), 2 * len(needed) + 1, 10**8
        edges = [(source, wanted[root], endless) for root in set(roots)]
        for k, vertex in wanted.items():
            edges.append((vertex, vertex + 1, price if k in known else endless))
            edges.append((vertex + 1, sink, self.costs[k]))
            edges += [(vertex + 1, wanted[operand], endless) for operand in self.operands[k]]
        start, end, capacity = np.array(edges, dtype=np.int32).T
        network = csr_array((capacity, (start, end)), shape=(sink + 1, sink + 1))
        rest = network - maximum_flow(network, source, sink).flow
        rest.eliminate_zeros()
        reached = set(breadth_first_order(rest, source, return_predecessors=False).tolist())
        return frozenset(k for k, vertex in wanted.items() if vertex in reached and vertex + 1 not in reached)
