"""Runge-Kutta-Munthe-Kaas for constrained systems: constraints are eliminated by coordinate partitioning, stage by stage.

Partitioning: Wehage and Haug, J. Mech. Des. 104 (1982) 247. What one stage gives is the Runge-Kutta method's own field made
continuous off the constraints by a smooth correction, so the order stays the method's: Hairer, Lubich, Wanner, Geometric
Numerical Integration (2006), section IV.4.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from eomgen.integrators.families.family import Need
from eomgen.integrators.families.runge_kutta import RUNGE_KUTTA_MUNTHE_KAAS_4, RungeKuttaMuntheKaas

PARTITIONED = "partitioned"

#: Largest component of B_D^-1 B_I, velocities weighed by the roots of their inertias, with which a partition is kept, and
#: below which there is nothing to improve when one is chosen. 1 can always be had. Errors of the independent components come
#: back multiplied: on the spatial slider-crank in absolute coordinates (90 rad/s, steps of 2e-4 s) the error after 0.2 s is
#: 1.1e-5 with a bound of 1.02, 5.5e-4 with 1.5, 2e-2 with 3, and of order one with 10.
LARGEST_GAIN, GOOD_GAIN = 1.02, 1.01
#: Pivots of B_D that are this much smaller than the largest, rows and columns weighed, count as zero.
SMALLEST_PIVOT = 1e-9
#: Parts of what the smallest pivot of B_D has been at most: a singular position is near below the first, so that corrections take
#: factors of their own; below the second accelerations are continued from those before, for digits that they lose grow with its
#: third power.
NEAR_PART, SINGULAR_PART = 0.03, 3e-4

_CONSTRAINED = Need(
    "constraints", True, "it eliminates constraint equations, and rk4 does the same work where there are none", "rk4"
)  # fmt: skip


@dataclass(frozen=True)
class PartitionedRungeKutta(RungeKuttaMuntheKaas):
    """An explicit Runge-Kutta method in the Lie algebra whose stages are brought onto the constraints.

    As many velocity components as there are constraint rows are dependent (D), the rest independent (I). Positions and
    velocities are corrected along D only, and accelerations follow from (R^T M R) vdot_I = -R^T r, R = [-B_D^-1 B_I; 1].
    """

    family: str = field(default=PARTITIONED, init=False)
    needs: tuple[Need, ...] = field(default=(_CONSTRAINED,), init=False)


PARTITIONED_RUNGE_KUTTA_4 = PartitionedRungeKutta(
    A=RUNGE_KUTTA_MUNTHE_KAAS_4.A,
    b=RUNGE_KUTTA_MUNTHE_KAAS_4.b,
    c=RUNGE_KUTTA_MUNTHE_KAAS_4.c,
    order=RUNGE_KUTTA_MUNTHE_KAAS_4.order,
    commutators=RUNGE_KUTTA_MUNTHE_KAAS_4.commutators,
    source="Munthe-Kaas 1999; Wehage and Haug 1982",
)
