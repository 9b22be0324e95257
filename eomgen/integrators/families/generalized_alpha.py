"""Generalized-alpha methods as data.

Generalized-alpha on Lie groups: Bruls and Cardona, J. Comput. Nonlinear Dyn. 5 (2010) 031002; Arnold, Bruls and
Cardona, Numer. Math. 129 (2015) 149; scaling: Arnold and Hante, J. Comput. Nonlinear Dyn. 12 (2017) 021002.
Internal states of first order: Jansen, Whiting and Hulbert, Comput. Methods Appl. Mech. Engrg. 190 (2000) 305.
Runge-Kutta on Lie groups: Munthe-Kaas, Appl. Numer. Math. 29 (1999) 115.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any, ClassVar

from eomgen.base.data import dataclass, field, replace
from eomgen.errors import Problem, UsageError
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
    GroupFunction,
    LinearStep,
    MethodName,
    SceneFact,
    Setting,
    Sizes,
    Status,
    rotation_too_large,
    velocities,
)
from eomgen.integrators.families.generalized_alpha_cases import Coefficients, hht, newmark, trapezoidal, wbz
from eomgen.integrators.families.needs import UNCONSTRAINED_CONDITIONALLY_STABLE, SystemRequirement
from eomgen.lie.product import Factor

if TYPE_CHECKING:
    from eomgen.integrators.newton.solver import Solver
    from eomgen.system.system import System

_SOURCE = "Bruls and Cardona 2010; Arnold, Bruls and Cardona 2015; Arnold and Hante 2017"
#: How constraints enter a step: positions only, or positions and velocities with one more multiplier per holonomic row.
INDEX_3, STABILISED = "index3", "stabilised"
#: How the increment of a step is cut into exponentials: one; velocity and acceleration; velocity and both
#: accelerations. ``spatial``: one exponential, and algorithmic variables of the last step are rotated with this
#: exponential.
SPATIAL = "spatial"
VARIANTS = ("F0", "F1", "F2", SPATIAL)
#: Largest spectral radius at which index 3 is known to damp transients of the start, and spectral radius above which
#: index 3 is known to fail.
INDEX_3_SAFE_RHO, INDEX_3_REFUSED_RHO = 0.9, 0.99
#: If forces damp, so that errors do not add up, a step may end with its first iteration: the part of the tolerance that
#: may remain by a contraction known from earlier steps, and the number of steps for which this contraction is used.
_OF_DAMPED_FORCES = {"known_part": 0.1, "unobserved_steps": 15}
#: Named cases: constructor, parameters, and name of the C file.
NAMED_CASES: Mapping[str, tuple[Callable[..., Coefficients], tuple[str, ...], tuple[str, ...], str]] = {
    "hht": (hht, ("alpha", "rho_inf"), (), "HHT-alpha"),
    "wbz": (wbz, ("alpha", "rho_inf"), (), "WBZ-alpha"),
    "newmark": (newmark, ("alpha", "beta", "gamma"), (), "Newmark's method"),
    "trapezoidal": (trapezoidal, (), ("average_acceleration",), "the trapezoidal rule"),
}
#: Cases that are always of order 2: with a tolerance they have adaptive steps.
OF_ORDER_2 = ("hht", "wbz", "trapezoidal")


#: Reason for which steps of other forms and variants have one size, and methods that follow a tolerance.
_INDEX_3_FIXED = (
    "in index 3 velocities lie off the constraints by the square of the step, and a change of the step leaves"
    " multipliers with errors of first order",
    "generalized_alpha, which holds velocities on the constraints, or rk45_partitioned",
)
_VARIANT_FIXED: Mapping[str, tuple[str, str] | tuple[()]] = {
    "F0": (),
    "F1": ("the estimate of errors is for steps with one exponential", "generalized_alpha"),
    "F2": ("the estimate of errors is for steps with one exponential", "generalized_alpha"),
    SPATIAL: ("vectors that turn with a body from step to step need steps of one size", "generalized_alpha, or rk45"),
}
_NEWMARK_FIXED = (
    "the estimate of errors is of methods of order 2, and with damping its order is 1",
    "trapezoidal, which it is without damping, or generalized_alpha",
)


#: Parameters of cases whose own do not damp, which index 3 does not bear.
_COMPILED_WITH: Mapping[str, Mapping[str, float]] = {"newmark_index3": {"alpha": 0.05}}


@lru_cache(maxsize=64)
def _decimal_fraction(number: float) -> Fraction:
    """Return a number as the decimal number of its text."""
    return Fraction(repr(number))


def _differs(form: str, variant: str) -> tuple[SceneFact, ...]:
    """Return the facts of a scene (constraints, rotations) for which form and variant differ from the plain method."""
    of_form: tuple[SceneFact, ...] = ("constraints",) if form == INDEX_3 else ()
    return of_form if variant == "F0" else (*of_form, "rotations")


@dataclass(frozen=True)
class GeneralizedAlpha(Family):
    """Generalized-alpha on a Lie group: optimal for a spectral radius at infinite frequency, or a named case.

    Parameters
    ----------
    rho_inf : float
        0 (asymptotic annihilation) to 1 (no dissipation); below 0.99 in index 3. Raises UsageError outside.
    form : str
        For constrained systems: ``stabilised`` (index 2: constraints and their rates hold at every step) or ``index3``
        (constraints hold, their rates to second order only).
    variant : str
        ``F0`` (q_n o exp(h Dq)), ``F1`` or ``F2``: velocity and acceleration, or velocity and both accelerations, in
        separate exponentials. ``spatial``: velocities and accelerations are interpolated in a frame that does not turn
        with the body.
    case : Coefficients, optional
        Of HHT, WBZ, Newmark or the trapezoidal rule; ``rho_inf`` is then the spectral radius of the case, for any
        argument.
    """

    rho_inf: float = 0.9
    form: str = STABILISED
    variant: str = "F0"
    case: Coefficients | None = None
    order: int = field(default=2, init=False)
    source: str = field(default=_SOURCE, init=False)
    needs: tuple[SystemRequirement, ...] = field(default=(), init=False)
    family = "generalized_alpha"
    dense_output: ClassVar[DenseOutput] = "hermite_3"
    implicit = True
    holds_constraints = True
    renewal = "starts anew from q and v, as after a jump of the forces"
    projection = "the smallest change in the metric of M"

    def __post_init__(self) -> None:
        """Check spectral radius, form and variant. Raises UsageError."""
        if self.case is not None:
            self._take(self.case)
        elif not (isinstance(self.rho_inf, int | float) and math.isfinite(self.rho_inf) and 0.0 <= self.rho_inf <= 1.0):
            fault = f"the spectral radius at infinite frequency must lie in 0..1, not {self.rho_inf!r} [E0335]"
            hint = "0.9 for mild numerical damping, 1 for none, 0 for the most"
            raise UsageError(Problem("method.rho_inf", fault, hint))
        for key, value, known in (("form", self.form, (STABILISED, INDEX_3)), ("variant", self.variant, VARIANTS)):
            if value not in known:
                fault = f"there is no {key} {value!r} [E0100]"
                raise UsageError(Problem(f"method.{key}", fault, f"one of {', '.join(known)}"))
        if self.form == INDEX_3 and self.rho_inf >= INDEX_3_REFUSED_RHO:
            self._refuse_index_3()

    def _take(self, case: Coefficients) -> None:
        """Set order, source, needs and spectral radius of this method to the values of a named case."""
        values: dict[str, object] = {"order": case.order, "source": f"{case.source}; {_SOURCE}"}
        values["rho_inf"] = case.radius_at_infinity
        if not case.unconditionally_stable:
            values["needs"] = (*self.needs, UNCONSTRAINED_CONDITIONALLY_STABLE)
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def _refuse_index_3(self) -> None:
        radius = f"a spectral radius of {self.rho_inf:.4g}"
        fault = f"index 3 does not bear {radius}, at which nothing damps the multipliers: iterations diverge [E0338]"
        hint = "form stabilised, which runs at any radius, or a radius of at most 0.9"
        if self.case is not None:
            unstable = "index 3 is weakly unstable: nothing damps errors of the multipliers, which grow [E0339]"
            fault = f"{self.case.name} has {radius} here, and {unstable}"
            hint = f"{self.case.name} without _index3, the stabilised form, or hht_index3 with alpha = 0.05"
        raise UsageError(Problem("method.rho_inf", fault, hint))

    def warnings(self, constrained: bool) -> tuple[str, ...]:
        """Return sentences on coefficients that are not stable for all steps or scenes; empty for coefficients that
        are."""
        if self.form == INDEX_3 and not constrained:
            return ()
        text = ""
        if self.case is not None and not self.case.unconditionally_stable:
            text = f"{self.case.name} with 2 beta < gamma is stable only while step times the highest angular"
            text += f" frequency stays below {self.case.largest_phase:.4g}"
        elif self.form == INDEX_3 and self.rho_inf > INDEX_3_SAFE_RHO:
            text = f"index 3 with a spectral radius of {self.rho_inf:.4g} damps multipliers too little: errors of its"
            text += " start live for many steps, and from 0.99 on it fails; take at most 0.9, or the stabilised form"
        return (text,) if text else ()

    @classmethod
    def names(cls) -> tuple[MethodName, ...]:
        """Return the names of the optimal method in both forms and all variants, and of named cases in both forms."""
        rows: list[MethodName] = []
        for form, middle in ((STABILISED, ""), (INDEX_3, "_index3")):
            for variant in ("F0", "F1", "F2", SPATIAL):
                name = f"generalized_alpha{middle}" + (f"_{variant.lower()}" if variant != "F0" else "")
                others, adaptive = (("chung_hulbert",), f"{name}_adaptive") if name == "generalized_alpha" else ((), "")
                differs = _differs(form, variant)
                make = partial(_optimal, form, variant)
                fixed = _INDEX_3_FIXED if form == INDEX_3 else _VARIANT_FIXED[variant]
                rows.append(MethodName(name, make, ("rho_inf",), others, (), differs, adaptive, fixed))
        for case, (_, parameters, aliases, _) in NAMED_CASES.items():
            make, adaptive = partial(_named_case, case, STABILISED), f"{case}_adaptive" if case in OF_ORDER_2 else ""
            fixed = () if adaptive else _NEWMARK_FIXED
            rows.append(MethodName(case, make, parameters, aliases, by_tolerance=adaptive, fixed_steps=fixed))
            index_3, differs = partial(_named_case, case, INDEX_3), _differs(INDEX_3, "F0")
            row = MethodName(f"{case}_index3", index_3, parameters, differs=differs)
            rows.append(replace(row, fixed_steps=_INDEX_3_FIXED, compiled_with=_COMPILED_WITH.get(row.name, {})))
        return tuple(rows)

    @classmethod
    def terms(cls, constrained: bool, internal: bool, mass: bool) -> tuple[str, ...]:
        if constrained:
            forces = () if internal else ("residual",)
            return ("mass", *forces, *KINEMATIC, "jacobian_values", "equations", "iteration")
        return ("forward_dynamics", *(("equations", "iteration") if internal else ("residual", "partials")))

    def calls(self, system: System) -> set[str]:
        if not len(system.multipliers) and not system.facts.internal_states:
            return {"residual", "iteration" if "iteration" in system.functions else "partials"}
        called = {"equations", "iteration"} | ({"constraint_bias"} if len(system.multipliers) else set())
        if system.holonomic:
            called |= {"constraint_size"} | ({"jacobian_values"} if self.form == STABILISED else set())
        return called

    def title(self, constrained: bool) -> str:
        name = "generalized-alpha" if self.case is None else NAMED_CASES[self.case.name][3]
        form = {STABILISED: ", stabilised index 2", INDEX_3: ", index 3"}[self.form] if constrained else ""
        return f"{name} on Lie groups{form}" + ("" if self.variant == "F0" else f", variant {self.variant}")

    @property
    def linear_step(self) -> LinearStep | None:
        if self.variant != "F0":
            return None
        first_order = self.rate_alpha_m, self.rate_gamma
        return LinearStep(*map(float, (self.alpha_m, self.alpha_f, self.beta, self.gamma, *first_order)))

    @property
    def group_functions(self) -> tuple[GroupFunction, ...]:
        return ("update", "tangent", *(("bracket", "transport") if self.variant == SPATIAL else ()))

    @property
    def instead(self) -> str:
        return "rk4_partitioned or rattlie" if self.case is None else "generalized_alpha"

    @property
    def more_stable(self) -> str:
        if self.case is not None and not self.case.unconditionally_stable:
            return super().more_stable
        return "a smaller rho_inf" if self.case is None and self.rho_inf > 0 else "another method"

    @property
    def keywords(self) -> dict[str, float]:
        if self.case is None:
            return {"rho_inf": self.rho_inf}
        if self.case.name in ("hht", "wbz"):
            return {"alpha": float(self.case.gamma - Fraction(1, 2))}
        if self.case.name == "trapezoidal":
            return {}
        return {"beta": float(self.case.beta), "gamma": float(self.case.gamma)}

    def _index_3(self, sizes: Sizes) -> bool:
        """Return whether constraints are enforced at position level only."""
        return self.form == INDEX_3 and sizes.holonomic > 0

    def _eta(self, sizes: Sizes) -> int:
        """Return the number of multipliers of the velocity constraints."""
        return sizes.holonomic if self.form == STABILISED else 0

    def state(self, sizes: Sizes) -> tuple[Field, ...]:
        """Return the members of the stepper's state beyond the common ones: algorithmic accelerations, multipliers and
        rates with their last values for predictions, and the coefficients."""
        before = "of the last two steps, newest first, for predictions"
        history = "number of steps for predictions, at most 3; -1: none, and the first step is damped"
        fields = [
            Field("a", "algorithmic acceleration", sizes.v),
            Field("a_before", f"algorithmic accelerations {before}", 2 * sizes.v),
        ]
        if self._eta(sizes):
            fields += [
                Field("eta", "multipliers of the velocity constraints", self._eta(sizes)),
                Field("displaced", "mean velocity by eta in the last step", sizes.v),
                Field("inverse_inertia", "1/M_ii at the start: change of positions per eta", sizes.v),
            ]
        if self.variant == SPATIAL:
            mean = "mean velocities of the last three steps, newest first, in the frame of the state"
            fields.append(Field("mean_before", mean, 3 * sizes.v))
        if sizes.lam:
            fields.append(Field("lam_before", f"multipliers {before}", 2 * sizes.lam))
        if sizes.z:
            fields += [
                Field("z_rate", "algorithmic rate of z", sizes.z),
                Field("z_rate_before", f"algorithmic rates {before}", 2 * sizes.z),
            ]
        return (
            *fields,
            Field("history", history, 0, "long"),
            Field("predictor_order", "order of the polynomial with the best prediction of the last step", 0, "long"),
            *(Field(name, "coefficient with which a was computed") for name in self.coefficients),
        )

    def settings(self, sizes: Sizes) -> tuple[Setting, ...]:
        """Return the settings of the stepper with default, meaning and range: coefficients, tolerances, limits of
        iterations."""
        below = f" (index 3: below {INDEX_3_REFUSED_RHO:g})" if self._index_3(sizes) else ""
        meaning = {
            "rho_inf": f"spectral radius at infinite frequency, 0 to 1{below}",
            "alpha_m": "(1 - alpha_m) a' + alpha_m a = (1 - alpha_f) vdot' + alpha_f vdot",
            "alpha_f": "alpha_m <= alpha_f <= 1/2",
            "beta": "Newmark coefficient, > 0",
            "gamma": "Newmark coefficient, >= 1/2; order 2 if gamma = 1/2 + alpha_f - alpha_m",
        }
        also = (", step lam" if sizes.lam else "") + (" and eta" if self._eta(sizes) else "")
        also += ", and (z - z_n)/step" if sizes.z else ""
        increment = f"tolerance of Newton increments of mean velocity{also}: weighted RMS, relative to each component"
        whole_motion = "tolerance of the same increments, relative to the size of the whole motion in such components"
        perturb = "1: start with velocities that avoid a first-order error of the multipliers; 0: with the given ones"
        reuse = "1: reuse a factorization as long as iterations converge well; 0: one per step"
        return (
            *(Setting(name, float(value), meaning[name]) for name, value in self.coefficients.items()),
            # errors of the iteration stay below errors of the method at steps of 1e-5; the stepper keeps the demand
            # above round-off
            Setting("rtol", 1e-10, increment, single=1e-5),
            Setting("atol", 1e-12, whole_motion, single=1e-6),
            Setting("max_iterations", 16, "Newton iterations per attempt at most", (1, 2**31 - 1)),
            Setting("max_halvings", 6, "halvings at most of a step that fails with a fresh matrix", (0, 30)),
            Setting("reuse", 1, reuse, (0, 1)),
            *((Setting("perturb", 1, perturb, (0, 1)),) if self._index_3(sizes) else ()),
        )

    def bounds(self, sizes: Sizes) -> tuple[Bound, ...]:
        """Return the conditions on the step, the coefficients, the tolerances and the limits of iterations, checked in
        C."""
        largest = Bound("rho_inf", "<", INDEX_3_REFUSED_RHO) if self._index_3(sizes) else Bound("rho_inf", "<=", 1.0)
        of_case = (
            Bound("alpha_m", "<=", "alpha_f"),
            Bound("alpha_f", "<=", 0.5),
            Bound("gamma", ">=", 0.5),
            Bound("beta", ">", 0.0),
            *(Bound(name, "finite") for name in ("alpha_m", "beta", "gamma")),
        )
        return (
            Bound("step", "finite"),
            Bound("step", ">", 0.0),
            *((Bound("rho_inf", ">=", 0.0), largest) if self.case is None else of_case),
            Bound("rtol", ">=", 0.0),
            Bound("atol", ">=", 0.0),
            Bound("rtol", "finite"),
            Bound("atol", "finite"),
            Bound("rtol + atol", ">", 0.0),
            Bound("max_iterations", ">", 0),
            Bound("max_halvings", ">=", 0),
            Bound("max_halvings", "<=", 30),
        )

    def choices(self, sizes: Sizes) -> Mapping[str, bool]:
        """Return facts for the templates by name: whether rho_inf gives all coefficients, and the additions of the
        variant."""
        return {
            "by_radius": self.case is None,
            "offset": self.variant != "F0",
            "exponentials": self.variant in ("F1", "F2"),
            "spatial": self.variant == SPATIAL,
        }

    def statistics(self, sizes: Sizes) -> tuple[Field, ...]:
        """Return the statistics that the stepper counts beyond the common ones with constraints; none without
        constraints."""
        if not sizes.lam:
            return ()
        raw = "; if it is large, rows of the record hold the values that follow from q and v" * self._index_3(sizes)
        return (
            Field("max_constraint", "largest |Phi| over the recorded states and the last one"),
            Field("max_constraint_velocity", "largest |w| over these states"),
            Field("max_eta", "largest multiplier of the velocity constraints; it is O(step^2)"),
            Field("max_rounding", f"largest rounding of multipliers, relative to the largest forces{raw}"),
            Field("max_impulse_rate", "largest constraint and inertial forces, in roots of kinetic energy per s"),
            Field("pivot_ratio", "ratio of largest to smallest pivot of the last iteration matrix"),
        )

    def statuses(self, constrained: bool, angles: bool) -> tuple[Status, ...]:
        diverges = "the Newton iteration did not converge, also with a fresh matrix and the smallest sub-steps"
        damped = ", or a smaller rho_inf" if self.case is None and self.rho_inf > 0.0 else ""
        repeated = ": constraints that repeat each other, or a part without mass" if constrained else ""
        return (
            Status(1, "NOT_CONVERGED", diverges, SMALLER_STEP + damped),
            Status(2, "SINGULAR", f"the mass or iteration matrix is singular{repeated}", SINGULAR_ADVICE),
            NOT_FINITE,
            BAD_ARGUMENT,
            rotation_too_large(angles),
            *((NOT_CONSISTENT,) if constrained else ()),
        )

    def data(self, system: System, step: float, samples: Any) -> Mapping[str, Any]:
        """Return the data of the templates of generalized-alpha for a system: unknowns, linear solver, hooks and
        options. `step` in s and `samples`, or else the system's tape, give the numbers by which pivots are planned."""
        from eomgen.integrators.harmonics import harmonics_data  # noqa: PLC0415
        from eomgen.integrators.newton.matrix import Unknowns  # noqa: PLC0415
        from eomgen.integrators.newton.sample_matrices import samples_of  # noqa: PLC0415
        from eomgen.integrators.newton.solver import make_solver, solver_data  # noqa: PLC0415

        nv, nl, nz = velocities(system.factors), len(system.multipliers), len(system.initial_z)
        owners = system.inner_owners
        unknowns = Unknowns(nv, nl, system.holonomic, self.form == STABILISED, len(owners), nz)
        known = samples if samples is not None else samples_of(system)
        weights = self._weights(step)
        solver = make_solver(unknowns, system.factors, known, weights, step, owners, sample=system.sample)
        perturbed = unknowns.holonomic > 0 and not unknowns.eta
        hooks = {"row": "without_rounding"} if perturbed else {}
        harmonics = harmonics_data(system)
        return {
            **({"harmonics": harmonics} if harmonics else {}),
            **(_OF_DAMPED_FORCES if system.facts.velocity_forces else {}),
            "hooks": {**hooks, **({"recorded": "observe", "end": "finish"} if nl else {})},
            "row_notes": _ROW_NOTES if perturbed else [],
            "matrices": True,
            "form": self.form,
            "variant": self.variant,
            "unknowns": unknowns.data,
            "solver": solver_data(solver, system.factors, iterated=True),
            "angular": [int(turns) for turns in system.angular] or [0] * nv,
            "places": indices_in_q(system.factors, nv),
            "quaternions": [factor.q_start + k for factor in system.factors if factor.group != "R" for k in range(4)],
            "factorization_cost": _factorization_cost(system, solver),
            "input_times": [0.0, 1.0],
            **({"starts_with_rates_of_inputs": True} if system.inputs else {}),
        }

    def _weights(self, step: float) -> list[float]:
        """Return the weights of an iteration matrix, in the order of ``newton.matrix.WEIGHTS``."""
        g = float(self.gamma / self.beta)
        b = float((1 - self.alpha_m) / (self.beta * (1 - self.alpha_f)))
        return [b, step * g, step * step, g, step, 1.0, step * float(self.rate_gain)]

    @property
    def parameters(self) -> dict[str, Fraction]:
        return self.coefficients

    @property
    def coefficients(self) -> dict[str, Fraction]:
        """The spectral radius, or the four coefficients of a named case."""
        if self.case is None:
            return {"rho_inf": self.rho}
        return {"alpha_m": self.alpha_m, "alpha_f": self.alpha_f, "beta": self.beta, "gamma": self.gamma}

    @property
    def rho(self) -> Fraction:
        """The spectral radius as the decimal number that was written."""
        return _decimal_fraction(float(self.rho_inf))

    @property
    def alpha_m(self) -> Fraction:
        return (2 * self.rho - 1) / (self.rho + 1) if self.case is None else self.case.alpha_m

    @property
    def alpha_f(self) -> Fraction:
        return self.rho / (self.rho + 1) if self.case is None else self.case.alpha_f

    @property
    def gamma(self) -> Fraction:
        return Fraction(1, 2) + self.alpha_f - self.alpha_m if self.case is None else self.case.gamma

    @property
    def beta(self) -> Fraction:
        return (self.gamma + Fraction(1, 2)) ** 2 / 4 if self.case is None else self.case.beta

    @property
    def rate_alpha_m(self) -> Fraction:
        """alpha_m of internal states, equations of first order (Jansen, Whiting, Hulbert 2000); a case's own."""
        return (3 * self.rho - 1) / (2 * (self.rho + 1)) if self.case is None else self.case.alpha_m

    @property
    def rate_gamma(self) -> Fraction:
        return Fraction(1, 2) + self.alpha_f - self.rate_alpha_m if self.case is None else self.case.gamma

    @property
    def rate_gain(self) -> Fraction:
        """Change of zdot with (z - z_n)/step."""
        return (1 - self.rate_alpha_m) / (self.rate_gamma * (1 - self.alpha_f))


_ROW_NOTES = """\
Constraints are met at positions only, so v, vdot and lam of the state hold rounding of positions by the step and by
its square. Where that is much of lam, rows have v on the constraints and the vdot and lam that follow from q and v;
the state goes on with its own.""".splitlines()


def _optimal(form: str, variant: str, rho_inf: float | None = 0.8) -> GeneralizedAlpha:
    return GeneralizedAlpha(0.8 if rho_inf is None else rho_inf, form, variant)


def _named_case(name: str, form: str, **parameters: float | None) -> GeneralizedAlpha:
    """Return a case; ``rho_inf`` is left out if ``alpha`` says the same."""
    if parameters.get("alpha") is not None:
        parameters = {key: value for key, value in parameters.items() if key != "rho_inf"}
    return GeneralizedAlpha(form=form, case=NAMED_CASES[name][0](**parameters))


def _factorization_cost(system: System, solver: Solver) -> list[float]:
    """Return the operations to form and factor the iteration matrix, and of an iteration with old factors: two numbers.
    Substitution waits for earlier results, and group operations take roots and quotients: both weigh more than their
    operation counts. Fronts wait less for memory: right sides are loaded and stored for each front, and so are factors
    (3.2 iterations by instructions with a chain of 100 hinges)."""
    residual = "equations" if len(system.multipliers) or len(system.initial_z) else "residual"
    turns = sum(1 for factor in system.factors if factor.group != "R")
    waits = 4 if solver.fronts is None else 1
    iteration = system.counts[residual].flops + waits * solver.solve_operations
    iteration += 10 * solver.unknowns.size + 120 * turns
    forming = system.counts[solver.packing.function].flops + 2 * solver.factor_operations + 60 * turns
    return [int(count) if count == int(count) else count for count in (forming, iteration)]


def indices_in_q(factors: Sequence[Factor], nv: int) -> list[int]:
    """Return for each velocity component the index in q of the coordinate whose rate it is, -1 for quaternions."""
    indices = [-1] * nv
    for factor in factors:
        rotation = 0 if factor.group == "R" else 3
        first = factor.q_start + (4 if rotation else 0)
        for k in range(rotation, factor.v_size):
            indices[factor.v_start + k] = first + k - rotation
    return indices
