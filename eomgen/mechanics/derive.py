"""Derive the System of a scene: only the terms that are asked for, each from its own virtual work."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from eomgen.errors import ModelError, Problem
from eomgen.mechanics.constants import described, named_constants
from eomgen.mechanics.constraints.counted_angles import angle_labels
from eomgen.mechanics.derivation import Derivation
from eomgen.mechanics.discontinuities import discontinuities, validity
from eomgen.mechanics.extent import extent
from eomgen.mechanics.forces.symbols import input_signal
from eomgen.mechanics.initial_coordinates import absolute_start, joint_start
from eomgen.mechanics.rates.drivers import base_rates, input_rates
from eomgen.mechanics.summary import kept_and_dropped
from eomgen.mechanics.terms.rates import OF_RIGID_TREES, RATE_TERMS, rate_blocks
from eomgen.mechanics.terms.recorders import RECORDERS
from eomgen.mechanics.tree.base import base_law
from eomgen.scene.joints.unresisted import UNRESISTED
from eomgen.scene.scene import Scene
from eomgen.symbolic.operations import InputSymbol, Op
from eomgen.symbolic.tape import Tape
from eomgen.system.system import BASE_LAYOUT, INPUT_BLOCKS, Block, Facts, Function, Quantity, System

#: All terms, with the input blocks each may depend on and what it is.
TERMS: dict[str, tuple[tuple[str, ...], str]] = {
    "mass": (("p", "q"), "inertia matrix M(q), symmetric, full"),
    "coupling": (("p", "q", "v"), "nonlinear coupling vector h(q, v): inertia terms quadratic in v, base at rest"),
    "force": (("p", "t", "q", "v", "z", "u", "base"), "generalized force Q: gravity, springs, dampers, actuators, formulas"),
    "base_motion": (("p", "q", "v", "base"), "base-motion terms b: inertia terms that vanish when the base is at rest"),
    "inverse_dynamics": (("p", "t", "q", "v", "a", "z", "u", "base"), "tau = M a + h + b - Q in one recursion"),
    "forward_dynamics": (("p", "t", "q", "v", "z", "u", "base"), "vdot = M^-1 (Q - h - b)"),
    "residual": (
        ("p", "t", "q", "v", "a", "z", "lam", "u", "base"),
        "residual r = M a + h + b - Q + B^T lam of an implicit step",
    ),
    "partials": (("p", "t", "q", "v", "a", "z", "lam", "u", "base"), "its partials: K in q (left-trivialised), C in v, M in a"),
    "internal_rate": (("p", "t", "q", "v", "z", "u", "base"), "rates of the internal states: zdot = f(q, v, z, t, u)"),
    "internal_partials": (
        ("p", "t", "q", "v", "z", "u", "base"),
        "partials of these rates in q (left-trivialised), v and z, and of the residual in z",
    ),
    "constraint": (("p", "t", "q", "base"), "holonomic constraints Phi(q, t), zero where they are met"),
    "constraint_velocity": (("p", "t", "q", "v", "base"), "rates of the holonomic constraints, and velocity-level constraints"),
    "constraint_bias": (("p", "t", "q", "v", "base"), "what is left of the constraints' accelerations when vdot = 0"),
    "constraint_jacobian": (("p", "t", "q", "base"), "B: derivative of the constraints along w is B w, left-trivialised"),
    "constraint_size": (
        ("p", "t", "q", "base"),
        "what the magnitudes of the summands of each row add up to, and the extent of what it joins",
    ),
    "velocity_partials": (("p", "t", "q", "v", "base"), "left-trivialised partials in q of the constraints' rates"),
    "equations": (("p", "t", "q", "v", "a", "z", "lam", "u", "base"), "residual, constraints and their rates together"),
    "iteration": (("p", "t", "q", "v", "a", "z", "lam", "u", "base"), "nonzeros of all partials of an implicit step together"),
    "jacobian_values": (("p", "t", "q", "base"), "nonzeros of B"),
    "poses": (("p", "q", "base"), "quaternion (body to world) and position of every body"),
    "twists": (("p", "q", "v", "base"), "inertial twist of every body in body axes, angular first"),
    "accelerations": (("p", "q", "v", "a", "base"), "inertial accelerations of every body in body axes, angular first"),
    "jacobians": (("p", "q"), "body Jacobians: twist of every body against the base is J v, body axes, angular first"),
    "outputs": (("p", "t", "q", "v", "a", "z", "lam", "u", "base"), "the scene's named outputs"),
    "elastic": (
        ("p", "t", "q", "v", "a", "z", "u", "base"),
        "beams: structural stiffness K, damping D, and geometric stiffness K_geo for the present motion",
    ),
    "linearization": (
        ("p", "t", "q", "v", "a", "z", "lam", "u", "base"),
        "linear model about a state: M0, C0, K0, and the influence of inputs, B0, and of disturbances, E0",
    ),
    "acceleration_partials": (
        ("p", "t", "q", "v", "a", "base"),
        "partials of the constraints' accelerations in q (left-trivialised) and v",
    ),
    "joint_velocities": (
        ("p", "t", "q", "v", "a", "base"),
        "velocities and accelerations of joints between absolute bodies, and their partials in q (left-trivialised) and v",
    ),
    "output_partials": (
        ("p", "t", "q", "v", "a", "z", "lam", "u", "base"),
        "partials of the outputs in q (left-trivialised), v, a, z, lam, inputs and disturbances",
    ),
    "energy": (
        ("p", "t", "q", "v", "a", "z", "lam", "u", "base"),
        "kinetic and potential energy, non-conservative power, power of base and drivers",
    ),
    **{name: (term.blocks, term.description) for name, term in RATE_TERMS.items()},
}

#: Terms that exist only where something is constrained.
OF_CONSTRAINTS = frozenset(
    {
        "constraint", "constraint_velocity", "constraint_bias", "constraint_jacobian", "constraint_size", "velocity_partials",
        "jacobian_values", "acceleration_partials",
    }
)  # fmt: skip

#: Terms that exist only where there are internal states.
OF_STATES = frozenset({"internal_rate", "internal_partials"})

#: Terms that are recorded only when they are asked for by name.
ON_REQUEST = frozenset(
    {
        "accelerations", "jacobians", "elastic", "linearization", "acceleration_partials", "joint_velocities", "output_partials",
        *RATE_TERMS,
    }
)  # fmt: skip

#: Terms that may do without accelerations and multipliers.
OF_MOTION = frozenset({"energy", "outputs", "output_partials"})

#: Terms of large trees that are recorded only when they are asked for by name: whole matrices, which no stepper of theirs needs.
QUADRATIC = frozenset({"mass", "partials"})

_ROUGH = frozenset({Op.ABS, Op.SIGN, Op.MIN, Op.MAX, Op.LT, Op.LE, Op.SELECT})


def derive(scene: Scene, terms: Sequence[str] | None = None, without_rows: Sequence[int] = ()) -> System:
    """Derive the separated equations of motion of a scene.

    Parameters
    ----------
    terms : sequence of str, optional
        Names from ``TERMS``; the scene's own list, or all that the scene can use, when omitted.
    without_rows : sequence of int
        Constraint rows to leave out, because they follow from others.

    Raises
    ------
    ModelError
        For an unknown term, or one that the scene cannot have; for numbers that no double can hold together.
    """
    try:
        derivation = Derivation(scene, without_rows)
        return _assembled(derivation, _chosen(derivation, terms))
    except (ZeroDivisionError, OverflowError):
        if cause := next((note for note in scene.notes if note.startswith(UNRESISTED)), None):
            what, hint = cause.split("; try: ")
            raise ModelError(Problem(scene.name, what, hint)) from None
        what = "numbers of the scene combine to an infinite one: they are too small or too large, or cancel to zero in a divisor"
        raise ModelError(Problem(scene.name, what, "masses, inertias and lengths between 1e-100 and 1e100")) from None


def _chosen(derivation: Derivation, terms: Sequence[str] | None) -> list[str]:
    asked = list(terms) if terms is not None else list(derivation.scene.terms)
    unknown = [name for name in asked if name not in TERMS]
    if unknown:
        raise ModelError(f"no term is called {', '.join(map(repr, unknown))}", f"one of {', '.join(TERMS)}")
    if asked:
        return [name for name in TERMS if name in asked and _present(derivation, name)]
    left_out = ON_REQUEST | QUADRATIC if derivation.large and derivation.constraints is None else ON_REQUEST
    return [name for name in TERMS if name not in left_out and _present(derivation, name)]


def _present(derivation: Derivation, name: str) -> bool:
    """Return whether a term has any meaning for the scene."""
    match name:
        case "equations":
            return derivation.constraints is not None or bool(derivation.scene.states)
        case "iteration":
            return derivation.constraints is not None or derivation.large or bool(derivation.scene.states)
        case "base_motion" | "base_motion_rates" | "base_motion_rates_1":
            return derivation.base.moving
        case "joint_velocities":
            return derivation.absolute
        case "elastic":
            return derivation.tree.elastic
        case "outputs" | "output_partials":
            return bool(derivation.scene.outputs)
        case "forward_dynamics" | "forward_rates" | "forward_rates_1":
            return derivation.constraints is None
        case _:
            if name in OF_STATES:
                return bool(derivation.scene.states)
            if name in OF_RIGID_TREES:
                return not derivation.tree.elastic
            return name not in OF_CONSTRAINTS or derivation.constraints is not None


def _assembled(derivation: Derivation, terms: Sequence[str]) -> System:
    scene, tape, tree = derivation.scene, derivation.tape, derivation.tree
    made: dict[str, Function] = {}
    for name in terms:
        inputs, description = TERMS[name]
        made[name] = Function(name, description, inputs, tuple(_blocks(derivation, name)))
    timed = any(InputSymbol("t", 0) in tape.depends_on(function.refs) for function in made.values())
    order = max((RATE_TERMS[name].order for name in terms if name in RATE_TERMS), default=0)
    taken = {block for function in made.values() for block in function.inputs}
    functions = {name: _pruned(derivation, function, timed) for name, function in made.items()}
    functions |= _drivers(derivation, order, taken)
    angles = angle_labels(scene)
    if angles:
        what = "angles of joints over all turns, which steppers let the references in q follow"
        of_angles = Function("joint_angles", what, ("p", "q", "v", "base"), tuple(derivation.joint_angles()))
        functions[of_angles.name] = _pruned(derivation, of_angles, timed)
    facts = _facts(derivation, made)
    kept, dropped = kept_and_dropped(scene, tree, functions, facts)
    sizes = extent(scene, derivation.algebra, derivation.constant)
    rows = derivation.constraints.rows if derivation.constraints is not None else None
    if derivation.absolute:
        initial_q, initial_v = absolute_start(derivation)
    else:
        initial_q, initial_v = joint_start(derivation)
    return System(
        name=scene.name, tape=tape, factors=tree.factors, functions=functions,
        parameters=tuple(Quantity(p.name, p.value, 1, p.unit, p.description) for p in scene.parameters if p.tunable),
        inputs=tuple(Quantity(i.name, 0.0, 1, i.unit, i.description) for i in scene.inputs),
        states=tuple(Quantity(s.name, s.initial, 1, s.unit, s.description) for s in scene.states),
        outputs=tuple(Quantity(o.name, 0.0, len(o.values), o.unit, o.description) for o in scene.outputs),
        bodies=tuple(body.name for body in scene.bodies), initial_q=initial_q, initial_v=initial_v, angles=angles,
        multipliers=tuple(row.name for row in rows.all) if rows is not None else (),
        row_units=tuple(row.unit for row in rows.all) if rows is not None else (),
        holonomic=len(rows.holonomic) if rows is not None else 0,
        patterns=dict(derivation.patterns), inner_owners=derivation.inner_owners,
        extent=tuple(size.ref for size in sizes), angular=tree.angular(),
        dof_parent=tree.dof_parents(), facts=facts, kept=kept, dropped=dropped,
        notes=scene.notes, discontinuities=discontinuities(scene), validity=validity(scene),
        constants=named_constants(tree, derivation.quantities), beams=described(tree),
        description=scene.description, defaults=dict(vars(scene.simulation)), order=order,
    )  # fmt: skip


def _blocks(derivation: Derivation, name: str) -> Sequence[Block]:
    if name in RATE_TERMS:
        return rate_blocks(derivation, RATE_TERMS[name])
    return RECORDERS[name](derivation)


def _drivers(derivation: Derivation, order: int, taken: set[str]) -> dict[str, Function]:
    """Return the functions of time alone: motion of the base, inputs that the scene gives, and derivatives that are taken."""
    scene = derivation.scene
    tunable = any(parameter.tunable for parameter in scene.parameters)
    inputs = ("p", "t") if tunable else ("t",)
    drivers: dict[str, Function] = {}
    if scene.base is not None:
        law = base_law(derivation.algebra, scene.base, derivation.tree.parameters)
        size = sum(count for _, count, _ in BASE_LAYOUT)
        block = derivation.block("base", (size,), law, "base struct")
        drivers["base"] = Function("base", "motion of the base at time t", inputs, (block,))
        if "base_rates" in taken:
            of_base = base_rates(derivation.tape, law, order)
            what = "further derivatives of the base's twist at time t"
            drivers["base_rates"] = Function("base_rates", what, inputs, (of_base,))
    if any(item.given for item in scene.inputs):
        values = [input_signal(derivation.quantities, item) for item in scene.inputs]
        block = derivation.block("u", (len(values),), values, "inputs")
        drivers["inputs"] = Function("inputs", "inputs given by the scene", inputs, (block,))
        if "u_dot" in taken:
            what = "time derivatives of the inputs given by the scene"
            drivers["input_rates"] = Function("input_rates", what, inputs, input_rates(derivation.tape, values, order))
    return drivers


def _facts(derivation: Derivation, made: Mapping[str, Function]) -> Facts:
    tape = derivation.tape
    loads = [value.ref for value in derivation.applied()]
    return Facts(
        constant_mass=not derivation.deep and "q" not in {symbol.block for symbol in tape.depends_on(_refs(derivation.mass()))},
        velocity_forces=any(symbol.block == "v" for symbol in tape.depends_on(loads)),
        smooth=not any(_rough(tape, node) for node in tape.live(loads)),
        moving_base=derivation.scene.base is not None,
        constraints=derivation.constraints is not None,
        internal_states=bool(derivation.scene.states),
        conservative="energy" in made and all(tape.value(ref) == 0.0 for ref in made["energy"].outputs[0].refs[2:]),
    )


def _rough(tape: Tape, node: int) -> bool:
    return bool(tape.curves[tape.b[node]][0].kinks()) if tape.op[node] is Op.CURVE else tape.op[node] in _ROUGH


def _refs(blocks: Sequence[Block]) -> list[int]:
    return [ref for block in blocks for ref in block.refs]


def _pruned(derivation: Derivation, function: Function, timed: bool) -> Function:
    """Drop the input blocks that this scene does not have."""
    scene = derivation.scene
    used = {symbol.block for symbol in derivation.tape.depends_on(function.refs)}
    absent = {
        "p": not any(parameter.tunable for parameter in scene.parameters),
        "t": not timed, "z": not scene.states, "u": not scene.inputs, "base": scene.base is None,
        "lam": derivation.constraints is None or (function.name in OF_MOTION and "lam" not in used),
        "a": function.name in OF_MOTION and "a" not in used,
        "u_dot": not scene.inputs, "u_ddot": not scene.inputs, "u_higher": not scene.inputs, "base_rates": scene.base is None,
    }  # fmt: skip
    inputs = tuple(block for block in INPUT_BLOCKS if block in function.inputs and not absent.get(block, False))
    return Function(function.name, function.description, inputs, function.outputs)
