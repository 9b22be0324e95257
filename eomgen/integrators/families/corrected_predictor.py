"""A predictor that is corrected once, for forces that are measured or whose partials are not known.

With y' = F(y, t), any matrix J, s = h/2 and an estimate Phi_n of F(y_n, t_n) that goes with the state:

    (I - s J) k = Phi_n,   y* = y_n + h k                       the predicted end of the step
    (I - s J) d = s (Phi_n + F(y*, t_n + h)) - h k              the only forces of the step
    y' = y* + d,   Phi' = F(y*, t_n + h) + J d = F(y*, t_n + h) + (d - right side)/s

Order 2 for every J (Rosenbrock methods of one stage need J to O(h)), with one evaluation of forces at a configuration
that is known before: a test rig is brought there, and its measured force is an input. For y = (q, v), q' = v, the right
side of d has no part in q, and Phi keeps v itself:

    M* k = M phi - s K v_n,   v* = v_n + h k,   q* = q_n o exp(h (v_n + s k)),   M* = M + s C + s^2 K
    b = s (phi + a(q*, v*, t_n + h)) - h k,   M* d = M b,   v' = v* + d,   q' = q_n o exp(h (v_n + s k) + s d)

M, C, K belong to a step's start, or to the run's (``matrix_every = 0``), which leaves two substitutions as the work
of a step. Undamped linear forces of stiffness K are followed at every step size if M* has 2/3 K or more.

Predicted displacements and measured forces: Nakashima, Kato and Takaoka, Earthquake Eng. Struct. Dyn. 21 (1992) 79;
Jia, Liu, Li and Liao (2014).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar

from eomgen.base.data import dataclass
from eomgen.integrators.families.family import (
    Bound,
    DenseOutput,
    Field,
    MethodName,
    Setting,
    Sizes,
    Status,
)
from eomgen.integrators.families.needs import UNCONSTRAINED_LINEARISED
from eomgen.integrators.families.one_factorization import (
    FIXED_STEPS,
    GROWTH_STATUS,
    STOP_AT_GROWTH,
    UNFOLLOWED_GROWTH,
    OneFactorization,
    linear_system,
    matrix_functions,
)

if TYPE_CHECKING:
    from eomgen.integrators.step_work import Work
    from eomgen.system.system import System


@dataclass(frozen=True)
class CorrectedPredictor(OneFactorization):
    """Linearly implicit steps for measured forces: a predicted end of the step, and one correction by the forces there.
    Of order 2 with any matrix; without constraints."""

    order = 2
    needs = (UNCONSTRAINED_LINEARISED,)
    source = "Jia, Liu, Li and Liao 2014; Nakashima, Kato and Takaoka 1992"
    family = "corrected_predictor"
    group_functions = ("update",)
    dense_output: ClassVar[DenseOutput] = "hermite_3"
    renewal = "evaluates accelerations anew"

    @classmethod
    def names(cls) -> tuple[MethodName, ...]:
        return (MethodName("corrected_predictor", cls, idle=("rho_inf",), fixed_steps=FIXED_STEPS),)

    def calls(self, system: System) -> set[str]:
        return {"forward_dynamics", *matrix_functions(system)}

    def title(self, constrained: bool) -> str:
        return "a predictor that is corrected once, on Lie groups"

    def settings(self, sizes: Sizes) -> tuple[Setting, ...]:
        meaning = "number of steps with one matrix; 0: all steps of this size use the matrix of the first"
        return (Setting("matrix_every", 1, meaning, (0, 1_000_000_000)), STOP_AT_GROWTH)

    def bounds(self, sizes: Sizes) -> tuple[Bound, ...]:
        return (*super().bounds(sizes), Bound("matrix_every", ">=", 0))

    def statistics(self, sizes: Sizes) -> tuple[Field, ...]:
        return (*super().statistics(sizes), UNFOLLOWED_GROWTH)

    def statuses(self, constrained: bool, angles: bool) -> tuple[Status, ...]:
        return (*super().statuses(constrained, angles), GROWTH_STATUS)

    def data(self, system: System, step: float, samples: Any) -> Mapping[str, Any]:
        return {**linear_system(system, step / 2, samples, guarded=True), "input_times": [0.0, 1.0]}

    def work(self, system: System, method: Mapping[str, Any]) -> tuple[Work, ...]:
        """Return the work of a step that forms and factors a matrix: calls of model functions, and the stepper's
        operations. `method` is ``Program.method``."""
        from eomgen.integrators.step_work import Work, work_of_groups, work_of_matrix  # noqa: PLC0415

        un = method["unknowns"]
        v, z = un["v"], un["size"] - un["first_z"]
        plain = sum(run["size"] for run in method["lie"]["runs"] if run["group"] == "R")
        return (
            Work("forward_dynamics", 1, of_model=True),
            *((Work("internal_rate", 1, of_model=True),) if z else ()),
            *work_of_matrix(system, method, drivers=2, inertia=2, stiffness=1, solutions=2),
            *work_of_groups(method, {"update": 2}),
            Work("vectors and time", 1, False, 8 * (v + z) + 1, 7 * (v + z) + 4, 1),
            Work("compensation of sums", 1, False, 4 * (v + z) + 3 * plain),
        )
