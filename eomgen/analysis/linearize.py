"""Linear models of a compiled model: about equilibria, steady motions, the initial state, and any other state."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from eomgen.analysis.driven_rest import driven_components, drives, held_base, law_rates
from eomgen.analysis.equilibrium import Equilibrium, equilibrium
from eomgen.analysis.equilibrium_warnings import Measures as MeasuresOfScene
from eomgen.analysis.sampled import sampled_part
from eomgen.analysis.steady_motion import SteadyMotion, steady_motion
from eomgen.arrays import Array
from eomgen.compiled.arguments import check_finite, check_name, components, number_of
from eomgen.compiled.coordinates import coordinate_units
from eomgen.compiled.initial_state import initial_state
from eomgen.compiled.state import State as RunState
from eomgen.compiled.terms import Inputs, Parameters
from eomgen.errors import ModelError, NumericalError, Problem, UsageError
from eomgen.lie.product import update
from eomgen.linear.freedom import Measures, freedom, singular_mechanism
from eomgen.linear.linearization import Linearization, Names, Reference
from eomgen.linear.partials import Partials
from eomgen.linear.sampled_loop import SampledPart, held_as_inputs
from eomgen.system.description import component_names
from eomgen.system.terms import PURPOSES

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel

#: How far constraints may be off in a state that is given, in their own units.
MET = 1e-6
#: Part of a turn after which a linear model about a motion is looked at again, and by how much it may differ then.
_LATER, _SAME = 0.11, 1e-6
#: How blocks of the terms are called in ``Partials``; others have the same name there.
_IN_PARTIALS = {"M0": "M", "C0": "C", "K0": "K", "B0": "B", "E0": "E", "B": "J"}
#: What ``model.equilibrium`` or ``model.steady_motion`` found.
EquilibriumState = Equilibrium | SteadyMotion


@dataclass(frozen=True)
class State:
    """A state to linearise about; accelerations and multipliers are None where the dynamics give them."""

    what: str
    q: Array
    v: Array
    z: Array
    a: Array | None = None
    multipliers: Array | None = None


@dataclass(frozen=True)
class OperatingPoint:
    """What holds besides the state: time, parameters, inputs, and a base that is not where the scene has it."""

    t: float
    parameters: Array
    u: Inputs
    base: Array | None

    @property
    def given(self) -> dict[str, Any]:
        """Keywords of the model's functions."""
        return {"t": self.t, "parameters": self.parameters, "u": self.u, "base": self.base}


def linearize(
    model: CompiledModel,
    given: Mapping[str, Any],
    t: float,
    u: Inputs,
    *,
    parameters: Parameters = None,
    base: ArrayLike | None = None,
    at: str | EquilibriumState | None = None,
    initial: Mapping[str, Any] | None = None,
    any_kind: bool = False,
    independent: Sequence[str] = (),
) -> Linearization:
    """Return the linear model about a state; see ``Model.linearize``. ``given``: q, v, a, z and multipliers."""
    p = model.evaluator.one_set(parameters)
    able = model.having((*PURPOSES["linearization"], "samples"))
    operating_point = OperatingPoint(number_of("t", t), p, u, None if base is None else able.evaluator.base(base))
    specified = sorted(name for name, value in given.items() if value is not None)
    if specified:
        if "q" not in specified:
            raise UsageError(
                Problem("linearize", f"{', '.join(specified)} need the q of their state", "q=..., or initial=...")
            )
        if at is not None or initial is not None:
            raise UsageError(Problem("linearize", "the state is given by q as well as by at or initial", "one of them"))
        state = _given_state(able, given)
        _check_constraints(able, state, operating_point)
    elif at is None or isinstance(at, str):
        state, operating_point = _found_state(able, at, initial, operating_point, any_kind=any_kind)
    else:
        state, operating_point = _state_found(
            "steady motion" if isinstance(at, SteadyMotion) else "equilibrium", at, operating_point
        )
    found = about(able, state, operating_point, independent)
    if state.a is not None and np.any(state.v) and not np.any(state.a) and found.sampled is None:
        _warn_of_change(able, state, operating_point, found)
    return found


def about_motion(model: CompiledModel, state: RunState, u: Array | None, p: Array) -> Linearization:
    """Return the linear model about a state of a motion, brought onto the constraints."""
    able, t = model.having((*PURPOSES["linearization"], "samples")), float(state.t)
    q, v = state.q, state.v
    if able.multipliers:
        consistent = able.consistent(q, v, t, parameters=p)
        q, v = consistent.q, consistent.v
    return about(able, State("motion", q, v, state.z), OperatingPoint(t, p, u, None))


def about(
    model: CompiledModel, state: State, operating_point: OperatingPoint, independent: Sequence[str] = ()
) -> Linearization:
    """Return the linear model about a state of a model that has all terms that are needed.

    Raises
    ------
    UsageError
        A component that is to be independent and is not there, or that constraints do not leave free.
    ModelError, NumericalError
        Constraints depend on each other there, the inertia matrix is singular, or partials are not finite.
    """
    a, lam = _dynamics(model, state, operating_point)
    measures, names = _measures(model, state, a, operating_point, independent)
    of_inputs = model.nu or model.nz or names.disturbances
    # where nothing else acts
    whole = "linearization" if "linearization" in model.functions or of_inputs else "partials"
    terms = ["velocity_partials", "acceleration_partials", "constraint_jacobian", "output_partials"]
    blocks: dict[str, Array] = {}
    for term in (whole, *(term for term in terms if term in model.functions)):
        blocks |= model.evaluate(term, state.q, state.v, a, z=state.z, multipliers=lam, **operating_point.given)
    blocks = {_IN_PARTIALS.get(name, name): block for name, block in blocks.items()}
    bad = sorted(name for name, block in blocks.items() if not np.all(np.isfinite(block)))
    if bad:
        what = f"partials are not finite numbers in this state: {', '.join(bad)}"
        raise NumericalError(Problem("linearize", what, "a state in which forces and their slopes have a value"))
    holonomic = model.functions.sizes["holonomic"]
    partials = Partials.of(blocks, len(names.inputs), len(names.disturbances), len(names.outputs), holonomic)
    sampled = sampled_part(model, state.q, state.v, state.z, operating_point.given)
    free = freedom(measures, partials, [names.measured.index(name) for name in independent])
    held = [name for name in independent if names.measured.index(name) not in free.coordinates]
    if held:
        what = f"constraints do not leave {', '.join(held)} free beside the other independent coordinates"
        raise UsageError(
            Problem("independent", what, f"up to {len(free.coordinates)} components that can move by themselves")
        )
    reference = Reference(
        operating_point.t, state.q, state.v, a, state.z, _inputs(model, operating_point), lam, state.what
    )
    values = _references(model, reference, operating_point, measures)
    turned = {} if model.description.joints else _orientations(model, state.q)
    names = replace(names, references=values, orientations=turned)
    if sampled is not None:
        partials, names = held_as_inputs(partials, sampled), _with_held(names, sampled)
    return Linearization(reference, partials, free, names, sampled)


def _warn_of_change(model: CompiledModel, state: State, operating_point: OperatingPoint, found: Linearization) -> None:
    """Warn where a linear model about a state that moves with constant velocities changes as it moves on.

    Forces may stay balanced along the motion and their slopes change, as with a rotor of two blades.
    """
    turning = np.abs([v for v, unit in zip(state.v, model.v_units, strict=True) if unit == "rad/s"])
    fastest = float(np.max(turning, initial=0.0))
    if not fastest:
        return
    seconds = _LATER * 2.0 * np.pi / fastest
    later = replace(operating_point, t=operating_point.t + seconds)
    q = update(model.factors, state.q, state.v * seconds)
    q = model.evaluator.followed(q, later.t, later.parameters, later.base)
    moved = about(model, replace(state, q=q, multipliers=None), later, found.coordinates)
    before, after = found.state_space().A, moved.state_space().A
    if not before.size or before.shape != after.shape:
        return
    change = float(np.max(np.abs(after - before), initial=0.0))
    if change > _SAME * float(np.max(np.abs(before))):
        what = (
            f"linear about the {state.what}: the linear model changes with the turn of {drives(model, state.v)}, so it"
            " holds at this instant only; try: a scene that is symmetric about what turns, or simulate"
        )
        warnings.warn(what, RuntimeWarning, stacklevel=5)


def _dynamics(model: CompiledModel, state: State, operating_point: OperatingPoint) -> tuple[Array, Array]:
    """Return accelerations and multipliers of a state: those given, or those of the motion through it."""
    given = operating_point.given | {"z": state.z}
    if not model.multipliers:
        if state.a is None or state.what != "given state":
            _check_mass(model, state, operating_point)
        a = state.a if state.a is not None else model.forward_dynamics(state.q, state.v, **given)
        lam = np.zeros(0)
    elif state.a is None:
        try:
            a, lam = model.constrained_dynamics(state.q, state.v, **given)
        except NumericalError:
            raise singular_mechanism() from None
    else:
        a, lam = state.a, np.zeros(0)
    if model.multipliers and state.multipliers is not None:
        lam = state.multipliers
    elif model.multipliers and state.a is not None:
        rest = np.zeros(len(model.multipliers))
        (r,) = model.evaluate("residual", state.q, state.v, a, multipliers=rest, **given).values()
        (B,) = model.evaluate("constraint_jacobian", state.q, **operating_point.given).values()
        lam = np.asarray(np.linalg.lstsq(B.T, -r, rcond=None)[0], dtype=float)
    check_finite("acceleration", a, [f"the acceleration of {name}" for name in model.v_names])
    return a, lam


def _check_mass(model: CompiledModel, state: State, operating_point: OperatingPoint) -> None:
    """Raise ModelError where the inertia matrix of a model without constraints is not positive definite, with the
    component."""
    M = model.mass(state.q, parameters=operating_point.parameters)
    sizes = np.sqrt(np.abs(np.diagonal(M)))
    sizes[sizes == 0.0] = 1.0
    if not np.all(np.isfinite(M)):
        return
    values, vectors = np.linalg.eigh(M / np.outer(sizes, sizes))
    if values[0] > 0.0:
        return
    along = model.v_names[int(np.argmax(np.abs(vectors[:, 0])))]
    how = "singular" if values[0] == 0.0 else "not positive definite"
    used = ", ".join(
        f"{name} = {value:.6g}" for name, value in zip(model.parameters, operating_point.parameters, strict=True)
    )
    what = f"the inertia matrix in this state is {how} along {along}{f', at {used}' if used else ''}"
    raise ModelError(Problem("linearize", what, "masses and inertias that bodies can have"))


def _given_state(model: CompiledModel, given: Mapping[str, Any]) -> State:
    """Return the caller's state, each part as one vector."""
    sizes = {"q": model.nq, "v": model.nv, "a": model.nv, "multipliers": len(model.multipliers)}
    parts: dict[str, Array] = {}
    for name, size in sizes.items():
        if given.get(name) is None:
            continue
        whole = model.evaluator.with_references(name, given[name]) if name == "q" else given[name]
        parts[name] = components(name, whole, size)
        if parts[name].ndim != 1:
            what = f"one state is needed, not a batch of shape {parts[name].shape}"
            raise UsageError(Problem(name, what, "one call for each state; nothing is compiled again"))
        check_finite(name, parts[name])
    parts["q"] = model.evaluator.configuration(parts["q"])
    z = model.evaluator.internal(given.get("z"))
    v = parts.get("v", np.zeros(model.nv))
    return State("given state", parts["q"], v, z, parts.get("a"), parts.get("multipliers"))


def _check_constraints(model: CompiledModel, state: State, operating_point: OperatingPoint) -> None:
    """Raise UsageError where a given state does not meet the constraints, or given accelerations break them."""
    model.check_left_out(state.q, state.v, operating_point.t, operating_point.parameters)
    if not model.multipliers:
        return
    given = operating_point.given
    at_velocity = next(iter(model.evaluate("constraint_velocity", state.q, state.v, **given).values()))
    rows = [("rate", model.multipliers, at_velocity)]
    if model.functions.sizes["holonomic"]:
        at_position = next(iter(model.evaluate("constraint", state.q, **given).values()))
        rows.insert(0, ("position", model.multipliers, at_position))
    if state.a is not None:
        (B,) = model.evaluate("constraint_jacobian", state.q, **given).values()
        (g,) = model.evaluate("constraint_bias", state.q, state.v, **given).values()
        rows.append(("acceleration", model.multipliers, B @ state.a + g))
    for level, names, values in rows:
        worst = int(np.argmax(np.abs(values)))
        if not abs(values[worst]) <= MET:
            what = (
                f"the state does not meet the constraints: {names[worst]} is off by {values[worst]:.3g} in its {level}"
            )
            hint = (
                "a without it, for that of the motion"
                if level == "acceleration"
                else "q and v of model.consistent(q, v)"
            )
            raise UsageError(Problem("linearize", what, hint))


def _found_state(
    model: CompiledModel,
    at: str | None,
    initial: Mapping[str, Any] | None,
    operating_point: OperatingPoint,
    *,
    any_kind: bool,
) -> tuple[State, OperatingPoint]:
    """Return the state that ``at`` specifies; by default an equilibrium, else the initial state."""
    if at not in (None, "equilibrium", "steady", "initial"):
        hint = '"equilibrium", "steady", "initial", or what model.equilibrium or model.steady_motion found'
        raise UsageError(Problem("linearize", f"at = {at!r} is unknown", hint))
    reason = ""
    start = initial_state(model, initial, operating_point.parameters)
    where = (initial, operating_point.parameters, operating_point.t, operating_point.u)
    driven = bool(np.any(law_rates(model, _of_scene(model, operating_point), start.q)))
    absolute = driven and bool(model.description.joints)
    turning = at is None and (absolute or (operating_point.base is None and _base_moves(model, operating_point)))
    if at == "steady" or turning:
        try:
            given = _zero_velocities(model, start.q, operating_point) if turning and not absolute else None
            return _state_found("steady motion", steady_motion(model, given, None, *where), operating_point)
        except NumericalError:
            if at == "steady":
                raise
    if at in (None, "equilibrium"):
        try:
            found = equilibrium(model, *where, any_kind=any_kind)
            if cautions := found.warnings(any_kind=any_kind):
                what = f"{model.name}: linear about an equilibrium in doubt: {'; '.join(cautions)}"
                warnings.warn(what, RuntimeWarning, stacklevel=5)
            return _state_found("equilibrium", found, operating_point)
        except (NumericalError, ModelError) as error:
            if at == "equilibrium":
                raise
            reason = error.problems[0].what
    q, v = start.q, start.v
    if model.multipliers:
        consistent = model.consistent(q, v, operating_point.t, parameters=operating_point.parameters)
        q, v = consistent.q, consistent.v
        if at is None and driven:
            what = f"linear about the initial state, which does not last: {reason}"
            warnings.warn(f'{what}; try: at="initial" if it is meant', RuntimeWarning, stacklevel=5)
    if reason and operating_point.u is not None and not (model.multipliers and driven):
        what = f"linear about the initial state, with the inputs that are given: {reason}"
        warnings.warn(f'{what}; try: at="initial" if it is meant', RuntimeWarning, stacklevel=5)
    return State("initial state", q, v, start.z), operating_point


def _state_found(what: str, found: EquilibriumState, operating_point: OperatingPoint) -> tuple[State, OperatingPoint]:
    """Return a state that was found, and the base as it was then; warn where its velocities turn."""
    if np.any(found.a):
        how = "its velocities turn in these coordinates, so the linear model holds at this instant only"
        hint = "a frame on a free joint that does not spin, with spins as joints of their own"
        warnings.warn(f"linear about a {what}: {how}; try: {hint}", RuntimeWarning, stacklevel=5)
    state = State(what, found.q, found.v, found.z, found.a, found.multipliers)
    return state, replace(
        operating_point, t=found.t, base=found.base if operating_point.base is None else operating_point.base
    )


def _base_moves(model: CompiledModel, operating_point: OperatingPoint) -> bool:
    return "base" in model.functions and bool(
        np.any(model.base(operating_point.t, parameters=operating_point.parameters)[7:])
    )


def _of_scene(model: CompiledModel, operating_point: OperatingPoint) -> MeasuresOfScene:
    """Return the scene at a time and parameters, its base held."""
    p, t = operating_point.parameters, operating_point.t
    return MeasuresOfScene(model, p, t, held_base(model, p, t))


def _zero_velocities(model: CompiledModel, q: Array, operating_point: OperatingPoint) -> dict[str, float]:
    """Return velocities of zero against the base, for all components but those that are driven."""
    driven = driven_components(model, _of_scene(model, operating_point), q)
    return {name: 0.0 for name in (name.removeprefix("v.") for name in model.v_names) if name not in driven}


def _measures(
    model: CompiledModel, state: State, a: Array, operating_point: OperatingPoint, independent: Sequence[str]
) -> tuple[Measures, Names]:
    """Return what neighbouring motions are measured by, and all names.

    Joints between absolute bodies measure them as joint coordinates would. Components of the bodies' velocities do
    where the caller makes one of them independent.
    """
    components, joints = [name.removeprefix("v.") for name in model.v_names], model.description.joints or model.factors
    of_joints = [name for factor in joints for name in component_names("", factor.name, factor.v_size)]
    absolute = bool(model.description.joints)
    by_joints = absolute and not (independent and all(name in components for name in independent))
    measured = of_joints if by_joints else components
    for name in independent:
        check_name("coordinate of a joint" if by_joints else "component", name, measured)
    names = _names(model, components, measured)
    if not by_joints:
        return Measures.components(model.factors, state.v, a), names
    blocks = model.evaluate("joint_velocities", state.q, state.v, a, z=state.z, **operating_point.given)
    of_state = {"P": "Pv", "Z": "Pq", "Av": "Pav", "Aq": "Paq"}
    shape = (len(measured), model.nv)
    partials = {name: blocks.get(block, np.zeros(shape)) for name, block in of_state.items()}
    return Measures(joints, blocks["joint_v"], blocks["joint_a"], **partials), names


def _names(model: CompiledModel, components: Sequence[str], measured: Sequence[str]) -> Names:
    description = model.description
    outputs = [
        name
        for item in model.library.layout["outputs"]
        for name in component_names("", str(item["name"]), int(item["size"]))
    ]
    return Names(
        tuple(components),
        tuple(measured),
        model.states,
        description.driven,
        description.disturbances,
        tuple(outputs),
        _units(model),
        _units_by_kind(model, measured == components),
    )


def _units(model: CompiledModel) -> dict[str, str]:
    """Return the units of inputs, disturbances, outputs, coordinates and velocities by their names."""
    units = {item.name: item.unit for item in model.description.inputs}
    for item in model.library.layout["outputs"]:
        units |= dict.fromkeys(component_names("", str(item["name"]), int(item["size"])), str(item["unit"]))
    for name, unit in zip(model.v_names, model.v_units, strict=True):
        units |= {name: unit, name.removeprefix("v."): unit.removesuffix("/s")}
    units |= {f"base.acceleration[{k}]": "m/s^2" for k in range(3)}
    return units | {f"base.angular_acceleration[{k}]": "rad/s^2" for k in range(3)}


def _units_by_kind(model: CompiledModel, by_components: bool) -> dict[str, tuple[str, ...]]:
    """Return the units of all signals of the linear model, by kind; empty where they are not known."""
    description = model.description
    velocities = model.v_units
    if not by_components:
        velocities = coordinate_units(description.joints, description.coordinates)[1]
    of_inputs = {item.name: item.unit for item in description.inputs}
    of_base = {name: "rad/s^2" if "angular" in name else "m/s^2" for name in description.base}
    layout = model.library.layout["outputs"]
    return {
        "measured": tuple(unit.removesuffix("/s") for unit in velocities),
        "velocities": tuple(velocities),
        "states": tuple(model.z_units),
        "inputs": tuple(of_inputs[name] for name in description.driven),
        "disturbances": tuple((of_inputs | of_base)[name] for name in description.disturbances),
        "outputs": tuple(str(item["unit"]) for item in layout for _ in range(int(item["size"]))),
    }


def _references(
    model: CompiledModel, reference: Reference, operating_point: OperatingPoint, measures: Measures
) -> dict[str, Array]:
    """Return what all signals are at the reference, by kind; not a number where that is not known.

    Components on groups have no value of their own, and the joints between absolute bodies are not evaluated.
    """
    description = model.description
    coordinates = np.full(len(measures.v), np.nan)
    if measures.factors is model.factors:
        for factor in model.factors:
            if factor.q_size == factor.v_size:
                coordinates[factor.v] = reference.q[factor.q]
    given = dict(zip(model.inputs, reference.u, strict=True))
    outputs = np.zeros(0)
    if "outputs" in model.functions:
        multipliers = {"multipliers": reference.multipliers} if len(reference.multipliers) else {}
        of_state = {"z": reference.z, **multipliers, **operating_point.given}
        outputs = next(iter(model.evaluate("outputs", reference.q, reference.v, reference.a, **of_state).values()))
    return {
        "measured": coordinates,
        "velocities": measures.v,
        "states": reference.z,
        "inputs": np.array([given[name] for name in description.driven]),
        "disturbances": np.array([given.get(name, np.nan) for name in description.disturbances]),
        "outputs": outputs,
    }


def _with_held(names: Names, sampled: SampledPart) -> Names:
    """Return names with the sampled states among the inputs, behind the others."""
    held, kept = list(sampled.places), sampled.others

    def moved(by_kind: Mapping[str, Any]) -> dict[str, Any]:
        states = by_kind["states"]
        return {
            **by_kind,
            "states": type(states)([states[k] for k in kept]) if isinstance(states, tuple) else states[kept],
            "inputs": (*by_kind["inputs"], *(states[k] for k in held))
            if isinstance(states, tuple)
            else np.append(by_kind["inputs"], states[held]),
        }

    return replace(
        names,
        states=tuple(names.states[k] for k in kept),
        inputs=(*names.inputs, *sampled.names),
        units={
            **names.units,
            **dict(zip(sampled.names, (names.units_by_kind["states"][k] for k in held), strict=True)),
        },
        units_by_kind=moved(names.units_by_kind),
        references=moved(names.references),
    )


def _orientations(model: CompiledModel, q: Array) -> dict[str, tuple[float, ...]]:
    """Return the coordinates of joints on groups by name."""
    return {factor.name: tuple(q[factor.q].tolist()) for factor in model.factors if factor.q_size != factor.v_size}


def _inputs(model: CompiledModel, operating_point: OperatingPoint) -> Array:
    values = {"t": np.asarray(operating_point.t), "p": operating_point.parameters}
    return model.evaluator.inputs(operating_point.u, values)
