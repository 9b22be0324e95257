"""Lengths of the elements of a beam that has nodes at given places."""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise


def widths_between(places: Sequence[Fraction], count: int) -> tuple[Fraction, ...]:
    """Return the lengths of ``count`` elements, or of one between each two places where these are more.

    The longest element is as short as can be: each further element goes to where elements are longest.

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
