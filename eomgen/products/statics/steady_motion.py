"""Steady motions (relative equilibria), for example a top in steady precession, a governor, a wheel that circles; their
arguments, velocities and coordinates by name, checked against drives.

A steady motion goes along a symmetry of the equations (``symmetries``): v = X(q) g and vdot = W v. For cyclic
coordinates, velocities are constant; rotations of the whole scene and spins of symmetric bodies
are symmetries, too. So the search is one for roots of

    r(q, v, vdot, lam) = 0,  Phi = 0,  B v + Phi_t = 0,  its rate = 0,  zdot = 0,  and v as given

in q across the symmetries and in g (Meirovitch 1970, section 2.13; Marsden 1992, chapter 4). If no symmetry is
found, constant velocities are tried: of single cyclic coordinates, of given ones, and of coordinates that
the rows force to go with them. The result is followed along the motion before it is called steady.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, field
from eomgen.base.messages import distinct, shown
from eomgen.base.rounding import COMPUTED
from eomgen.base.threads import one_thread_of_algebra
from eomgen.compiled.arguments import check_finite, check_name, components, number_of, numbers
from eomgen.compiled.initial_state import initial_state
from eomgen.compiled.rest.driven_rest import driven_components, held_base, where_driven
from eomgen.compiled.rest.sparse_partials import check_continuous
from eomgen.compiled.rest.state_warnings import SceneMeasures, beams_beyond_linear_range, inertia_warning, off_axis_hint
from eomgen.compiled.terms import Inputs, Parameters
from eomgen.errors import ModelError, NumericalError, Problem, UsageError
from eomgen.products.statics.steady_conditions import Conditions
from eomgen.products.statics.steady_search import (
    Linear,
    PrescribedComponents,
    SteadySearch,
    linear_conditions,
    motion_at,
    search,
)
from eomgen.products.statics.symmetries import Fields, KnownSymmetries
from eomgen.system.terms import PURPOSES

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel


Mask = NDArray[np.bool_]


def named_values(
    model: CompiledModel, q: Array, velocities: Mapping[str, float] | None, coordinates: Mapping[str, ArrayLike] | None
) -> tuple[Array, Mask, Array, Mask]:
    """Return prescribed coordinates and velocities, read by name: q with these coordinates, the mask (nv,) of the held
    coordinates, v (nv,), and the mask (nv,) of its prescribed components.

    Parameters
    ----------
    model : CompiledModel
        Gives the names.
    q : (nq,) ndarray
        Configuration for all other coordinates.
    velocities, coordinates : mapping or None
        Values by name, SI units.

    Raises
    ------
    UsageError
        Unknown names, components of a rotation, values that are not finite numbers or not as many as are needed.
    """
    q, v = q.copy(), np.zeros(model.nv)
    held_q, held_v = np.zeros(model.nv, dtype=bool), np.zeros(model.nv, dtype=bool)
    names = [name.removeprefix("v.") for name in model.v_names]
    for quantity, values_by_name in (("velocities", velocities), ("coordinates", coordinates)):
        if values_by_name is not None and not isinstance(values_by_name, Mapping):
            fault = f"a mapping is needed, not {type(values_by_name).__name__} [E0090]"
            raise UsageError(Problem(quantity, fault, f'{quantity}={{"{names[0]}": 2.0}}'))
    for name, value in (velocities or {}).items():
        if str(name).startswith("q."):
            fault = f"{shown(str(name))} is a position, and a velocity is given here [E0091]"
            raise UsageError(Problem("velocities", fault, f'coordinates={{"{str(name)[2:]}": ...}}'))
        check_name("component", str(name).removeprefix("v."), names)
        k = names.index(name.removeprefix("v."))
        v[k], held_v[k] = _number(f"velocity {name}", value), True
    joints = {factor.name: factor for factor in model.factors}
    single = {
        label: (factor.q_start + k, factor.v_start + k)
        for factor in model.factors
        if factor.group == "R"
        for k, label in enumerate(names[factor.v])
    }
    for name, numbers_of in (coordinates or {}).items():
        if name in single:
            index, component = single[name]
            q[index], held_q[component] = _number(f"coordinate {name}", numbers_of), True
            continue
        check_name("coordinate or joint", name, [*single, *(joint for joint in joints if joint not in single)])
        factor = joints[name]
        q[factor.q] = components(f"coordinates {name}", numbers_of, factor.q_size)
        held_q[factor.v] = True
    check_finite("coordinates", q, model.q_names)
    q = model.evaluator.configuration(q)
    return q, held_q, v, held_v


def check_drives(model: CompiledModel, driven: Mapping[str, float], v: Array) -> None:
    """Raise UsageError if a given velocity, (nv,), differs from the rate of a drive of the same component."""
    for name, value, unit in zip(model.v_names, v.tolist(), model.v_units, strict=True):
        rate = driven.get(name.removeprefix("v."), value)
        if abs(rate - value) > STEADY * max(abs(rate), abs(value)):
            law_rate, given_rate = distinct(rate, value)
            fault = f"it is driven at {law_rate} {unit}, and {given_rate} {unit} is given [E0092]"
            hint = 'a tunable parameter in the law, drive = "w*t", and the value as that parameter\'s; or no drive'
            raise UsageError(Problem(f"velocity {name.removeprefix('v.')}", fault, hint))


def _number(name: str, value: ArrayLike) -> float:
    array = numbers(name, value)
    if array.ndim:
        raise UsageError(Problem(name, f"one number is needed, not an array of shape {array.shape} [E0093]"))
    check_finite(name, array)
    return float(array)


#: Fractions of a turn of the fastest component at which the motion is looked at again.
LATER = (0.11, 0.37, 1.0, 2.6)
#: Part of the measure of accelerations, of a velocity or of a displacement that is tolerated.
STEADY = 1e-7


@dataclass(frozen=True)
class SteadyMotion:
    """A motion along which no force changes.

    Attributes
    ----------
    q, v, z : (nq,), (nv,), (nz,); ``initial`` is the argument of ``simulate(initial=...)``
    multipliers : (rows,)
    t : time of inputs and of the base, s
    acceleration : largest unbalanced acceleration, m/s^2 or rad/s^2
    iterations : steps taken
    ignorable : names of the components of v with cyclic coordinates
    undetermined : names of unknowns of which one more could have been given a value
    base : None, the base moves as the scene says
    message : all of this in one sentence
    a : (nv,) rates of v: zero, except velocities that turn with the motion, such as velocities of a wheel in wheel axes
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
        """The state in the form of ``simulate(initial=...)``."""
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

    Velocities that are not given are 0, with three exceptions: unknown velocities along symmetries, which start from
    the initial state; velocities forced by constraints; and velocities of drives, given by the laws. Give as many
    values as determine the motion: for a top the spin and the inclination, and the same for a wheel that rolls in a
    circle.

    Parameters
    ----------
    velocities : mapping, optional
        Components of v (``spin``, ``ball[2]``) in rad/s or m/s, by name.
    coordinates : mapping, optional
        Components (``nutation``, ``slide[1]``) in rad or m by name, or all components of q of a joint.
    initial : mapping
        As of ``simulate``: the start of the search.
    parameters, u : mapping or array_like, optional
        Tunable parameters (np,) and inputs (nu,), SI units; values of the scene if not given.
    t : float, optional
        Time of inputs, base and formulas, s.

    Returns
    -------
    SteadyMotion
        State ``q`` (nq,), ``v`` and ``a`` (nv,) and ``z`` (nz,) at t, with ``multipliers`` and ``message``.

    Raises
    ------
    UsageError
        Unknown names, values of a wrong kind, another velocity than a drive's.
    NumericalError
        The search did not end, or the motion does not last; the message names the accelerating component and the
        violated rows.
    ModelError
        The inertia matrix is not positive definite at the start or the end of the search.

    Examples
    --------
    >>> top = eomgen.SceneBuilder("spinning_top").body("yoke", 0).body("ring", 0)
    >>> top = top.body("top", 1.3, center_of_mass=[0, 0, 0.25], inertia=[0.04, 0.04, 0.03])
    >>> top = top.joint("precession", "revolute", "base", "yoke", axis=[0, 0, 1])
    >>> top = top.joint("nutation", "revolute", "yoke", "ring", axis=[1, 0, 0], initial={"position": 0.5})
    >>> top = top.joint("spin", "revolute", "ring", "top", axis=[0, 0, 1])
    >>> steady = eomgen.build(top.build()).steady_motion({"spin": 80.0}, {"nutation": 0.6})
    >>> steady.v.round(4)                              # of precession, nutation and spin, rad/s
    array([ 1.389,  0.   , 80.   ])
    """
    with one_thread_of_algebra(model.nv):
        return motion_along(model, KnownSymmetries(), velocities, coordinates, initial, parameters, t, u)


def motion_along(
    model: CompiledModel,
    known_symmetries: KnownSymmetries,
    velocities: Mapping[str, float] | None,
    coordinates: Mapping[str, ArrayLike] | None,
    initial: Mapping[str, Any] | None,
    parameters: Parameters,
    t: float,
    u: Inputs,
) -> SteadyMotion:
    """Return a steady motion, as ``steady_motion`` does, from symmetries that earlier searches at the same parameters,
    time and inputs have found.

    Parameters
    ----------
    model, known_symmetries : CompiledModel, KnownSymmetries
        The model, and the memory of symmetries.
    velocities, coordinates : mapping or None
        Prescribed values by name, SI units.
    initial : mapping or None
        Initial state in the form of ``simulate``, from which the search begins.
    parameters, t, u : mapping or (np,) array_like, float, and (nu,) array_like or None
        Parameters, time (s) and inputs.
    """
    p = model.evaluator.one_set(parameters)
    able = model.having(PURPOSES["linearization"])
    check_continuous(able, "steady_motion")
    start, time = initial_state(able, initial, p), number_of("t", t)
    measures = SceneMeasures(able, p, time, held_base(able, p, time))
    driven = driven_components(able, measures, start.q)
    if velocities is None or isinstance(velocities, Mapping):
        named = {str(name).removeprefix("v."): value for name, value in (velocities or {}).items()}
        velocities = {**driven, **named}
    first = where_driven(able, measures, start.q) if driven and time else start.q
    q, held_q, v, held_v = named_values(able, first, velocities, coordinates)
    check_drives(able, driven, v)
    conditions = _conditions(able, p, time, u, q, np.where(held_v, v, start.v))
    try:
        q = conditions.followed(q)
        targets = PrescribedComponents(held_q, held_v, v, conditions.ignorable(q, start.z))
        names = [able.v_names[k] for k in np.flatnonzero(targets.alone)]
        result = search(conditions, known_symmetries.near(conditions, q, start.z), targets, q, start.v, start.z)
        if not result.balanced:
            raise _failure(conditions, result, targets)
        _check_lasting(conditions, result, measures, targets)
    except np.linalg.LinAlgError:
        raise _not_positive_definite(able, q, p) from None
    state = result.state
    able.check_left_out(state.q, state.v, conditions.t, p)
    undetermined = tuple(_undetermined(conditions, result, targets))
    acceleration = float(np.max(np.abs(conditions.accelerations(*state.motion))))
    message = f"steady after {result.steps} steps, unbalanced acceleration {acceleration:.3g}"
    if undetermined:
        message += f"; one more value could have been given, of {', '.join(undetermined[:6])}"
    pace, extents = conditions.pace, conditions.extents
    v = np.where(np.abs(state.v) > COMPUTED * pace * extents, state.v, 0.0)
    a = np.where(np.abs(state.a) > STEADY * pace**2 * extents, state.a, 0.0)
    said = (acceleration, result.steps, tuple(names), undetermined, message)
    return SteadyMotion(state.q, v, state.z, state.lam, conditions.t, *said, None, a)


def _conditions(model: CompiledModel, p: Array, t: float, u: Inputs, q: Array, v: Array) -> Conditions:
    """Return the conditions of a steady motion; displacements are measured by the scene's largest length at q,
    velocities by v (nv,) or by a pendulum of that length."""
    measures = SceneMeasures(model, p, t, None)
    length = measures.length(q)
    extents = np.where([unit == "rad/s" for unit in model.v_units], 1.0, length)
    pace = max(float(np.max(np.abs(v) / extents)), float(np.sqrt(measures.gravity() / length))) or 1.0
    return Conditions(model, p, t, u, extents, pace)


def _undetermined(conditions: Conditions, search: SteadySearch, targets: PrescribedComponents) -> list[str]:
    """Return the names of coordinates and velocities along which all conditions stay satisfied, so that one more could
    be given; empty for an isolated motion."""
    model = conditions.model
    linear = linear_conditions(conditions, search.fields, targets, search.state)
    moving, coordinates = linear.across.shape[1] + len(search.fields), linear.across.shape[1]
    J, rest = linear.J[:, :moving], linear.J[:, moving:]
    if rest.shape[1]:  # multipliers follow, and internal states too
        J = J - rest @ np.linalg.lstsq(rest, J, rcond=None)[0]
    sizes = np.linalg.norm(J, axis=0)
    sizes = np.where(sizes > 0.0, sizes, 1.0)
    _, singular, Vt = np.linalg.svd(J / sizes)
    free = (Vt[int(np.sum(singular > STEADY * singular[:1])) :] / sizes).T
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
    return [name for name, part in zip(names, parts, strict=True) if part > 0.05]


def _check_lasting(
    conditions: Conditions, search: SteadySearch, measures: SceneMeasures, targets: PrescribedComponents
) -> None:
    """Raise NumericalError if the motion found is not steady: accelerations appear later along it. Permitted are
    rounding errors and, in every component, twice the largest acceleration left at the start, whose direction may turn
    with the motion."""
    model, state, extents = conditions.model, search.state, conditions.extents
    fastest = float(np.max(np.abs(state.v) / extents))
    turn = 2.0 * np.pi / fastest if fastest > COMPUTED * conditions.pace else 1.0 / conditions.pace
    at, worst = conditions.at(*state.motion), np.zeros(model.nv)
    rounding = conditions.measured(at, at.values)[1][: model.nv] * conditions.pace**2 * extents
    left = 2.0 * float(np.max(np.abs(conditions.accelerations(*state.motion)) / extents))
    for share in LATER:
        later = conditions.after(share * turn)
        moved = motion_at(later, search.fields, search.fields.after(state.q, state.g, share * turn), state.g, state.z)
        worst = np.maximum(worst, np.abs(later.accelerations(*moved.motion)))
    k = int(np.argmax((worst - rounding) / extents))
    if not worst[k] <= (STEADY * conditions.pace**2 + left) * extents[k] + rounding[k]:
        fault = f"forces balance at this instant only: later {_accelerates(model, k, worst[k])} [E0094]"
        hint = off_axis_hint(model, measures, state.q, state.v) or _hint(model, targets, search.fields)
        raise NumericalError(Problem("steady motion", fault, hint))


def _failure(conditions: Conditions, search: SteadySearch, targets: PrescribedComponents) -> NumericalError:
    """Return the error of a search that failed: accelerating components, constraint equations and given velocities that
    are not met, with a hint."""
    model, state = conditions.model, search.state
    unbalanced = conditions.accelerations(*state.motion)
    if not np.all(np.isfinite(unbalanced)):
        fault = "forces are not finite numbers at the start of the search [E0096]"
        return NumericalError(Problem("steady motion", fault, "another initial state"))
    linear = linear_conditions(conditions, search.fields, targets, state)
    parts, hint = [], _hint(model, targets, search.fields)
    k = int(np.argmax(np.abs(unbalanced) / conditions.extents))
    if abs(linear.values[k]) > STEADY or not len(linear.at.velocity):
        parts.append(_accelerates(model, k, -unbalanced[k]))
        hint = f"{model.v_names[k]} left out, for a force acts along it" if targets.held_v[k] else hint
    parts += _rows_not_met(model, linear)
    missed = targets.held_v & (np.abs(state.v - targets.v) > STEADY * conditions.pace * conditions.extents)
    for component in np.flatnonzero(missed):
        unit = model.v_units[component]
        found_v, given_v = distinct(state.v[component], targets.v[component])
        parts.append(f"{model.v_names[component]} is {found_v} {unit} and not {given_v} {unit} as given")
    fault = f"no steady motion was found in {search.steps} steps: {', '.join(parts)} [E0095]"
    return NumericalError(Problem("steady motion", fault, f"other values, an initial state nearer to it, or {hint}"))


def _rows_not_met(model: CompiledModel, linear: Linear) -> list[str]:
    """Return a clause on each constraint equation that is violated, at level of position, velocity or acceleration; at
    most three, the largest first."""
    at, names = linear.at, model.multipliers
    units = ["rad" if unit in ("1", "1/s") else unit.removesuffix("/s") for unit in model.library.layout["row_units"]]
    rows = [(f"{name} is off by", unit) for name, unit in zip(names[: len(at.position)], units, strict=False)]
    for level, per in (("the rate of ", "/s"), ("the acceleration of ", "/s^2")):
        rows += [(f"{level}{name} is off by", unit + per) for name, unit in zip(names, units, strict=True)]
    values = np.concatenate([at.position, at.velocity, at.acceleration]).tolist()
    sizes = np.abs(linear.values[model.nv : model.nv + len(rows)])
    worst = [k for k in np.argsort(-sizes, kind="stable")[:3] if sizes[k] > STEADY]
    return [f"{rows[k][0]} {values[k]:.4g} {rows[k][1]}" for k in worst]


def _not_positive_definite(model: CompiledModel, q: Array, p: Array) -> ModelError:
    start = inertia_warning(model, q, p, where="at the start of the search")
    if start is not None and beams_beyond_linear_range(model, q, p):
        return ModelError(Problem("steady motion", start.text, start.hint))
    fault = "the inertia matrix is singular at the end of the search [E0097]"
    hint = "an initial state nearer to the motion, or masses and inertias that bodies can have"
    return ModelError(Problem("steady motion", fault, hint))


def _accelerates(model: CompiledModel, k: int, acceleration: float) -> str:
    return f"{model.v_names[k]} accelerates with {acceleration:.3g} {model.v_units[k].replace('/s', '/s^2')}"


def _hint(model: CompiledModel, targets: PrescribedComponents, fields: Fields) -> str:
    if np.any(targets.alone):
        several = ", ".join([model.v_names[k] for k in np.flatnonzero(targets.alone & ~targets.held_v)][:8])
        return f"velocities of coordinates on which nothing depends: {several}" if several else "fewer given values"
    if fields.symmetric and len(fields):
        many = "a symmetry" if len(fields) == 1 else f"{len(fields)} symmetries"
        return f"velocities that go together as {many} of the scene let{'s' * (len(fields) == 1)} them"
    return "rest: in this scene forces depend on all coordinates, so none can move steadily"
