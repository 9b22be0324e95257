"""Order of the paragraphs of a function, so that few values wait at once: a branch of a tree is carried outwards and
back before the next branch begins.

Mechanics records quantity after quantity, accelerations of all bodies before the forces of any body, so that values of
all bodies wait for the last step, more than a processor has registers for, and in lanes more than a first-level cache
holds. A paragraph, the operations with one label in the generated C, stays whole.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

#: Values that may wait at once: functions with fewer keep the order in which they were recorded. AVX2 and NEON have
#: 16 and 32 registers for numbers.
REGISTERS = 32


def reordered(order: Sequence[int], labels: Sequence[str], reads: Mapping[int, Collection[int]]) -> list[int]:
    """Return the operations with fewer waiting values, or in the given order if none is better.

    Parameters
    ----------
    order : the operations, each after the operations that it reads.
    labels : the label of each operation; neighbours with the same label are a paragraph.
    reads : the operations that each operation reads.
    """
    before = _waiting(order, reads)
    if before <= REGISTERS:
        return list(order)
    found = _Paragraphs(order, labels, reads).depth_first()
    return found if _waiting(found, reads) < before else list(order)


def _waiting(order: Sequence[int], reads: Mapping[int, Collection[int]]) -> int:
    """Return the largest number of values that wait for a read at any place of an order."""
    last = {operand: place for place, node in enumerate(order) for operand in reads[node]}
    ends = [0] * len(order)
    for place in last.values():
        ends[place] += 1
    waiting = most = 0
    for place, node in enumerate(order):
        waiting += (node in last) - ends[place]
        most = max(most, waiting)
    return most


class _Paragraphs:
    """Paragraphs of a function with the values that pass between the paragraphs.

    Attributes
    ----------
    growth : by how many the waiting values grow with each paragraph; less and less as other paragraphs are done.
    missing : number of paragraphs that have to be done before each.
    """

    def __init__(self, order: Sequence[int], labels: Sequence[str], reads: Mapping[int, Collection[int]]) -> None:
        self.nodes: list[list[int]] = []
        of: dict[int, int] = {}
        previous: str | None = None
        for node, label in zip(order, labels, strict=True):
            if label != previous:
                self.nodes.append([])
                previous = label
            self.nodes[-1].append(node)
            of[node] = len(self.nodes) - 1
        count = len(self.nodes)
        readers: dict[int, set[int]] = {}
        for node in order:
            for operand in reads[node]:
                if of[operand] != of[node]:
                    readers.setdefault(operand, set()).add(of[node])
        self.earlier: list[set[int]] = [set() for _ in range(count)]
        self.later: list[set[int]] = [set() for _ in range(count)]
        self.read: list[list[int]] = [[] for _ in range(count)]
        self.growth = [0] * count
        self.readers = readers
        for value, by in readers.items():
            own = of[value]
            self.growth[own] += 1
            for paragraph in by:
                self.read[paragraph].append(value)
                self.earlier[paragraph].add(own)
                self.later[own].add(paragraph)
            if len(by) == 1:
                self.growth[next(iter(by))] -= 1
        self.missing = [len(paragraphs) for paragraphs in self.earlier]
        self.left = {value: len(by) for value, by in readers.items()}
        self.done = [False] * count
        self.found: list[int] = []

    def depth_first(self) -> list[int]:
        """Return the operations: before a paragraph the paragraphs that it needs, the last recorded first, and after a
        paragraph all by which no more values wait."""
        for last in range(len(self.nodes) - 1, -1, -1):
            waiting = [(last, self._needed(last))]
            while waiting:
                paragraph, needed = waiting[-1]
                while needed and self.done[needed[-1]]:
                    needed.pop()
                if needed:
                    waiting.append((needed[-1], self._needed(needed[-1])))
                else:
                    self._do(paragraph)
                    waiting.pop()
        return self.found

    def _needed(self, paragraph: int) -> list[int]:
        return sorted(other for other in self.earlier[paragraph] if not self.done[other])

    def _do(self, paragraph: int) -> None:
        """Append a paragraph, and all that can be done by now and lets no more values wait."""
        ready = [paragraph]
        while ready:
            own = ready.pop()
            if self.done[own]:
                continue
            self.done[own] = True
            self.found += self.nodes[own]
            changed = set(self.later[own])
            for other in changed:
                self.missing[other] -= 1
            for value in self.read[own]:
                self.left[value] -= 1
                if self.left[value] == 1:
                    (reader,) = [other for other in self.readers[value] if not self.done[other]]
                    self.growth[reader] -= 1
                    changed.add(reader)
            free = [other for other in changed if not self.missing[other] and self.growth[other] <= 0]
            ready += sorted(free, key=lambda other: (-self.growth[other], -other))
