"""Joining: occurrences of a shared stretch that do not depend on one another, as for the tyres of a car, are computed
by one call, in the lanes of vectors.

An entry is an operation or an occurrence. Joined entries are computed together, after all entries that one of them
reads, and occurrences are joined only if all entries still have an order.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from heapq import heappop, heappush

from eomgen.codegen.scheduling.sharing import CALL, Occurrence

#: Occurrences that one call computes: in vectors of two, the places of the operands cost as much as is saved.
LANES = 4


def join(
    order: Sequence[int], reads: Mapping[int, Sequence[int]], stretches: Mapping[int, Occurrence]
) -> tuple[list[int], dict[int, tuple[Occurrence, ...]]]:
    """Return the entries in order, the first one of joined entries in place of all, and the occurrences that an entry
    computes.

    Parameters
    ----------
    order : entries in an order in which they can be computed
    reads : other entries, and inputs, that an entry reads
    stretches : occurrences by entry
    """
    rows = _rows(list(stretches.values()), _needs(order, reads, stretches))
    entries, first = list(stretches), dict[int, int]()  # the others of a group -> the first one
    groups: dict[int, tuple[Occurrence, ...]] = {entry: (stretch,) for entry, stretch in stretches.items()}
    for row in rows:
        members = [entries[k] for k in row]
        first |= dict.fromkeys(members[1:], members[0])
        groups |= {members[0]: tuple(stretches[entry] for entry in members)}
    groups = {entry: group for entry, group in groups.items() if entry not in first}
    if not rows:
        return list(order), groups
    together = {entry: list(reads[entry]) for entry in order if entry not in first}
    for entry, head in first.items():
        together[head] += reads[entry]
    return _sort({entry: [first.get(read, read) for read in together[entry]] for entry in together}), groups


def _needs(order: Sequence[int], reads: Mapping[int, Sequence[int]], stretches: Mapping[int, Occurrence]) -> list[int]:
    """Return the occurrences on which each occurrence depends, directly or not, as bits of an integer."""
    bit = {entry: 1 << k for k, entry in enumerate(stretches)}
    above: dict[int, int] = {}  # with the own bit
    for entry in order:
        bits = bit.get(entry, 0)
        for read in reads[entry]:
            bits |= above.get(read, 0)
        above[entry] = bits
    return [above[entry] ^ bit[entry] for entry in stretches]


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


def _sort(reads: Mapping[int, Sequence[int]]) -> list[int]:
    """Return entries so that each comes after the entries that it reads: of all that may come next, the first in the
    given order."""
    order = list(reads)
    readers: dict[int, list[int]] = {entry: [] for entry in order}
    missing = [0] * len(order)
    for place, entry in enumerate(order):
        for read in reads[entry]:
            if read in readers:
                readers[read].append(place)
                missing[place] += 1
    ready = [place for place, count in enumerate(missing) if not count]  # increasing, so a heap
    result: list[int] = []
    while ready:
        entry = order[heappop(ready)]
        result.append(entry)
        for place in readers[entry]:
            missing[place] -= 1
            if not missing[place]:
                heappush(ready, place)
    return result
