"""Hermite's corrector of order 4: one implicit step from accelerations and their rates at both ends.

    y_1 = y_0 + h/2 (y'_0 + y'_1) + h^2/12 (y''_0 - y''_1)

for y = (q, v, z), quaternions as they are and brought to unit length; y'' comes from the recurrence that Taylor steps use. Solved
by corrections, from what the last step foretells (Makino and Aarseth, Publ. Astron. Soc. Japan 44 (1992) 141). Symmetric, so
energies of oscillations do not drift. Where a step is too large for the highest frequency corrections diverge, and the run stops.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from eomgen.integrators.needs import Need

HERMITE = "hermite"
#: Corrections end where they change no component by more than this part of the largest one, or of 1.
CORRECTION_TOLERANCE = 1e-14
#: Corrections of a step at most.
MOST_CORRECTIONS = 30
#: Corrections have settled, too, when they shrink no more and are below this.
ROUND_OFF = 1e-12

_UNCONSTRAINED = Need(
    "constraints", False, "it steps ordinary differential equations and would ignore the constraint equations",
    "generalized_alpha, which keeps constraints, rk4_partitioned, which eliminates them, or a tree of joints",
)  # fmt: skip


@dataclass(frozen=True)
class Hermite:
    """Hermite's corrector with fixed steps."""

    family: str = field(default=HERMITE, init=False)
    order: int = field(default=4, init=False)
    source: str = field(default="Makino and Aarseth 1992", init=False)
    needs: tuple[Need, ...] = field(default=(_UNCONSTRAINED,), init=False)


def hermite_data(method: Hermite) -> dict[str, Any]:
    """Return what the template needs of the method, the functions of the recurrence aside."""
    return {
        "title": f"Hermite's corrector of order {method.order}, from accelerations and their rates",
        "max_order": 2,
        "correction_tolerance": CORRECTION_TOLERANCE,
        "round_off": ROUND_OFF,
        "max_iterations": MOST_CORRECTIONS,
        "input_times": [0.0, 1.0],
        "rows_per_step": 1,
    }
