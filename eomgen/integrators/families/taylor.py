"""Taylor series method of any order, with the step from the last two coefficients.

Jorba and Zou, Exp. Math. 14 (2005) 99. The order is higher than in the paper, for here the cost of an order hardly
depends on the number of orders.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from eomgen.base.data import dataclass, replace
from eomgen.errors import Problem, UsageError
from eomgen.integrators.families.adaptive import longest_setting
from eomgen.integrators.families.family import (
    BAD_ARGUMENT,
    NOT_FINITE,
    SINGULAR_MASS,
    SMALLER_STEP,
    Family,
    Field,
    MethodName,
    Setting,
    Sizes,
    Status,
)
from eomgen.integrators.families.needs import UNCONSTRAINED_SERIES

if TYPE_CHECKING:
    from eomgen.system.system import System

MAX_ORDER = 40
#: Numbers of the templates. ``safety``: the last two terms of a series are kept below this part of the tolerance, for
#: local errors of many steps add up. ``longest``: steps of the time grid that one series may be used for, even if the
#: last coefficients are small, for coefficients may vanish by symmetry. ``growth``: largest ratio of the lengths of
#: successive series. ``most_expansions``: series within one row before the run stops, since a call of compiled code
#: hears no Ctrl-C. ``defect``: tolerated multiple of tolerance times order of step * (acceleration of the equations -
#: of the series) at the end of a step. ``round_off``: the tolerance below which this test is lost in the round-off of
#: accelerations; ``rounding``: rounding of accelerations due to rounding of positions, through the effect of positions
#: within a series; both in units of rounding. ``coarse``: part of 1 rad, or of the size of the machine, that tolerances
#: are relative to if the motion is smaller. ``stretch``: deviation of the squared length of a quaternion from 1 at the
#: end of a step above which the quaternion is normalised. ``attempts``: steps are halved so often before the run stops.
_CONTROL: Mapping[str, float] = {
    "max_order": MAX_ORDER,
    "safety": 0.1,
    "longest": 256.0,
    "growth": 8.0,
    "most_expansions": 100_000,
    "defect": 10.0,
    "round_off": 450.0,
    "rounding": 8.0,
    "coarse": 0.01,
    "stretch": 0.1,
    "attempts": 40,
}


@dataclass(frozen=True)
class Taylor(Family):
    """A Taylor series method of any order, with steps by a tolerance or the steps of the time grid.

    Parameters
    ----------
    tolerance : float
        Of the local error, 1e-20 to 0.1, relative to the size of the motion: of lengths, of angles, and of the rates of
        both, over a step; of internal states relative to the largest, or to 1. 0: steps equal the time grid's, and the
        order has to be given.
    order : int, optional
        Of the series, 2 to 40; 0, the default: chosen by the tolerance.

    Raises
    ------
    UsageError
        Values beyond these bounds; neither a tolerance nor an order.
    """

    tolerance: float = 1e-12
    order: int = 0
    source = "Jorba and Zou 2005; Griewank and Walther 2008, table 13.2"
    needs = (UNCONSTRAINED_SERIES,)
    family = "taylor"
    group_functions = ("update",)
    discontinuity_order = MAX_ORDER
    inputs = "series"
    dense_output = "steps"
    renewal = "expands the motion anew"

    def __post_init__(self) -> None:
        """Check tolerance and order; choose the order by the tolerance. Raises UsageError."""
        if not (math.isfinite(self.tolerance) and 0.0 <= self.tolerance <= 0.1):
            fault = f"the tolerance must lie in 0..0.1, not {self.tolerance:g} [E0353]"
            raise UsageError(Problem("tolerance", fault, "1e-10, or 0 for steps of the time grid"))
        if 0.0 < self.tolerance < 1e-20:  # below 1e-16 steps only become shorter
            fault = f"the tolerance {self.tolerance:g} is far below the resolution of double precision [E0354]"
            raise UsageError(Problem("tolerance", fault, "1e-16 or more, or 0 for steps of the time grid"))
        if self.order == 0:
            if self.tolerance == 0.0:
                fault = "without a tolerance, the series needs an order [E0355]"
                raise UsageError(Problem("order", fault, "order = 12, or a tolerance, from which the order follows"))
            object.__setattr__(self, "order", order_for(self.tolerance))
        if self.order != int(self.order) or not 2 <= self.order <= MAX_ORDER:
            fault = f"the order must be a whole number, 2 to {MAX_ORDER}, not {self.order:g} [E0356]"
            raise UsageError(Problem("order", fault, "20"))
        object.__setattr__(self, "order", int(self.order))

    @classmethod
    def names(cls) -> tuple[MethodName, ...]:
        return (MethodName("taylor", cls, ("order", "tolerance")),)

    @classmethod
    def terms(cls, constrained: bool, internal: bool, mass: bool) -> tuple[str, ...]:
        return ("mass", "residual") if mass else ("forward_dynamics",)

    def title(self, constrained: bool) -> str:
        return "Taylor series of any order"

    @property
    def parameters(self) -> dict[str, Fraction]:
        return {"tolerance": Fraction(self.tolerance), "order": Fraction(self.order)}

    @property
    def keywords(self) -> dict[str, float]:
        return {"order": float(self.order), "tolerance": self.tolerance}

    @property
    def chooses_steps(self) -> bool:
        return self.tolerance > 0.0

    def settings(self, sizes: Sizes) -> tuple[Setting, ...]:
        states = ", and to z or 1" if sizes.z else ""
        tolerance = (
            f"tolerance of the local error, relative to angles, lengths and velocities{states}; 0: steps of the grid"
        )
        return (
            Setting("tolerance", self.tolerance, tolerance),
            Setting("order", self.order, f"order of the series, 2 to {MAX_ORDER}", (2, MAX_ORDER)),
            longest_setting(_CONTROL["longest"]),
        )

    def statistics(self, sizes: Sizes) -> tuple[Field, ...]:
        return (
            Field("expansions", "number of series", 0, "long"),
            Field("rejections", "steps that were repeated because a series was used for too long", 0, "long"),
        )

    def statuses(self, constrained: bool, angles: bool) -> tuple[Status, ...]:
        disagrees = "the Taylor series disagrees with the equations where it ends, however short the step"
        small = "the step became too small for the time to move on: the motion has a singularity near, or a corner"
        stiff = "the motion is stiff, or the tolerance cannot be met at this order"
        many = f"{_CONTROL['most_expansions']} series were not enough for one row: {stiff}"
        diverges = Status(1, "NOT_CONVERGED", disagrees, SMALLER_STEP)
        common: tuple[Status, ...] = (diverges, SINGULAR_MASS, NOT_FINITE, BAD_ARGUMENT)
        if self.chooses_steps:  # no smaller step of the grid helps
            advice = "the forces and formulas near that time, or another method"
            common = tuple(replace(status, advice=advice) for status in common)
        return (
            *common,
            Status(5, "STEP_TOO_SMALL", small, "the forces and formulas near that time, or another method"),
            Status(7, "TOO_MANY_STEPS", many, "generalized_alpha, a larger tolerance, or shorter rows"),
        )

    def data(self, system: System, step: float, samples: Any) -> Mapping[str, Any]:
        return {**_CONTROL, "input_times": [0.0, 1.0]}


def order_for(tolerance: float) -> int:
    """Return the order with the least work for a tolerance: 0.65 orders per e-fold of the tolerance, and three.

    A step is rho tolerance^(1/order), rho the radius of convergence: the best value is 1 for costs in proportion to the
    order, and 1/2 for costs in proportion to the square of the order (Jorba and Zou).
    """
    return max(4, min(MAX_ORDER, math.ceil(-0.65 * math.log(max(tolerance, 1e-17)) + 3.0)))
