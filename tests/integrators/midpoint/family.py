"""An implicit family of another distribution, as small as one may be: the midpoint rule on Lie groups.

    r(q_m, v_m, a, z_m, t_n + h/2) = 0,   y = zdot(q_m, v_m, z_m, t_n + h/2)
    v_m = v_n + h/2 a,   q_m = q_n o exp(h/2 v_m),   z_m = z_n + h/2 y
    v' = v_n + h a,      q' = q_n o exp(h v_m),      z' = z_n + h y

Hairer, Lubich, Wanner, Geometric Numerical Integration (2006), sections II.1 and IV.8. Unknowns are a and y; the matrix
of the iteration, M + h/2 C + (h/2)^2 K, is taken at the predicted midpoint with T = 1, which costs iterations and no
accuracy.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from eomgen.integrators.families.family import (
    BAD_ARGUMENT,
    EXCHANGES,
    NOT_FINITE,
    SINGULAR_ADVICE,
    SMALLER_STEP,
    Bound,
    Family,
    Field,
    MethodName,
    Setting,
    Sizes,
    Status,
    velocities,
)
from eomgen.integrators.families.needs import UNCONSTRAINED
from eomgen.integrators.newton.matrix import Unknowns
from eomgen.integrators.newton.sample_matrices import samples_of
from eomgen.integrators.newton.solver import make_solver, solver_data
from eomgen.system.system import System


@dataclass(frozen=True)
class Midpoint(Family):
    """The implicit midpoint rule."""

    order = 2
    source = "Hairer, Lubich and Wanner 2006"
    needs = (UNCONSTRAINED,)
    family = "midpoint"
    templates = Path(__file__).parent / "templates"
    dense_output = "hermite_3"
    implicit = True
    group_functions = ("update",)
    state_is_all = True

    @classmethod
    def names(cls) -> tuple[MethodName, ...]:
        return (MethodName("implicit_midpoint", cls, aliases=("gauss_2",)),)

    @classmethod
    def terms(cls, constrained: bool, internal: bool, mass: bool) -> tuple[str, ...]:
        return ("forward_dynamics", *(("equations", "iteration") if internal else ("residual", "partials")))

    def calls(self, system: System) -> set[str]:
        forces = "equations" if system.facts.internal_states else "residual"
        return {"forward_dynamics", forces, "iteration" if "iteration" in system.functions else "partials"}

    def title(self, constrained: bool) -> str:
        return "the implicit midpoint rule on Lie groups"

    def state(self, sizes: Sizes) -> tuple[Field, ...]:
        return (Field("unit", "in which pivots and corrections are compared", sizes.v + sizes.z),)

    def settings(self, sizes: Sizes) -> tuple[Setting, ...]:
        return (
            Setting("tolerance", 1e-12, "of corrections, in parts of the motion"),
            Setting("max_iterations", 30, "of one step", (2, 1000)),
        )

    def bounds(self, sizes: Sizes) -> tuple[Bound, ...]:
        return (Bound("step", "finite"), Bound("step", ">", 0.0), Bound("tolerance", ">", 0.0))

    def statistics(self, sizes: Sizes) -> tuple[Field, ...]:
        return (EXCHANGES, Field("most_iterations", "of one step", kind="long"))

    def statuses(self, constrained: bool, angles: bool) -> tuple[Status, ...]:
        return (
            Status(1, "NOT_CONVERGED", "corrections do not become small", SMALLER_STEP),
            Status(2, "SINGULAR", "the matrix of a step is singular", SINGULAR_ADVICE),
            NOT_FINITE,
            BAD_ARGUMENT,
        )

    def data(self, system: System, step: float, samples: Any) -> Mapping[str, Any]:
        owners, half = system.inner_owners, step / 2
        unknowns = Unknowns(velocities(system.factors), 0, 0, False, len(owners), len(system.initial_z))
        known = samples if samples is not None else samples_of(system)
        weights = (1.0, half, half * half, 1.0, 1.0, 1.0, half)
        solver = make_solver(unknowns, system.factors, known, weights, step, owners, at_start=True)
        return {
            "unknowns": unknowns.data,
            "rights": unknowns.matrix_size,
            "solver": solver_data(solver, system.factors, plain=True),
            "input_times": [0.0, 0.5, 1.0],
        }
