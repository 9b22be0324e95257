"""The register of terms: names, inputs, conditions of existence, and requests; and the choice of the functions in a
library, since fewer functions compile faster.

A front end records terms; whoever needs a fact about one asks its row here.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import starmap
from typing import Any

from eomgen.base.calls import TERMS_ELSEWHERE
from eomgen.base.data import dataclass, replace
from eomgen.base.messages import nearest

Inputs = tuple[str, ...]

#: Highest time derivative of inverse dynamics that can be asked for.
HIGHEST_RATE = 8
#: Codes of the notes on motions without inertia, in which ``forward_dynamics`` has no answer.
UNRESISTED = frozenset({"W0134", "W0269"})


@dataclass(frozen=True)
class Term:
    """A term: a function that a System may have, such as ``mass``, with inputs and conditions of existence.

    Attributes
    ----------
    inputs : tuple of str
        Input blocks on which the term may depend.
    exists : tuple of str
        Facts of a system of which one must hold; a term without any exists in all systems. Facts: ``constraints``,
        ``unconstrained``, ``states``, ``moving_base``, ``outputs``, ``absolute``, ``elastic``, ``rigid``, ``large``,
        ``exact_beams``, ``events``, ``event_actions``, ``event_impulse``, ``tunable`` (parameters), ``tunable_outputs``
        (both), ``rigid_tree`` (in joint coordinates), ``given_inputs``.
    on_request : bool
        Recorded only by request, by name.
    quadratic : bool
        A whole matrix, which in large trees is recorded only by request, by name.
    of_motion : bool
        May be without accelerations and multipliers, and then has no such arguments.
    observed : bool
        A function of a known motion: no equation of a step calls this function.
    of_events : bool
        Steppers find and treat the scene's events by this term, so it is always present.
    source : str
        For time derivatives and matrices of the closed form: the quantity that is differentiated.
    first, order : int
        The lowest and the highest time derivative of ``source`` in the outputs.
    differentiated : str
        For first and second derivatives in all arguments: the term that is differentiated.
    """

    name: str
    inputs: Inputs
    description: str
    exists: tuple[str, ...] = ()
    on_request: bool = False
    quadratic: bool = False
    of_motion: bool = False
    observed: bool = False
    of_events: bool = False
    source: str = ""
    first: int = 0
    order: int = 0
    differentiated: str = ""

    def exists_with(self, facts: Collection[str]) -> bool:
        """Return whether the term exists in a system with these facts."""
        return not self.exists or any(fact in facts for fact in self.exists)


_KINEMATIC: Inputs = ("p", "t", "q", "base")
_STATE: Inputs = ("p", "t", "q", "v", "z", "u", "base")
_MOTION: Inputs = ("p", "t", "q", "v", "a", "z", "u", "base")
_VELOCITIES: Inputs = ("p", "t", "q", "v", "base")
_ACCELERATIONS: Inputs = ("p", "t", "q", "v", "a", "base")
_ALL: Inputs = ("p", "t", "q", "v", "a", "z", "lam", "u", "base")
_CONSTRAINED = ("constraints",)

#: Axes and point of twists of frames: the suffix of the term's name, and words.
REFERENCES: Mapping[str, tuple[str, str]] = {
    "body": ("", "its own axes"),
    "local_world_aligned": ("_aligned", "world axes, about its own origin"),
    "world": ("_world", "world axes, about the world's origin"),
}


def _frame_terms() -> Iterator[Term]:
    """Yield the terms of frames: poses, Jacobians with rates and drifts for each pair of axes and point, and
    mobilities."""
    yield Term("frame_poses", ("p", "q", "base"), "quaternion (to world axes) and position of every frame")
    for ending, axes in REFERENCES.values():
        twist = f"twist of every frame against the base, {axes}, angular first"
        base = ("base",) if ending else ()
        yield Term(f"frame_jacobians{ending}", ("p", "q", *base), f"Jacobians J: the {twist}, is J v")
        yield Term(f"frame_jacobian_rates{ending}", ("p", "q", "v", *base), f"dJ/dt, J v being the {twist}")
        yield Term(f"frame_drifts{ending}", ("p", "q", "v", *base), f"dJ/dt v, J v being the {twist}")
    yield Term(
        "frame_mobilities",
        ("p", "q", "base"),
        "inverse of the operational-space inertia of every frame, J M^-1 J^T, J in world axes about its origin",
        exists=("unconstrained",),
    )


_PLACES: Inputs = ("p", "q", "base")
_RATES: Inputs = ("p", "q", "v", "base")
_CENTROIDAL = (
    Term("center_of_mass", _PLACES, "centre of mass in the world, and mass, of all that moves against the base"),
    Term("center_of_mass_jacobian", _PLACES, "J: velocity of the centre of mass against the base = J v, world axes"),
    Term("center_of_mass_jacobian_rate", _RATES, "dJ/dt of the centre of mass, world axes"),
    Term("center_of_mass_drift", _RATES, "dJ/dt v of the centre of mass, world axes"),
    Term("centroidal_momentum", _PLACES, "A: the momentum about the centre of mass is A v, world axes, angular first"),
    Term("centroidal_momentum_rate", _RATES, "dA/dt of the centroidal momentum matrix"),
    Term("centroidal_drift", _RATES, "dA/dt v of the centroidal momentum matrix"),
)

#: Terms by name, inputs, facts in words (conditions of existence and flags), and description.
_FIRST_ROWS = (
    ("mass", ("p", "q"), "quadratic", "inertia matrix M(q), symmetric, full"),
    ("mass_values", ("p", "q"), "on_request", "nonzeros of M(q)"),
    ("coupling", ("p", "q", "v"), "", "nonlinear coupling vector h(q, v): inertia terms quadratic in v, base at rest"),
    ("force", _STATE, "", "generalized force Q: gravity, springs, dampers, actuators, formulas"),
    ("base_motion", _RATES, "moving_base", "base-motion terms b: inertia terms that vanish when the base is at rest"),
    ("inverse_dynamics", _MOTION, "", "tau = M a + h + b - Q in one recursion"),
    ("forward_dynamics", _STATE, "unconstrained", "vdot = M^-1 (Q - h - b)"),
    ("residual", _ALL, "", "residual r = M a + h + b - Q + B^T lam of an implicit step"),
    ("partials", _ALL, "quadratic", "partial derivatives of the residual: K in q (left-trivialised), C in v, M in a"),
    ("internal_rate", _STATE, "states", "rates of the internal states: zdot = f(q, v, z, t, u)"),
    ("internal_partials", _STATE, "states",
     "partials of these rates in q (left-trivialised), v and z, and of the residual in z"),
    ("constraint", _KINEMATIC, "constraints", "holonomic constraints Phi(q, t), zero where they are met"),
    ("constraint_velocity", _VELOCITIES, "constraints",
     "rates of the holonomic constraints, and velocity-level constraints"),
    ("constraint_bias", _VELOCITIES, "constraints", "bias of the constraints' accelerations: their value at vdot = 0"),
    ("constraint_acceleration", _ACCELERATIONS, "constraints on_request", "accelerations of the constraints, B a + g"),
    ("constraint_jacobian", _KINEMATIC, "constraints quadratic",
     "B: derivative of the constraints along w is B w, left-trivialised"),
    ("constraint_size", _KINEMATIC, "constraints",
     "scales of each row: the sum of the magnitudes of its summands, and the extent of the joined bodies"),
    ("velocity_partials", _VELOCITIES, "constraints quadratic",
     "left-trivialised partials in q of the constraints' rates"),
    ("equations", _ALL, "constraints states", "residual, constraints and their rates together"),
    ("iteration", _ALL, "constraints large states", "nonzeros of all partials of an implicit step together"),
    ("jacobian_values", _KINEMATIC, "constraints", "nonzeros of B"),
    ("poses", _PLACES, "observed", "quaternion (body to world) and position of every body"),
    ("twists", _RATES, "observed", "inertial twist of every body in body axes, angular first"),
    ("accelerations", ("p", "q", "v", "a", "base"), "on_request",
     "inertial accelerations of every body in body axes, angular first"),
    ("jacobians", ("p", "q"), "on_request",
     "body Jacobians: twist of every body against the base is J v, body axes, angular first"),
)  # fmt: skip  # a table
_LAST_ROWS = (
    ("outputs", _ALL, "outputs of_motion observed", "named outputs of the scene"),
    ("events", _ALL, "events of_motion observed of_events",
     "functions whose roots are the scene's events, and their rates along the motion"),
    ("event_actions", _ALL, "event_actions of_motion observed of_events",
     "new values of the state and of modes at the events, and restitutions"),
    ("event_impulse", _KINEMATIC, "event_impulse observed of_events",
     "M, B and the gradients of impacts, which determine the impulses at events"),
    ("samples", _ALL, "samples of_motion observed of_events", "new values of the sampled states"),
    ("elastic", _MOTION, "elastic on_request",
     "beams: structural stiffness K, damping D, and geometric stiffness K_geo for the present motion"),
    ("section_loads", _ALL, "exact_beams of_motion observed",
     "geometrically exact beams: strains, and moments and forces of the sections, of each element"),
    ("linearization", _ALL, "on_request",
     "linear model about a state: M0, C0, K0, and the influence of inputs, B0, and of disturbances, E0"),
    ("acceleration_partials", _ACCELERATIONS, "constraints on_request",
     "partials of the constraints' accelerations in q (left-trivialised) and v"),
    ("reaction_partials", ("p", "t", "q", "v", "lam", "u", "base"), "constraints on_request",
     "partials of the constraint forces B^T lam in q (left-trivialised), and in the tunable parameters"),
    ("joint_velocities", _ACCELERATIONS, "absolute on_request",
     "velocities and accelerations of joints between absolute bodies, and their partials in q (left-"
     "trivialised) and v"),
    ("output_partials", _ALL, "outputs on_request of_motion",
     "partials of the outputs in q (left-trivialised), v, a, z, lam, inputs and disturbances"),
    ("parameter_partials", _ALL, "tunable on_request",
     "partials in the tunable parameters: of the residual, of rates of internal states, of constraints"),
    ("output_parameter_partials", _ALL, "tunable_outputs on_request of_motion",
     "partials of the outputs in the tunable parameters"),
    ("input_derivatives", ("p", "t"), "given_inputs on_request",
     "nonzeros of the Jacobian of the inputs that the scene gives in p and t"),
    ("second_partials", (*_ALL, "weights", "direction"), "on_request",
     "change along a direction of the gradient of a weighted sum of the equations and outputs"),
    ("regressor", _MOTION, "rigid_tree on_request",
     "Y and tau0: tau = Y pi + tau0, pi the inertial parameters of bodies, rotor inertias, coefficients of friction"),
    ("regressor_parameters", ("p",), "rigid_tree on_request",
     "pi: values of the parameters in which inverse dynamics is linear"),
    ("energy", _ALL, "of_motion observed",
     "kinetic and potential energy, non-conservative power, power of base and drivers"),
    ("momenta", _STATE, "on_request",
     "generalized momenta p = dT/dv, and dT/dq + Q (left-trivialised): with brackets and constraint forces the "
     "rate of p"),
)  # fmt: skip  # a table


def _term(name: str, inputs: Inputs, facts: str, description: str) -> Term:
    """Return a term with facts in words: conditions of existence, and the flags that hold."""
    flags = ("on_request", "quadratic", "of_motion", "observed", "of_events")
    words = facts.split()
    exists = tuple(word for word in words if word not in flags)
    held: dict[str, Any] = {flag: flag in words for flag in flags}
    return Term(name, inputs, description, exists, **held)


_PLAIN = (
    *starmap(_term, _FIRST_ROWS),
    *(replace(term, on_request=True) for term in (*_frame_terms(), *_CENTROIDAL)),
    *starmap(_term, _LAST_ROWS),
)

#: Matrices of the closed form: meaning, and the number of derivatives of v, relative to the order of the matrix.
_CLOSED: dict[str, tuple[str, int]] = {
    "system_jacobian": ("J, twists of all links against the base per unit of v", 1),
    "adjoints": ("A, adjoint transforms from every link to every link that it carries", 1),
    "joint_brackets": ("a, brackets ad of the joints' own twists, link by link", 0),
    "link_brackets": ("b, brackets ad of the links' twists against the base, link by link", 0),
    "coriolis": ("C with C v = h, J^T (M J' - b^T M J)", 0),
    "coriolis_skew": ("C with C v = h for which M' - 2 C is skew", 0),
}
#: Matrices of the closed form, each a term with time derivatives.
CLOSED_MATRICES = tuple(_CLOSED)
_SECOND_WAY = "by the closed matrix form: a second derivation, for checks"


def _rate(
    name: str, source: str, orders: tuple[int, int], accelerations: int, inputs: Inputs, description: str
) -> Term:
    """Return the Term of time derivatives of ``source``, recorded on request. ``orders`` are the lowest and the highest
    derivative in the outputs, ``accelerations`` is the highest derivative of a among the arguments (0 for a, -1 for
    none), ``inputs`` are the further arguments."""
    first, order = orders
    blocks = [*inputs, *("a", "j", "s")[: accelerations + 1], *(("a_higher",) if accelerations > 2 else ())]
    if "u" in inputs:
        blocks += ("u_dot", "u_ddot")[: min(order, 2)]
        blocks += ["u_higher"] if order > 2 else []
    blocks += ["base_rates"] if "base" in inputs else []
    return Term(name, tuple(blocks), description, on_request=True, source=source, first=first, order=order)


def _rates() -> Iterator[Term]:
    """Yield all terms that are time derivatives along a motion, and the matrices of the closed form.

    A name ending in ``_rates`` gives first and second derivatives, in ``_rates_1`` the first only. ``rates``, of
    inverse dynamics to any order, and ``forward_rates`` start with the quantity.
    """
    for order in range(1, HIGHEST_RATE + 1):
        meaning = {1: "time derivative", 2: "first and second time derivative"}.get(
            order, f"time derivatives up to order {order}"
        )
        text = f"tau and its {meaning}, tau = M a + h + b - Q along the motion"
        term = _rate("rates" if order == 2 else f"rates_{order}", "inverse_dynamics", (0, order), order, _STATE, text)
        yield term
        if order == 2:
            closed_tau = replace(term, name="rates_closed", source="closed_inverse_dynamics", exists=("rigid",))
    blocks: list[tuple[str, str, int, Inputs, tuple[str, ...]]] = [
        ("mass", "M", 2, ("p", "q", "v"), ()),
        ("coupling", "h", 1, ("p", "q", "v"), ()),
        ("force", "Q", 1, _STATE, ()),
        ("base_motion", "b", 1, ("p", "q", "v", "base"), ("moving_base",)),
    ]
    for source, symbol, less, inputs, exists in blocks:
        for order, suffix in ((1, "_1"), (2, "")):
            text = f"first {'' if order == 1 else 'and second '}time derivative of {symbol} along the motion"
            term = _rate(f"{source}_rates{suffix}", source, (1, order), order - less, inputs, text)
            yield replace(term, exists=exists)
            if source == "mass":
                closed_mass = replace(term, name="mass_rates_closed", source="closed_mass", exists=("rigid",))
    for closed in (closed_tau, closed_mass):
        yield replace(closed, description=f"{closed.description}, {_SECOND_WAY}")
    for name, (meaning, less) in _CLOSED.items():
        for first, order, suffix in ((0, 0, ""), (1, 1, "_rates_1"), (1, 2, "_rates")):
            needed = order - less  # derivatives of v
            inputs = ("p", "q", "v") if needed >= 0 else ("p", "q")
            text = ("", "first time derivative of ", "first and second time derivative of ")[order] + meaning
            yield replace(_rate(f"{name}{suffix}", name, (first, order), needed - 1, inputs, text), exists=("rigid",))
    for order, suffix in ((1, "_1"), (2, "")):
        text = f"vdot and its {'' if order == 1 else 'first and second '}time derivative along the free motion"
        term = _rate(f"forward_rates{suffix}", "forward_dynamics", (0, order), -1, _STATE, text)
        yield replace(term, exists=("unconstrained",))


#: Terms with derivatives in all arguments -> symbol in descriptions.
DIFFERENTIATED: Mapping[str, str] = {
    "inverse_dynamics": "tau",
    "forward_dynamics": "vdot",
    "residual": "r",
    "constraint": "Phi",
    "internal_rate": "zdot",
    "outputs": "y",
    "constraint_velocity": "w",
    "constraint_acceleration": "B a + g",
    "frame_poses": "the poses of frames",
    "momenta": "the momenta, and dT/dq + Q",
}
#: Arguments of these derivatives, in the order of rows and columns; t is one number.
ARGUMENTS = ("q", "v", "a", "z", "lam", "u", "p", "t")


def _derivatives() -> Iterator[Term]:
    """Yield the terms of first and second derivatives in all arguments, as nonzeros: ``NAME_derivatives``,
    ``NAME_hessian``."""
    plain = {term.name: term for term in _PLAIN}
    for name, symbol in DIFFERENTIATED.items():
        term = plain[name]
        arguments = ", ".join("q (left-trivialised)" if x == "q" else x for x in ARGUMENTS if x in term.inputs)
        first = f"nonzeros of the Jacobian of {symbol} in {arguments}"
        second = f"nonzeros of the lower triangle of the Hessian of weights . {symbol} in {arguments}"
        changes: dict[str, Any] = {"on_request": True, "differentiated": name, "quadratic": False}
        of_second = dict(changes)
        if name in ("residual", "momenta"):  # of steps with constraints; else inverse dynamics
            of_second["exists"] = _CONSTRAINED
        if name == "residual":
            changes["exists"] = _CONSTRAINED
        if "t" not in term.inputs:  # a moving base follows its law
            term = replace(term, inputs=(*term.inputs, "t"))
        yield replace(term, name=f"{name}_derivatives", description=first, **changes)
        inputs = (*term.inputs, "weights")
        yield replace(term, name=f"{name}_hessian", inputs=inputs, description=second, **of_second)


#: All terms by name, in the order of recording.
TERMS: Mapping[str, Term] = {term.name: term for term in (*_PLAIN, *_rates(), *_derivatives())}

#: Terms of constraints that bring a state onto the constraints.
KINEMATIC = ("constraint", "constraint_velocity", "constraint_bias", "constraint_jacobian", "constraint_size")
_INTERNAL = ("internal_rate", "internal_partials")
_LINEAR = (
    *("mass", "residual", "partials", "linearization", "outputs", "output_partials", "poses", "forward_dynamics"),
    *KINEMATIC,
)
#: Terms of whole matrices, and the terms of their nonzeros, which large systems have in place of these matrices.
NONZEROS: Mapping[str, str] = {"mass": "mass_values", "constraint_jacobian": "jacobian_values"}
#: Terms that are needed for a purpose, if present.
PURPOSES: Mapping[str, tuple[str, ...]] = {
    "run": ("mass", "force", "internal_rate", "poses", "outputs", "energy", "section_loads", *KINEMATIC),
    "initial_assembly": ("mass", "constraint", "constraint_velocity", "constraint_jacobian", "constraint_size"),
    "accelerations": ("forward_dynamics", "mass", "residual", "constraint_jacobian", "constraint_bias"),
    "equilibrium": ("mass", "residual", "partials", "poses", *KINEMATIC, *_INTERNAL),
    "linearization": (*_LINEAR, "velocity_partials", "acceleration_partials", "joint_velocities", *_INTERNAL),
}


def nearest_term(name: str) -> str:
    """Return a hint for an unknown term: the term with this name elsewhere, else the nearest names."""
    # names of rates are near to the names of the differentiated terms
    plain = [term for term in TERMS if "rates" not in term]
    return nearest(name, TERMS if "rate" in name else plain, TERMS_ELSEWHERE)


def takes_nonzeros(there: Collection[str], *, disturbed: bool) -> bool:
    """Return whether a linear model is made of the nonzeros of partials, as of scenes with many components. So it is if
    ``there``, the functions of the model, has ``iteration`` and no ``partials``, and neither inputs nor disturbances
    act (``disturbed``): then whole matrices are not built."""
    return "iteration" in there and "partials" not in there and not disturbed


def linear_terms(there: Collection[str], *, disturbed: bool, states: bool, moving: bool) -> list[str]:
    """Return the names of the terms that a linear model needs, if they exist, in the order of the register.

    Parameters
    ----------
    there : functions of the model
    disturbed : whether inputs or disturbances act
    states : whether there are internal states
    moving : whether partials of the accelerations of constraints are needed, which vanish at rest
    """
    terms = {*PURPOSES["linearization"], "samples"}
    if takes_nonzeros(there, disturbed=disturbed):
        terms -= {"partials", "linearization", "internal_partials"} | (set() if moving else {"mass"})
        terms |= {"iteration"}
    elif not (disturbed or states):
        terms -= {"linearization"}
    if not moving:
        terms -= {"acceleration_partials"}
    return [name for name in TERMS if name in terms]


#: The start of a ``Selection`` for linear models about rest.
REST = "rest"


@dataclass(frozen=True)
class Selection:
    """Which functions a library has.

    Attributes
    ----------
    terms : wanted by name; None: the scene's list, or all functions that the scene can use
    start : ``initial`` or ``equilibrium``: only functions called by runs with this start; ``rest``: by linear models
        about rest, without a stepper; empty: all functions
    """

    terms: tuple[str, ...] | None = None
    start: str = ""

    @property
    def whole(self) -> bool:
        """Whether these are all functions."""
        return self.terms is None and not self.start

    @classmethod
    def from_data(cls, data: Mapping[str, Any]) -> Selection:
        """Return the selection that a library's layout or a checkpoint holds as JSON."""
        return cls(None if data["terms"] is None else tuple(data["terms"]), data["start"])

    def functions(self, derived: Sequence[str], called: Collection[str], *, implicit: bool) -> list[str]:
        """Return the names of the selected functions of a derived System, in order; all without ``start``.

        Parameters
        ----------
        derived : names of the functions of the System
        called : names of the functions that steps of the method call
        implicit : whether these steps are implicit: unresolved motions are then found by partials of the residual, of
            which steps have nonzeros or the whole
        """
        if not self.start:
            return list(derived)
        accelerations = "forward_dynamics" if "forward_dynamics" in derived else "residual"
        of_residual = "iteration" if "iteration" in derived and "iteration" in called else "partials"
        # states that decay too fast, and the rounding of states at rest, are found by partials of the internal states
        needed = {*called, *PURPOSES["run"], accelerations, "internal_partials"}
        needed |= {of_residual} if implicit else set()
        needed |= {packed for whole, packed in NONZEROS.items() if whole not in derived}
        if self.start == "equilibrium":
            needed |= {*PURPOSES["equilibrium"], *(() if "partials" in derived else ("iteration",))}
        return [name for name in derived if name in needed or name not in TERMS or TERMS[name].of_events]
