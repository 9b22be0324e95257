"""Joining: occurrences of a shared stretch that do not depend on one another, as for the tyres of a car, are computed
by one call, in the lanes of vectors.

An entry is an operation or an occurrence. Joined entries are computed together, after all entries that one of them
reads, and occurrences are joined only if all entries still have an order.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from heapq import heappop, heappush

from eomgen.codegen.scheduling.sharing import CALL, Occurrence

#: Occurrences that one call computes: in vectors of two, the places of the operands cost as much as is saved.
LANES = 4


def join(
    order: Sequence[int], reads: Mapping[int, Set[int]], stretches: Mapping[int, Occurrence]
) -> tuple[list[int], dict[int, tuple[Occurrence, ...]]]:
    """Return the entries in order, the first one of joined entries in place of all, and the occurrences that an entry
    computes.

    Parameters
    ----------
    order : entries in an order in which they can be computed
    reads : other entries that an entry reads
    stretches : occurrences by entry
    """
    needs = _needs(order, reads, stretches)
    entries = list(stretches)
    first = dict(zip(order, order, strict=True))
    groups: dict[int, tuple[Occurrence, ...]] = {entry: (stretch,) for entry, stretch in stretches.items()}
    for row in _rows(list(stretches.values()), needs):
        members = [entries[k] for k in row]
        first |= dict.fromkeys(members, members[0])
        groups[members[0]] = tuple(stretches[entry] for entry in members)
        for entry in members[1:]:
            del groups[entry]
    together: dict[int, set[int]] = {}
    for entry in order:
        together.setdefault(first[entry], set()).update(first[read] for read in reads[entry])
    return _sort(together), groups


def _needs(order: Sequence[int], reads: Mapping[int, Set[int]], stretches: Mapping[int, Occurrence]) -> list[int]:
    """Return the occurrences on which each occurrence depends, directly or not, as bits of an integer."""
    bit = {entry: 1 << k for k, entry in enumerate(stretches)}
    needs: dict[int, int] = {}
    for entry in order:
        bits = 0
        for read in reads[entry]:
            bits |= needs[read] | bit.get(read, 0)
        needs[entry] = bits
    return [needs[entry] for entry in stretches]


def _rows(stretches: Sequence[Occurrence], needs: list[int]) -> list[list[int]]:
    """Return the numbers of the occurrences that are joined, by group. ``needs`` is changed: joined occurrences have
    the needs of each other, and readers of one need all."""
    rows: list[list[int]] = []
    alike: dict[int, list[int]] = {}
    for k, stretch in enumerate(stretches):
        if _pays(stretch):
            alike.setdefault(id(stretch.body), []).append(k)
    for left in alike.values():
        while len(left) >= LANES:
            row, inside, before = list[int](), 0, 0
            for k in left:
                if len(row) < LANES and not (needs[k] & inside or before >> k & 1):
                    row.append(k)
                    inside, before = inside | 1 << k, before | needs[k]
            if len(row) < LANES:
                del left[0]
                continue
            rows.append(row)
            for k, bits in enumerate(needs):
                if bits & inside:
                    needs[k] = bits | before | inside
                elif k in row:
                    needs[k] = before
            left[:] = [k for k in left if k not in row]
    return rows


def _pays(stretch: Occurrence) -> bool:
    """Return whether one call for ``LANES`` occurrences takes less time than a call for each. An operation on vectors
    takes as long as one on numbers; a value that goes into a lane, or out of it, takes one operation more."""
    moved = len(stretch.reads) + len(stretch.results) + len(stretch.components) + len(stretch.numbers)
    computed = CALL + len(stretch.nodes)
    return computed + LANES * 2 * moved < LANES * (computed + moved)


def _sort(reads: Mapping[int, Set[int]]) -> list[int]:
    """Return entries so that each comes after the entries that it reads: of all that may come next, the first in the
    given order."""
    order = list(reads)
    position = {entry: place for place, entry in enumerate(order)}
    missing = {entry: len(reads[entry]) for entry in order}
    readers: dict[int, list[int]] = {entry: [] for entry in order}
    for entry in order:
        for read in reads[entry]:
            readers[read].append(position[entry])
    ready = [position[entry] for entry in order if not missing[entry]]  # in order, so a heap
    result: list[int] = []
    while ready:
        entry = order[heappop(ready)]
        result.append(entry)
        for place in readers[entry]:
            missing[order[place]] -= 1
            if not missing[order[place]]:
                heappush(ready, place)
    return result
