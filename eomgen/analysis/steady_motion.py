"""Steady motions (relative equilibria), for example a top in steady precession, a governor, a wheel that circles.

A steady motion goes along a symmetry of the equations (``symmetries``): v = X(q) g and vdot = W v. Where these are
coordinates on which nothing depends, velocities are constant; turns of the whole scene and spins of symmetric bodies
are symmetries, too. So the search is one for roots of

    r(q, v, vdot, lam) = 0,  Phi = 0,  B v + Phi_t = 0,  its rate = 0,  zdot = 0,  and v as given

in q across the symmetries and in g (Meirovitch 1970, section 2.13; Marsden 1992, chapter 4). Where no symmetry is
found, constant velocities are tried: of single coordinates on which nothing depends, of those given, and of those that
the rows force to go with them. What is found is followed along the motion before it is called steady.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eomgen.analysis.definiteness import beams_beyond_linear_range, inertia_warning
from eomgen.analysis.equilibrium_warnings import Measures
from eomgen.analysis.sampled import check_continuous
from eomgen.analysis.steady_conditions import At, Conditions, named_values
from eomgen.analysis.symmetries import Fields, KnownSymmetries, constant
from eomgen.arrays import Array
from eomgen.compiled.arguments import number_of
from eomgen.compiled.initial_state import initial_state
from eomgen.compiled.terms import Inputs, Parameters
from eomgen.errors import ModelError, NumericalError, Problem
from eomgen.lie.product import update
from eomgen.system.terms import PURPOSES
from eomgen.text import distinct

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel

Mask = NDArray[np.bool_]
MAX_STEPS = 100
LARGEST_TURN = 0.5
#: States around the start that are tried where the search from there fails.
_RETRIES = 6
#: Values below this are none, each by its measure; round-off of large terms is allowed on top.
BALANCED = 1e-11
#: Fractions of a turn of the fastest component at which the motion is looked at again.
_LATER = (0.11, 0.37, 1.0, 2.6)
#: Part of the measure of accelerations that may appear along a steady motion.
_STEADY = 1e-7
#: Parts of a direction that are named.
_NAMED = 0.05
#: Singular values below this are zero.
_SAME = 1e-9
#: Rows that are named when they are not met.
_ROWS = 3


@dataclass(frozen=True)
class SteadyMotion:
    """A motion along which nothing that acts changes.

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
    a : (nv,) rates of v: zero, but for velocities that turn with the motion, as those of a wheel in its own axes
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
    a: Array = field(default_factory=lambda: np.zeros(0))

    def __repr__(self) -> str:
        return f"<SteadyMotion: {self.message}>"

    @property
    def initial(self) -> dict[str, Array]:
        """The state as ``simulate(initial=...)`` takes it."""
        return {"q": self.q, "v": self.v} | ({"z": self.z} if len(self.z) else {})


def steady_motion(
    model: CompiledModel,
    velocities: Mapping[str, float] | None = None,
    coordinates: Mapping[str, ArrayLike] | None = None,
    initial: Mapping[str, Any] | None = None,
    parameters: Parameters = None,
    t: float = 0.0,
    u: Inputs = None,
) -> SteadyMotion:
    """Return a steady motion near the initial state, with some velocities and coordinates given.

    Velocities that are not given are 0, but for those along symmetries, which are unknown and start from the initial
    state's, and for those that constraints force. Give as many values as leave the rest determined: of a top its spin
    and its inclination, of a wheel that rolls in a circle the same.

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
        The search did not end, or what it found does not last; names the component that accelerates and the rows not
        met.
    ModelError
        The inertia matrix is not positive definite where the search starts, or where it came to.
    """
    return motion_along(model, KnownSymmetries(), velocities, coordinates, initial, parameters, t, u)


def motion_along(
    model: CompiledModel,
    known: KnownSymmetries,
    velocities: Mapping[str, float] | None,
    coordinates: Mapping[str, ArrayLike] | None,
    initial: Mapping[str, Any] | None,
    parameters: Parameters,
    t: float,
    u: Inputs,
) -> SteadyMotion:
    """Return a steady motion as ``steady_motion`` does, with symmetries that are known from others at these parameters,
    time and inputs."""
    p = model.evaluator.one_set(parameters)
    able = model.having(PURPOSES["linearization"])
    check_continuous(able, "steady_motion")
    start = initial_state(able, initial, p)
    q, held_q, v, held_v = named_values(able, start.q, velocities, coordinates)
    conditions = _conditions(able, p, number_of("t", t), u, q, np.where(held_v, v, start.v))
    try:
        q = conditions.followed(q)
        given = _Given(held_q, held_v, v, conditions.ignorable(q, start.z))
        names = [able.v_names[k] for k in np.flatnonzero(given.alone)]
        found = _found(conditions, known.near(conditions, q, start.z), given, q, start.v, start.z)
        if not found.balanced:
            raise _failure(able, conditions, found, given, _hint(names, found.fields))
        _check_lasting(able, conditions, found, _hint(names, found.fields))
    except np.linalg.LinAlgError:
        raise _not_positive_definite(able, q, p) from None
    state = found.state
    able.check_left_out(state.q, state.v, conditions.t, p)
    undetermined = _undetermined(conditions, found, given)
    acceleration = float(np.max(np.abs(conditions.accelerations(*state.motion)), initial=0.0))
    message = f"steady after {found.steps} steps, unbalanced acceleration {acceleration:.3g}"
    if undetermined:
        message += f"; one more value could have been given, of {', '.join(undetermined[:6])}"
    return SteadyMotion(
        state.q,
        state.v,
        state.z,
        state.lam,
        conditions.t,
        acceleration,
        found.steps,
        tuple(names),
        tuple(undetermined),
        message,
        None,
        np.where(np.abs(state.a) > _STEADY * conditions.pace**2 * conditions.extents, state.a, 0.0),
    )


class _Given(NamedTuple):
    """Which components of q are held and which of v are given (nv,), the values of these, and which are ignorable."""

    held_q: Mask
    held_v: Mask
    v: Array
    alone: Mask


class _State(NamedTuple):
    q: Array
    v: Array
    a: Array
    z: Array
    lam: Array
    g: Array

    @property
    def motion(self) -> tuple[Array, Array, Array, Array, Array]:
        return self.q, self.v, self.a, self.z, self.lam


class _Search(NamedTuple):
    """Where a search for motions along some fields ended, after how many steps, and whether all conditions are met."""

    fields: Fields
    state: _State
    steps: int
    balanced: bool


def _conditions(model: CompiledModel, p: Array, t: float, u: Inputs, q: Array, v: Array) -> Conditions:
    """Return the conditions, measured by the scene's largest length and by the velocities given or a pendulum of that
    length."""
    measures = Measures(model, p, t, None)
    length = measures.length(q)
    extents = np.where([unit == "rad/s" for unit in model.v_units], 1.0, length)
    pace = max(float(np.max(np.abs(v) / extents, initial=0.0)), float(np.sqrt(measures.gravity() / length))) or 1.0
    return Conditions(model, p, t, u, extents, pace)


def _found(conditions: Conditions, fields: Fields, given: _Given, q: Array, v: Array, z: Array) -> _Search:
    """Search along symmetries, then with constant velocities; a failure is reported for the first of them that
    applies."""
    along = _search_around(conditions, fields, given, q, v, z) if len(fields) else None
    if along is not None and along.balanced:
        return along
    moving = given.alone | given.held_v
    components = np.flatnonzero(moving | _forced(conditions, moving, q))
    single = constant(conditions.model, components.tolist(), conditions.extents)
    found = _search_around(conditions, single, given, q, np.where(given.alone, v, 0.0), z)
    return found if found.balanced or along is None else along


def _forced(conditions: Conditions, moving: Mask, q: Array) -> Mask:
    """Return the components of v, (nv,), that the rows force to move where others do."""
    if not conditions.model.multipliers:
        return np.zeros_like(moving)
    B = conditions.jacobian(q) * conditions.extents
    if not np.all(np.isfinite(B)):
        return np.zeros_like(moving)
    answer = np.zeros((len(moving), int(np.sum(moving))))
    answer[~moving] = np.linalg.lstsq(B[:, ~moving], -B[:, moving], rcond=None)[0]
    sizes = np.max(np.abs(answer), axis=1, initial=0.0)
    result: Mask = sizes > _NAMED * np.max(sizes, initial=0.0)
    return result


def _search_around(conditions: Conditions, fields: Fields, given: _Given, q: Array, v: Array, z: Array) -> _Search:
    """Search from the start, and where that ends short of balance, from states around it."""
    rng = np.random.default_rng(2)
    first = found = _search(conditions, fields, given, _start(conditions, fields, given, q, v, z))
    for _ in range(_RETRIES):
        if found.balanced:
            return found
        eta = np.where(given.held_q, 0.0, conditions.around(rng.normal(0.0, 0.3, conditions.model.nv)))
        try:
            moved = _start(conditions, fields, given, update(conditions.model.factors, q, eta), v, z)
            found = _search(conditions, fields, given, moved)
        except np.linalg.LinAlgError:
            continue
    return found if found.balanced else first


def _start(conditions: Conditions, fields: Fields, given: _Given, q: Array, v: Array, z: Array) -> _State:
    """Return the motion along the fields at q that is nearest to velocities, those given before all others."""
    X = fields.directions(q) / conditions.extents[:, np.newaxis]
    wanted, held = np.where(given.held_v, given.v, v) / conditions.extents, given.held_v
    g = np.linalg.lstsq(X[held], wanted[held], rcond=_SAME)[0]
    left = _null_space(X[held])
    g = g + left @ np.linalg.lstsq(X[~held] @ left, (wanted - X @ g)[~held], rcond=_SAME)[0]
    return _at(conditions, fields, q, np.asarray(g), z)


def _null_space(matrix: Array) -> Array:
    """Return what a matrix takes to zero, one column each; its columns are of size one or less."""
    _, singular, Vt = np.linalg.svd(np.vstack([matrix, np.zeros((1, matrix.shape[1]))]))
    return np.asarray(Vt[int(np.sum(singular > _SAME)) :].T)


def _at(conditions: Conditions, fields: Fields, q: Array, g: Array, z: Array, lam: Array | None = None) -> _State:
    q = conditions.followed(q)
    v = fields.directions(q) @ g
    a = fields.along(g).W @ v
    return _State(q, v, a, z, conditions.multipliers(q, v, a, z) if lam is None else lam, g)


class _Linear(NamedTuple):
    """All conditions at a state by their measures, their rounding, and their partials in the unknowns.

    ``across`` (nv, n) are the increments of q that are unknown, ``by_eta`` (nv, nv) and ``by_g`` what they make of v.
    """

    values: Array
    rounding: Array
    J: Array
    across: Array
    by_eta: Array
    by_g: Array
    at: At


def _linear(conditions: Conditions, fields: Fields, given: _Given, state: _State) -> _Linear:
    """Return the conditions at a state. Raises numpy.linalg.LinAlgError where M is not positive definite."""
    conditions.root_of_mass(state.q)
    at = conditions.at(*state.motion)
    X, W = fields.directions(state.q), fields.along(state.g).W
    D = fields.slope(state.q, state.g)
    turns = np.column_stack([field.W @ state.v for field in fields.every]) if len(fields) else np.zeros_like(X)
    across = _across(at.M, X if fields.symmetric else np.eye(len(X))[:, given.alone], given.held_q)
    dv = np.hstack([D @ across, X])
    da = np.hstack([W @ D @ across, W @ X + turns])
    dq = np.hstack([across, np.zeros_like(X)])
    rows, nz = len(at.velocity), len(at.rates)
    holonomic = len(at.position)
    moved = [
        at.K @ dq + at.C @ dv + at.M @ da,
        at.B[:holonomic] @ dq,
        at.Z @ dq + at.B @ dv,
        at.Aq @ dq + at.Av @ dv + at.B @ da,
        at.Fq @ dq + at.Fv @ dv,
    ]
    by_z = [at.Rz, np.zeros((holonomic, nz)), np.zeros((2 * rows, nz)), at.Fz]
    by_lam = [at.B.T, np.zeros((holonomic + 2 * rows + nz, rows))]
    raw = np.hstack([np.concatenate(moved), np.concatenate(by_z), np.concatenate(by_lam)])
    values, rounding = conditions.measured(at, at.values)
    J, _ = conditions.measured(at, raw)
    of_given = np.flatnonzero(given.held_v)
    speed = conditions.pace * conditions.extents[of_given]
    short = (state.v - given.v)[of_given] / speed
    by_given = np.hstack([dv[of_given] / speed[:, np.newaxis], np.zeros((len(of_given), nz + rows))])
    return _Linear(
        np.concatenate([values, short]),
        np.concatenate([rounding, 0.0 * short]),
        np.concatenate([J, by_given]),
        across,
        D,
        X,
        at,
    )


def _across(M: Array, X: Array, held: Mask) -> Array:
    """Return increments of q, (nv, n), that leave what is held and go across the fields, in the sense of the
    inertias."""
    free = (np.eye(len(M)) / np.sqrt(np.diag(M)))[:, ~held]  # of unit kinetic energy each
    sizes = np.sqrt(np.einsum("ij,ik,kj->j", X, M, X))
    X = X[:, sizes > 0.0] / sizes[sizes > 0.0]
    along = X @ _null_space(np.sqrt(np.diag(M))[held, np.newaxis] * X[held])  # those that leave what is held
    return np.asarray(free @ _null_space((free.T @ M @ along).T))


def _search(conditions: Conditions, fields: Fields, given: _Given, state: _State) -> _Search:
    """Return where Gauss and Newton's steps of least size, halved until conditions are met better, lead."""
    steps, balanced = 0, False
    for steps in range(MAX_STEPS + 1):
        linear = _linear(conditions, fields, given, state)
        value, J = linear.values, linear.J
        balanced = bool(np.all(np.abs(value) <= BALANCED + linear.rounding))
        if not (np.all(np.isfinite(J)) and np.all(np.isfinite(value))) or steps == MAX_STEPS:
            balanced = balanced and bool(np.all(np.isfinite(value)))
            break
        scale = _weights(linear)
        change = -np.linalg.lstsq(J / scale, value, rcond=1e-11)[0] / scale
        increment = linear.across @ change[: linear.across.shape[1]]
        turn = float(np.max(np.abs(increment[conditions.turning]), initial=0.0))
        share = min(1.0, LARGEST_TURN / turn) if turn > 0.0 else 1.0
        for _ in range(1 if balanced else 30):
            moved = _moved(conditions, fields, linear, state, share * change)
            next_value = _values(conditions, given, linear.at, moved)
            enough = 0.5 if balanced else 1.0 - 0.1 * share
            if np.all(np.isfinite(next_value)) and np.linalg.norm(next_value) < enough * np.linalg.norm(value):
                break
            share *= 0.5
        else:
            break
        state = moved
    return _Search(fields, state, steps, balanced)


def _values(conditions: Conditions, given: _Given, at: At, state: _State) -> Array:
    """Return the conditions, by their measures at another state."""
    values, _ = conditions.measured(at, conditions.values(*state.motion))
    of_given = np.flatnonzero(given.held_v)
    return np.concatenate([values, (state.v - given.v)[of_given] / (conditions.pace * conditions.extents[of_given])])


def _weights(linear: _Linear) -> Array:
    """Return what makes unknowns comparable: coordinates and velocities by their kinetic energies, the rest by what
    they do."""
    M, moving = linear.at.M, linear.across.shape[1] + linear.by_g.shape[1]
    energies = [np.einsum("ij,ik,kj->j", part, M, part) for part in (linear.across, linear.by_g)]
    rest = np.linalg.norm(linear.J[:, moving:], axis=0)
    weights = np.concatenate([np.sqrt(np.concatenate(energies)), rest])
    return np.where(weights > 0.0, weights, 1.0)


def _moved(conditions: Conditions, fields: Fields, linear: _Linear, state: _State, change: Array) -> _State:
    ends = np.cumsum([linear.across.shape[1], len(fields), len(state.z)])
    by_q, dg, dz, _ = np.split(change, ends)
    return _at(
        conditions, fields, update(conditions.model.factors, state.q, linear.across @ by_q), state.g + dg, state.z + dz
    )


def _undetermined(conditions: Conditions, found: _Search, given: _Given) -> list[str]:
    """Return the names of the unknowns along which the conditions stay met."""
    model = conditions.model
    linear = _linear(conditions, found.fields, given, found.state)
    moving, coordinates = linear.across.shape[1] + len(found.fields), linear.across.shape[1]
    J, rest = linear.J[:, :moving], linear.J[:, moving:]
    if rest.shape[1]:  # multipliers follow, and internal states too
        J = J - rest @ np.linalg.lstsq(rest, J, rcond=None)[0]
    sizes = np.linalg.norm(J, axis=0)
    sizes = np.where(sizes > 0.0, sizes, 1.0)
    _, singular, Vt = np.linalg.svd(J / sizes)
    free = (Vt[int(np.sum(singular > 1e-7 * np.max(singular, initial=1e-300))) :] / sizes).T
    if not free.size:
        return []
    eta = linear.across @ free[:coordinates]
    dv = linear.by_eta @ eta + linear.by_g @ free[coordinates:]
    at = linear.at
    none = np.zeros((len(at.position), model.nv))
    by_q = np.concatenate([at.K, at.B[: len(at.position)], at.Z, at.Aq, at.Fq])
    by_v = np.concatenate([at.C, none, at.B, at.Av, at.Fv])
    effects = [np.linalg.norm(conditions.measured(at, columns)[0], axis=0)[:, np.newaxis] for columns in (by_q, by_v)]
    parts = np.abs(np.concatenate([effects[0] * eta, effects[1] * dv]))
    largest = np.max(parts, axis=0)
    parts = np.max(parts / np.where(largest > 0.0, largest, 1.0), axis=1)
    names = [*(name.removeprefix("v.") for name in model.v_names), *model.v_names]
    return [name for name, part in zip(names, parts, strict=True) if part > _NAMED]


def _check_lasting(model: CompiledModel, conditions: Conditions, found: _Search, hint: str) -> None:
    """Raise NumericalError where accelerations appear later along the motion found, beside what rounding leaves at its
    start, in directions that may turn with the motion."""
    state, extents = found.state, conditions.extents
    fastest = float(np.max(np.abs(state.v) / extents, initial=0.0))
    turn = 2.0 * np.pi / fastest if fastest > 0.0 else 1.0 / conditions.pace
    worst = np.zeros(model.nv)
    left = 2.0 * float(np.max(np.abs(conditions.accelerations(*state.motion)) / extents, initial=0.0))
    for share in _LATER:
        later = conditions.after(share * turn)
        moved = _at(later, found.fields, found.fields.after(state.q, state.g, share * turn), state.g, state.z)
        worst = np.maximum(worst, np.abs(later.accelerations(*moved.motion)))
    k = int(np.argmax(worst / extents)) if len(worst) else 0
    if len(worst) and not worst[k] <= (_STEADY * conditions.pace**2 + left) * extents[k]:
        what = (
            "forces balance at this instant only, for they change along the motion or with time: later"
            f" {model.v_names[k]} "
        )
        what += f"accelerates with {worst[k]:.3g} {_per_second(model, k)}"
        raise NumericalError(Problem("steady motion", what, hint))


def _failure(model: CompiledModel, conditions: Conditions, found: _Search, given: _Given, hint: str) -> NumericalError:
    """Return the unmet conditions: accelerating components, constraint equations, and given velocities."""
    state = found.state
    unbalanced = conditions.accelerations(*state.motion)
    if not np.all(np.isfinite(unbalanced)):
        what = "forces are not finite numbers where the search starts"
        return NumericalError(Problem("steady motion", what, "another initial state"))
    linear = _linear(conditions, found.fields, given, state)
    parts = []
    k = int(np.argmax(np.abs(unbalanced) / conditions.extents))
    if abs(linear.values[k]) > _STEADY or not len(linear.at.velocity):
        parts.append(f"{model.v_names[k]} still accelerates with {-unbalanced[k]:.4g} {_per_second(model, k)}")
    parts += _rows_not_met(model, linear)
    for component in np.flatnonzero(
        given.held_v & (np.abs(state.v - given.v) > _STEADY * conditions.pace * conditions.extents)
    ):
        unit = model.v_units[component]
        found_v, given_v = distinct(state.v[component], given.v[component])
        parts.append(f"{model.v_names[component]} is {found_v} {unit} and not {given_v} {unit} as given")
    what = f"no steady motion was found in {found.steps} steps: {', '.join(parts)}"
    return NumericalError(Problem("steady motion", what, f"other values, an initial state nearer to it, or {hint}"))


def _rows_not_met(model: CompiledModel, linear: _Linear) -> list[str]:
    """Return a clause on the constraint equations with the largest violations."""
    at = linear.at
    sets = [("", at.position, "m or rad"), ("the rate of ", at.velocity, "m/s or rad/s")]
    sets.append(("the acceleration of ", at.acceleration, "m/s^2 or rad/s^2"))
    start, clauses = model.nv, []
    for level, values, unit in sets:
        measured = np.abs(linear.values[start : start + len(values)])
        start += len(values)
        clauses += [
            (size, f"{level}{name} is off by {value:.4g} {unit}")
            for size, name, value in zip(measured, model.multipliers, values, strict=False)
            if size > _STEADY
        ]
    return [text for _, text in sorted(clauses, key=lambda item: -item[0])[:_ROWS]]


def _not_positive_definite(model: CompiledModel, q: Array, p: Array) -> ModelError:
    start = inertia_warning(model, q, p, where="where the search starts")
    if start is not None and beams_beyond_linear_range(model, q, p):
        return ModelError(Problem("steady motion", start.what, start.hint))
    what = "the inertia matrix is singular where the search came to"
    hint = "an initial state nearer to the motion, or masses and inertias that bodies can have"
    return ModelError(Problem("steady motion", what, hint))


def _per_second(model: CompiledModel, k: int) -> str:
    return model.v_units[k].replace("/s", "/s^2")


def _hint(ignorable: Sequence[str], fields: Fields) -> str:
    if ignorable:
        return f"velocities of coordinates on which nothing depends: {', '.join(ignorable[:8])}"
    if fields.symmetric and len(fields):
        many = "a symmetry" if len(fields) == 1 else f"{len(fields)} symmetries"
        return f"velocities that go together as {many} of the scene let{'s' * (len(fields) == 1)} them"
    return "rest: in this scene forces depend on all coordinates, so none can move steadily"
