"""Generalized-alpha with steps of its own, by an estimate of the local error of the configuration.

Steps of other sizes: the algorithmic acceleration a_n belongs to t_n + (alpha_m - alpha_f) h, and is moved along with h
(a_n - vdot_n scales with the step), which keeps order 2. That coefficients have to follow the step: Bruls and Arnold,
J. Comput. Nonlinear Dyn. 3 (2008) 041009. The estimate compares the increment with the quadrature of equilibrium
accelerations, as Zienkiewicz and Xie, Earthquake Eng. Struct. Dyn. 20 (1991) 871, do for Newmark's method.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from functools import partial
from typing import TYPE_CHECKING, Any

from eomgen.base.data import dataclass
from eomgen.integrators.families.adaptive import (
    CONTROL,
    LARGEST_TOLERANCE,
    STEP_GROUPS,
    check_tolerance,
    longest_setting,
    step_data,
    step_state,
    step_statistics,
    step_statuses,
    tolerance_setting,
)
from eomgen.integrators.families.family import Bound, Field, MethodName, Setting, Sizes, Status
from eomgen.integrators.families.generalized_alpha import NAMED_CASES, OF_ORDER_2, STABILISED, GeneralizedAlpha

if TYPE_CHECKING:
    from eomgen.system.system import System

#: A step of another size needs new factors; alternating steps 1 : 2 leave stiff modes damped at any spectral radius,
#: 1 : 4 do not.
_CONTROL = CONTROL._replace(least_growth=1.25, most_growth=2.0, noisy_growth=1.25)
#: Newton's tolerance on the mean velocity, by the tolerance of the local error and the change of velocity in a step,
#: and the part of the error of velocities that counts.
_OF_VELOCITIES = {"iterations": 1e-2, "velocity_part": 0.2}


@dataclass(frozen=True)
class AdaptiveGeneralizedAlpha(GeneralizedAlpha):
    """Generalized-alpha, stabilised if there are constraints, with adaptive steps.

    Parameters
    ----------
    tolerance : float
        Of the local error of the configuration, relative to its motion within the step, by kinetic energy; internal
        states each relative to its own change. Raises UsageError outside 1e-14..0.1.
    """

    tolerance: float = 1e-5
    family = "adaptive_generalized_alpha"
    group_functions = ("update", "tangent", "bracket")
    chooses_steps = True
    dense_output = "steps"
    groups = STEP_GROUPS

    def __post_init__(self) -> None:
        super().__post_init__()
        check_tolerance(self.tolerance)

    @classmethod
    def names(cls) -> tuple[MethodName, ...]:
        parameters: tuple[str, ...] = ("rho_inf", "tolerance")
        rows = [MethodName("generalized_alpha_adaptive", _optimal, parameters)]
        for case in OF_ORDER_2:
            _, parameters, _, _ = NAMED_CASES[case]
            make = partial(_named_case, case)
            rows.append(MethodName(f"{case}_adaptive", make, (*parameters, "tolerance")))
        return tuple(rows)

    def title(self, constrained: bool) -> str:
        return f"{super().title(constrained)}, with steps of its own"

    @property
    def parameters(self) -> dict[str, Fraction]:
        return {**self.coefficients, "tolerance": Fraction(repr(float(self.tolerance)))}

    @property
    def keywords(self) -> dict[str, float]:
        return {**super().keywords, "tolerance": self.tolerance}

    def state(self, sizes: Sizes) -> tuple[Field, ...]:
        return (*super().state(sizes), *step_state(sizes))

    def settings(self, sizes: Sizes) -> tuple[Setting, ...]:
        base_settings = (item for item in super().settings(sizes) if item.name != "max_halvings")
        return (*base_settings, tolerance_setting(self.tolerance), longest_setting(CONTROL.longest))

    def bounds(self, sizes: Sizes) -> tuple[Bound, ...]:
        base_bounds = (bound for bound in super().bounds(sizes) if bound.left != "max_halvings")
        return (*base_bounds, Bound("tolerance", ">", 0.0), Bound("tolerance", "<=", LARGEST_TOLERANCE))

    def statistics(self, sizes: Sizes) -> tuple[Field, ...]:
        return (*super().statistics(sizes), *step_statistics())

    def statuses(self, constrained: bool, angles: bool) -> tuple[Status, ...]:
        return (*super().statuses(constrained, angles), *step_statuses())

    def data(self, system: System, step: float, samples: Any) -> Mapping[str, Any]:
        on_a_grid = ("harmonics", "known_part", "unobserved_steps", "starts_with_rates_of_inputs")
        base_data = super().data(system, step, samples)
        return {
            **{key: value for key, value in base_data.items() if key not in on_a_grid},
            **step_data(2, _CONTROL),
            **_OF_VELOCITIES,
            "parameters": list(self.coefficients),
            "turning": [],
        }


def _optimal(rho_inf: float = 0.8, tolerance: float = AdaptiveGeneralizedAlpha.tolerance) -> AdaptiveGeneralizedAlpha:
    return AdaptiveGeneralizedAlpha(rho_inf, STABILISED, tolerance=tolerance)


def _named_case(
    name: str, tolerance: float = AdaptiveGeneralizedAlpha.tolerance, **parameters: float
) -> AdaptiveGeneralizedAlpha:
    """Return a case; ``alpha``, if given, replaces ``rho_inf``."""
    if "alpha" in parameters:
        parameters.pop("rho_inf", None)
    return AdaptiveGeneralizedAlpha(case=NAMED_CASES[name][0](**parameters), tolerance=tolerance)
