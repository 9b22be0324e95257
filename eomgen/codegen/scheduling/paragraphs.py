"""Order of the paragraphs of a function, so that few values wait at once: a branch of a tree is carried outwards and
back before the next branch begins.

Mechanics records quantity after quantity, accelerations of all bodies before the forces of any body, so that values of
all bodies wait for the last step, more than a processor has registers for, and in lanes more than a first-level cache
holds. A paragraph, the operations with one label in the generated C, stays whole.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import accumulate, chain

#: Values that may wait between paragraphs: functions with fewer keep the order in which they were recorded. AVX2 and
#: NEON have 16 and 32 registers for numbers.
REGISTERS = 32


def reorder(paragraphs: Sequence[Sequence[int]], reads: Mapping[int, Sequence[int]]) -> list[int]:
    """Return the operations in an order of paragraphs with fewer values that wait between paragraphs.

    The recorded order is kept if at most ``REGISTERS`` values wait, or if depth first is not better.

    Parameters
    ----------
    paragraphs : the operations of each paragraph; operations read earlier ones.
    reads : the operations and leaves that each operation reads.
    """
    graph = _Paragraphs(paragraphs, reads)
    order = list(range(len(paragraphs)))
    before = graph.waiting(order)
    if before > REGISTERS:
        by_depth = graph.depth_first()
        order = by_depth if graph.waiting(by_depth) < before else order
    return list(chain.from_iterable(paragraphs[number] for number in order))


class _Paragraphs:
    """Paragraphs of a function, numbered in recorded order, with the values that pass between the paragraphs.

    Attributes
    ----------
    of : the paragraph of each operation.
    readers : the paragraphs that read each value of another paragraph; ``read`` : these values of each paragraph.
    earlier, later : for each paragraph, the paragraphs of whose values it reads, and the paragraphs that read its
        values.
    growth : by how many the waiting values grow with each paragraph; less and less as other paragraphs are done.
    missing : number of paragraphs that have to be done before each.
    left : number of paragraphs that still read each value; ``done`` and ``order`` : the paragraphs done so far.
    """

    def __init__(self, paragraphs: Sequence[Sequence[int]], reads: Mapping[int, Sequence[int]]) -> None:
        """Collect all attributes from the operations of each paragraph and the values that each operation reads."""
        self.of = {node: number for number, nodes in enumerate(paragraphs) for node in nodes}
        home = self.of.get
        self.readers: dict[int, set[int]] = {}
        for number, nodes in enumerate(paragraphs):
            for node in nodes:
                for operand in reads[node]:
                    if home(operand, number) != number:
                        self.readers.setdefault(operand, set()).add(number)
        count = len(paragraphs)
        self.earlier: list[set[int]] = [set() for _ in range(count)]
        self.later: list[set[int]] = [set() for _ in range(count)]
        self.read: list[list[int]] = [[] for _ in range(count)]
        self.growth = [0] * count
        for value, by in self.readers.items():
            made = self.of[value]
            self.growth[made] += 1
            self.later[made] |= by
            for number in by:
                self.read[number].append(value)
                self.earlier[number].add(made)
            if len(by) == 1:
                self.growth[next(iter(by))] -= 1
        self.missing = [len(numbers) for numbers in self.earlier]
        self.left = {value: len(by) for value, by in self.readers.items()}
        self.done = [False] * count
        self.order: list[int] = []

    def waiting(self, order: Sequence[int]) -> int:
        """Return the largest number of values that wait between two paragraphs of an order."""
        position = {number: k for k, number in enumerate(order)}
        change = [0] * (len(order) + 1)
        for value, by in self.readers.items():
            change[position[self.of[value]]] += 1
            change[max(position[number] for number in by)] -= 1
        return max(accumulate(change))

    def depth_first(self) -> list[int]:
        """Return the paragraphs in depth-first order, from the last paragraph on; may be called once. Before a
        paragraph come the paragraphs whose values it reads, the last recorded first; after a paragraph come all
        paragraphs that are ready and do not raise the number of waiting values."""
        for last in range(len(self.done) - 1, -1, -1):
            open_paragraphs = [(last, self._pending_paragraphs(last))]
            while open_paragraphs:
                number, needed = open_paragraphs[-1]
                while needed and self.done[needed[-1]]:
                    needed.pop()
                if needed:
                    open_paragraphs.append((needed[-1], self._pending_paragraphs(needed[-1])))
                else:
                    self._do(number)
                    open_paragraphs.pop()
        return self.order

    def _pending_paragraphs(self, number: int) -> list[int]:
        return sorted(earlier for earlier in self.earlier[number] if not self.done[earlier])

    def _do(self, number: int) -> None:
        """Append a paragraph to ``order``, and then all paragraphs that are ready and do not raise the number of
        waiting values."""
        ready = [number]
        while ready:
            first = ready.pop()
            if self.done[first]:
                continue
            self.done[first] = True
            self.order.append(first)
            changed = set(self.later[first])
            for later in changed:
                self.missing[later] -= 1
            for value in self.read[first]:
                self.left[value] -= 1
                if self.left[value] == 1:
                    (reader,) = [later for later in self.readers[value] if not self.done[later]]
                    self.growth[reader] -= 1
                    changed.add(reader)
            free = [later for later in changed if not self.missing[later] and self.growth[later] <= 0]
            ready += sorted(free, key=lambda later: (-self.growth[later], -later))
