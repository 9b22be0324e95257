"""Linearly implicit methods for real time: one factorization a step and no iteration.

With y' = F(y, t) for y = (q, v, z), and J = dF/dy from the exact partials at the start of the step, in canonical
coordinates about it:

    one stage:   (I - gamma h J) k = (1 - gamma) F(y_n, t_n) + gamma F(y_n, t_n + h),   y' = y_n + h k,   gamma = 1/2

after Jia, Liu, Li and Liao (2014): forces of the state at the start, at the times of both ends of the step. And LSRT2,
L-stable and of order 2 with any J (Bursi, Gonzalez-Buelga, Vulcan, Neild, Wagg 2008):

    (I - gamma h J) k_1 = F(y_n, t_n),   y' = y_n + h k_2,   gamma = 1 - sqrt(1/2)
    (I - gamma h J) k_2 = F(y_n + h k_1/2, t_n + h/2) - gamma h J k_1

In forces, with a residual r = M a - f and any accelerations a that are O(h) off, taken from the step before:

    (M + gamma h C + (gamma h)^2 K) k_v = M a - r(a) - gamma h K v_n,   k_q = v_n + gamma h k_v

so M may be singular if the matrix is not. With constraints, multipliers lam and accelerations of the step before:

    (M + gamma h C + (gamma h)^2 K) k_v + B_n^T d = M a - r(a, lam) - gamma h K v_n,   lam' = lam + d
    B^ (v_n + h k_v) + Phi_t^ = 0,   B^, Phi_t^ at q^ = q_n o exp(h (v_n + h a/2)) and t_n + h

with the change of B^T lam with q in K, and q^ is O(h^3) off the end of the step, as its state is off the
constraints. The same factors take it there, each of a fixed number of corrections leaving O(h^3) of the error:

    S d_q + B_n^T mu = 0,  B^ d_q = -Phi(q', t_n + h),       S d_v + B_n^T mu = 0,  B^ d_v = -w(q', v', t_n + h)

Multipliers and accelerations of rows belong to the state, of order 2; stored ones are means of a step.

On rotations d k_q/d q, half a bracket with v_n, is left out of J: it acts on k_q = v_n + O(h), whose bracket with v_n
is of the order of other terms left out.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, ClassVar

from eomgen.base.data import dataclass
from eomgen.integrators.families.family import (
    KINEMATIC,
    NOT_CONSISTENT,
    SMALLER_STEP,
    Bound,
    DenseOutput,
    Field,
    GroupFunction,
    MethodName,
    Setting,
    Sizes,
    Status,
    rotation_too_large,
)
from eomgen.integrators.families.one_factorization import (
    FIXED_STEPS,
    GROWTH_OR_SINGULAR_STATUS,
    GROWTH_STATUS,
    STOP_AT_GROWTH,
    UNFOLLOWED_GROWTH,
    OneFactorization,
    linear_system,
)

if TYPE_CHECKING:
    from eomgen.integrators.step_work import Work
    from eomgen.system.system import System


@dataclass(frozen=True)
class Rosenbrock(OneFactorization):
    """A Rosenbrock method of order 2 with one factorization a step.

    Attributes
    ----------
    stages : int
        1, with the forces of both ends of a step, or 2, the second in the middle.
    gamma : float
        Of the matrix, in shares of a step.
    """

    stages: int
    gamma: float
    source: str
    order = 2
    family = "rosenbrock"
    dense_output: ClassVar[DenseOutput] = "hermite_3"
    holds_constraints = True
    state_is_all = True
    projection = "the smallest change in the metric of M"
    renewal = "needs no restart, because it evaluates the forces at its start"

    @classmethod
    def names(cls) -> tuple[MethodName, ...]:
        return (
            MethodName("rosenbrock", lambda: ONE_STAGE, idle=("rho_inf",), fixed_steps=FIXED_STEPS),
            MethodName("lsrt2", lambda: LSRT2, idle=("rho_inf",), fixed_steps=FIXED_STEPS),
        )

    @classmethod
    def terms(cls, constrained: bool, internal: bool, mass: bool) -> tuple[str, ...]:
        if not constrained:
            return super().terms(constrained, internal, mass)
        return ("mass", "residual", *KINEMATIC, "jacobian_values", "iteration")

    def calls(self, system: System) -> set[str]:
        if not len(system.multipliers):
            return super().calls(system)
        kinematic = {"constraint", "constraint_velocity", "constraint_bias", "constraint_size", "jacobian_values"}
        return {"residual", "iteration", *kinematic}

    def title(self, constrained: bool) -> str:
        stages = "one stage, forces of both ends of a step" if self.stages == 1 else "two stages (LSRT2)"
        held = ", brought onto the constraints by the factors of its step" if constrained else ""
        return f"Rosenbrock's linearly implicit method on Lie groups, {stages}{held}"

    @property
    def group_functions(self) -> tuple[GroupFunction, ...]:
        return ("update",) if self.stages == 1 else ("update", "bracket")

    @property
    def more_stable(self) -> str:
        return "lsrt2, which damps unresolved motions" if self.stages == 1 else "generalized_alpha"

    def state(self, sizes: Sizes) -> tuple[Field, ...]:
        kept = super().state(sizes)
        if sizes.lam:
            unit = Field(
                "unit",
                "unit of each unknown: its value that alone makes a kinetic energy of 1/2, at the start",
                _size(sizes),
            )
            row_size = Field("row_size", "scale of the violation of each constraint row", sizes.lam)
            kept = (unit, row_size, *kept[1:])
        if self.stages == 2:
            return kept
        return (*kept, Field("damped", "1: the next step is two steps of implicit Euler", 0, "long"))

    def settings(self, sizes: Sizes) -> tuple[Setting, ...]:
        drift = "largest |Phi|, and step |w|, after a step, relative to the terms or the extent of each row"
        # far below the error of such a step
        left = (STOP_AT_GROWTH, *((Setting("drift", 1e-6, drift, single=1e-3),) if sizes.lam else ()))
        if self.stages == 2:
            return left
        meaning = "1: the first step, and each after a jump, is two steps of implicit Euler, which damp fast motions"
        return (Setting("damped_start", 0, meaning, (0, 1)), *left)

    def bounds(self, sizes: Sizes) -> tuple[Bound, ...]:
        return (*super().bounds(sizes), *((Bound("drift", "finite"), Bound("drift", ">", 0.0)) if sizes.lam else ()))

    def statistics(self, sizes: Sizes) -> tuple[Field, ...]:
        held = (
            Field("max_constraint", "largest |Phi| over the ends of all steps"),
            Field("max_constraint_velocity", "largest |w| over these states"),
        )
        return (*super().statistics(sizes), UNFOLLOWED_GROWTH, *(held if sizes.lam else ()))

    def statuses(self, constrained: bool, angles: bool) -> tuple[Status, ...]:
        slipped = "the corrections of a step, a fixed number, did not bring it onto the constraints"
        held = (Status(1, "NOT_CONVERGED", slipped, f"{SMALLER_STEP}, or generalized_alpha"), NOT_CONSISTENT)
        return (
            *super().statuses(constrained, angles),
            *((GROWTH_OR_SINGULAR_STATUS, *held) if constrained else (GROWTH_STATUS,)),
            *((rotation_too_large(angles),) if angles else ()),
        )

    def data(self, system: System, step: float, samples: Any) -> Mapping[str, Any]:
        return {
            "stages": self.stages,
            "gamma": self.gamma,
            **linear_system(system, self.gamma * step, samples, guarded=True),
            "corrections": 2,  # of positions, and of velocities, in each step
            "positions_held": system.holonomic,
            "rows_of_numbers": [int(unit in ("1", "1/s")) for unit in system.row_units]
            or [0] * len(system.multipliers),
            "input_times": [0.0, 1.0] if self.stages == 1 else [0.0, 0.5, 1.0],
        }

    def work(self, system: System, method: Mapping[str, Any]) -> tuple[Work, ...]:
        """Return the work of one step: calls of the model's functions, and operations of the stepper.
        `method` is ``Program.method``."""
        from eomgen.integrators.step_work import Work, work_of_groups, work_of_matrix  # noqa: PLC0415

        un = method["unknowns"]
        v, lam, z = un["v"], un["lam"], un["size"] - un["first_z"]
        forces = ("residual", *(("internal_rate",) if z else ())) if lam else ("equations",) if z else ("residual",)
        timed = any({"t", "u", "base"} & set(system.functions[name].inputs) for name in forces)
        forces = ("relative_forces",) if method["links"] else forces
        twice = 2 if timed or self.stages == 2 else 1
        of_positions, of_velocities = (method["corrections"] * bool(rows) for rows in (method["positions_held"], lam))
        prepared = self.stages * 2 if lam else twice
        solutions = self.stages + of_positions + of_velocities
        updates = self.stages + bool(lam) + of_positions
        group_calls = {"update": updates, "bracket": 1} if self.stages == 2 else {"update": updates}
        plain = sum(run["size"] for run in method["lie"]["runs"] if run["group"] == "R")
        return (
            *(Work(name, twice, of_model=True) for name in forces),
            *(_work_of_rows(method, of_positions, of_velocities, self.stages) if lam else ()),
            *work_of_matrix(system, method, drivers=prepared, inertia=1, stiffness=self.stages, solutions=solutions),
            *work_of_groups(method, group_calls),
            Work("vectors and time", 1, False, *_vector_operations(method, self.stages, timed=timed)),
            Work("compensation of sums", 1, False, 3 * (plain * (1 + of_positions) + v * (1 + of_velocities) + z)),
        )


def _vector_operations(method: Mapping[str, Any], stages: int, *, timed: bool) -> tuple[int, int]:
    """Return the additions and multiplications of a step with vectors and the time."""
    un = method["unknowns"]
    v, z = un["v"], un["size"] - un["first_z"]
    if stages == 1:
        mean = v + z + len(method["links"]) if timed else 0
        return 2 * v + z + mean + 1, 2 * v + 2 * z + mean + 4
    turned = sum(run["size"] for run in method["lie"]["runs"] if run["group"] != "R")
    return (8 if turned else 6) * v + 4 * z + 2, 5 * v + 4 * z + 2 * turned + 4


def _work_of_rows(method: Mapping[str, Any], of_positions: int, of_velocities: int, stages: int) -> Iterator[Work]:
    """Yield the work that constraints add to a step: calls of constraint functions and operations on rows.
    `of_positions` and `of_velocities` are the numbers of corrections in a step. Linear systems and group functions are
    not included."""
    from eomgen.integrators.step_work import Work  # noqa: PLC0415

    v, lam, held = method["unknowns"]["v"], method["unknowns"]["lam"], method["positions_held"]
    yield Work("jacobian_values", 1, of_model=True)
    yield Work("constraint_velocity", of_velocities + 2, of_model=True)
    if held:
        yield Work("constraint", of_positions + 1, of_model=True)
    judged = held + lam  # divided by the sum of the rows' summands
    added = v * (1 + of_velocities) + stages * lam + judged
    yield Work("constraints", 1, False, added, 2 * v + lam, lam + judged)


def _size(sizes: Sizes) -> int:
    return sizes.v + sizes.lam + sizes.z


ONE_STAGE = Rosenbrock(1, 0.5, "Jia, Liu, Li and Liao 2014; start: Rannacher 1984")
LSRT2 = Rosenbrock(2, 1.0 - math.sqrt(0.5), "Bursi, Gonzalez-Buelga, Vulcan, Neild and Wagg 2008")
