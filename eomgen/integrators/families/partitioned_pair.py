"""Embedded explicit Runge-Kutta pairs with coordinate partitioning, with adaptive steps.

Pairs are rows of ``embedded_pair``, in the Lie algebra; stages are brought onto the
constraints as in ``partitioned``: Wehage and Haug, J. Mech. Des. 104 (1982) 247.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

from eomgen.base.data import dataclass
from eomgen.integrators.families.adaptive import STEP_GROUPS, step_state, step_statistics, step_statuses
from eomgen.integrators.families.embedded_pair import PAIRS, EmbeddedRungeKutta
from eomgen.integrators.families.family import Field, MethodName, Sizes, Status
from eomgen.integrators.families.needs import Need, constrained
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
    def needs(self) -> tuple[Need, ...]:  # type: ignore[override]
        return (constrained(self.pair.name),)

    @classmethod
    def names(cls) -> tuple[MethodName, ...]:
        return tuple(MethodName(f"{pair.name}_partitioned", partial(cls, pair=pair), ("tolerance",)) for pair in PAIRS)

    @classmethod
    def terms(cls, constrained: bool, internal: bool, mass: bool) -> tuple[str, ...]:
        return PartitionedRungeKutta.terms(constrained, internal, mass)

    def calls(self, system: System) -> set[str]:
        return super(EmbeddedRungeKutta, self).calls(system) - (set() if system.holonomic else {"constraint"})

    def title(self, constrained: bool) -> str:
        pair, own = super().title(constrained).split(", ")
        return f"{pair}, constraints eliminated by coordinate partitioning, {own}"

    def state(self, sizes: Sizes) -> tuple[Field, ...]:
        return (*partition_state(sizes), *step_state(sizes))

    def statistics(self, sizes: Sizes) -> tuple[Field, ...]:
        return (*PARTITION_STATISTICS, *step_statistics())

    def statuses(self, constrained: bool, angles: bool) -> tuple[Status, ...]:
        return (*partition_statuses(angles), *step_statuses())

    def data(self, system: System, step: float, samples: Any) -> Mapping[str, Any]:
        return {**super().data(system, step, samples), **partition_data(system), "turning": []}
