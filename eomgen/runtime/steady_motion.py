"""Steady motions: velocities stay what they are and accelerations are zero, as of a top in steady precession, or of a governor.

Coordinates on which nothing depends (ignorable ones) may move steadily; all others rest, and so the search is one for roots of

    r(q, v, a = 0, lam) = 0,  Phi = 0,  B v + Phi_t = 0,  B a + g = 0 at a = 0,  zdot = 0

in the coordinates that are not ignorable and the velocities of those that are (Meirovitch 1970, section 2.13). What is found is
followed along the motion before it is called steady.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eomgen.errors import ModelError, NumericalError, Problem, UsageError
from eomgen.lie.product import update
from eomgen.runtime.indefinite import beyond_order, indefinite_mass
from eomgen.runtime.initial import initial_state
from eomgen.runtime.linearize import terms_needed
from eomgen.runtime.run_settings import number_of
from eomgen.runtime.steady_conditions import Conditions, Unknowns, named_values
from eomgen.runtime.terms import Inputs, Parameters

if TYPE_CHECKING:
    from eomgen.runtime.model import Model

Array = NDArray[np.float64]
MAX_STEPS = 100
LARGEST_TURN = 0.5
#: States around the start that are tried where the search from there fails.
_RETRIES = 6
#: Unbalanced accelerations below this are none, m/s^2 or rad/s^2; round-off of large terms is allowed on top.
BALANCED = 1e-10
#: Fractions of a turn of the fastest component at which the motion is looked at again.
_LATER = (0.11, 0.37, 1.0, 2.6)
#: Part of the accelerations at arbitrary states that may appear along a steady motion.
_STEADY = 1e-7


@dataclass(frozen=True)
class SteadyMotion:
    """A motion with constant velocities.

    Attributes
    ----------
    q, v, z : (nq,), (nv,), (nz,); ``initial`` is what ``simulate(initial=...)`` takes
    multipliers : (rows,)
    t : time of inputs and of the base, s
    acceleration : largest unbalanced acceleration, m/s^2 or rad/s^2
    iterations : steps taken
    ignorable : names of the components of v on whose coordinates nothing depends
    undetermined : names of unknowns of which one more could have been given a value
    base : None, the base moves as the scene says
    message : all of this in one sentence
    """

    q: Array
    v: Array
    z: Array
    multipliers: Array
    t: float
    acceleration: float
    iterations: int
    ignorable: Sequence[str]
    undetermined: Sequence[str]
    message: str
    base: Array | None = None

    @property
    def initial(self) -> dict[str, Array]:
        """The state as ``simulate(initial=...)`` takes it."""
        return {"q": self.q, "v": self.v} | ({"z": self.z} if len(self.z) else {})


def steady_motion(
    model: Model,
    velocities: Mapping[str, float] | None = None,
    coordinates: Mapping[str, ArrayLike] | None = None,
    initial: Mapping[str, Any] | None = None,
    parameters: Parameters = None,
    t: float = 0.0,
    u: Inputs = None,
) -> SteadyMotion:
    """Return a steady motion near the initial state, with some velocities and coordinates given.

    Velocities that are not given are 0, but for ignorable coordinates, whose velocities are unknown and start from the initial
    state's. Give as many values as leave the rest determined: of a top its spin and its inclination, for instance.

    Parameters
    ----------
    velocities : mapping from component of v (``spin``, ``ball[2]``) to rad/s or m/s
    coordinates : mapping from component (``nutation``, ``slide[1]``) to rad or m, or from joint to all its numbers in q
    initial : mapping
        As of ``simulate``: where the search starts.
    parameters, t, u : as of the model's functions

    Raises
    ------
    UsageError
        Names that there are not, values of a wrong kind.
    NumericalError
        The search did not end, or what it found does not last; names the component that accelerates.
    ModelError
        The inertia matrix is not positive definite where the search starts, or where it came to.
    """
    p = model.parameter_array(parameters)
    if p.ndim != 1:
        raise UsageError(Problem("parameters", f"one set of parameters is needed, not a batch of shape {p.shape}"))
    able = model.having(terms_needed(model))
    start = initial_state(able, initial, p)
    q, held_q, v, held_v = named_values(able, start.q, velocities, coordinates)
    conditions = Conditions(able, p, number_of("t", t), u)
    try:
        ignorable, typical = conditions.ignorable(q, start.z)
        v = np.where(ignorable & ~held_v, start.v, v)
        dv = np.flatnonzero(ignorable & ~held_v)
        unknowns = Unknowns(np.flatnonzero(~ignorable & ~held_q), dv, able.nz, len(able.multipliers))
        names = [able.v_names[k] for k in np.flatnonzero(ignorable)]
        state, steps, balanced = _search_around(conditions, unknowns, _at(conditions, q, v, start.z))
        if not balanced:
            raise _failure(able, conditions, state, steps, names)
        _check_lasting(able, conditions, state, typical, names)
    except np.linalg.LinAlgError:
        raise _indefinite(able, q, p) from None
    able._check_left_out(state.q, state.v, conditions.t, p)
    undetermined = _undetermined(able, conditions, unknowns, state)
    acceleration = float(np.max(np.abs(conditions.accelerations(*state)), initial=0.0))
    message = f"steady after {steps} steps, unbalanced acceleration {acceleration:.3g}"
    if undetermined:
        message += f"; one more value could have been given, of {', '.join(undetermined[:6])}"
    return SteadyMotion(
        state.q, state.v, state.z, state.lam, conditions.t, acceleration, steps, tuple(names), tuple(undetermined), message
    )  # fmt: skip


class _State(NamedTuple):
    q: Array
    v: Array
    z: Array
    lam: Array


def _search_around(conditions: Conditions, unknowns: Unknowns, start: _State) -> tuple[_State, int, bool]:
    """Search from the start, and where that ends short of balance, from states around it."""
    rng = np.random.default_rng(2)
    first = found = _search(conditions, unknowns, start)
    for _ in range(_RETRIES):
        if found[2]:
            return found
        eta = np.zeros(conditions.model.nv)
        eta[unknowns.eta] = rng.normal(0.0, 0.3, len(unknowns.eta))
        q = update(conditions.model.factors, start.q, conditions.around(eta))
        try:
            moved = _at(conditions, q, start.v, start.z)
            found = _search(conditions, unknowns, moved)
        except np.linalg.LinAlgError:
            continue
    return found if found[2] else first


def _search(conditions: Conditions, unknowns: Unknowns, state: _State) -> tuple[_State, int, bool]:
    """Return where Gauss and Newton's steps of least size, halved until conditions are met better, lead; steps; success."""
    steps = 0
    for steps in range(MAX_STEPS + 1):
        L = conditions.root_of_mass(state.q)
        value = conditions.values(*state, L)
        floor = BALANCED + 64.0 * float(np.finfo(float).eps) * conditions.size(*state, L)
        balanced = bool(np.max(np.abs(value), initial=0.0) <= floor)
        J = conditions.jacobian(*state, unknowns)
        if not (np.all(np.isfinite(J)) and np.all(np.isfinite(value))) or steps == MAX_STEPS:
            break
        scale = _weights(J, L, unknowns)
        change = -np.linalg.lstsq(J / scale, value, rcond=1e-11)[0] / scale
        turn = float(np.max(np.abs(unknowns.turns(change, conditions.turning)), initial=0.0))
        share = min(1.0, LARGEST_TURN / turn) if turn > 0.0 else 1.0
        for _ in range(30):
            moved = _moved(conditions, unknowns, state, share * change)
            next_value = conditions.values(*moved, L)
            if np.all(np.isfinite(next_value)) and np.linalg.norm(next_value) < (1.0 - 0.1 * share) * np.linalg.norm(value):
                break
            share *= 0.5
        else:
            break
        state = moved
    return state, steps, balanced


def _weights(J: Array, L: Array, unknowns: Unknowns) -> Array:
    """Return what makes unknowns comparable: coordinates and velocities by their kinetic energies, the rest by what they do."""
    inertia = np.sqrt(np.sum(L * L, axis=1))
    rest = np.linalg.norm(J[:, len(unknowns.eta) + len(unknowns.dv) :], axis=0)
    weights: Array = np.concatenate([inertia[unknowns.eta], inertia[unknowns.dv], np.where(rest > 0.0, rest, 1.0)])
    return weights


def _moved(conditions: Conditions, unknowns: Unknowns, state: _State, change: Array) -> _State:
    eta, dv, dz, _ = unknowns.split(change, len(state.v))
    return _at(conditions, update(conditions.model.factors, state.q, eta), state.v + dv, state.z + dz)


def _at(conditions: Conditions, q: Array, v: Array, z: Array) -> _State:
    q = conditions.model._terms.followed(q, conditions.t, conditions.parameters)
    return _State(q, v, z, conditions.multipliers(q, v, z, conditions.root_of_mass(q)))


def _undetermined(model: Model, conditions: Conditions, unknowns: Unknowns, state: _State) -> list[str]:
    """Return the names of the unknowns along which the conditions stay met."""
    J = conditions.jacobian(*state, unknowns)
    moving = J[:, : len(unknowns.eta) + len(unknowns.dv)]  # multipliers follow, and internal states too
    rest = J[:, moving.shape[1] :]
    if rest.shape[1]:
        moving = moving - rest @ np.linalg.lstsq(rest, moving, rcond=None)[0]
    sizes = np.linalg.norm(moving, axis=0)
    scaled = moving / np.where(sizes > 0.0, sizes, 1.0)
    _, singular, Vt = np.linalg.svd(scaled)
    free = Vt[int(np.sum(singular > 1e-7 * np.max(singular, initial=1e-300))) :]
    parts = np.max(np.abs(free), axis=0, initial=0.0)
    names = [*(model.v_names[k].removeprefix("v.") for k in unknowns.eta), *(model.v_names[k] for k in unknowns.dv)]
    return [name for name, part in zip(names, parts, strict=True) if part > 0.05]


def _check_lasting(model: Model, conditions: Conditions, state: _State, typical: float, ignorable: Sequence[str]) -> None:
    """Raise NumericalError where accelerations appear later along a motion with the velocities found."""
    fastest = float(np.max(np.abs(state.v), initial=0.0))
    turn = 2.0 * np.pi / fastest if fastest > 0.0 else 1.0
    worst = np.zeros(model.nv)
    for share in _LATER:
        later = conditions.after(share * turn)
        q = update(model.factors, state.q, share * turn * state.v)
        unbalanced = later.accelerations(q, state.v, state.z, state.lam)
        worst = np.maximum(worst, np.abs(unbalanced))
    k = int(np.argmax(worst)) if len(worst) else 0
    if len(worst) and not worst[k] <= _STEADY * (typical + 1.0):
        what = f"forces balance at this instant only, for they change along the motion or with time: later {model.v_names[k]} "
        what += f"accelerates with {worst[k]:.3g} {_per_second(model, k)}"
        raise NumericalError(Problem("steady motion", what, _hint(ignorable)))


def _failure(model: Model, conditions: Conditions, state: _State, steps: int, ignorable: Sequence[str]) -> NumericalError:
    unbalanced = conditions.accelerations(*state)
    if not np.all(np.isfinite(unbalanced)):
        what = "forces are not finite numbers where the search starts"
        return NumericalError(Problem("steady motion", what, "another initial state"))
    k = int(np.argmax(np.abs(unbalanced)))
    what = f"no steady motion was found in {steps} steps: {model.v_names[k]} still accelerates with "
    what += f"{-unbalanced[k]:.4g} {_per_second(model, k)}"
    return NumericalError(Problem("steady motion", what, f"other values, an initial state nearer to it, or {_hint(ignorable)}"))


def _indefinite(model: Model, q: Array, p: Array) -> ModelError:
    start = indefinite_mass(model, q, p, where="where the search starts")
    if start is not None and beyond_order(model, q, p):
        return ModelError(Problem("steady motion", start.what, start.hint))
    what = "the inertia matrix is singular where the search came to"
    hint = "an initial state nearer to the motion, or masses and inertias that bodies can have"
    return ModelError(Problem("steady motion", what, hint))


def _per_second(model: Model, k: int) -> str:
    return model.v_units[k].replace("/s", "/s^2")


def _hint(ignorable: Sequence[str]) -> str:
    if not ignorable:
        return "rest: in this scene forces depend on all coordinates, so none can move steadily"
    return f"velocities of coordinates on which nothing depends: {', '.join(ignorable[:8])}"
