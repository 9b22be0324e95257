"""Hermite's implicit method of order 4: accelerations and their rates at both ends of a step.

    y_1 = y_0 + h/2 (y'_0 + y'_1) + h^2/12 (y''_0 - y''_1)

for y = (q, v, z), quaternions as they are and brought to unit length; y'' comes from the recurrence that Taylor steps
use. Solved by corrections, from the prediction of the last step (Makino and Aarseth, Publ. Astron. Soc. Japan 44 (1992)
141). Symmetric, so energies of oscillations do not drift. If a step is too large for the highest frequency
corrections diverge, and the run stops.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from eomgen.base.data import dataclass
from eomgen.integrators.families.family import (
    BAD_ARGUMENT,
    NOT_FINITE,
    SINGULAR_MASS,
    SMALLER_STEP,
    Family,
    GroupFunction,
    MethodName,
    Status,
)
from eomgen.integrators.families.needs import UNCONSTRAINED

if TYPE_CHECKING:
    from eomgen.system.system import System

#: Corrections end if no component changes by more than this part of the sizes of its kind, in units of rounding.
CORRECTION_TOLERANCE = 45.0
#: Corrections of a step at most.
MOST_CORRECTIONS = 30
#: Corrections have converged, too, if corrections no longer shrink and are below this limit, in the same units.
ROUND_OFF = 4500.0
#: The part of 1 rad, or of the size of the machine, that counts as the size of a smaller motion: rounding is not far
#: below.
COARSE = 0.01
#: Deviation of the squared length of a quaternion from 1 above which the quaternion is normalised; steps that settle
#: deviate far less.
STRETCH = 0.1


#: Reason for steps that do not follow a tolerance, and methods with adaptive steps.
_FIXED = ("its steps are all of one size, so that energies do not drift", "rk45, or taylor")


@dataclass(frozen=True)
class Hermite(Family):
    """Hermite's corrector with fixed steps."""

    order = 4
    source = "Makino and Aarseth 1992"
    needs = (UNCONSTRAINED,)
    family = "hermite"
    inputs = "series"
    dense_output = "hermite_5"
    implicit = True
    renewal = "evaluates accelerations and their rates anew"

    @classmethod
    def names(cls) -> tuple[MethodName, ...]:
        return (MethodName("hermite", cls, fixed_steps=_FIXED),)

    @classmethod
    def terms(cls, constrained: bool, internal: bool, mass: bool) -> tuple[str, ...]:
        return ("mass", "residual") if mass else ("forward_dynamics",)

    @property
    def group_functions(self) -> tuple[GroupFunction, ...]:
        return ("update",)

    def title(self, constrained: bool) -> str:
        return f"Hermite's corrector of order {self.order}, from accelerations and their rates"

    def statuses(self, constrained: bool, angles: bool) -> tuple[Status, ...]:
        large = "the corrections of a step do not settle: it is too large for the highest frequency"
        return (Status(1, "NOT_CONVERGED", large, SMALLER_STEP), SINGULAR_MASS, NOT_FINITE, BAD_ARGUMENT)

    def data(self, system: System, step: float, samples: Any) -> Mapping[str, Any]:
        return {
            "max_order": 2,
            "correction_tolerance": CORRECTION_TOLERANCE,
            "round_off": ROUND_OFF,
            "coarse": COARSE,
            "stretch": STRETCH,
            "max_iterations": MOST_CORRECTIONS,
            "input_times": [0.0, 1.0],
        }
