"""Runge-Kutta-Munthe-Kaas with coordinate partitioning: dependent coordinates are eliminated at each stage; with fixed
steps, and embedded pairs with adaptive steps.

Partitioning: Wehage and Haug, J. Mech. Des. 104 (1982) 247. The field of one stage is the Runge-Kutta method's own
made continuous off the constraints by a smooth correction, so the order stays the method's: Hairer, Lubich, Wanner,
Geometric Numerical Integration (2006), section IV.4.

Pairs are rows of ``embedded_pair``, in the Lie algebra.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

from eomgen.base.data import dataclass
from eomgen.errors import ModelError, Problem
from eomgen.integrators.families.adaptive import STEP_GROUPS, step_state, step_statistics, step_statuses
from eomgen.integrators.families.embedded_pair import PAIRS, EmbeddedRungeKutta
from eomgen.integrators.families.family import (
    BAD_ARGUMENT,
    KINEMATIC,
    NOT_CONSISTENT,
    NOT_FINITE,
    SINGULAR_ADVICE,
    SMALLER_STEP,
    Field,
    MethodName,
    Sizes,
    Status,
    rotation_too_large,
    velocities,
)
from eomgen.integrators.families.needs import SystemRequirement, needs_constraints
from eomgen.integrators.families.runge_kutta import RUNGE_KUTTA_MUNTHE_KAAS_4, RungeKuttaMuntheKaas

if TYPE_CHECKING:
    from eomgen.system.system import System


#: Limits of the templates. ``max_iterations``: corrections of positions by Newton's method at most. ``largest_gain``
#: and ``good_gain``: largest component of B_D^-1 B_I, velocities weighed by the roots of their inertias, up to which a
#: partition is kept, and below which the search for a partition ends. Errors of the independent components come back
#: multiplied: on the spatial slider-crank in absolute coordinates (90 rad/s, steps of 2e-4 s) the error after 0.2 s is
#: 1.1e-5 with a bound of 1.02, 5.5e-4 with 1.5, 2e-2 with 3, and of order one with 10. ``smallest_pivot``: pivots of
#: B_D that are this much smaller than the largest, rows and columns weighed, count as zero. ``near_part`` and
#: ``singular_part``: ratios of the smallest pivot of B_D to its largest value so far: below the first ratio a singular
#: position is near, so that corrections have new factors; below the second ratio accelerations are extrapolated from
#: earlier accelerations, because the loss of digits grows with the third power of the ratio.
_LIMITS: Mapping[str, float] = {
    "max_iterations": 16,
    "largest_gain": 1.02,
    "good_gain": 1.01,
    "smallest_pivot": 1e-9,
    "near_part": 0.03,
    "singular_part": 3e-4,
}


def partition_state(sizes: Sizes) -> tuple[Field, ...]:
    """Return the members of a stepper's state for coordinate partitioning, and for passing singular positions."""
    largest = "largest value so far of the smallest pivot of B_D, rows and columns weighted by inertia"
    times = "times of the last two states with regular constraints, newest first"
    return (
        Field("dependent", "velocity components that follow from the others, in increasing order", sizes.lam, "long"),
        Field("largest_regularity", largest, group="passage"),
        Field("passage_t", times, 2, "real", "passage", "t"),
        Field("passage_vdot", "accelerations of these states", 2 * sizes.v, "real", "passage", "vdot"),
        Field("history", "number of these states", 0, "long", "passage"),
        Field("singularity_near", "1: a singular position is near", 0, "long", "passage"),
    )


PARTITION_STATISTICS = (
    Field("partitions", "number of sets of dependent components in use, one after the other", 0, "long"),
    Field("max_constraint", "largest |Phi| over the ends of all steps"),
    Field("max_constraint_velocity", "largest |w| over these states"),
    Field("max_pivot_ratio", "largest ratio of largest to smallest weighted pivot of B_D over all evaluations"),
    Field(
        "singular_passages",
        "number of singular, or nearly singular, positions of the constraints that were passed",
        0,
        "long",
    ),
)


def partition_statuses(angles: bool) -> tuple[Status, ...]:
    """Return the failures of steps with coordinate partitioning; `angles`: whether angles are counted over turns."""
    slipped = "the correction of the dependent coordinates did not converge, whichever they are"
    singular = (
        "the constraints are singular here or within the step, whichever coordinates depend on the others, "
        "or a part has no mass"
    )
    return (
        Status(1, "NOT_CONVERGED", slipped, SMALLER_STEP),
        Status(2, "SINGULAR", singular, f"{SMALLER_STEP}, {SINGULAR_ADVICE}"),
        NOT_FINITE,
        BAD_ARGUMENT,
        *((rotation_too_large(angles),) if angles else ()),
        NOT_CONSISTENT,
    )


def partition_data(system: System) -> Mapping[str, Any]:
    """Return the data of the templates for coordinate partitioning: unknowns, units of rows, and limits of pivots.
    Raises ModelError if there are more constraint rows than velocity components."""
    nv, nl = velocities(system.factors), len(system.multipliers)
    if nl > nv:
        fault = f"there are {nl} constraint rows for {nv} velocity components: some repeat others [E0346]"
        raise ModelError(Problem("method", fault, "leave out the rows that follow from others"))
    return {
        "matrices": False,
        "unknowns": {"v": nv, "lam": nl, "holonomic": system.holonomic, "eta": 0},
        "angular": [int(turns) for turns in system.angular],
        "lengths": [int(unit not in ("1", "1/s")) for unit in system.row_units],
        **_LIMITS,
    }


@dataclass(frozen=True)
class PartitionedRungeKutta(RungeKuttaMuntheKaas):
    """An explicit Runge-Kutta method in the Lie algebra whose stages are brought onto the constraints.

    As many velocity components as there are constraint rows are dependent (D), the rest independent (I). Positions and
    velocities are corrected along D only, and accelerations follow from (R^T M R) vdot_I = -R^T r, R = [-B_D^-1 B_I;
    1].
    """

    needs = (needs_constraints("rk4"),)
    family = "partitioned"
    holds_constraints = True
    passes_singularities = True
    state_is_all = False
    projection = "changes of the dependent components"
    groups = (("passage", "Data for passing singular positions of the constraints."),)

    @classmethod
    def names(cls) -> tuple[MethodName, ...]:
        return (
            MethodName(
                "rk4_partitioned",
                lambda: PARTITIONED_RUNGE_KUTTA_4,
                aliases=("partitioned",),
                idle=("rho_inf",),
                fixed_steps=("it has no estimate of its errors", "rk45_partitioned"),
            ),
        )

    @classmethod
    def terms(cls, constrained: bool, internal: bool, mass: bool) -> tuple[str, ...]:
        if not constrained:  # refused with a better reason than missing terms
            return ("residual",)
        return ("mass", "residual", *KINEMATIC)

    def calls(self, system: System) -> set[str]:
        return super(RungeKuttaMuntheKaas, self).calls(system) - (set() if system.holonomic else {"constraint"})

    def title(self, constrained: bool) -> str:
        return f"{super().title(constrained)}, constraints eliminated by coordinate partitioning"

    def state(self, sizes: Sizes) -> tuple[Field, ...]:
        return partition_state(sizes)

    def statistics(self, sizes: Sizes) -> tuple[Field, ...]:
        return PARTITION_STATISTICS

    def statuses(self, constrained: bool, angles: bool) -> tuple[Status, ...]:
        return partition_statuses(angles)

    def data(self, system: System, step: float, samples: Any) -> Mapping[str, Any]:
        return {**super().data(system, step, samples), **partition_data(system)}


PARTITIONED_RUNGE_KUTTA_4 = PartitionedRungeKutta(
    A=RUNGE_KUTTA_MUNTHE_KAAS_4.A,
    b=RUNGE_KUTTA_MUNTHE_KAAS_4.b,
    c=RUNGE_KUTTA_MUNTHE_KAAS_4.c,
    order=RUNGE_KUTTA_MUNTHE_KAAS_4.order,
    commutators=RUNGE_KUTTA_MUNTHE_KAAS_4.commutators,
    source="Munthe-Kaas 1999; Wehage and Haug 1982",
)


@dataclass(frozen=True)
class PartitionedEmbeddedRungeKutta(EmbeddedRungeKutta):
    """An embedded pair with stages brought onto the constraints along dependent components.

    Parameters
    ----------
    tolerance : float
        Bound of the local error of the embedded solution, relative to the motion within the step, by kinetic energy;
        internal states each relative to its own change. Raises UsageError outside 1e-14..0.1.
    pair : EmbeddedPair
        Coefficients.
    """

    family = "partitioned_pair"
    holds_constraints = True
    passes_singularities = True
    state_is_all = False
    projection = PartitionedRungeKutta.projection
    groups = (*STEP_GROUPS, *PartitionedRungeKutta.groups)

    @property
    def source(self) -> str:  # type: ignore[override]  # families without coefficients have a text here
        return f"{super().source}; Wehage and Haug 1982"

    @property
    def needs(self) -> tuple[SystemRequirement, ...]:  # type: ignore[override]
        return (needs_constraints(self.pair.name),)

    @classmethod
    def names(cls) -> tuple[MethodName, ...]:
        return tuple(MethodName(f"{pair.name}_partitioned", partial(cls, pair=pair), ("tolerance",)) for pair in PAIRS)

    @classmethod
    def terms(cls, constrained: bool, internal: bool, mass: bool) -> tuple[str, ...]:
        return PartitionedRungeKutta.terms(constrained, internal, mass)

    def calls(self, system: System) -> set[str]:
        return super(EmbeddedRungeKutta, self).calls(system) - (set() if system.holonomic else {"constraint"})

    def title(self, constrained: bool) -> str:
        pair, remainder = super().title(constrained).split(", ")
        return f"{pair}, constraints eliminated by coordinate partitioning, {remainder}"

    def state(self, sizes: Sizes) -> tuple[Field, ...]:
        return (*partition_state(sizes), *step_state(sizes))

    def statistics(self, sizes: Sizes) -> tuple[Field, ...]:
        return (*PARTITION_STATISTICS, *step_statistics())

    def statuses(self, constrained: bool, angles: bool) -> tuple[Status, ...]:
        return (*partition_statuses(angles), *step_statuses())

    def data(self, system: System, step: float, samples: Any) -> Mapping[str, Any]:
        return {**super().data(system, step, samples), **partition_data(system), "turning": []}
