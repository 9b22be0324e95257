"""Changes of a start by the constraints, in the coordinates and velocities that it was given in."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.text import distinct
from eomgen.solvers.beams import STRAINED
from eomgen.solvers.consistency import Assembly

#: Beginning of the sentence.
CORRECTED = "corrected onto the constraints: "
#: Parts of the machine, of 1 rad, or of the largest velocity of the unit, from which on a change is told; how many are
#: listed.
_TOLD, _LISTED = 1e-6, 6


def tells_strain(sentence: str) -> bool:
    """Return whether a sentence on a start is about beams that a loop strains."""
    return STRAINED in sentence


def corrected_start(
    consistent: Assembly,
    guess: tuple[Array, Array],
    names: tuple[Sequence[str], Sequence[str]],
    units: tuple[Sequence[str], Sequence[str]],
) -> list[str]:
    """Return one sentence on the largest changes from a guess to a consistent state; none if changes are small.

    Parameters
    ----------
    guess, names, units : of q and of v
    """
    changed = []
    held = (consistent.violations, {**consistent.violations, **consistent.rate_violations})
    for before, after, labels, measured, off in zip(
        guess, (consistent.q, consistent.v), names, units, held, strict=True
    ):
        largest = np.maximum(np.abs(before), np.abs(after))
        for k, (name, unit) in enumerate(zip(labels, measured, strict=True)):
            same = [index for index, other in enumerate(measured) if other == unit]
            size = largest[same].max() if unit.endswith("/s") else consistent.extent if unit == "m" else 1.0
            share = abs(after[k] - before[k]) / size if off and size else 0.0
            if share > _TOLD:
                first, second = distinct(before[k] + 0.0, after[k] + 0.0)
                changed.append((share, f"{name} {first} -> {second}{'' if unit in ('', '1') else f' {unit}'}"))
    changed.sort(key=lambda change: -change[0])
    more = f" and {len(changed) - _LISTED} more" if len(changed) > _LISTED else ""
    return [f"{CORRECTED}{', '.join(text for _, text in changed[:_LISTED])}{more}"] if changed else []
