"""Lengths of the elements of a beam that has nodes at given places."""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise


def widths_between(places: Sequence[Fraction], count: int) -> tuple[Fraction, ...]:
    """Return the lengths of ``count`` elements with nodes at ``places``; at least one element between two places.

    The longest element is as short as possible: each further element splits the piece with the longest elements.

    Parameters
    ----------
    places : in increasing order, both ends among them
    """
    pieces = [end - start for start, end in pairwise(places)]
    counts = [1] * len(pieces)
    longest = [(-piece, number) for number, piece in enumerate(pieces)]
    heapq.heapify(longest)
    for _ in range(count - len(pieces)):
        _, number = heapq.heappop(longest)
        counts[number] += 1
        heapq.heappush(longest, (-pieces[number] / counts[number], number))
    return tuple(piece / parts for piece, parts in zip(pieces, counts, strict=True) for _ in range(parts))
