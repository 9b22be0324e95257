"""What the C templates of a method need to know beyond the model: plain data for ``Program.method``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

from eomgen.errors import ModelError, Problem, UsageError
from eomgen.integrators.families.family import FactsLike
from eomgen.integrators.families.generalized_alpha import (
    GENERALIZED_ALPHA,
    INDEX_3,
    INDEX_3_REFUSED_RHO,
    SPATIAL,
    STABILISED,
    GeneralizedAlpha,
)
from eomgen.integrators.families.hermite import Hermite, hermite_data
from eomgen.integrators.families.partitioned import (
    GOOD_GAIN,
    LARGEST_GAIN,
    NEAR_PART,
    PARTITIONED,
    SINGULAR_PART,
    SMALLEST_PIVOT,
    PartitionedRungeKutta,
)
from eomgen.integrators.families.taylor import MAX_ORDER, Taylor, taylor_data
from eomgen.integrators.methods import Method, check_needs
from eomgen.integrators.newton.matrix import Unknowns
from eomgen.integrators.newton.samples import Samples, samples_of
from eomgen.integrators.newton.solver import Solver, make_solver, solver_data
from eomgen.integrators.step_splitting import jump_data
from eomgen.lie import kernels
from eomgen.lie.groups import group_named
from eomgen.lie.product import FactorLike

#: Newton's stopping test on the increment of the mean velocity. Tight enough that errors left by it stay below those of the
#: method at steps of 1e-5; the stepper itself keeps the demand above round-off.
RELATIVE_TOLERANCE = 1e-10
ABSOLUTE_TOLERANCE = 1e-12
MAX_ITERATIONS = 16
MAX_HALVINGS = 6


class SystemLike(Protocol):
    """What is asked of a system (``system.System`` answers)."""

    @property
    def facts(self) -> Any: ...
    @property
    def factors(self) -> Any: ...
    @property
    def functions(self) -> Any: ...
    @property
    def counts(self) -> Any: ...
    @property
    def multipliers(self) -> Any: ...
    @property
    def holonomic(self) -> int: ...
    @property
    def row_units(self) -> Any: ...
    @property
    def angular(self) -> Any: ...
    @property
    def turning(self) -> Any: ...
    @property
    def positions(self) -> int: ...
    @property
    def initial_z(self) -> Any: ...
    @property
    def patterns(self) -> Any: ...
    @property
    def discontinuities(self) -> Any: ...
    @property
    def inner_owners(self) -> Any: ...


def method_data(method: Method, system: SystemLike, step: float = 1e-3, samples: Samples | None = None) -> dict[str, Any]:
    """Return ``Program.method``: JSON types only. ``templates/c/integrators`` has a folder for each family.

    Parameters
    ----------
    method : Method
    system : System
        Its facts are held against the method's needs first.
    step : float
        Default step in s; like rho_inf and the tolerances it is a setting of the compiled stepper, not part of its code.
    samples : Samples, optional
        Numbers by which the pivots are chosen; the system's tape at a few states by default.

    Raises
    ------
    ModelError
        The system lacks something that the method needs, or its iteration matrix is singular at the initial state.
    UsageError
        The step is not positive.
    """
    facts: FactsLike = system.facts
    check_needs(method, facts)
    if not 0.0 < step < float("inf"):
        raise UsageError(Problem("method.step", f"the step must be a positive number of seconds, not {step!r}", "1e-3"))
    _check_functions(method, system)
    implicit = isinstance(method, GeneralizedAlpha)
    has_dynamics = "forward_dynamics" in system.functions
    data: dict[str, Any] = {
        "family": method.family,
        "order": method.order,
        "source": method.source,
        "step": float(step),
        "matrices": implicit or not (has_dynamics or isinstance(method, PartitionedRungeKutta | Taylor | Hermite)),
        "lie": _lie_data(system.factors, implicit, getattr(method, "variant", "")),
        "turning": list(system.turning),
        "positions": system.positions,
    }
    if jumps := jump_data(system.discontinuities, MAX_ORDER if isinstance(method, Taylor) else method.order):
        data["jumps"] = jumps
    if isinstance(method, GeneralizedAlpha):
        nl, owners, nz = len(system.multipliers), system.inner_owners, len(system.initial_z)
        unknowns = Unknowns(_nv(system), nl, system.holonomic, method.form == STABILISED, len(owners), nz)
        known = samples if samples is not None else samples_of(system)
        solver = make_solver(unknowns, system.factors, known, _weights(method, step), step, owners)
        data |= {
            "title": f"{_title(method)} on Lie groups{_form_text(method, unknowns)}",
            "form": method.form,
            "variant": method.variant,
            "warnings": list(method.warnings) if unknowns.holonomic else [],
            "parameters": list(method.parameters),
            **{name: float(value) for name, value in method.parameters.items()},
            "rho_inf_below": INDEX_3_REFUSED_RHO if method.form == INDEX_3 and unknowns.holonomic else None,
            "rtol": RELATIVE_TOLERANCE,
            "atol": ABSOLUTE_TOLERANCE,
            "max_iterations": MAX_ITERATIONS,
            "max_halvings": MAX_HALVINGS,
            "unknowns": {
                "v": unknowns.v, "lam": unknowns.lam, "holonomic": unknowns.holonomic, "eta": unknowns.eta,
                "size": unknowns.size, "phi": unknowns.phi, "w": unknowns.v + unknowns.holonomic, "skipped": unknowns.skipped,
                "first_z": unknowns.first_z,
            },
            "solver": solver_data(solver, system.factors),
            "angular": [int(turns) for turns in system.angular] or [0] * _nv(system),
            "places": _places(system.factors, _nv(system)),
            "quaternions": [factor.q_start + k for factor in system.factors if factor.group != "R" for k in range(4)],
            "factorization_cost": _factorization_cost(system, solver),
            "input_times": [0.0, 1.0],
            "rows_per_step": 1,
        }  # fmt: skip
        return data
    if isinstance(method, Taylor):
        return data | taylor_data(method)
    if isinstance(method, Hermite):
        return data | hermite_data(method)
    if isinstance(method, PartitionedRungeKutta):
        data |= {
            "unknowns": {"v": _nv(system), "lam": len(system.multipliers), "holonomic": system.holonomic, "eta": 0},
            "angular": [int(turns) for turns in system.angular],
            "lengths": [int(unit != "1") for unit in system.row_units],
            "largest_gain": LARGEST_GAIN,
            "good_gain": GOOD_GAIN,
            "smallest_pivot": SMALLEST_PIVOT,
            "near_part": NEAR_PART,
            "singular_part": SINGULAR_PART,
            "max_iterations": MAX_ITERATIONS,
        }
    nodes = sorted({c for c in method.c if c != 0} | {1})
    return data | {
        "title": f"explicit Runge-Kutta in the Lie algebra, order {method.order}"
        + (", constraints eliminated by coordinate partitioning" if method.family == PARTITIONED else ""),
        "stages": len(method.b),
        "A": [[float(x) for x in row] for row in method.A],
        "b": [float(x) for x in method.b],
        "c": [float(x) for x in method.c],
        "input_rows": [0 if c == 0 else nodes.index(c) + 1 for c in method.c],
        "input_times": [0.0, *(float(x) for x in nodes)],
        "rows_per_step": len(nodes),
    }


def _check_functions(method: Method, system: SystemLike) -> None:
    if isinstance(method, PartitionedRungeKutta):
        needed = {"mass", "residual", "constraint_velocity", "constraint_bias", "constraint_jacobian", "constraint_size"}
        needed |= {"constraint"} if system.holonomic else set()
    elif isinstance(method, Taylor | Hermite):
        needed = {"mass", "residual"} if "mass" in system.functions else {"forward_dynamics"}
    elif len(system.multipliers) or (system.facts.internal_states and method.family == GENERALIZED_ALPHA):
        needed = {"equations", "iteration"} | ({"constraint_bias"} if len(system.multipliers) else set())
        if isinstance(method, GeneralizedAlpha) and system.holonomic:
            needed |= {"constraint_size"} | ({"jacobian_values"} if method.form == STABILISED else set())
    else:
        matrix = "iteration" if "iteration" in system.functions else "partials"
        needed = {"residual", matrix} if method.family == GENERALIZED_ALPHA else set()
        if "forward_dynamics" not in system.functions:
            needed |= {"residual", matrix}
    needed |= {"internal_rate"} if system.facts.internal_states else set()
    missing = sorted(needed - set(system.functions))
    problems = []
    if missing:
        what = f"{method.family} calls {', '.join(missing)}, which the model was built without"
        problems.append(Problem("method", what, "ask for these terms"))
    if isinstance(method, PartitionedRungeKutta) and len(system.multipliers) > _nv(system):
        what = f"there are {len(system.multipliers)} constraint rows for {_nv(system)} velocity components: some repeat others"
        problems.append(Problem("method", what, "leave out the rows that follow from others"))
    if not system.factors:
        what = "there is nothing to integrate: every joint is fixed"
        problems.append(Problem("method", what, "give a joint a degree of freedom"))
    if problems:
        raise ModelError(problems)


def _nv(system: SystemLike) -> int:
    return sum(factor.v_size for factor in system.factors)


def _title(method: GeneralizedAlpha) -> str:
    titles = {"hht": "HHT-alpha", "wbz": "WBZ-alpha", "newmark": "Newmark's method", "trapezoidal": "the trapezoidal rule"}
    return "generalized-alpha" if method.case is None else titles[method.case.name]


def _form_text(method: GeneralizedAlpha, unknowns: Unknowns) -> str:
    variant = "" if method.variant == "F0" else f", variant {method.variant}"
    if not unknowns.lam:
        return variant
    return (", stabilised index 2" if method.form == STABILISED else ", index 3") + variant


def _weights(method: GeneralizedAlpha, step: float) -> list[float]:
    """Return the weights of an iteration matrix, in the order of ``newton.matrix.WEIGHTS``."""
    g = float(method.gamma / method.beta)
    b = float((1 - method.alpha_m) / (method.beta * (1 - method.alpha_f)))
    return [b, step * g, step * step, g, step, 1.0, step * float(method.rate_gain)]


def _factorization_cost(system: SystemLike, solver: Solver) -> float:
    """Return what forming and factoring the iteration matrix costs, in iterations with old factors, by operation counts.

    Substitution waits for its own results, and group operations take roots and quotients: both weigh more than they count.
    """
    residual = "equations" if len(system.multipliers) or len(system.initial_z) else "residual"
    turns = sum(1 for factor in system.factors if factor.group != "R")
    iteration = float(system.counts[residual].flops + 4 * solver.solve_operations + 10 * solver.unknowns.size + 120 * turns)
    return float(system.counts[solver.packing.function].flops + 2 * solver.factor_operations + 60 * turns) / iteration


def _lie_data(factors: Sequence[FactorLike], implicit: bool, variant: str) -> dict[str, Any]:
    """Return the factors as runs, neighbouring R's merged, and the group functions that they need."""
    runs: list[dict[str, Any]] = []
    for factor in factors:
        last = runs[-1] if runs else None
        if (
            last is not None and factor.group == last["group"] == "R"
            and (last["q"] + last["size"], last["v"] + last["size"]) == (factor.q_start, factor.v_start)
        ):  # fmt: skip
            last["size"] += factor.v_size
        else:
            runs.append({"group": factor.group, "q": factor.q_start, "v": factor.v_start, "size": factor.v_size})
    groups = [group_named(name) for name in sorted({run["group"] for run in runs} - {"R"})]
    made = [kernels.update, kernels.tangent if implicit else kernels.bracket]
    made += [kernels.bracket, kernels.transport] if variant == SPATIAL else []
    return {
        "runs": runs,
        "kernels": [_kernel_data(make(group)) for group in groups for make in made],
    }


def _places(factors: Sequence[FactorLike], nv: int) -> list[int]:
    """Return for each velocity component the number of q that it moves, or its position has in its place; -1: quaternions."""
    places = [-1] * nv
    for factor in factors:
        rotation = 0 if factor.group == "R" else 3
        first = factor.q_start + (4 if rotation else 0)
        for k in range(rotation, factor.v_size):
            places[factor.v_start + k] = first + k - rotation
    return places


def _kernel_data(kernel: kernels.Kernel) -> dict[str, Any]:
    return {
        "name": kernel.name,
        "description": kernel.description,
        "inputs": [list(pair) for pair in kernel.inputs],
        "statements": kernel.statements(),
        "results": kernel.results(),
    }
