"""Time-discontinuous Galerkin steps in passes: orders 3 to 7, one factorization a step and no Newton iteration.

A polynomial of degree p on each step, discontinuous at the start, is found in a fixed number of passes after Thompson
and Kunthong (2006). With y' = F(y, t) for y = (theta, v, z), theta canonical coordinates about the start of the step
(q = q_n o exp(theta), theta' = T(theta)^-1 v), values Y_i at the nodes of Radau, and J = dF/dy at the start,

    G_i = y_n + h sum_j Q_ij F(Y_j, t_j) - Y_i,   g = V^-1 G,   Y' = Y + V d
    (I - gamma h J) d_j = g_j - gamma h J d_{j-1},   j = 0..p

with Q = V P V^-1 in the first pass, which makes it a stiffly accurate SDIRK method linearised at the start and keeps
positions exact that stiff forces drive, and Radau's A in later ones, with the parent method as limit. Laguerre's
polynomials (columns of V) make P bidiagonal with the one eigenvalue gamma; see ``galerkin_operators``.

In forces, with a residual r = M a - f, the accelerations a = A^-1 (v - v_n)/h of the polynomial in later passes, and
M_n of the start:

    M_n F_v = -r(a = 0) in the first pass,   M_n a - r(a) in later ones,
    (M + gamma h C + (gamma h)^2 K) d_v = b - gamma h K b_theta,   d_theta = b_theta + gamma h d_v

so M may be singular if the matrix is not. If M depends on q, M_n a - r is off by (M_n - M_i) M_i^-1 r, which is
of the power of h of the error of a pass anyway. If passes are so few that the order rests on more than a power each
(``is_refined``), one correction of a by the factors of the step makes r small to one more power of h. Numbers of q have
theta' = v, which is linear: after a pass its defect is -gamma h r d_p of v alone, with r = (P - A)/gamma applied to
L_p, so no sum over nodes is needed for them.

On rotations d theta'/d theta is -ad(v_n)/2; 1 - gamma h of it is T(gamma h v_n)^-1 up to terms left out by J, so
K and d_theta have T(gamma h v_n) in front of theta. Without it the stages, of order 2 at p = 1, would leave the method
at order 2.

Five passes at p = 3 give order 7 to linear equations and 6 to others: the first pass, linear about the start, leaves
h^3, and each later one takes off one power of h. Six give order 7 to all, and are A-stable too.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

from eomgen.base.data import dataclass, replace
from eomgen.integrators.families.family import (
    DenseOutput,
    Field,
    MethodName,
    Setting,
    Sizes,
    Status,
    rotation_too_large,
)
from eomgen.integrators.families.galerkin_operators import (
    Operators,
    laguerre,
    operators,
    product,
    root,
)
from eomgen.integrators.families.needs import UNCONSTRAINED_LINEARISED
from eomgen.integrators.families.one_factorization import (
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
class DiscontinuousGalerkin(OneFactorization):
    """A time-discontinuous Galerkin method in passes.

    Attributes
    ----------
    degree : int
        Of the polynomials.
    gamma : Fraction
        The one eigenvalue of the operator of the first pass, in shares of a step.
    passes : int
    """

    degree: int
    gamma: Fraction
    passes: int
    order: int
    needs = (UNCONSTRAINED_LINEARISED,)
    source = "Thompson and Kunthong 2006; Burrage 1978; Butcher 1979"
    family = "discontinuous_galerkin"
    group_functions = ("update", "tangent", "rate")
    more_stable = "tdg1, which damps unresolved motions most"
    dense_output: ClassVar[DenseOutput] = "hermite_5"
    state_is_all = True
    renewal = "needs no restart, because it evaluates the forces at its start"

    @cached_property
    def operators(self) -> Operators:
        """Nodes and matrices."""
        return operators(self.degree, self.gamma)

    @property
    def is_refined(self) -> bool:
        """Whether passes are too few for accelerations that are off by the defect of the pass before."""
        return self.order > self.passes + min(self.degree, 2) - 1

    @property
    def _lag(self) -> list[list[float]]:
        """Two lists of coefficients of Laguerre's polynomials L_0(s/gamma) to L_p(s/gamma): 1 integrated by -P/gamma,
        and (P - A)/gamma applied to L_p, with P, A and gamma of the module."""
        operators = self.operators
        apart = [
            [x - y for x, y in zip(*rows, strict=True)]
            for rows in zip(operators.first, operators.integration, strict=True)
        ]
        last = product(product(operators.modes, apart), operators.values)
        return [
            [-1.0, 1.0, *(0.0 for _ in range(self.degree - 1))],
            [float(row[-1] / self.gamma) for row in last],
        ]

    @classmethod
    def names(cls) -> tuple[MethodName, ...]:
        return tuple(MethodName(name, make, idle=("rho_inf",), fixed_steps=_FIXED) for name, make in METHODS.items())

    def title(self, constrained: bool) -> str:
        parts = f"degree {self.degree}, {self.passes} passes, order {self.order}"
        return f"time-discontinuous Galerkin method in passes on Lie groups, {parts}"

    def settings(self, sizes: Sizes) -> tuple[Setting, ...]:
        return (STOP_AT_GROWTH,)

    def statistics(self, sizes: Sizes) -> tuple[Field, ...]:
        return (*super().statistics(sizes), UNFOLLOWED_GROWTH)

    def statuses(self, constrained: bool, angles: bool) -> tuple[Status, ...]:
        return (*super().statuses(constrained, angles), rotation_too_large(angles), GROWTH_STATUS)

    def data(self, system: System, step: float, samples: Any) -> Mapping[str, Any]:
        """Return the data of the templates for a system: the linear system of a step, nodes, operators and passes.
        `step` in s and `samples` give the numbers by which pivots are planned."""
        result = self.operators
        return {
            **linear_system(system, float(self.gamma) * step, samples, guarded=True, turned=True),
            "stages": self.degree + 1,
            "passes": self.passes,
            "gamma": float(self.gamma),
            "nodes": [float(node) for node in result.nodes],
            "first": numbers(product(result.modes, result.first)),
            "later": numbers(product(result.modes, result.integration)),
            "modes": numbers(result.modes),
            "at_nodes": numbers(result.values),
            "derivative": numbers(result.derivative),
            "lag": self._lag,
            "refined": self.is_refined and not system.facts.constant_mass,
            "input_times": [0.0, *(float(node) for node in result.nodes)],
        }

    def work(self, system: System, method: Mapping[str, Any]) -> tuple[Work, ...]:
        """Return the work of one step: calls of the model's functions, and operations of the stepper.
        `method` is ``Program.method``."""
        from eomgen.integrators.step_work import Work, work_of_groups, work_of_matrix  # noqa: PLC0415

        un, refined, tangents = method["unknowns"], bool(method["refined"]), method["solver"]["tangents"]
        v, z = un["v"], un["size"] - un["first_z"]
        runs = method["lie"]["runs"]
        plain = sum(run["size"] for run in runs if run["group"] == "R")
        nodes, later = self.degree + 1, self.passes - 1
        evaluated, modes = later * nodes, self.passes * nodes
        equations = "equations" if z else "residual"
        called = "relative_forces" if method["links"] else equations
        timed = bool({"t", "u", "base"} & set(system.functions[equations].inputs))
        again = evaluated if refined else 0
        forces = method["rights"] if refined or method["links"] else v
        rotating = self.passes + later if v > plain else 0
        sums = Counter({v: 2 * self.passes + rotating})
        sums[forces] += self.passes
        sums[z] += self.passes * 2 + later
        sum_of_node = Work("", 1, False, v * nodes + z, nodes + v * nodes)
        return (
            Work(called, (nodes if timed else 1) + evaluated + again, of_model=True),
            *work_of_matrix(
                system, method, drivers=nodes + 1, inertia=modes + again, stiffness=modes, solutions=modes + again
            ),
            *(_work_of_turns(tangents, 2 * modes) if tangents else ()),
            *work_of_groups(method, {"update": evaluated + 1, "rate": evaluated, "tangent": 1}),
            *(
                Work(f"sums over nodes, {size} each", times, False, nodes * nodes * size, nodes * nodes * (size + 1))
                for size, times in sorted(sums.items())
                if size
            ),
            Work("right sides and corrections", self.passes, False, *_pass_work(nodes, plain, v, z, forces)),
            replace(sum_of_node, what="velocities and accelerations of nodes", times=evaluated,
                    additions=sum_of_node.additions + 2 * v * refined),
            Work("accelerations of the end", 1, False, (v + z) * (nodes - 1), nodes + (v + z) * nodes, 1),
            Work("compensation of sums", 1, False, 4 * (v + z) + 3 * plain),
            Work("times and gain", 1, False, nodes + 1, nodes + 3 + v - plain, 1),
        )  # fmt: skip  # a table


def _pass_work(nodes: int, plain: int, v: int, z: int, forces: int) -> tuple[int, int]:
    """Return additions and multiplications of a pass, except sums over nodes, products with M and K, and substitutions.
    `plain` is the number of coordinates in R, `v` and `z` the numbers of velocities and internal states, and `forces`
    the number of components of a right side."""
    added = plain + 2 * (v - plain) + forces + v + 2 * z
    return nodes * added, nodes * (plain + bool(plain) + v + z)


def _work_of_turns(tangents: Sequence[Mapping[str, Any]], times: int) -> tuple[Work]:
    """Return the work of ``times`` products of T with a vector."""
    from eomgen.integrators.step_work import Work  # noqa: PLC0415

    poses = sum(tangent["group"] == "se3" for tangent in tangents)
    additions, multiplications = (6 * len(tangents) + 15 * poses, 9 * len(tangents) + 18 * poses)
    return (Work("T x", times, False, additions, multiplications),)


def numbers(matrix: list[list[Fraction]]) -> list[list[float]]:
    """Return a matrix as JSON."""
    return [[float(x) for x in row] for row in matrix]


def _square_root(x: Fraction) -> Fraction:
    return root(lambda y: y * y - x, Fraction(0), max(x, Fraction(1)))


METHODS: Mapping[str, Callable[[], DiscontinuousGalerkin]] = {
    "tdg1": lambda: DiscontinuousGalerkin(1, 1 - _square_root(Fraction(1, 2)), 2, 3),
    "tdg1_star": lambda: DiscontinuousGalerkin(1, _square_root(Fraction(1, 6)), 3, 3),
    "tdg2": lambda: DiscontinuousGalerkin(2, Fraction(1, 4), 4, 5),
    "tdg2s": lambda: DiscontinuousGalerkin(
        2, root(lambda x: laguerre(3, 1 / x)[3], Fraction(2, 5), Fraction(1, 2)), 2, 4
    ),
    "tdg3": lambda: DiscontinuousGalerkin(3, Fraction(33, 200), 6, 7),
}
_FIXED = ("its steps are all of one size", "generalized_alpha, or rk45 for motions that are not stiff")
