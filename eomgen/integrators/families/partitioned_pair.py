"""The embedded explicit pair of order 5(4) with coordinate partitioning, with steps of its own.

Pair: Dormand and Prince, J. Comput. Appl. Math. 6 (1980) 19, in the Lie algebra; stages are brought onto the
constraints as in ``partitioned``: Wehage and Haug, J. Mech. Des. 104 (1982) 247.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from eomgen.integrators.families.adaptive import STEP_GROUPS, step_state, step_statistics, step_statuses
from eomgen.integrators.families.dormand_prince import COMPARED_TOLERANCES, DormandPrince
from eomgen.integrators.families.family import Field, MethodName, Sizes, Status
from eomgen.integrators.families.needs import constrained
from eomgen.integrators.families.partitioned import (
    PARTITION_STATISTICS,
    PartitionedRungeKutta,
    partition_data,
    partition_state,
    partition_statuses,
)

if TYPE_CHECKING:
    from eomgen.system.system import System


@dataclass(frozen=True)
class PartitionedDormandPrince(DormandPrince):
    """The pair of Dormand and Prince whose stages are brought onto the constraints along dependent components.

    Parameters
    ----------
    tolerance : float
        Of the local error of the solution of order 4, relative to what the motion moves within the step, by kinetic
        energy; internal states each relative to its own change. Raises UsageError outside 1e-14..0.1.
    """

    source = "Dormand and Prince 1980; Munthe-Kaas 1999; Shampine 1986; Wehage and Haug 1982"
    needs = (constrained("rk45"),)
    family = "partitioned_pair"
    holds_constraints = True
    passes_singularities = True
    state_is_all = False
    projection = PartitionedRungeKutta.projection
    groups = (*STEP_GROUPS, *PartitionedRungeKutta.groups)

    @classmethod
    def names(cls) -> tuple[MethodName, ...]:
        return (MethodName("rk45_partitioned", cls, ("tolerance",), compared={"tolerance": COMPARED_TOLERANCES}),)

    @classmethod
    def terms(cls, constrained: bool, internal: bool, mass: bool) -> tuple[str, ...]:
        return PartitionedRungeKutta.terms(constrained, internal, mass)

    def calls(self, system: System) -> set[str]:
        return super(DormandPrince, self).calls(system) - (set() if system.holonomic else {"constraint"})

    def title(self, constrained: bool) -> str:
        return (
            "explicit Runge-Kutta pair of order 5(4) in the Lie algebra, constraints eliminated by coordinate"
            " partitioning, with steps of its own"
        )

    def state(self, sizes: Sizes) -> tuple[Field, ...]:
        return (*partition_state(sizes), *step_state(sizes))

    def statistics(self, sizes: Sizes) -> tuple[Field, ...]:
        return (*PARTITION_STATISTICS, *step_statistics())

    def statuses(self, constrained: bool, angles: bool) -> tuple[Status, ...]:
        return (*partition_statuses(angles), *step_statuses())

    def data(self, system: System, step: float, samples: Any) -> Mapping[str, Any]:
        return {**super().data(system, step, samples), **partition_data(system), "turning": []}
