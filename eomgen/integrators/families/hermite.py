"""Hermite's corrector of order 4: one implicit step from accelerations and their rates at both ends.

    y_1 = y_0 + h/2 (y'_0 + y'_1) + h^2/12 (y''_0 - y''_1)

for y = (q, v, z), quaternions as they are and brought to unit length; y'' comes from the recurrence that Taylor steps use. Solved
by corrections, from what the last step foretells (Makino and Aarseth, Publ. Astron. Soc. Japan 44 (1992) 141). Symmetric, so
energies of oscillations do not drift. Where a step is too large for the highest frequency corrections diverge, and the run stops.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from eomgen.integrators.families.family import UNCONSTRAINED, Need

HERMITE = "hermite"
#: Corrections end where they change no component by more than this part of the sizes of its kind, in units of rounding.
CORRECTION_TOLERANCE = 45.0
#: Corrections of a step at most.
MOST_CORRECTIONS = 30
#: Corrections have settled, too, when they shrink no more and are below this, in the same units.
ROUND_OFF = 4500.0
#: The part of 1 rad, or of the size of the machine, that counts as the size of a smaller motion: rounding is not far below.
COARSE = 0.01
#: By how much the square of a quaternion's length may be off before it is brought to 1; steps that settle miss it by far less.
STRETCH = 0.1


@dataclass(frozen=True)
class Hermite:
    """Hermite's corrector with fixed steps."""

    family: str = field(default=HERMITE, init=False)
    order: int = field(default=4, init=False)
    source: str = field(default="Makino and Aarseth 1992", init=False)
    needs: tuple[Need, ...] = field(default=(UNCONSTRAINED,), init=False)


def hermite_data(method: Hermite) -> dict[str, Any]:
    """Return what the template needs of the method, the functions of the recurrence aside."""
    return {
        "title": f"Hermite's corrector of order {method.order}, from accelerations and their rates",
        "max_order": 2,
        "correction_tolerance": CORRECTION_TOLERANCE,
        "round_off": ROUND_OFF,
        "coarse": COARSE,
        "stretch": STRETCH,
        "max_iterations": MOST_CORRECTIONS,
        "input_times": [0.0, 1.0],
        "rows_per_step": 1,
    }
