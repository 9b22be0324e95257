"""Linear models of a compiled model: about equilibria, steady motions, the initial state, and any other state;
with names, units and reference values of their signals.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.base.calls import names_of
from eomgen.base.data import replace
from eomgen.base.messages import listed, nearest, shown
from eomgen.base.rounding import SUMMED, WRITTEN
from eomgen.base.threads import one_thread_of_algebra
from eomgen.compiled.arguments import check_finite, check_name, number_of
from eomgen.compiled.coordinates import StateArrays, coordinate_units
from eomgen.compiled.rest.driven_rest import drives
from eomgen.compiled.rest.sparse_partials import sparse_partials
from eomgen.compiled.terms import Inputs, Parameters, States
from eomgen.errors import ModelError, NumericalError, Problem, UsageError
from eomgen.lie.product import update
from eomgen.products.linear.analyses.operating_point import (
    EquilibriumState,
    OperatingPoint,
    OperatingState,
    as_found,
    check_constraints,
    found_state,
    given_state,
)
from eomgen.products.linear.analyses.sampled_states import sampled_part
from eomgen.products.linear.freedom import Measures, Partials, freedom, singular_mechanism
from eomgen.products.linear.linearization import Linearization, LinearNames, Reference
from eomgen.products.linear.multiblade import (
    AT_ONE_AZIMUTH,
    Basis,
    Blades,
    Multiblade,
    Rotor,
    checked_groups,
    in_multiblade,
    largest_change,
)
from eomgen.products.linear.sampling import SampledPart, held_as_inputs
from eomgen.products.statics.steady_motion import SteadyMotion
from eomgen.solvers.bordered_newton import whole
from eomgen.system.description import component_names
from eomgen.system.terms import linear_terms, takes_nonzeros

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel


def signal_names(model: CompiledModel, components: Sequence[str], measured: Sequence[str]) -> LinearNames:
    """Return the names and units of all signals of a linear model; ``references`` and ``orientations`` stay empty.
    `components` are the nv names of the components of v without ``v.``, `measured` the names of the candidates of
    independent coordinates: the same components, or coordinates of joints between absolute bodies. States, inputs,
    disturbances and outputs (one name for each component of an output) are read from the model."""
    description, velocities = model.description, model.v_units
    if measured != components:
        velocities = coordinate_units(description.joints, description.coordinates)[1]
    of_inputs = {item.name: item.unit for item in description.inputs}
    of_base = {name: "rad/s^2" if "angular" in name else "m/s^2" for name in description.base}
    outputs = {
        name: str(item["unit"])
        for item in model.library.layout["outputs"]
        for name in component_names("", str(item["name"]), int(item["size"]))
    }
    units = {
        "measured": tuple(unit.removesuffix("/s") for unit in velocities),
        "velocities": tuple(velocities),
        "states": tuple(model.z_units),
        "inputs": tuple(of_inputs[name] for name in description.driven),
        "disturbances": tuple((of_inputs | of_base)[name] for name in description.disturbances),
        "outputs": tuple(outputs.values()),
    }
    signals = (model.states, description.driven, description.disturbances, tuple(outputs))
    return LinearNames(tuple(components), tuple(measured), *signals, units)


def reference_values(
    model: CompiledModel, reference: Reference, point: OperatingPoint, measures: Measures
) -> dict[str, Array]:
    """Return the values of all signals at the reference of a linear model, by kind of signal.

    The keys are ``measured`` (coordinates), ``velocities``, ``states`` (internal states), ``inputs``, ``disturbances``
    and ``outputs``, the values arrays in SI units. Not a number stands for unknown values: components on groups,
    coordinates of joints between absolute bodies, disturbances by base motion.

    Parameters
    ----------
    model : CompiledModel
        The model that was made linear.
    reference, point : Reference, OperatingPoint
        State and inputs; time, parameters and base.
    measures : Measures
        Values of the measured coordinates' velocities, and the factors or joints that they belong to.
    """
    description = model.description
    coordinates = np.full(len(measures.v), np.nan)
    if measures.factors is model.factors:
        for factor in model.factors:
            if factor.q_size == factor.v_size:
                coordinates[factor.v] = reference.q[factor.q]
    inputs = dict(zip(model.inputs, reference.u, strict=True))
    outputs = np.zeros(0)
    if "outputs" in model.functions:
        multipliers = {"multipliers": reference.multipliers} if len(reference.multipliers) else {}
        of_state = {"z": reference.z, **multipliers, **point.keywords}
        outputs = next(iter(model.evaluate("outputs", reference.q, reference.v, reference.a, **of_state).values()))
    return {
        "measured": coordinates,
        "velocities": measures.v,
        "states": reference.z,
        "inputs": np.array([inputs[name] for name in description.driven]),
        "disturbances": np.array([inputs.get(name, np.nan) for name in description.disturbances]),
        "outputs": outputs,
    }


def with_held(names: LinearNames, sampled: SampledPart) -> LinearNames:
    """Return names whose sampled states stand among the inputs, after the other inputs, instead of among the states.
    Units and reference values move, too. `sampled` gives the places and names of the sampled
    states."""
    held, kept = list(sampled.places), sampled.others
    units, values = names.units_by_kind, names.references
    states, inputs = units["states"], (*units["inputs"], *(units["states"][k] for k in held))
    units = {**units, "states": tuple(states[k] for k in kept), "inputs": inputs}
    moved = np.append(values["inputs"], values["states"][held])
    values = {**values, "states": values["states"][kept], "inputs": moved}
    states, inputs = tuple(names.states[k] for k in kept), (*names.inputs, *sampled.names)
    return replace(names, states=states, inputs=inputs, units_by_kind=units, references=values)


#: Limit of the difference of linear models that are computed again along a motion.
SAME = WRITTEN
#: Words of the warning of a linear model that is frozen at an instant.
AT_ONE_INSTANT = "the linear model changes with the turn"
#: Parts of a turn after which models are compared: no rotor of few blades is alike there.
AZIMUTHS = (0.11, 0.37, 0.71)
#: Names in ``Partials`` of blocks of the terms, if different.
_IN_PARTIALS = {"M0": "M", "C0": "C", "K0": "K", "B0": "B", "E0": "E", "B": "J"}


def linearize(
    model: CompiledModel,
    q: ArrayLike | None = None,
    v: ArrayLike | None = None,
    a: ArrayLike | None = None,
    t: float = 0.0,
    u: Inputs = None,
    *,
    z: States = None,
    multipliers: ArrayLike | None = None,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
    at: str | EquilibriumState | None = None,
    initial: Mapping[str, Any] | None = None,
    any_kind: bool = False,
    independent: Sequence[str] = (),
    multiblade: Blades | None = None,
) -> Linearization:
    """Return the linear model about a state: second order, state space, modes, frequency responses.

    Without a state: about the static equilibrium near the initial state at ``t``, with the base held; on a base that
    moves at t, about lasting rest relative to the base; without either, about the initial state. Functions of time are
    frozen at ``t``.

    Parameters
    ----------
    q, v, a : array_like, optional
        A state (nq,), (nv,), (nv,), left-trivialised; v is 0 by default, and a the result of forward dynamics.
    t : float, optional
        Time at which functions of time are frozen, s.
    u, z, parameters : mapping or array_like, optional
        Inputs (nu,), internal states (nz,) and tunable parameters (np,), SI units; values of the scene if not given.
    multipliers : array_like, optional
        Multipliers of the constraints (rows,); by default the state's own.
    base : array_like, optional
        State of the base (19,), as returned by ``base``; the scene's motion at t if not given.
    at : str, or a result of ``equilibrium`` or ``steady_motion``
        ``equilibrium`` or ``steady`` (an error if there is none), or ``initial``. A result with inputs and parameters
        other than the scene's needs the same inputs and parameters here.
    initial : mapping
        As of ``simulate``: the state, or the start of the search for an equilibrium.
    any_kind : bool
        Whether an unstable equilibrium will do: the nearest.
    independent : sequence of str
        Components (``hinge``, ``ball[2]``) to be independent coordinates, as far as constraints leave a choice.
    multiblade : mapping
        Equal coordinates of three or more blades by the joint of their rotor, in the order of azimuth about its axis:
        ``{"spin": [("flap_1", "flap_2", "flap_3")]}``, or names of beams, internal states, inputs. The model has
        their multiblade (Coleman) coordinates, with constant coefficients about a steady motion.

    Returns
    -------
    Linearization
        Matrices of the second-order model, with ``state_space()``, ``modes()`` and frequency responses.

    Raises
    ------
    UsageError
        Arguments that cannot be taken; a state that does not meet the constraints.
    ModelError
        Constraints depend on each other in this state; a model that changes with the azimuth in multiblade
        coordinates, too.
    NumericalError
        The equilibrium asked for was not found, or partials are not finite.

    Examples
    --------
    >>> model = eomgen.build("examples/quarter_car/scene.toml")
    >>> linear = model.linearize()
    >>> linear.coordinates
    ('wheel', 'body')
    """
    p = model.evaluator.one_set(parameters)
    arguments: dict[str, Any] = {"q": q, "v": v, "a": a, "z": z, "multipliers": multipliers}
    specified = sorted(name for name, value in arguments.items() if value is not None)
    independent = names_of("independent", "coordinates", independent, "hinge")
    able = able_to_linearize(model, moving=bool(specified) or at in ("initial", "steady"))
    point = OperatingPoint(number_of("t", t), p, u, None if base is None else able.evaluator.base(base))
    with one_thread_of_algebra(model.nv):
        if specified:
            if "q" not in specified:
                fault = f"{', '.join(specified)} need the q of their state [E0059]"
                raise UsageError(Problem("linearize", fault, "q=..., or initial=..."))
            if at is not None or initial is not None:
                fault = "the state is given by q as well as by at or initial [E0060]"
                raise UsageError(Problem("linearize", fault, "one of them"))
            state = given_state(able, arguments, point)
            check_constraints(able, state)
        elif not isinstance(at, EquilibriumState | SteadyMotion):
            state = found_state(able, at, initial, point, any_kind=any_kind, asked=model)
        else:
            state = as_found("steady motion" if isinstance(at, SteadyMotion) else "equilibrium", at, point)
        if multiblade is not None:
            return _in_multiblade_coordinates(able, state, independent, multiblade)
        result = about(able, state, independent)
        if state.a is not None and np.any(state.v) and not np.any(state.a) and result.sampled is None:
            _warn_of_change(able, state, result)
        if specified and state.a is None and not np.any(state.v):
            _warn_of_acceleration(able, result)
        return result


def able_to_linearize(model: CompiledModel, *, moving: bool = False) -> CompiledModel:
    """Return the model, or one of the same scene, with all terms that a linear model needs.

    Parameters
    ----------
    moving : as of ``linear_terms``
    """
    there, disturbed = model.functions.names, _is_disturbed(model)
    return model.having(linear_terms(there, disturbed=disturbed, states=bool(model.nz), moving=moving))


def _is_disturbed(model: CompiledModel) -> bool:
    return bool(model.nu or model.description.disturbances)


def _able_at(model: CompiledModel, state: OperatingState, a: Array) -> CompiledModel:
    """Return the model, with partials of the accelerations of constraints unless these partials vanish: of rows
    Phi(q) = 0 accelerations are J a + g, linear in a and quadratic in v."""
    taken = model.functions.inputs("constraint_bias") if model.multipliers else ()
    timed = {"t", "base"}.intersection(taken) or model.functions.sizes["holonomic"] < len(model.multipliers)
    return able_to_linearize(model, moving=True) if timed or np.any(state.v) or np.any(a) else model


def about_motion(model: CompiledModel, state: StateArrays, u: Array | None, p: Array) -> Linearization:
    """Return the linear model about a state of a motion, brought onto the constraints.

    Parameters
    ----------
    model : CompiledModel
        The model that moves.
    state : StateArrays
        Time t (s), q, v and z.
    u : (nu,) ndarray or None
        Inputs at the time; None for the inputs that the scene gives.
    p : (np,) ndarray
        Parameters.
    """
    able, t = able_to_linearize(model, moving=True), float(state.t)
    q, v = state.q, state.v
    if able.multipliers:
        consistent = able.consistent(q, v, t, parameters=p)
        q, v = consistent.q, consistent.v
    return about(able, OperatingState("motion", OperatingPoint(t, p, u, None), q, v, state.z))


def _finite_blocks(
    model: CompiledModel, state: OperatingState, a: Array, lam: Array, names: LinearNames
) -> dict[str, Array]:
    """Return the partial derivatives of the equations of motion at a state, as dense matrices by name of ``Partials``.
    These are derivatives of residual, rates of internal states and, if the model has these terms, outputs,
    accelerations of constraints and the constraint Jacobian. `a` is the acceleration (nv,), `lam` the multipliers
    (rows,), `names` serve the messages. Raises NumericalError if a partial derivative is not finite."""
    of_inputs = model.nu or model.nz or names.disturbances
    # unless another force acts
    of_forces = "linearization" if "linearization" in model.functions or of_inputs else "partials"
    terms = ["velocity_partials", "acceleration_partials", "constraint_jacobian", "output_partials"]
    nonzeros = takes_nonzeros(model.functions.names, disturbed=_is_disturbed(model))
    terms += [] if nonzeros else [of_forces]
    blocks: dict[str, Array] = {}
    for term in (term for term in terms if term in model.functions):
        blocks |= model.evaluate(term, state.q, state.v, a, z=state.z, multipliers=lam, **state.point.keywords)
    if nonzeros:
        matrices = vars(sparse_partials(model, state.q, state.v, a, state.z, lam, state.point.keywords))
        blocks |= {name: whole(matrices[name]) for name in ("K", "C", "M", "Rz", "Fq", "Fv", "Fz")}
    blocks = {_IN_PARTIALS.get(name, name): block for name, block in blocks.items()}
    _check_finite(blocks, names)
    return blocks


def _check_finite(blocks: Mapping[str, Array], names: LinearNames) -> None:
    """Raise NumericalError if a matrix of partial derivatives is not finite. The message names the matrices in
    `blocks`, or, if only derivatives of outputs (names ``Y...``) are concerned, the outputs by their rows."""
    bad = sorted(name for name, block in blocks.items() if not np.all(np.isfinite(block)))
    steep = [
        output
        for row, output in enumerate(names.outputs)
        if any(name.startswith("Y") and not np.all(np.isfinite(blocks[name][row])) for name in bad)
    ]
    if any(not name.startswith("Y") for name in bad):
        fault = f"partials are not finite numbers in this state: {', '.join(bad)} [E0061]"
        raise NumericalError(Problem("linearize", fault, "a state in which forces and their slopes have a value"))
    if steep:
        fault = f"the slope of the output {' and of '.join(steep)} is not a finite number in this state [E2221]"
        raise NumericalError(Problem("linearize", fault, "another state, or a scene without this output"))


def about(model: CompiledModel, state: OperatingState, independent: Sequence[str] = ()) -> Linearization:
    """Return the linear model of a compiled model about a state.

    The model must have all terms that linear models need (``able_to_linearize``). Sampled states become inputs of the
    result. `independent` are names of components that have to be independent coordinates.

    Raises
    ------
    UsageError
        A component that is to be independent and is not there, or that constraints do not leave free.
    ModelError, NumericalError
        Constraints depend on each other there, the inertia matrix is singular, or partials are not finite.
    """
    a, lam = _dynamics(model, state)
    model = _able_at(model, state, a)
    measures, names = _measures(model, state, a, independent)
    blocks = _finite_blocks(model, state, a, lam, names)
    holonomic = model.functions.sizes["holonomic"]
    partials = Partials.of(blocks, len(names.inputs), len(names.disturbances), len(names.outputs), holonomic)
    sampled = sampled_part(model, state.q, state.v, state.z, state.point.keywords)
    free = freedom(measures, partials, [names.measured.index(name) for name in independent])
    held = [name for name in independent if names.measured.index(name) not in free.coordinates]
    if held:
        bound = ", ".join(held)
        fault = f"constraints do not leave {bound} free in addition to the other independent coordinates [E0062]"
        hint = f"up to {len(free.coordinates)} components that can move by themselves"
        raise UsageError(Problem("independent", fault, hint))
    point = state.point
    u = model.evaluator.inputs(point.u, {"t": np.asarray(point.t), "p": point.parameters})
    reference = Reference(point.t, state.q, state.v, a, state.z, u, lam, state.kind)
    values = reference_values(model, reference, point, measures)
    turning = () if model.description.joints else (item for item in model.factors if item.q_size != item.v_size)
    turned = {factor.name: tuple(state.q[factor.q].tolist()) for factor in turning}
    names = replace(names, references=values, orientations=turned)
    if sampled is not None:
        partials, names = held_as_inputs(partials, sampled), with_held(names, sampled)
    return Linearization(reference, partials, free, names, sampled)


def _warn_of_change(model: CompiledModel, state: OperatingState, linear: Linearization) -> None:
    """Warn (RuntimeWarning) if a linear model about a motion with constant velocities changes along the motion. The
    model is computed again after 0.11 turns of the fastest rotating velocity, and the matrices A are compared. No
    comparison without a rotating velocity. Forces may stay balanced along the motion although their derivatives change,
    as for a rotor with two blades."""
    turning = [abs(v) for v, unit in zip(state.v, model.v_units, strict=True) if unit == "rad/s"]
    if not any(turning):
        return
    moved = _later(model, state, linear, AZIMUTHS[0] * 2.0 * np.pi / max(turning))
    before, after = linear.state_space().A, moved.state_space().A
    if before.size and before.shape == after.shape and np.abs(after - before).max() > SAME * np.abs(before).max():
        turn = f"{AT_ONE_INSTANT} of {drives(model, state.v)}, so it holds at this instant only"
        hint = "multiblade for three or more equal blades, a scene that is symmetric about the axis, or model.floquet"
        warnings.warn(f"linear about the {state.kind}: {turn}; try: {hint} [W0004]", RuntimeWarning, stacklevel=4)


def _later(model: CompiledModel, state: OperatingState, linear: Linearization, seconds: float) -> Linearization:
    """Return the linear model later along a motion with constant velocities, in the same coordinates."""
    later = replace(state.point, t=state.point.t + seconds)
    q = update(model.factors, state.q, state.v * seconds)
    q = model.evaluator.follow_angles(q, later.t, later.parameters, later.base)
    return about(model, replace(state, point=later, q=q, multipliers=None), linear.coordinates)


def _in_multiblade_coordinates(
    model: CompiledModel, state: OperatingState, independent: Sequence[str], blades: Blades
) -> Linearization:
    """Return the linear model in multiblade coordinates, after a comparison with the model at other azimuths.

    `blades` are the groups of equal coordinates by the angle of their rotor, `independent` further names of independent
    coordinates. The result's ``multiblade`` has the largest relative change over azimuths. Warns of inputs and outputs
    that change with the azimuth.

    Raises
    ------
    UsageError
        Blades or rotors that cannot be taken, or blades in the order against the azimuth.
    ModelError
        The state is not a steady motion, states are sampled, or the model changes with the azimuth.
    """
    if np.any(state.v) and (state.a is None or np.any(state.a)):
        fault = f"velocities of the {state.kind} change, and multiblade coordinates need a steady motion [E0063]"
        raise ModelError(Problem("multiblade", fault, 'at="steady", or the result of steady_motion'))
    first = about(model, state, independent)
    if first.sampled is not None:
        raise ModelError(Problem("multiblade", "the scene has sampled states [E0064]", "continuous states"))
    names = first.names
    known = [*names.measured, *names.states, *names.inputs, *names.disturbances, *names.outputs]
    rotors = _rotors(model, state, checked_groups(blades, known))
    groups = Basis.of(names.measured, rotors).groups
    wanted = [names.measured[position] for group in groups for position in group.places]
    if not set(wanted) <= set(first.coordinates):
        first = about(model, state, list(dict.fromkeys((*independent, *wanted))))
    result = _to_multiblade(first, rotors)
    speeds = [abs(rotor.speed) for rotor in rotors if rotor.speed]
    if not speeds or result.multiblade is None:
        return result
    times = [share * 2.0 * np.pi / min(speeds) for share in AZIMUTHS]
    models = [(seconds, _later(model, state, first, seconds)) for seconds in times]
    others = _at_azimuths(models, rotors)
    variation, row = _variation(result, others, rotors)
    if not variation <= SAME:
        reverse = [replace(rotor, groups=tuple(group[::-1] for group in rotor.groups)) for rotor in rotors]
        if _variation(_to_multiblade(first, reverse), _at_azimuths(models, reverse), reverse)[0] <= SAME:
            fault = "the blades are named against the order of their azimuths [E0066]"
            raise UsageError(Problem("multiblade", fault, ", ".join(reverse[0].groups[0])))
        of = f"{result.state_space().states[row]}' by {variation:.2g} of its coefficients"
        fault = f"the linear model changes with the azimuth in multiblade coordinates, too: {of} [E0065]"
        period = 2.0 * np.pi / min(speeds)
        hint = f"all coordinates of all blades, if these are equal; or model.floquet({period:.6g}), in Python"
        raise ModelError(Problem("multiblade", fault, hint))
    _warn_of_one_azimuth(result, others, rotors)
    return replace(result, multiblade=replace(result.multiblade, variation=variation))


def _warn_of_one_azimuth(result: Linearization, others: Sequence[Linearization], rotors: Sequence[Rotor]) -> None:
    """Warn of inputs and outputs whose rows of B, or C, change with the azimuth in a model that does not change. Such
    signals belong to single blades. `result` and `others` are linear models in multiblade coordinates at different
    azimuths, `rotors` give the names in the warning."""
    spaces = [model.state_space() for model in (result, *others)]
    sizes = sizes_of_states(result)
    rows = {"output": [space.C / sizes for space in spaces], "input": [space.B.T * sizes for space in spaces]}
    told = []
    for kind, (first, *later) in rows.items():
        largest = np.max(np.abs(first), axis=1)
        change = np.max([np.max(np.abs(matrix - first), axis=1) for matrix in later], axis=0)
        changing = change > np.maximum(SAME * largest, SUMMED * np.linalg.norm(largest))
        names = [name for name, true in zip(getattr(spaces[0], f"{kind}s"), changing, strict=True) if true]
        if names:
            told.append(f"the {kind}{'s' if len(names) > 1 else ''} {listed(names)}")
    if told:
        turning = ", ".join(rotor.name for rotor in rotors if rotor.speed)
        warnings.warn(
            f"{' and '.join(told)} {AT_ONE_AZIMUTH} of {turning}, since their rows of the linear model turn; try:"
            " equal signals of all blades as a group in multiblade [W0005]",
            RuntimeWarning,
            stacklevel=4,
        )


def _variation(result: Linearization, others: Sequence[Linearization], rotors: Sequence[Rotor]) -> tuple[float, int]:
    """Return the largest relative change of matrix A over later models in multiblade coordinates, and the row of A."""
    matrices, sizes = [model.state_space().A for model in others], sizes_of_states(result)
    return largest_change(result.state_space().A, matrices, sizes, max(rotor.speed**2 for rotor in rotors))


def _at_azimuths(models: Sequence[tuple[float, Linearization]], rotors: Sequence[Rotor]) -> list[Linearization]:
    """Return the later models in multiblade coordinates, each with the rotors turned on to the model's time. `models`
    are pairs of seconds after the reference and a linear model in coordinates of single blades."""
    turned = []
    for seconds, moved in models:
        there = [replace(rotor, azimuth=rotor.azimuth + rotor.speed * seconds) for rotor in rotors]
        turned.append(_to_multiblade(moved, there))
    return turned


def sizes_of_states(linear: Linearization) -> Array:
    """Return the scales (ns,) of states by which entries of A are compared. Scales are roots of the diagonal of M0 for
    coordinates and for velocities, and 1 for internal states; 1 for all states if constraints are not holonomic."""
    sizes = np.ones(len(linear.state_space().A))
    if linear.free.holonomic:
        inertias = np.sqrt(np.abs(np.diag(linear.M0)))
        sizes[: 2 * len(inertias)] = np.tile(inertias, 2)
    return sizes


def _rotors(
    model: CompiledModel, state: OperatingState, groups: Mapping[str, tuple[tuple[str, ...], ...]]
) -> list[Rotor]:
    """Return the rotors with their speed (rad/s) and azimuth (rad) in a state, and their groups of blades. `groups`
    maps the name of a rotor's joint angle to tuples of blade coordinates. Raises UsageError for a name that is not the
    angle of a revolute joint in joint coordinates."""
    components = [name.removeprefix("v.") for name in model.v_names]
    angles = {
        components[factor.v_start]: factor.q_start
        for factor in model.factors
        if factor.group == "R" and factor.q_size == 1 and model.v_units[factor.v_start] == "rad/s"
    }
    for name in groups:
        if name not in angles:
            fault = f"{shown(name)} is not the angle of a joint by which a rotor turns [E0067]"
            hint = nearest(name, angles) or "a revolute joint in joint coordinates"
            raise UsageError(Problem("multiblade", fault, hint))
    return [
        Rotor(name, float(state.v[components.index(name)]), float(state.q[angles[name]]), members)
        for name, members in groups.items()
    ]


def _to_multiblade(linear: Linearization, rotors: Sequence[Rotor]) -> Linearization:
    """Return a linear model transformed into the multiblade coordinates of rotors.

    Partials, free motions, names, units and reference values of coordinates, states, inputs, disturbances and outputs
    that are blades of a rotor are combined. Partials of the forces are X^T M X, X^T C X and X^T K X, without rates of
    the transformation X; these rates are in the free motions (so in M0, C0, K0 and A) and in ``Fz``. ``multiblade`` of
    the result holds the rotors and the transformation; its ``variation`` is not yet computed.
    """
    names = linear.names
    kinds = ("measured", "states", "inputs", "disturbances", "outputs")
    of = {kind: Basis.of(getattr(names, kind), rotors) for kind in kinds}
    same = names.components == names.measured
    of["components"] = of["measured"] if same else Basis.of(names.components, ())
    partials, free = in_multiblade(linear.partials, linear.free, of, of["measured"])
    bases = {**of, "velocities": of["measured"]}
    values = {kind: bases[kind].values(references) for kind, references in names.references.items()}
    renamed: dict[str, Any] = {kind: basis.names for kind, basis in of.items()}
    multiblade = Multiblade(tuple(rotors), of["components"].matrix, tuple(of["measured"].pairs))
    names = replace(names, **renamed, references=values)
    return replace(linear, partials=partials, free=free, names=names, multiblade=multiblade)


def _warn_of_acceleration(model: CompiledModel, linear: Linearization) -> None:
    """Warn if a state given without velocities is not at rest, because its modes may be mistaken for modes of an
    equilibrium."""
    a = linear.reference.a
    k = int(np.argmax(np.abs(a)))
    if abs(a[k]) > 1e-3:
        name, unit = model.v_names[k].removeprefix("v."), model.v_units[k].replace("/s", "/s^2")
        sentence = f"linear about a state that does not rest: {name} accelerates with {a[k]:.4g} {unit}"
        hint = 'linearize() for an equilibrium, at="initial", or the a of the state if it is meant'
        warnings.warn(
            f"{sentence}, so modes hold at this instant only; try: {hint} [W0006]", RuntimeWarning, stacklevel=4
        )


def _dynamics(model: CompiledModel, state: OperatingState) -> tuple[Array, Array]:
    """Return the accelerations (nv,) and the multipliers (rows,) of a state. Both are given values, else the result of
    forward dynamics; multipliers of a state with given accelerations balance the residual in least squares. Raises
    ModelError for a singular inertia matrix or dependent constraints, NumericalError for accelerations that are not
    finite."""
    keywords = state.point.keywords | {"z": state.z}
    if not model.multipliers:
        a = state.a if state.a is not None else model.forward_dynamics(state.q, state.v, **keywords)
        lam = np.zeros(0)
    elif state.a is None:
        try:
            a, lam = able_to_linearize(model, moving=True).constrained_dynamics(state.q, state.v, **keywords)
        except NumericalError:
            raise singular_mechanism() from None
    else:
        a, lam = state.a, np.zeros(0)
    if model.multipliers and state.multipliers is not None:
        lam = state.multipliers
    elif model.multipliers and state.a is not None:
        rest = np.zeros(len(model.multipliers))
        (r,) = model.evaluate("residual", state.q, state.v, a, multipliers=rest, **keywords).values()
        (B,) = model.evaluate("constraint_jacobian", state.q, **state.point.keywords).values()
        lam = np.asarray(np.linalg.lstsq(B.T, -r, rcond=None)[0], dtype=float)
    check_finite("acceleration", a, [f"the acceleration of {name}" for name in model.v_names])
    return a, lam


def _measures(
    model: CompiledModel, state: OperatingState, a: Array, independent: Sequence[str]
) -> tuple[Measures, LinearNames]:
    """Return the measures of neighbouring motions, and the names of all signals of the linear model. Neighbouring
    motions are measured by joints between absolute bodies, like joint coordinates. If the caller selects a component of
    a body's velocity as independent, components of the bodies' velocities are the measures. Raises UsageError for an
    unknown name in `independent`."""
    components, joints = [name.removeprefix("v.") for name in model.v_names], model.description.joints or model.factors
    of_joints = [name for factor in joints for name in component_names("", factor.name, factor.v_size)]
    absolute = bool(model.description.joints)
    by_joints = absolute and not (independent and all(name in components for name in independent))
    measured = of_joints if by_joints else components
    for name in independent:
        check_name("coordinate of a joint" if by_joints else "component", name, measured)
    names = signal_names(model, components, measured)
    if not by_joints:
        return Measures.components(model.factors, state.v, a), names
    blocks = model.evaluate("joint_velocities", state.q, state.v, a, z=state.z, **state.point.keywords)
    of_state = {"P": "Pv", "Z": "Pq", "Av": "Pav", "Aq": "Paq"}
    shape = (len(measured), model.nv)
    partials = {name: blocks.get(block, np.zeros(shape)) for name, block in of_state.items()}
    return Measures(joints, blocks["joint_v"], blocks["joint_a"], **partials), names
