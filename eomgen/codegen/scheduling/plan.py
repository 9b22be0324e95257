"""Plan of a function before scheduling: live operations, fused groups, uses of each node, and the parts of a long
function."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence, Set
from itertools import accumulate, chain
from typing import cast

from eomgen.codegen.program import NEST_LIMIT
from eomgen.codegen.scheduling.joining import join
from eomgen.codegen.scheduling.paragraphs import reorder
from eomgen.codegen.scheduling.rerolling import RerolledLoop
from eomgen.codegen.scheduling.sharing import Occurrence, find_stretches
from eomgen.symbolic.map import Map
from eomgen.symbolic.operations import LEAVES, Op
from eomgen.symbolic.tape import ARITY, ZERO, Ref, Tape

_CIRCULAR = (Op.SIN, Op.COS)
_MAP = Op.MAP


class Plan:
    """The order of the operations that some outputs need, cut into parts of nearly equal length.

    Operations are numbers of tape nodes.

    Attributes
    ----------
    live : all operations, in order; ``order`` : without operations computed together with an earlier one.
    members : from an operation to the operations computed together with it: cosine with sine, results of a loop.
    by_part : the operations of each part.
    part_of, last_part : the part that computes an operation, and the last part that reads the result.
    uses : number of reads and stores of an operation.
    stores : places of stored operations: output number, component, sign.
    loops : from the first operation of a loop to the loop; in ``order`` this operation stands for the whole loop.
    stretches : likewise, from the first operation of a shared stretch to the stretch and those joined with it.
    head : from each operation of a loop or stretch to the first operation.
    read_outside : operations of loops and stretches that are read outside of the loop or stretch.
    added : from the number of a Map to the results that the loop adds to outputs at the end.
    maps : from the number of a Map to the loop of the Map (several joined Maps may have one loop), and the position of
        the Map's first result among the loop's results.
    angles_first : whether sines and cosines of inputs come first, side by side.
    """

    angles_first = True

    def __init__(
        self,
        tape: Tape,
        outputs: Sequence[Sequence[Ref]],
        part_limit: int,
        reroll: Callable[[Tape, Sequence[int]], list[RerolledLoop]],
        added: Mapping[int, Sequence[int]] | None = None,
        *,
        share: bool = False,
    ) -> None:
        """Find the live operations, loops, shared stretches, fused groups, order and parts. ``outputs`` are the
        references of each output, ``part_limit`` the operations per part at most. ``reroll`` returns the loops among
        given operations; ``added`` has the results of Maps that loops add to outputs, by the number of the Map;
        ``share`` allows shared stretches."""
        self.tape = tape
        self.added = added or {}
        last = {node for nodes in self.added.values() for node in nodes}
        needed = chain(chain.from_iterable(outputs), last)
        self.live = [node for node in tape.live(needed) if tape.op[node] not in LEAVES]
        rerolled = reroll(tape, [node for node in self.live if node not in last] if last else self.live)
        self.loops = {loop.iterations[0][0]: loop for loop in rerolled}
        self.head = {node: head for head, loop in self.loops.items() for node in chain.from_iterable(loop.iterations)}
        self.stretches = self._share(outputs, share=share)
        self.maps = self._joined_maps()
        leader = self._leaders()
        order = [node for node in self.live if node not in leader and self.head.get(node, node) == node]
        self.order = sorted(order, key=last.__contains__)
        self.members: dict[int, list[int]] = {}
        for node, first in leader.items():
            self.members.setdefault(first, []).append(node)
        self.order = self._with_few_waiting(leader)
        self.part_of = self._cut(part_limit)
        self.by_part: list[list[int]] = [[] for _ in range(self.parts)]
        for node in self.order:
            self.by_part[self.part_of[node]].append(node)
        self.part_of |= {node: self.part_of[head] for node, head in self.head.items()}
        self.part_of |= {node: self.part_of[first] for node, first in leader.items()}
        self.last_part = dict(self.part_of)
        self.uses = dict.fromkeys(self.live, 0)
        self.read_outside: set[int] = set()
        self._count_reads()
        self.stores: dict[int, list[tuple[int, int, int]]] = {}
        self._count_stores(outputs)

    def _share(self, outputs: Sequence[Sequence[Ref]], *, share: bool) -> dict[int, tuple[Occurrence, ...]]:
        """Return the shared stretches by their first operation, and note the operations of each in ``head``. Empty if
        ``share`` is false, or for functions with loops."""
        if self.loops or self.added or not share:
            return {}
        stretches = find_stretches(self.tape, self.live, outputs)
        self.head |= {node: stretch.nodes[0] for stretch in stretches for node in stretch.nodes}
        return {stretch.nodes[0]: (stretch,) for stretch in stretches}

    def _operations(self, node: int) -> Sequence[int]:
        """Return the operations of an entry of ``order``, unless the entry is a loop."""
        group = self.stretches.get(node)
        return self.group(node) if group is None else [member for stretch in group for member in stretch.nodes]

    def _join(self, leader: Mapping[int, int]) -> list[int]:
        """Join shared stretches in ``stretches`` and ``head``, and return ``order`` with an entry for each group.
        ``leader`` is as in ``_with_few_waiting``."""
        stretches = {node: group[0] for node, group in self.stretches.items()}
        order, self.stretches = join(self.order, self._reads(leader), stretches)
        self.head |= {node: head for head in self.stretches for node in self._operations(head)}
        return order

    def _reads(self, leader: Mapping[int, int]) -> dict[int, Sequence[int]]:
        """Return the entries and inputs that each entry of ``order`` reads; ``leader`` as in ``_with_few_waiting``."""
        tape, entry = self.tape, {**leader, **self.head}.get
        op, a, b = tape.op, tape.a, tape.b
        reads: dict[int, Sequence[int]] = {}
        for node in self.order:
            if ARITY[op[node]] == 2 and node not in self.stretches:
                x, y = abs(a[node]), abs(b[node])
                reads[node] = (entry(x, x), entry(y, y))
            else:
                refs = [abs(ref) for member in self._operations(node) for ref in tape.operands(member)]
                reads[node] = [read for read in [entry(ref, ref) for ref in refs] if read != node]
        return reads

    def _joined_maps(self) -> dict[int, tuple[Map, int]]:
        """Return ``maps``."""
        tape = self.tape
        numbers = {tape.a[node] for node in self.live if tape.op[node] is _MAP}
        joined = Map.together({number: cast("Map", tape.maps[number]) for number in sorted(numbers)})
        return {number: (loop, start) for loop, starts in joined for number, start in starts.items()}

    def _with_few_waiting(self, leader: Mapping[int, int]) -> list[int]:
        """Return ``order`` with paragraphs arranged so that few values wait between them (see ``paragraphs.reorder``).
        ``leader`` maps each operation that is computed together with an earlier one to this one. Shared stretches are
        joined in place of this, and functions with loops or Maps keep their order."""
        if self.stretches:
            return self._join(leader)
        if self.loops or self.maps:
            return self.order
        paragraphs: list[list[int]] = []
        label: str | None = None
        end = 0
        for node in self.order:
            if node >= end:
                before, (_, end, label) = label, self.tape.label_range(node)
                if label != before or not paragraphs:
                    paragraphs.append([])
            paragraphs[-1].append(node)
        return reorder(paragraphs, self._reads(leader))

    def _cut(self, part_limit: int) -> dict[int, int]:
        """Set ``parts``, the number of parts, and return the number of the part of each operation in ``order``. Parts
        have nearly equal numbers of operations, at most ``part_limit``; a third of this in functions of more than
        four times the limit."""
        weights = [self.weight(node) for node in self.order]
        # Parts of a third of the limit: compilers take up to a third less time, and long functions no longer, for most
        # values wait in memory in any case. Forward dynamics of 2500 operations would take up to 9 % longer.
        parts_of_limit = 3 if sum(weights) > 4 * part_limit else 1
        self.parts = max(1, -(-parts_of_limit * sum(weights) // part_limit))
        length = max(1, -(-sum(weights) // self.parts))
        before = accumulate(weights, initial=0)
        return {node: begun // length for node, begun in zip(self.order, before, strict=False)}

    def weight(self, node: int) -> int:
        """Return the number of operations written for an entry of ``order``."""
        if node in self.stretches:
            return 4 * len(self.stretches[node])  # operations compile in the time of a call with its tables
        return self.loops[node].period if node in self.loops else 1

    def group(self, node: int) -> list[int]:
        """Return an operation and the operations computed together with it, in order."""
        others = self.members.get(node)
        return [node] if others is None else sorted([node, *others])

    def last_reads(self) -> dict[int, int]:
        """Return the last position in ``order`` at which each operation or input is read, also by expressions that are
        nested in later statements."""
        tape, last = self.tape, dict[int, int]()
        for position in range(len(self.order) - 1, -1, -1):
            node = self.order[position]
            read_at = max(position, last.get(node, position)) if self.uses[node] == 1 else position
            for member in self._operations(node):
                for ref in tape.operands(member):
                    last[abs(ref)] = max(read_at, last.get(abs(ref), read_at))
        return last

    def _leaders(self) -> dict[int, int]:
        op, a = self.tape.op, self.tape.a
        first_of: dict[int, int] = {}  # by loop, or by negative argument
        leader: dict[int, int] = {}
        for node in self.live:
            if node in self.head:
                continue
            code = op[node]
            if code in _CIRCULAR or code is _MAP:
                first = first_of.setdefault(id(self.maps[a[node]][0]) if code is _MAP else -abs(a[node]), node)
                if first != node:
                    leader[node] = first
        return leader

    def _count_reads(self) -> None:
        """Count the reads of each operation in ``uses``, and find ``last_part`` and ``read_outside``. Operands of loops
        and shared stretches count twice, for separate statements."""
        tape, uses, last_part, head = self.tape, self.uses, self.last_part, self.head
        for node in self.order:
            part = self.part_of[node]
            if node in self.loops:  # operands of loops have separate statements, so they count twice
                members, times = list(chain.from_iterable(self.loops[node].iterations)), 2
            elif node in self.stretches:
                members, times = list(self._operations(node)), 2
            else:
                members, times = [node], 1
            for member in members:
                for ref in tape.operands(member):
                    operand = abs(ref)
                    if operand in uses:
                        if operand in head and head[operand] != node:
                            self.read_outside.add(operand)
                        uses[operand] += times
                        last_part[operand] = max(last_part[operand], part)

    def _count_stores(self, outputs: Sequence[Sequence[Ref]]) -> None:
        for number, refs in enumerate(outputs):
            for component, ref in enumerate(refs):
                if ref != ZERO and abs(ref) in self.uses:  # most entries of a whole matrix are zero
                    self.uses[abs(ref)] += 1
                    self.stores.setdefault(abs(ref), []).append((number, component, 1 if ref > 0 else -1))


class PartPlan(Plan):
    """The plan of a part by itself, which computes its operations again if earlier parts have computed them."""

    angles_first = False

    def __init__(self, whole: Plan, order: Sequence[int], outputs: Sequence[Sequence[Ref]], kept: Set[int]) -> None:
        """Take operations of a plan without loops in order. ``outputs`` have the references that the part stores, and
        zeros; ``kept`` are operations whose results later parts read."""
        self.tape, self.added, self.parts = whole.tape, {}, 1
        self.loops, self.stretches, self.maps, self.head = {}, {}, {}, {}
        self.order, self.by_part = list(order), [list(order)]
        self.members = {node: whole.members[node] for node in order if node in whole.members}
        self.live = [member for node in order for member in self.group(node)]
        self.part_of = dict.fromkeys(self.live, 0)
        self.last_part = {node: int(node in kept) for node in self.live}
        self.uses, self.read_outside, self.stores = dict.fromkeys(self.live, 0), set(), {}
        self._count_reads()
        self._count_stores(outputs)
        place = {member: k for k, node in enumerate(order) for member in self.group(node)}
        for member in self.live:
            for operand in map(abs, self.tape.operands(member)):
                if place[member] - place.get(operand, len(place)) > NEST_LIMIT:
                    self.uses[operand] += 1  # as if read twice: a nested operation would keep its operands live so far
