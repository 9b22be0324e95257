"""Time-discontinuous Galerkin in passes, with steps of its own: the change by the last pass is the estimate of errors.

Passes raise the order by one each, so the last but one is a solution of one order less at no cost, with stiff parts
filtered as the solution is. Between the nodes a step is the polynomial through the start and the nodes, with an error
of h^(p+2), and ends of steps have order 2 p + 1 (Hairer and Wanner, Solving Ordinary Differential Equations II, IV.8,
for Radau's nodes). Its derivative misses the equations by a polynomial that vanishes at the nodes, so the defect at the
start of the step, with known accelerations, gives that error. It does not add up, and is compared with the size of
velocities.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from functools import partial
from typing import TYPE_CHECKING, Any

from eomgen.base.data import dataclass
from eomgen.integrators.families.adaptive import (
    LARGEST_TOLERANCE,
    LONGEST,
    STEP_GROUPS,
    check_tolerance,
    longest_setting,
    step_data,
    step_state,
    step_statistics,
    step_statuses,
    tolerance_setting,
)
from eomgen.integrators.families.discontinuous_galerkin import METHODS, DiscontinuousGalerkin, numbers
from eomgen.integrators.families.family import Bound, Field, MethodName, Setting, Sizes, Status, velocities
from eomgen.integrators.families.galerkin_operators import inverse
from eomgen.integrators.families.generalized_alpha import indices_in_q
from eomgen.integrators.families.one_factorization import SHRINK_AT_GROWTH

if TYPE_CHECKING:
    from eomgen.integrators.step_work import Work
    from eomgen.system.system import System

DEFAULT_TOLERANCE = 1e-6
#: Steps may grow if they grow by so much: no stored data belong to a size.
LEAST_GROWTH = 1.0


@dataclass(frozen=True)
class AdaptiveDiscontinuousGalerkin(DiscontinuousGalerkin):
    """A time-discontinuous Galerkin method in passes with steps of its own.

    Parameters
    ----------
    tolerance : float
        Of the local error of the last pass but one, relative to the motion within the step, by kinetic
        energy; internal states each relative to its own change. Raises UsageError outside 1e-14..0.1.
    """

    tolerance: float = DEFAULT_TOLERANCE
    family = "adaptive_discontinuous_galerkin"
    dense_output = "steps"
    state_is_all = False
    groups = STEP_GROUPS

    def __post_init__(self) -> None:
        super().__post_init__()
        check_tolerance(self.tolerance)

    @classmethod
    def names(cls) -> tuple[MethodName, ...]:
        return tuple(
            MethodName(
                f"{name}_adaptive", partial(_made, name), ("tolerance",), idle=("rho_inf",),
            )
            for name, row in METHODS.items()
            if row.estimate
        )  # fmt: skip  # a row of arguments

    @classmethod
    def terms(cls, constrained: bool, internal: bool, mass: bool) -> tuple[str, ...]:
        return (*super().terms(constrained, internal, mass), *(("mass",) if mass else ("residual",)))

    def title(self, constrained: bool) -> str:
        return f"{super().title(constrained)}, with steps of its own"

    @property
    def parameters(self) -> dict[str, Fraction]:
        return {"tolerance": Fraction(repr(float(self.tolerance)))}

    @property
    def keywords(self) -> dict[str, float]:
        return {"tolerance": self.tolerance}

    @property
    def chooses_steps(self) -> bool:
        return True

    def state(self, sizes: Sizes) -> tuple[Field, ...]:
        return (*super().state(sizes), *step_state(sizes))

    def settings(self, sizes: Sizes) -> tuple[Setting, ...]:
        return (SHRINK_AT_GROWTH, tolerance_setting(self.tolerance), longest_setting(LONGEST))

    def bounds(self, sizes: Sizes) -> tuple[Bound, ...]:
        within = (Bound("tolerance", ">", 0.0), Bound("tolerance", "<=", LARGEST_TOLERANCE))
        return (*super().bounds(sizes), *within)

    def statistics(self, sizes: Sizes) -> tuple[Field, ...]:
        return (*super().statistics(sizes), *step_statistics())

    def statuses(self, constrained: bool, angles: bool) -> tuple[Status, ...]:
        return (*super().statuses(constrained, angles), *step_statuses())

    def data(self, system: System, step: float, samples: Any) -> Mapping[str, Any]:
        nodes = self.operators.nodes
        powers = [[node**k for k in range(1, len(nodes) + 1)] for node in nodes]
        size = velocities(system.factors)
        return {
            **super().data(system, step, samples),
            **step_data(self.order - 1),
            "least_growth": LEAST_GROWTH,
            "polynomial": numbers([list(column) for column in zip(*inverse(powers), strict=True)]),
            "between": float(largest_between(nodes)),
            "angular": [int(turns) for turns in system.angular] or [0] * size,
            "places": indices_in_q(system.factors, size),
            "input_times": [0.0, 0.25, 0.5, 0.75, 1.0],
        }

    def work(self, system: System, method: Mapping[str, Any]) -> tuple[Work, ...]:
        return ()


def largest_between(nodes: Sequence[Fraction]) -> Fraction:
    """Return the largest integral over (0, s) of the polynomial that is 0 at the nodes, 1 at 0: it is at a node."""
    coefficients = [Fraction(1)]
    for node in nodes:  # times 1 - s/node
        shifted = [Fraction(0), *(-x / node for x in coefficients)]
        coefficients = [x + y for x, y in zip([*coefficients, Fraction(0)], shifted, strict=True)]
    return max(
        abs(sum((x * node ** (k + 1) / (k + 1) for k, x in enumerate(coefficients)), Fraction(0))) for node in nodes
    )


def _made(name: str, tolerance: float = DEFAULT_TOLERANCE) -> AdaptiveDiscontinuousGalerkin:
    made = METHODS[name].make()
    return AdaptiveDiscontinuousGalerkin(made.degree, made.gamma, made.passes, made.order, tolerance)
