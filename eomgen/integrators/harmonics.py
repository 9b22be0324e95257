"""Inputs that are sums of harmonics in time, such as random roads, at the times of a step's grid.

Between the times T + d of a block about T the phases w d alone differ:

    sum a cos w (T + d) + b sin w (T + d) = sum A cos w d + B sin w d
    A = a cos w T + b sin w T,    B = b cos w T - a sin w T

cos w d and sin w d are the same in all blocks of a grid, and T + d and T - d have the sums over A and over B in common
but for a sign. So a time costs one sine and one cosine of each frequency in ``2 * PAIRS`` times, and two
multiplications and additions of each harmonic. Which block a time is in follows from the count of steps alone, so a
run that is resumed has the same bits.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from eomgen.system.system import System

#: Pairs of times in a block.
PAIRS = 8
#: Fewer harmonics of one input are as fast one by one.
LEAST = 16
#: Inputs whose sums are taken side by side: two for each are in registers.
_SIDE_BY_SIDE = 4
#: The number of harmonics is rounded up to a multiple of this number by harmonics of amplitude 0, so that loops need no
#: remainder.
_MULTIPLE = 8


def harmonics_data(system: System) -> dict[str, Any] | None:
    """Return the data of the templates for inputs that are sums of harmonics, evaluated at the times of the step grid.
    None unless every given input is a sum of harmonics or constant and one has many, and if steps may leave the grid:
    at jumps, samples and events. Inputs with the same frequencies form groups of up to four with common sines and
    cosines."""
    if system.discontinuities or system.sampled or system.events:
        return None
    constant: list[list[float]] = []
    by_frequencies: dict[tuple[float, ...], list[tuple[int, tuple[float, ...], tuple[float, ...]]]] = {}
    for index, component in enumerate(system.harmonics):
        if isinstance(component, float):
            constant.append([index, component])
            continue
        in_phase, frequencies, quadrature = component
        by_frequencies.setdefault(frequencies, []).append((index, in_phase, quadrature))
    if max(map(len, by_frequencies), default=0) < LEAST:  # with no inputs too
        return None
    groups, first = [], 0
    for frequencies, inputs in by_frequencies.items():
        count = -(-len(frequencies) // _MULTIPLE) * _MULTIPLE
        for start in range(0, len(inputs), _SIDE_BY_SIDE):
            group_inputs = inputs[start : start + _SIDE_BY_SIDE]
            groups.append(
                {
                    "first": first,
                    "count": count,
                    "stretch": _stretch(count),
                    "frequencies": _pad(frequencies, count) if start == 0 else [],
                    "inputs": [index for index, _, _ in group_inputs],
                    "in_phase": [_pad(column, count) for _, column, _ in group_inputs],
                    "quadrature": [_pad(column, count) for _, _, column in group_inputs],
                }
            )
        first += count
    return {"pairs": PAIRS, "frequencies": first, "groups": groups, "constant": constant}


def _stretch(count: int) -> int:
    """Return the number of harmonics that are summed before the sums are stored: the largest allowed divisor of
    `count`."""
    # sums of more harmonics would wait in memory that is farther away
    sizes = range(_MULTIPLE, 8 * _MULTIPLE + 1, _MULTIPLE)
    return max(size for size in sizes if count % size == 0 or size == _MULTIPLE)


def _pad(column: Sequence[float], count: int) -> list[float]:
    return [*column, *[0.0] * (count - len(column))]
