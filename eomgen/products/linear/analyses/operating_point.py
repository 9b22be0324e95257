"""The state that a linear model is about: the caller's, an equilibrium, a steady motion, or the initial state; rest of
exact beams on a base that turns evenly, by sparse load steps with centrifugal and gyroscopic forces.

On a base that turns, all velocities are relative to the base, so this is rest with one more load. No inertia matrix is
inverted, which rotary inertias far below the bending stiffness would make useless.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, replace
from eomgen.base.rounding import COMPUTED, WRITTEN
from eomgen.compiled.arguments import check_finite, components
from eomgen.compiled.initial_state import InitialState, initial_state
from eomgen.compiled.rest.driven_rest import driven_components, held_base, law_rates
from eomgen.compiled.rest.equilibrium import Equilibrium, equilibrium, solved_equilibrium
from eomgen.compiled.rest.loaded_statics import loaded_statics
from eomgen.compiled.rest.state_warnings import SceneMeasures
from eomgen.compiled.terms import Inputs
from eomgen.errors import ModelError, NumericalError, Problem, UsageError
from eomgen.products.statics.steady_motion import LATER, STEADY, SteadyMotion, motion_along
from eomgen.products.statics.symmetries import KnownSymmetries
from eomgen.solvers.bordered_newton import LoadedState
from eomgen.solvers.equilibrium_path import PathEndError, StepLimits
from eomgen.solvers.load_steps import by_load_steps
from eomgen.solvers.tangent_stiffness import compliance

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel


#: Largest load steps: all loads at once if few and small corrections suffice.
_STEPS = StepLimits(factor=1.0)
#: Slice of a base's state: angular velocity.
_TURNING = slice(7, 10)


def rest_on_base(model: CompiledModel, q: Array, z: Array, p: Array, t: float, u: Inputs) -> SteadyMotion:
    """Return the state of rest relative to an evenly turning base, found by load steps from q and z.

    Parameters
    ----------
    model : CompiledModel
        A model on a base that turns at a constant rate.
    q, z : (nq,) and (nz,) ndarray
        Configuration and internal states from which load steps begin.
    p : (np,) ndarray
        Parameters.
    t, u : float and (nu,) array_like or None
        Time, s, and inputs.

    Raises
    ------
    NumericalError
        Load steps do not lead to rest, the stiffness is singular, or forces change as the base turns; the message names
        the component.
    """
    base = model.base(t, parameters=p)
    still = np.zeros(model.nv)
    statics = loaded_statics(model, SceneMeasures(model, p, t, base), q, u, still)
    start = LoadedState(q, np.zeros(len(model.multipliers)), z, 1.0)
    try:
        rest, path, _ = by_load_steps(statics, start, _STEPS)
    except PathEndError as end:
        fault = f"no rest was found on the base, which turns: load steps end, for {end.why} [E0072]"
        hint = "an initial state nearer to it, or more elements"
        raise NumericalError(Problem("steady motion", fault, hint)) from None
    tangents = statics.tangents(rest)
    flexible = compliance(tangents.K, tangents.B)
    if flexible is None:
        fault = "nothing holds the scene on its base, for its stiffness is singular [E0071]"
        raise NumericalError(Problem("steady motion", fault, "steady_motion with velocities"))
    rate = float(np.linalg.norm(base[_TURNING]))
    now = statics.balance(rest).residual
    later = t + np.array(LATER) * 2.0 * np.pi / rate
    where: dict[str, Any] = {"t": later, "parameters": p, "base": model.base(later, parameters=p), "u": u, "z": rest.z}
    q = np.tile(rest.q, (len(later), 1))
    (residuals,) = model.evaluate("residual", q, still, still, multipliers=rest.multipliers, **where).values()
    moved = np.abs(flexible((residuals - now).T).T) / statics.sizes
    row, k = np.unravel_index(int(np.argmax(moved)), moved.shape)
    if moved[row, k] > STEADY:
        name, by = model.v_names[k].removeprefix("v."), f"{moved[row, k]:.3g} of a rad or of the scene's length"
        fault = f"forces change as the base turns: at t = {later[row]:.6g} s they would move {name} by {by} [E0073]"
        hint = "gravity along the axis of the base, or none, and loads that turn with the base; or simulate"
        raise NumericalError(Problem("steady motion", fault, hint))
    message = f"at rest on the base, which turns at {rate:.6g} rad/s, after {len(path) - 1} load steps"
    return SteadyMotion(rest.q, still, rest.z, rest.multipliers, t, 0.0, len(path) - 1, (), (), message, None, still)


#: The result of ``model.equilibrium`` or ``model.steady_motion``.
EquilibriumState = Equilibrium | SteadyMotion


@dataclass(frozen=True)
class OperatingPoint:
    """Conditions of a linear model besides the state: time in s, parameters (np,), inputs, and the state of a base
    (19,). Inputs of None are the scene's; a base of None moves as the scene says."""

    t: float
    parameters: Array
    u: Inputs
    base: Array | None

    @property
    def keywords(self) -> dict[str, Any]:
        """Keywords of the model's functions."""
        return {"t": self.t, "parameters": self.parameters, "u": self.u, "base": self.base}


@dataclass(frozen=True)
class OperatingState:
    """A state to linearise about: q (nq,), v (nv,), z (nz,), with the kind in words and the operating point.
    Accelerations (nv,) and multipliers (rows,) are None if the dynamics determine them."""

    kind: str
    point: OperatingPoint
    q: Array
    v: Array
    z: Array
    a: Array | None = None
    multipliers: Array | None = None


def given_state(model: CompiledModel, state: Mapping[str, Any], point: OperatingPoint) -> OperatingState:
    """Return the caller's state as vectors: ``q``, and optionally ``v``, ``a``, ``z`` and ``multipliers`` of a mapping.
    v is zero if it is not given, a and multipliers are None. Raises UsageError for a batch of states, wrong sizes or
    values that are not finite."""
    sizes = {"q": model.nq, "v": model.nv, "a": model.nv, "multipliers": len(model.multipliers)}
    parts: dict[str, Array] = {}
    for name, size in sizes.items():
        if state.get(name) is None:
            continue
        whole = model.evaluator.with_references(name, state[name]) if name == "q" else state[name]
        parts[name] = components(name, whole, size)
        if parts[name].ndim != 1:
            fault = f"one state is needed, not a batch of shape {parts[name].shape} [E0074]"
            raise UsageError(Problem(name, fault, "one call for each state; nothing is compiled again"))
        check_finite(name, parts[name])
    parts["q"] = model.evaluator.configuration(parts["q"])
    z = model.evaluator.internal(state.get("z"))
    v = parts.get("v", np.zeros(model.nv))
    return OperatingState("given state", point, parts["q"], v, z, parts.get("a"), parts.get("multipliers"))


def check_constraints(model: CompiledModel, state: OperatingState) -> None:
    """Raise UsageError if a state violates the constraints at position or velocity level by more than 1e-6.
    Accelerations, if given, are compared with the second derivative of the constraints, too."""
    model.check_left_out(state.q, state.v, state.point.t, state.point.parameters)
    if not model.multipliers:
        return
    keywords = state.point.keywords
    at_velocity = next(iter(model.evaluate("constraint_velocity", state.q, state.v, **keywords).values()))
    rows = [("rate", at_velocity)]
    if model.functions.sizes["holonomic"]:
        at_position = next(iter(model.evaluate("constraint", state.q, **keywords).values()))
        rows.insert(0, ("position", at_position))
    if state.a is not None:
        (B,) = model.evaluate("constraint_jacobian", state.q, **keywords).values()
        (g,) = model.evaluate("constraint_bias", state.q, state.v, **keywords).values()
        rows.append(("acceleration", B @ state.a + g))
    for level, values in rows:
        worst = int(np.argmax(np.abs(values)))
        if not abs(values[worst]) <= WRITTEN:
            name, off = model.multipliers[worst], values[worst]
            fault = f"the state does not meet the constraints: {name} is off by {off:.3g} in its {level} [E0075]"
            hint = "no a, for the acceleration of the motion"
            hint = hint if level == "acceleration" else "q and v of model.consistent(q, v)"
            raise UsageError(Problem("linearize", fault, hint))


def found_state(
    model: CompiledModel,
    at: str | None,
    initial: Mapping[str, Any] | None,
    point: OperatingPoint,
    *,
    any_kind: bool,
    asked: CompiledModel | None = None,
) -> OperatingState:
    """Return the state that ``at`` specifies; by default an equilibrium, else the initial state.

    Warns if the equilibrium is in doubt, or if the initial state is taken although an equilibrium was sought. Raises
    the errors of the search if ``at`` names the kind of state.

    Parameters
    ----------
    model : CompiledModel
        The model to make linear.
    at : {"equilibrium", "steady", "initial"} or None
        Kind of state.
    initial : mapping or None
        Initial state in the form of ``simulate``.
    point : OperatingPoint
        Time, parameters, inputs and base.
    any_kind : bool
        Whether an unstable equilibrium is accepted.
    asked : CompiledModel, optional
        A model of the same scene with which the equilibrium may have been solved before.
    """
    if at is not None and (not isinstance(at, str) or at not in ("equilibrium", "steady", "initial")):
        hint = '"equilibrium", "steady", "initial", or the result of model.equilibrium or model.steady_motion'
        raise UsageError(Problem("linearize", f"at = {at!r} is unknown [E0076]", hint))
    start = initial_state(model, initial, point.parameters)
    driven = bool(np.any(law_rates(model, _scene_measures(model, point), start.q)))
    if moving := _steady_state(model, at, initial, point, start, driven=driven):
        return moving
    reason = ""
    if at in (None, "equilibrium"):
        where = (initial, point.parameters, point.t, point.u)
        try:
            result = None
            if initial is None and point.u is None:
                result = solved_equilibrium([model, asked or model], *where[1:3], any_kind=any_kind)
            result = result or equilibrium(model, *where, any_kind=any_kind)
            if cautions := result.warnings(any_kind=any_kind):
                sentence = f"{model.name}: linear about an equilibrium in doubt: {'; '.join(cautions)} [W0009]"
                warnings.warn(sentence, RuntimeWarning, stacklevel=4)
            return as_found("equilibrium", result, point)
        except (NumericalError, ModelError) as error:
            if at == "equilibrium":
                raise
            reason = error.problems[0].what
    q, v, hint = start.q, start.v, 'at="initial" if it is meant'
    if model.multipliers:
        consistent = model.consistent(q, v, point.t, parameters=point.parameters)
        q, v = consistent.q, consistent.v
        if at is None and driven:
            sentence = f"linear about the initial state, which does not last: {reason}; try: {hint} [W0008]"
            warnings.warn(sentence, RuntimeWarning, stacklevel=4)
    if reason and point.u is not None and not (model.multipliers and driven):
        sentence = f"linear about the initial state, with the inputs that are given: {reason}; try: {hint} [W0007]"
        warnings.warn(sentence, RuntimeWarning, stacklevel=4)
    return OperatingState("initial state", point, q, v, start.z)


def _steady_state(
    model: CompiledModel,
    at: str | None,
    initial: Mapping[str, Any] | None,
    point: OperatingPoint,
    start: InitialState,
    *,
    driven: bool,
) -> OperatingState | None:
    """Return the steady motion that ``at`` asks for, or by default the steady motion of driven joints or a moving base.
    None if another state is meant; also, with a warning, if a base turns evenly and there is no steady motion. `start`
    is the initial state, `driven` whether laws of time move coordinates. Raises NumericalError if ``at`` is ``steady``
    and no steady motion is found."""
    p, t, u = point.parameters, point.t, point.u
    absolute = driven and bool(model.description.joints)
    base = _base_of_scene(model, point)
    turning = at is None and (absolute or bool(np.any(base[7:])))
    rate = float(np.linalg.norm(base[_TURNING]))
    evenly = turning and not driven and float(np.linalg.norm(base[13:16])) <= COMPUTED * rate**2 and rate > 0.0
    unsteady = ""
    if evenly and model.description.exact_beams:
        try:
            rest = rest_on_base(model, start.q, start.z, p, t, u)
            return as_found("steady motion", rest, point, stacklevel=5)
        except NumericalError as error:
            unsteady, turning = error.problems[0].what, False
    if at == "steady" or turning:
        at_rest = [_zero_velocities(model, start.q, point)] if turning and not absolute else []
        known = KnownSymmetries()
        for velocities in (*at_rest, None):  # without given velocities, rounding of symmetries does not matter
            try:
                motion = motion_along(model, known, velocities, None, initial, p, t, u)
                return as_found("steady motion", motion, point, stacklevel=5)
            except NumericalError as error:
                if at == "steady":
                    raise
                unsteady = unsteady or error.problems[0].what
    if evenly:
        sentence = "linear about an equilibrium with the base held, which turns, for there is no steady motion"
        text = f'{sentence}: {unsteady}; try: at="equilibrium" if it is meant [W0011]'
        warnings.warn(text, RuntimeWarning, stacklevel=5)
    return None


def as_found(kind: str, rest: EquilibriumState, point: OperatingPoint, *, stacklevel: int = 4) -> OperatingState:
    """Return the result of a search as an operating state at the same time and base; warn if velocities change
    direction with the motion. An equilibrium with drives that move is a steady motion.

    Parameters
    ----------
    kind : str
        Kind of state, in words.
    rest : EquilibriumState
        Result of the search.
    point : OperatingPoint
        Conditions of the search.
    stacklevel : int, optional
        Stack level of the warning.
    """
    kind = "steady motion" if np.any(np.abs(rest.v) > COMPUTED) else kind
    if np.any(rest.a):
        how = "its velocities turn in these coordinates, so the linear model holds at this instant only"
        hint = "a frame on a free joint that does not spin, with spins as joints of their own"
        warnings.warn(f"linear about a {kind}: {how}; try: {hint} [W0012]", RuntimeWarning, stacklevel=stacklevel)
    there = replace(point, t=rest.t, base=rest.base if point.base is None else point.base)
    return OperatingState(kind, there, rest.q, rest.v, rest.z, rest.a, rest.multipliers)


def _scene_measures(model: CompiledModel, point: OperatingPoint) -> SceneMeasures:
    """Return the scene at a time and parameters, with the base held."""
    p, t = point.parameters, point.t
    return SceneMeasures(model, p, t, held_base(model, p, t))


def _base_of_scene(model: CompiledModel, point: OperatingPoint) -> Array:
    """Return the state (19,) of a base that moves as the scene says; zeros for other bases."""
    moves = point.base is None and "base" in model.functions
    return model.base(point.t, parameters=point.parameters) if moves else np.zeros(19)


def _zero_velocities(model: CompiledModel, q: Array, point: OperatingPoint) -> dict[str, float]:
    """Return velocities of zero against the base, for all components except driven ones."""
    driven = driven_components(model, _scene_measures(model, point), q)
    return {name: 0.0 for name in (name.removeprefix("v.") for name in model.v_names) if name not in driven}
