"""RATTLie: a variational integrator on Lie groups whose multipliers jump from step to step.

With q' = q o exp(h w), the mean velocity w of a step, and the discrete Lagrangian h/2 (T(q, w, t) + T(q', w, t')) less
the trapezoidal rule of the potential, momenta p = dT/dv meet the constraints' rates at both ends of every step:

    T^-T(-h w) (p(q, w) + p(q', w))/2 = p(q, v) + h/2 (dT/dq + Q)(q, w) - h/2 B(q)^T lam^+,   Phi(q') = 0
    p(q', v') = T^-T(h w) (p(q, w) + p(q', w))/2 + h/2 (dT/dq + Q)(q', w) - h/2 B(q')^T lam^-,   B(q') v' + Phi_t = 0

If M is constant this is RATTLie of Hante and Arnold (2021). If it varies, as in joint coordinates, dT/dq is taken
at both ends with w, and so are forces that depend on velocities: the map stays its own adjoint, so of order 2; it
stays variational if there is a potential, so it keeps momentum maps, and energies do not drift.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar

from eomgen.base.data import dataclass, replace
from eomgen.integrators.families.family import (
    BAD_ARGUMENT,
    KINEMATIC,
    NOT_CONSISTENT,
    NOT_FINITE,
    SINGULAR_ADVICE,
    SMALLER_STEP,
    Bound,
    DenseOutput,
    Family,
    Field,
    LinearTransitions,
    MethodName,
    Setting,
    Sizes,
    Status,
    rotation_too_large,
    velocities,
)
from eomgen.integrators.families.needs import POSITIONS_ALONE

if TYPE_CHECKING:
    from eomgen.integrators.newton.sample_matrices import SampledPartials
    from eomgen.system.system import System

_SIDES = (
    "in rows of the record: 0: by accelerations; 1: before the row; 2: after it; 3: mean; 2 and 3 solve a step ahead"
)
_FIXED = ("it keeps momenta and energies because its steps are all of one size", "generalized_alpha, or rk45")


@dataclass(frozen=True)
class Rattlie(Family):
    """RATTLie, the variational integrator of order 2, whose multipliers differ before and after each row."""

    order = 2
    source = "Hante and Arnold 2021; Hante, Tumiotto and Arnold 2022"
    needs = (POSITIONS_ALONE,)
    family = "rattlie"
    group_functions = ("update", "tangent", "cotangent")
    more_stable = "generalized_alpha, which is stable at any step"
    dense_output: ClassVar[DenseOutput] = "hermite_3"
    implicit = True
    holds_constraints = True
    state_is_all = True
    renewal = "evaluates accelerations and multipliers anew, by which it predicts"
    projection = "the smallest change in the metric of M"

    @classmethod
    def names(cls) -> tuple[MethodName, ...]:
        return (MethodName("rattlie", cls, idle=("rho_inf",), fixed_steps=_FIXED),)

    @classmethod
    def terms(cls, constrained: bool, internal: bool, mass: bool) -> tuple[str, ...]:
        if constrained:
            return ("mass", "momenta", "residual", *KINEMATIC, "jacobian_values", "iteration")
        return ("momenta", "residual", "iteration" if internal else "partials")

    def calls(self, system: System) -> set[str]:
        matrix = "iteration" if "iteration" in system.functions else "partials"
        names = {"momenta", "residual", matrix}
        if not len(system.multipliers):
            return names
        return names | {"constraint", "constraint_velocity", "constraint_bias", "constraint_size", "jacobian_values"}

    def title(self, constrained: bool) -> str:
        multipliers = ", multipliers at both sides of every step" if constrained else ""
        return f"RATTLie, a variational integrator on Lie groups{multipliers}"

    @property
    def linear_step(self) -> LinearTransitions:
        return LinearTransitions()

    def state(self, sizes: Sizes) -> tuple[Field, ...]:
        unit = Field(
            "unit", "unit of each unknown: its value that alone makes a kinetic energy of 1/2", sizes.v + sizes.lam
        )
        if not sizes.lam:
            return (unit,)
        return (
            unit,
            Field("lam_before", "multipliers at the end of the last step", sizes.lam),
            Field("lam_after", "multipliers at the start of the last step, by this step", sizes.lam),
            Field("lam_mean", "mean of lam_after and the multipliers by the step before; of order 2", sizes.lam),
            Field("last_step", "size of the last step, s; 0: none"),
            Field("side", "multipliers in rows of the record, as in the settings", 0, "long"),
        )

    def settings(self, sizes: Sizes) -> tuple[Setting, ...]:
        increment = "tolerance of the Newton increment of the mean velocity over a step, in the norm of kinetic energy"
        return (
            # the error after the step is smaller by the contraction, about h^2 omega^2/12, because momentum maps are
            # conserved to the accuracy of the solution of the steps
            Setting("rtol", 1e-12, increment, single=1e-5),
            Setting("max_iterations", 50, "iterations of a step at most", (1, 2**31 - 1)),
            *((Setting("multipliers", 0, _SIDES, (0, 3)),) if sizes.lam else ()),
        )

    def bounds(self, sizes: Sizes) -> tuple[Bound, ...]:
        return (
            Bound("step", "finite"),
            Bound("step", ">", 0.0),
            Bound("rtol", ">", 0.0),
            Bound("rtol", "finite"),
            Bound("max_iterations", ">", 0),
        )

    def statistics(self, sizes: Sizes) -> tuple[Field, ...]:
        if not sizes.lam:
            return ()
        return (
            Field("max_constraint", "largest |Phi| over the ends of all steps"),
            Field("max_constraint_velocity", "largest |w| over these states"),
            Field("max_jump", "largest jump of a multiplier from one step to the next; it is O(step)"),
        )

    def statuses(self, constrained: bool, angles: bool) -> tuple[Status, ...]:
        repeated = ": constraints that repeat each other, or a part without mass" if constrained else ""
        return (
            Status(1, "NOT_CONVERGED", "the Newton iteration of a step did not converge", SMALLER_STEP),
            Status(2, "SINGULAR", f"the mass matrix, or the matrix of a step, is singular{repeated}", SINGULAR_ADVICE),
            NOT_FINITE,
            BAD_ARGUMENT,
            rotation_too_large(angles),
            *((NOT_CONSISTENT,) if constrained else ()),
        )

    def data(self, system: System, step: float, samples: Any) -> Mapping[str, Any]:
        """Return the data of the templates for a system: unknowns, linear solver and hooks. `step` in s and `samples`,
        or else the system's tape, give the numbers by which pivots are planned."""
        from eomgen.integrators.newton.matrix import Unknowns  # noqa: PLC0415
        from eomgen.integrators.newton.sample_matrices import samples_of  # noqa: PLC0415
        from eomgen.integrators.newton.solver import make_solver, solver_data  # noqa: PLC0415

        nv, nl = velocities(system.factors), len(system.multipliers)
        owners = system.inner_owners
        unknowns = Unknowns(nv, nl, system.holonomic, False, len(owners))
        known = samples if samples is not None else samples_of(system)
        state_pattern, known = known.packing.nonzeros["Fz"], _momentum_samples(known)
        weights = (1.0, 0.5 * step, 0.0, 1.0, 1.0, 1.0, 1.0)
        solver = make_solver(unknowns, system.factors, known, weights, step, owners, sample=system.sample)
        data = solver_data(solver, system.factors, plain=True, iterated=True)
        return {
            "unknowns": unknowns.data,
            "solver": data,
            "rights": unknowns.matrix_size,
            "state_pattern": [list(index) for index in state_pattern],
            "hooks": {"row": "multipliers_of_row"} if nl else {},
            "input_times": [0.0, 1.0],
        }


#: Terms outside the matrix of a step: forces and internal states belong to an end, the change of momenta with positions
#: is O(step^2), and rates of constraints are not equations of the step.
_LEFT_OUT = ("K", "Z", "Rz", "Fq", "Fv", "Fz", "Fx")


def _momentum_samples(samples: SampledPartials) -> SampledPartials:
    """Return samples with B at both ends of a step, and without terms outside the matrix of a step."""
    from eomgen.integrators.newton.sample_matrices import at_both_ends  # noqa: PLC0415

    both = at_both_ends(samples)
    nonzeros = {**both.packing.nonzeros, **{name: {} for name in _LEFT_OUT}}
    return replace(both, packing=replace(both.packing, nonzeros=nonzeros))
