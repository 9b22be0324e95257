"""Derivation of a scene's System: only the requested terms, each from its own virtual work, with a summary of them."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import chain, islice

from eomgen.errors import Message, ModelError, Problem
from eomgen.mechanics.beam_axes import beam_axes
from eomgen.mechanics.constraints.joints import angle_labels
from eomgen.mechanics.describe import extent, reading_notes
from eomgen.mechanics.discontinuities import discontinuities, overshoots, validity
from eomgen.mechanics.forces.symbols import input_signal
from eomgen.mechanics.initial_coordinates import absolute_start, joint_start
from eomgen.mechanics.named_constants import describe_beams, named_constants, slopes
from eomgen.mechanics.scene_tape import Derivation
from eomgen.mechanics.terms.events import event_rows, modes, needs_impulse, sample_rows
from eomgen.mechanics.terms.recorders import differentiand_recorder, recorder
from eomgen.mechanics.tree.base import base_law
from eomgen.mechanics.tree.links import Tree
from eomgen.scene.bodies.cosserat import CONSTRAINED, Cosserat
from eomgen.scene.bodies.model import KINDS, Beam
from eomgen.scene.forces.cosserat_beams import CosseratBeam
from eomgen.scene.scene import Scene
from eomgen.symbolic.external import HighDerivativeError
from eomgen.symbolic.operations import Op
from eomgen.symbolic.tape import Tape
from eomgen.system.system import BASE_SIZE, INPUT_BLOCKS, Block, Facts, Function, Quantity, System
from eomgen.system.terms import TERMS, UNRESISTED


def kept_and_dropped(
    scene: Scene, tree: Tree, functions: Mapping[str, Function], facts: Facts
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return two tuples of sentences: effects in the equations, and effects left out, each with the reason.
    ``functions`` are the derived functions by name."""
    kept: list[str] = [f"{name}: {function.description}" for name, function in functions.items()]
    dropped: list[str] = []
    kept += [f"curve {curve.name}: {curve}" for curve in scene.curves]
    kept += [] if scene.base is None else scene.base.integrals.values()
    followers = [f"{joint.name} follows {joint.mimic.joint}" for joint in scene.joints if joint.mimic is not None]
    if followers:
        dropped.append(f"coordinates of {len(followers)} joint(s) that follow others: {', '.join(followers)}")
    beams = {body.name: body.beam for body in scene.bodies if body.beam is not None}
    kept += [f"beam {text}" for text in describe_beams(tree)]
    dropped += _absent_deformations(beams)
    kept += [_strains(element.beam) for element in scene.elements if isinstance(element, CosseratBeam)]
    fixed = [joint.name for joint in scene.joints if not joint.kind.moves and joint.child not in beams]
    if fixed:
        dropped.append(f"{len(fixed)} fixed joint(s) merged into their parents: {', '.join(fixed)}")
    dropped += [f"{effect}: {why}" for present, effect, why in _effects(scene, tree, functions, facts) if not present]
    return tuple(kept), tuple(dropped)


def _absent_deformations(beams: Mapping[str, Beam]) -> Iterator[str]:
    """Yield for each beam, by name, a sentence on the kinds of deformation that the scene does not request."""
    for name, beam in beams.items():
        if lacking := [kind for kind in KINDS if kind not in {item.kind for item in beam.deformations}]:
            yield f"{', '.join(lacking)} of beam {name}: the scene asks for none"


def _strains(beam: Cosserat) -> str:
    """Return a sentence on the elements and the constrained strains of a geometrically exact beam."""
    strains = ", ".join(strain.replace("_", " along ") for strain in CONSTRAINED[beam.model])
    without = f", without {strains}: {len(beam.absent_strains)} rows for each" if strains else ""
    return f"beam {beam.name}: model {beam.model}, {beam.elements} elements{without}"


def _effects(
    scene: Scene, tree: Tree, functions: Mapping[str, Function], facts: Facts
) -> Iterator[tuple[bool, str, str]]:
    """Yield (present, effect, reason): whether an effect is in the equations, its name, and the reason for its
    absence."""
    yield facts.moving_base, "base_motion, base struct", "the base is at rest"
    yield scene.base is None or bool(scene.base.rotations), "rotation of the base", "the base only translates"
    yield bool(scene.springs), "springs between points", "the scene has none"
    yield bool(scene.forces or scene.efforts), "forces and efforts by formula", "the scene has none"
    yield bool(scene.inputs), "inputs", "the scene has none"
    yield bool(scene.states), "internal states", "the scene has none"
    tunable = any(parameter.tunable for parameter in scene.parameters)
    yield tunable, "parameter struct", "all parameters are fixed and folded"
    rotors = any(not rotor.is_zero for link in tree.links for rotor in link.rotor_inertias)
    yield rotors, "rotor inertia", "no joint has any"
    yield facts.velocity_forces, "damping in the iteration matrix", "no applied force depends on velocity"
    yield "outputs" in functions, "outputs", "not asked for" if scene.outputs else "the scene names none"
    for term in ("partials", "energy"):
        yield term in functions, term, "not asked for"


#: Terms with partials in the accelerations of the base.
_DISTURBED = frozenset({"linearization", "output_partials"})
_NON_SMOOTH = frozenset({Op.ABS, Op.SIGN, Op.MIN, Op.MAX, Op.LT, Op.LE, Op.SELECT})


#: By the constraint rows left out, and whether the base has disturbances.
Derivations = dict[tuple[tuple[int, ...], bool], Derivation]


def derive(
    scene: Scene, terms: Sequence[str] | None = None, without_rows: Sequence[int] = (), known: Derivations | None = None
) -> System:
    """Derive the separated equations of motion of a scene.

    Parameters
    ----------
    terms : sequence of str, optional
        Names from ``TERMS``, of which terms that the scene cannot have are left out; the scene's own list, or all
        default terms of the scene, when omitted.
    without_rows : sequence of int
        Numbers of constraint rows to leave out, because they follow from other rows.
    known : dict, optional
        Earlier derivations of the scene, to which this one is added: with the same rows left out they share a tape,
        so that one reuses operations of another.

    Raises
    ------
    ModelError
        For an unknown term, or a law without the derivatives that a term needs; for numbers that no double can hold
        together.
    """
    try:
        disturbed = not _DISTURBED.isdisjoint(scene.terms if terms is None else terms)
        key = tuple(without_rows), disturbed
        derivation = (known or {}).get(key) or Derivation(scene, without_rows, disturbed=disturbed)
        if known is not None:
            known[key] = derivation
        return _assemble(derivation, _chosen(derivation, terms))
    except (ZeroDivisionError, OverflowError):
        if cause := next((note for note in map(Message, scene.notes) if note.code in UNRESISTED), None):
            raise ModelError(Problem(scene.name, *cause.fault_and_remedy(), cause.code)) from None
        fault = (
            "numbers of the scene combine to an infinite one: they are too small or too large, or cancel to zero in a"
            " divisor [E0496]"
        )
        raise ModelError(Problem(scene.name, fault, "masses, inertias and lengths between 1e-100 and 1e100")) from None


def _chosen(derivation: Derivation, terms: Sequence[str] | None) -> list[str]:
    """Return the names of the terms to derive: the requested terms that exist for the scene, or the default terms.
    ``terms`` None stands for the scene's list. Terms of events are always added. Raises ModelError for an unknown
    name."""
    requested = list(terms) if terms is not None else list(derivation.scene.terms)
    unknown = [name for name in requested if name not in TERMS]
    if unknown:
        raise ModelError(f"no term is called {', '.join(map(repr, unknown))} [E0497]", f"one of {', '.join(TERMS)}")
    facts = _existence_facts(derivation)
    existing = [term for term in TERMS.values() if term.exists_with(facts)]
    if requested:
        return [term.name for term in existing if term.name in requested or term.of_events]
    whole = derivation.whole_matrices
    # judgements of runs need M and B
    packed = {"mass_values"} if derivation.absolute and derivation.has_constraints and "mass" not in whole else set()
    return [
        term.name
        for term in existing
        if term.name in packed or (not term.on_request and (not term.quadratic or term.name in whole))
    ]


def _existence_facts(derivation: Derivation) -> set[str]:
    """Return the names of a scene's facts on which the existence of terms depends, see ``system.terms``."""
    scene = derivation.scene
    constrained = derivation.constraints is not None
    facts = {
        "constraints": constrained,
        "unconstrained": not constrained,
        "states": bool(scene.states),
        "outputs": bool(scene.outputs),
        "rigid_tree": not derivation.absolute and derivation.tree.rigid,
        "tunable": any(parameter.tunable for parameter in scene.parameters),
        "tunable_outputs": bool(scene.outputs) and any(parameter.tunable for parameter in scene.parameters),
        "given_inputs": any(item.given for item in scene.inputs),
        "moving_base": derivation.base.moving,
        "absolute": derivation.absolute,
        "elastic": derivation.tree.elastic,
        "rigid": derivation.tree.rigid,
        "large": derivation.tree.large,
        "events": bool(scene.events),
        "event_actions": any(event.action in ("reset", "impact", "switch") for event in scene.events),
        "exact_beams": bool(derivation.section_loads.beams),
        "samples": any(state.sampling is not None for state in scene.states),
        "event_impulse": needs_impulse(derivation),
    }
    return {name for name, holds in facts.items() if holds}


def _assemble(derivation: Derivation, terms: Sequence[str]) -> System:
    """Record the functions of the named terms, and return the System with facts, sparsity patterns and notes. Raises
    ModelError if a law has no derivatives of the order that a term needs."""
    # an attribute of the System a line; the decisions are the parts that a scene need not have
    scene, tape, tree = derivation.scene, derivation.tape, derivation.tree
    made = _functions_of_terms(derivation, terms)
    order = max((TERMS[name].order for name in terms), default=0)
    functions = _functions(derivation, made, order)
    facts = _facts(derivation, made)
    kept, dropped = kept_and_dropped(scene, tree, functions, facts)
    sizes = extent(scene, derivation.algebra, derivation.constant)
    rows = derivation.constraints.rows if derivation.constraints is not None else None
    if derivation.start is None:
        derivation.start = (absolute_start if derivation.absolute else joint_start)(derivation)
    initial_q, initial_v = derivation.start
    return System(
        name=scene.name,
        tape=tape,
        factors=tree.factors,
        functions=functions,
        parameters=tuple(Quantity(p.name, p.value, 1, p.unit, p.description) for p in scene.parameters if p.tunable),
        inputs=tuple(Quantity(i.name, 0.0, 1, i.unit, i.description) for i in scene.inputs),
        states=tuple(Quantity(s.name, s.initial, 1, s.unit, s.description) for s in scene.states),
        outputs=tuple(Quantity(o.name, 0.0, len(o.values), o.unit, o.description) for o in scene.outputs),
        bodies=tuple(body.name for body in scene.bodies),
        frames=tuple(frame.name for frame in scene.frames_of_terms()),
        initial_q=initial_q,
        initial_v=initial_v,
        angles=angle_labels(scene),
        base_zeros=derivation.prescribed.zeros,
        multipliers=tuple(row.name for row in rows.all) if rows is not None else (),
        row_units=tuple(row.unit for row in rows.all) if rows is not None else (),
        holonomic=len(rows.holonomic) if rows is not None else 0,
        patterns=dict(derivation.patterns),
        inner_owners=derivation.inner_owners,
        extent=tuple(size.ref for size in sizes),
        angular=tree.angular(),
        dof_parent=tree.dof_parents(),
        facts=facts,
        kept=kept,
        dropped=dropped,
        notes=tuple(map(Message, _notes(scene))),
        events=event_rows(derivation) if scene.events else (),
        modes=modes(derivation),
        sampled=sample_rows(derivation),
        controllers=scene.sampled,
        discontinuities=discontinuities(scene),
        validity=validity(scene),
        constants=named_constants(tree, derivation.quantities),
        beams=describe_beams(tree),
        slopes=slopes(tree),
        axes=beam_axes(tree) if "poses" in made else (),
        description=scene.description,
        defaults=dict(vars(scene.simulation)),
        order=order,
    )


def _functions_of_terms(derivation: Derivation, terms: Sequence[str]) -> dict[str, Function]:
    """Return the functions of the terms by name, with all inputs that their terms have in any scene."""
    made: dict[str, Function] = {}
    for name in terms:
        term = TERMS[name]
        try:
            blocks = tuple(_blocks(derivation, name))
        except HighDerivativeError as error:
            hint = "terms without this one, or formulas in place of the law"
            raise ModelError(Problem(name, str(error), hint)) from None
        made[name] = Function(name, term.description, term.inputs, blocks)
    return made


def _functions(derivation: Derivation, made: Mapping[str, Function], order: int) -> dict[str, Function]:
    """Return all functions of the System by name, with the inputs that the scene has.

    Parameters
    ----------
    order : highest order of time derivatives among the terms
    """
    read = _blocks_read(derivation, made)
    timed = any("t" in blocks for blocks in read.values())
    taken = {block for function in made.values() for block in function.inputs}
    functions = {name: _prune(derivation, function, read[name], timed) for name, function in made.items()}
    functions |= _drivers(derivation, order, taken)
    if angle_labels(derivation.scene):
        description = "angles of joints over all turns, which steppers let the references in q follow"
        angles = Function("joint_angles", description, ("p", "q", "v", "base"), tuple(derivation.joint_angles()))
        blocks = {symbol.block for symbol in derivation.tape.depends_on(angles.refs)}
        functions[angles.name] = _prune(derivation, angles, blocks, timed)
    return functions


def _blocks_read(derivation: Derivation, made: Mapping[str, Function]) -> dict[str, set[str]]:
    """Return for each function the names of the input blocks on which its outputs depend. Functions of derivatives take
    the blocks of the differentiated function as well."""
    read = derivation.tape.blocks_read({name: function.refs for name, function in made.items()})
    for name in (name for name in made if TERMS[name].differentiated and TERMS[name].of_motion):
        values = [ref for block in differentiand_recorder(TERMS[name].differentiated)(derivation) for ref in block.refs]
        read[name] |= {symbol.block for symbol in derivation.tape.depends_on(values)}
    return read


def _blocks(derivation: Derivation, name: str) -> Sequence[Block]:
    if TERMS[name].source:
        from eomgen.mechanics.terms.rates import rate_blocks  # noqa: PLC0415  # terms of few models

        return rate_blocks(derivation, TERMS[name])
    if of := TERMS[name].differentiated:
        from eomgen.mechanics.terms.argument_derivatives import derivative_blocks  # noqa: PLC0415  # terms of few models

        return derivative_blocks(derivation, name, differentiand_recorder(of)(derivation))
    return recorder(name)(derivation)


def _drivers(derivation: Derivation, order: int, taken: set[str]) -> dict[str, Function]:
    """Return the functions of time alone, by name: ``base``, ``inputs`` and their derivatives, if the scene has them.

    Parameters
    ----------
    order : highest order of time derivatives among the terms
    taken : names of input blocks that functions of terms take: ``u_dot`` brings in ``input_rates``, ``base_rates`` the
        function of this name
    """
    scene = derivation.scene
    tunable = any(parameter.tunable for parameter in scene.parameters)
    inputs = ("p", "t") if tunable else ("t",)
    drivers: dict[str, Function] = {}
    if scene.base is not None:
        law = base_law(derivation.algebra, scene.base, derivation.tree.parameters)
        block = derivation.block("base", (BASE_SIZE,), law, "base struct")
        drivers["base"] = Function("base", "motion of the base at time t", inputs, (block,))
        if "base_rates" in taken:
            from eomgen.mechanics.rates.jets import base_rates  # noqa: PLC0415  # models with time derivatives

            of_base = base_rates(derivation.tape, law, order)
            text = "further derivatives of the base's twist at time t"
            drivers["base_rates"] = Function("base_rates", text, inputs, (of_base,))
    if any(item.given for item in scene.inputs):
        values = [input_signal(derivation.quantities, item) for item in scene.inputs]
        block = derivation.block("u", (len(values),), values, "inputs")
        drivers["inputs"] = Function("inputs", "inputs given by the scene", inputs, (block,))
        if "u_dot" in taken:
            from eomgen.mechanics.rates.jets import input_rates  # noqa: PLC0415  # models with time derivatives

            text = "time derivatives of the inputs given by the scene"
            drivers["input_rates"] = Function("input_rates", text, inputs, input_rates(derivation.tape, values, order))
    return drivers


def _facts(derivation: Derivation, made: Mapping[str, Function]) -> Facts:
    """Return the facts of the equations by which methods and checks are chosen; ``made`` are the functions by name."""
    tape = derivation.tape
    loads = [value.ref for value in derivation.applied_forces()]
    masses = [] if derivation.tree.deep else [value.ref for row in derivation.mass_rows for value in row.values()]
    return Facts(
        constant_mass=not derivation.tree.deep and "q" not in {symbol.block for symbol in tape.depends_on(masses)},
        velocity_forces=any(symbol.block == "v" for symbol in tape.depends_on(loads)),
        smooth=not any(_non_smooth(tape, node) for node in tape.live(loads)),
        moving_base=derivation.scene.base is not None,
        constraints=derivation.constraints is not None,
        velocity_constraints=derivation.constraints is not None
        and len(derivation.constraints.rows.all) > len(derivation.constraints.rows.holonomic),
        internal_states=bool(derivation.scene.states),
        ill_scaled=derivation.ill_scaled,
        conservative="energy" in made and all(tape.value(ref) == 0.0 for ref in made["energy"].outputs[0].refs[2:]),
    )


def _non_smooth(tape: Tape, node: int) -> bool:
    """Return whether a node has a corner or a jump that depends on the motion; for functions of time alone False, as
    steps end at the times."""
    corners = tape.curves[tape.b[node]][0].kinks() if tape.op[node] is Op.CURVE else tape.op[node] in _NON_SMOOTH
    return bool(corners) and not {symbol.block for symbol in tape.depends_on([node])} <= {"t", "p"}


def _prune(derivation: Derivation, function: Function, used: Collection[str], timed: bool) -> Function:
    """Return a function without the input blocks that this scene does not have. ``used`` are the blocks on which its
    outputs depend: "lam" and "a" go if unused. ``timed``: some function depends on t."""
    scene = derivation.scene
    of_motion = function.name in TERMS and TERMS[function.name].of_motion
    absent = {
        "p": not any(parameter.tunable for parameter in scene.parameters),
        "t": not timed,
        "z": not scene.states,
        **dict.fromkeys(("u", "u_dot", "u_ddot", "u_higher"), not scene.inputs),
        **dict.fromkeys(("base", "base_rates"), scene.base is None),
        "lam": derivation.constraints is None or (of_motion and "lam" not in used),
        "a": of_motion and "a" not in used,
    }
    inputs = tuple(block for block in INPUT_BLOCKS if block in function.inputs and not absent.get(block, False))
    return Function(function.name, function.description, inputs, function.outputs)


def _notes(scene: Scene) -> Iterator[str]:
    """Yield the notes of the equations, then of splines that overshoot, at most one for each entry of further sections,
    such as maps."""
    yield from reading_notes(scene)
    yield from overshoots(scene.curves)
    for entry in chain.from_iterable(scene.parts.values()):
        yield from islice(overshoots(getattr(entry, "profiles", ())), 1)
