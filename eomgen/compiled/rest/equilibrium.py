"""Static equilibrium of a compiled model: position, stability, and undetermined coordinates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, replace
from eomgen.base.messages import first_of
from eomgen.base.rounding import WRITTEN
from eomgen.base.threads import one_thread_of_algebra
from eomgen.compiled.arguments import number_of
from eomgen.compiled.initial_state import angles_of_several_turns, initial_state
from eomgen.compiled.rest.driven_rest import check_lasting, check_rates, driven_velocity, drives, held_base
from eomgen.compiled.rest.loaded_statics import check_partials, loaded_statics
from eomgen.compiled.rest.sparse_partials import SparsePartials, check_continuous, soft_modes, sparse_partials
from eomgen.compiled.rest.state_warnings import SceneMeasures, equilibrium_notes
from eomgen.compiled.terms import Inputs, Parameters
from eomgen.errors import Message, ModelError, NumericalError, Problem
from eomgen.formula.features import rough_operations
from eomgen.lie.product import difference
from eomgen.solvers.blocks import SOFT
from eomgen.solvers.bordered_newton import LoadedState, LoadedStatics, Matrix, whole
from eomgen.solvers.equilibrium_path import PathEndError, StepLimits
from eomgen.solvers.equilibrium_search import left_at_start, nearest_rest
from eomgen.solvers.load_steps import by_load_steps
from eomgen.solvers.statics import (
    LargestForces,
    Search,
    SearchPoint,
    Statics,
    examine,
    onto_constraints,
    polish,
)
from eomgen.solvers.tangent_stiffness import TangentStiffness

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel

_TO_STAY = "any_kind=True (--any-kind) finds the nearest of any kind"
_ELSEWHERE = "it is not where a damped motion"
#: Name of the last equilibrium in the results that are kept with a library.
_KEPT = "equilibrium"
#: Largest load steps.
_STEPS = StepLimits(factor=0.5)


@dataclass(frozen=True)
class Equilibrium:
    """A state of equilibrium, relative to coordinates driven at a constant rate.

    Attributes
    ----------
    q, v, z : (nq,), (nv,), (nz,); ``initial`` is for ``simulate(initial=...)``; v is zero but for driven coordinates
    multipliers : (rows,) constraint forces are -B^T multipliers
    t : time of inputs and of the base, s
    residual : largest unbalanced generalized force
    acceleration : largest acceleration with which the system would start to move, m/s^2 or rad/s^2
    iterations : steps taken
    frequencies : (free,) angular frequencies of small motions without damping, rad/s, increasing; for an unstable
        direction minus the rate of growth; for driven systems by stiffness alone, without gyroscopic forces, which
        ``linearize`` includes
    stable : False if a direction is unstable; None if internal states, follower forces or gyroscopic forces decide
    undetermined : components of v without restoring force
    message : all of this in one sentence
    base : (19,) state of the base, held in its pose at t; None for a base that is the world
    notes : doubts: that a damped motion settles elsewhere, springs and tyres that are inside out, long ways
    """

    q: Array
    v: Array
    z: Array
    multipliers: Array
    t: float
    residual: float
    acceleration: float
    iterations: int
    frequencies: Array
    stable: bool | None
    undetermined: Sequence[str]
    message: str
    base: Array | None = None
    notes: Sequence[str] = ()

    def __repr__(self) -> str:
        return f"<Equilibrium: {self.message}>"

    @property
    def initial(self) -> dict[str, Array]:
        """The state in the form of ``simulate(initial=...)``."""
        return {"q": self.q, "v": self.v} | ({"z": self.z} if len(self.z) else {})

    @property
    def a(self) -> Array:
        """(nv,) zeros."""
        return np.zeros(len(self.v))

    def warnings(self, *, any_kind: bool) -> list[str]:
        """Return the notes that are warnings; if an unstable equilibrium was asked for, without the note on a damped
        motion.

        Parameters
        ----------
        any_kind : bool
            Whether an unstable equilibrium was asked for.

        Returns
        -------
        list of str
            One sentence for each.
        """
        return [note for note in self.notes if not (any_kind and note.startswith(_ELSEWHERE))]


def equilibrium(
    model: CompiledModel,
    initial: Mapping[str, Any] | None = None,
    parameters: Parameters = None,
    t: float = 0.0,
    u: Inputs = None,
    *,
    any_kind: bool = False,
) -> Equilibrium:
    """Return the nearest state of rest, with the base held in the pose at t.

    A coordinate driven at a constant rate keeps this rate, and the other coordinates are at rest relative to the drive:
    a governor's arm on the turning shaft. A law whose rate at t is zero is held.

    Without ``any_kind`` that is the end of a heavily damped motion from the initial state: a stable equilibrium, also
    from an unstable one. With ``any_kind``, the result is the nearest of all equilibria found, with distances measured
    by the kinetic energy of a motion in unit time: candidates are the end of the damped motion, and the ends of
    Newton's paths from the initial state and from slow points of the damped motion. If no damped motion settles,
    Newton's equilibrium is returned. ``notes`` say if the result differs from the end of the damped motion, and name
    springs and tyres that are inside out at rest, and ways that are longer than the scene. Dampers and regularised
    friction do not act at rest.

    Parameters
    ----------
    initial : mapping
        As of ``simulate``; velocities do not matter.
    parameters, u : mapping or array_like, optional
        Tunable parameters (np,) and inputs (nu,), SI units; values of the scene if not given.
    t : float, optional
        Time of inputs, base and formulas, s.
    any_kind : bool
        Whether an unstable equilibrium will do.

    Returns
    -------
    Equilibrium
        State ``q`` (nq,), ``v``, ``z``, ``multipliers``, with ``stable``, ``message`` and ``notes``.

    Raises
    ------
    NumericalError
        Forces that cannot balance, a search without end, or forces that are not finite; names the coordinates. The rate
        of a drive changes, or forces change with a driven coordinate, named in the message.
    ModelError
        The inertia matrix is not positive definite; rows that were left out at the default parameters do not follow at
        these.
    UsageError
        The model was built without the terms that are needed, or arguments cannot be taken.

    Examples
    --------
    >>> model = eomgen.build("examples/quarter_car/scene.toml")
    >>> model.equilibrium(t=5.0, u={"road": 0.01}).q.round(4)
    array([0.01, 0.01])
    """
    check_continuous(model, "equilibrium")
    check_partials(model, "equilibrium")
    time = number_of("t", t)
    p = model.evaluator.one_set(parameters)
    start = initial_state(model, initial, p)
    measures = SceneMeasures(model, p, time, held_base(model, p, time))
    with one_thread_of_algebra(model.nv):
        statics = _statics(model, measures, start.q, u, np.zeros(model.nv))
        try:
            first = examine(statics, start.q, start.z)
            driven = driven_velocity(model, measures, first.q)
            if np.any(driven):
                assembled = onto_constraints(statics, first)
                driven = driven_velocity(model, measures, assembled.q)
                check_rates(model, measures, assembled.q, driven)
                statics = _statics(model, measures, start.q, u, driven)
                first = examine(statics, start.q, start.z)
        except np.linalg.LinAlgError:
            fault = "the inertia matrix at the initial state is not positive definite [E0051]"
            raise ModelError(Problem("equilibrium", fault, "masses and inertias that bodies can have")) from None
        if not first.finite:
            raise _not_finite(model, first)
        assembled = onto_constraints(statics, first)
        loaded = loaded_statics(model, measures, assembled.q, u, driven)
        stepped: Search | str = ""
        left_along: Array | None = None
        if model.description.exact_beams:
            stepped, left_along = _by_load_steps(loaded, statics, assembled, stable=not any_kind)
        if isinstance(stepped, Search):
            damped, chosen = stepped, stepped
        else:
            damped, rest = nearest_rest(statics, start.q, start.z, any_kind=any_kind)
            if rest is None:
                stepped = stepped or _by_load_steps(loaded, statics, assembled, stable=False)[0]
                if isinstance(stepped, str):
                    raise _failure(model, statics, damped, stepped, start.v if np.any(driven) else None)
                rest = stepped
            chosen = rest
        if np.any(driven):
            check_lasting(model, measures, u, chosen.point.q, driven, chosen.point.z)
        deviations = model.check_left_out(chosen.point.q, driven, time, p)
        notes = [*angles_of_several_turns(model, initial), *deviations, *_elsewhere(model, statics, chosen, damped)]
        if not any_kind and chosen is damped and chosen is not stepped and left_at_start(statics, start.z, damped):
            notes.append(_instability_note(model, statics, damped))
        notes += equilibrium_notes(measures, chosen.path, u)
        if left_along is not None:
            notes.append(_branches(model, statics, left_along))
        stiffness = _stiffness(statics, loaded, chosen.point)
        result = _result(model, loaded, stiffness, chosen, driven, measures, notes)
        if initial is None and u is None:
            model.library.kept[_KEPT] = (p.tobytes(), time, any_kind), _copy(result)
        return result


def solved_equilibrium(
    models: Sequence[CompiledModel], parameters: Array, t: float, *, any_kind: bool
) -> Equilibrium | None:
    """Return a copy of the equilibrium that one of a scene's models solved last, from the scene's initial state.

    None if its parameters, time or kind were others, or none was solved.

    Parameters
    ----------
    parameters : (np,) of the equilibrium
    t, any_kind : as of ``equilibrium``
    """
    for model in models:
        conditions, result = model.library.kept.get(_KEPT, (None, None))
        if conditions == (parameters.tobytes(), t, any_kind):
            return _copy(result)
    return None


def _copy(result: Equilibrium) -> Equilibrium:
    """Return an equilibrium with arrays of its own, since callers may change the arrays of theirs."""
    arrays: dict[str, Any] = {name: value for name, value in vars(result).items() if isinstance(value, np.ndarray)}
    return replace(result, **{name: array.copy() for name, array in arrays.items()})


def _by_load_steps(
    loaded: LoadedStatics, statics: Statics, start: SearchPoint, *, stable: bool
) -> tuple[Search | str, Array | None]:
    """Return a search that found rest by load steps, or the reason for its failure as text, and a displacement or None.
    The displacement, (nv,), leads away from an unstable rest on the way. ``start`` is the assembled state; ``stable``
    asks for a stable rest."""
    try:
        rest, path, left_along = by_load_steps(
            loaded, LoadedState(start.q, start.lam, start.z, 1.0), _STEPS, stable=stable
        )
        search = Search(polish(statics, examine(statics, rest.q, rest.z)), True, len(path) - 1, path)
    except PathEndError as end:
        part = end.point.rest.s if end.point else 0.0
        return f"load steps from the start end at {100.0 * part:.3g} % of the loads, for {end.why}", None
    except np.linalg.LinAlgError:
        return "load steps from the start end where the inertia matrix is not positive definite", None
    largest = LargestForces(max(statics.weight, start.force), np.abs(start.rates))
    if not (search.point.finite and largest.balances(search.point)):
        return "load steps from the start leave forces unbalanced", None
    return search, left_along


def _skew(model: CompiledModel, loaded: LoadedStatics, point: SearchPoint) -> bool:
    """Return whether the stiffness at a state is not symmetric, as of forces that follow the motion. Stiffness alone
    does not decide stability then."""
    skew = point.stiffness_blocks.skew > 1e-6 * point.largest_stiffness
    if skew or not model.description.exact_beams:
        return skew
    return not TangentStiffness.at(
        loaded, LoadedState(point.q, point.lam, point.z, 1.0)
    ).symmetric  # loads in addition to stretch


def _not_by_stiffness(model: CompiledModel, loaded: LoadedStatics, point: SearchPoint, v: Array, against: int) -> str:
    """Return the reason for which stiffness alone does not decide stability, as text; empty if it does. v are the
    driven velocities, ``against`` the number of directions of negative stiffness."""
    if any(map(np.any, point.couplings[1:])):
        return "internal states take part"
    if _skew(model, loaded, point):
        return "forces or moments that follow the motion, or moments about fixed axes, have no potential"
    # in an even number of directions (Chetaev 1961)
    if np.any(v) and against and against % 2 == 0:
        return "gyroscopic forces may stabilise directions of negative stiffness"
    return ""


def _stiffness(statics: Statics, loaded: LoadedStatics, point: SearchPoint) -> tuple[Array, Array]:
    """Return squared frequencies by stiffness alone, (rad/s)^2, increasing, exactly 0 without restoring force, and the
    directions, (nv, m), of the first m, which are not positive."""
    largest = point.largest_stiffness
    limit = max(1e2 * SOFT * largest, _no_stiffness(statics))
    values, vectors = point.stiffness_blocks.symmetric.lowest(limit)
    if point.stiffness_blocks.skew > 1e-6 * largest:  # without a potential the symmetric part has no frequencies
        squares, ways = np.linalg.eig(point.stiffness)
        order = np.argsort(squares.real)
        values, vectors = squares.real[order], ways.real[:, order[squares.real[order] <= limit]]
    directions = np.asarray(point.basis @ vectors)
    soft = np.abs(values[: vectors.shape[1]]) <= limit
    rest, mass = LoadedState(point.q, point.lam, point.z, 1.0), statics.mass(point.q)
    values[: len(soft)][soft], directions[:, soft] = soft_modes(loaded, rest, mass, directions[:, soft], largest)
    order = np.argsort(values[: len(soft)], kind="stable")
    directions = directions[:, order[values[order] <= 0.0]]
    return np.sort(values), directions


def _branches(model: CompiledModel, statics: Statics, left_along: Array) -> str:
    """Return the warning that rest was found past a bifurcation; names the side of the coordinate that moved most.
    ``left_along``, (nv,), is the displacement away from the unstable rest."""
    shares = left_along / statics.sizes
    k = int(np.flatnonzero(np.abs(shares) >= (1.0 - WRITTEN) * np.max(np.abs(shares)))[0])
    sides = ("positive", "negative") if shares[k] > 0.0 else ("negative", "positive")
    name = model.v_names[k].removeprefix("v.")
    return (
        f"past a bifurcation or limit point, past which load steps lead to rest that is unstable: this is the stable"
        f" rest on the {sides[0]} side of {name}, others may be on its {sides[1]} side (initial near them, or"
        " equilibrium_path(...).branch) [W0003]"
    )


def _elsewhere(model: CompiledModel, statics: Statics, chosen: Search, damped: Search) -> list[str]:
    """Return a note, in a list, if a damped motion from the start settles elsewhere than at the ``chosen`` rest, or not
    at all. Empty if ``damped`` is the chosen search, or both ends agree."""
    if chosen is damped:
        return []
    if not damped.balanced:
        return [
            "whether a motion from the start comes to rest here is not known, for a damped one was not seen to settle"
        ]
    off = difference(statics.factors, chosen.point.q, damped.point.q)
    k = int(np.argmax(np.abs(off) / statics.sizes)) if len(off) else 0
    if not len(off) or abs(off[k]) <= WRITTEN * statics.sizes[k]:
        return []
    unit = model.v_units[k].removesuffix("/s")
    where = f"{off[k]:.4g} {unit} from here along {model.v_names[k].removeprefix('v.')}"
    return [f"{_ELSEWHERE} from the start settles, which is {where}"]


def _instability_note(model: CompiledModel, statics: Statics, damped: Search) -> str:
    """Return the warning that the start is an equilibrium left by a damped motion, with the distance of the rest."""
    off = difference(statics.factors, damped.path[0], damped.point.q)
    k = int(np.argmax(np.abs(off) / statics.sizes))
    away = f"{abs(off[k]):.4g} {model.v_units[k].removesuffix('/s')} away along {model.v_names[k].removeprefix('v.')}"
    where = "at the start, or next to it, is an equilibrium"
    return f"{where}, which a damped motion leaves for this one, {away}; {_TO_STAY} [W0002]"


def _statics(model: CompiledModel, measures: SceneMeasures, q: Array, u: Inputs, v: Array) -> Statics:
    """Return the functions of a model at rest relative to coordinates moving with v, for the search of an equilibrium.
    The base is held in place; lengths are relative to the largest length of the scene and of the configuration q; ``u``
    are the inputs. Large models give sparse matrices."""
    rest, rows, p = np.zeros(model.nv), len(model.multipliers), measures.p
    forces: dict[str, Any] = {"t": measures.t, "parameters": p, "base": measures.base, "u": u}
    holonomic = model.functions.sizes["holonomic"]
    terms = model.evaluator.at(**forces)
    still, z0 = {"v": v, "a": rest, "lam": np.zeros(rows)}, model.evaluator.internal(None)

    def value(term: str, q: Array, **more: Array) -> Array:
        return terms(term, q=q, **{"z": z0, **still, **more})[0]

    entire = "partials" in model.functions  # else the nonzeros of large scenes are there

    last: list[tuple[bytes, SparsePartials]] = []  # a point asks for the mass, the stiffness and the couplings

    def nonzeros(q: Array, lam: Array, z: Array) -> SparsePartials:
        key = b"".join(part.tobytes() for part in (q, lam, z))
        if not last or last[0][0] != key:
            partials = sparse_partials(model, q, v, rest, z, lam, forces, of_velocities=model.nz > 0)
            last[:] = [(key, partials)]
        return last[0][1]

    def mass(q: Array) -> Matrix:
        if "mass" in model.functions:
            return value("mass", q)
        return nonzeros(q, np.zeros(rows), np.zeros(model.nz)).M

    def stiffness(q: Array, lam: Array, z: Array) -> Matrix:
        return value("partials", q, z=z, lam=lam) if entire else nonzeros(q, lam, z).K

    def couplings(q: Array, z: Array) -> tuple[Array, ...]:
        if not model.nz:
            return np.zeros((model.nv, 0)), *np.zeros((2, 0, model.nv)), np.zeros((0, 0))
        if not entire:
            result = nonzeros(q, np.zeros(rows), z)
            return whole(result.Rz), whole(result.Fq), whole(result.Fv), whole(result.Fz)
        return terms("internal_partials", q=q, z=z, **still)

    def carried_in_motion(q: Array, z: Array, v_moving: Array) -> Array:
        if not entire:
            return whole(sparse_partials(model, q, v + v_moving, rest, z, still["lam"], forces, of_velocities=True).Fv)
        return terms("internal_partials", q=q, z=z, **{**still, "v": v + v_moving})[2]

    return Statics(
        factors=model.factors,
        turning=np.array([unit == "rad/s" for unit in model.v_units]),
        holonomic=holonomic,
        mass=mass,
        jacobian=lambda q: value("constraint_jacobian", q) if rows else np.zeros((0, model.nv)),
        constraint=lambda q: value("constraint", q) if holonomic else np.zeros(0),
        residual=lambda q, lam, z: value("residual", q, z=z, lam=lam),
        stiffness=stiffness,
        rates=lambda q, z: value("internal_rate", q, z=z) if model.nz else np.zeros(0),
        couplings=couplings,
        rates_in_motion=lambda q, z, v_moving: value("internal_rate", q, z=z, v=v + v_moving),
        carried_in_motion=carried_in_motion,
        followed=lambda q: model.evaluator.follow_angles(q, measures.t, p, measures.base),
        length=measures.length(q),
        gravity=measures.gravity(),
        total=measures.mass(),
    )


def _result(
    model: CompiledModel,
    loaded: LoadedStatics,
    stiffness: tuple[Array, Array],
    search: Search,
    v: Array,
    measures: SceneMeasures,
    notes: Sequence[str],
) -> Equilibrium:
    """Return an equilibrium with its stability, frequencies, undetermined coordinates and message."""
    point, (values, directions) = search.point, stiffness
    soft = values == 0.0
    undetermined = _components(model, directions[:, soft[: directions.shape[1]]])
    against = int(np.sum(values[~soft] < 0.0))
    stable: bool | None = not against
    why = _not_by_stiffness(model, loaded, point, v, against)
    if why:
        stable = None
    frequencies = np.where(soft, 0.0, np.sign(values) * np.sqrt(np.abs(values)))
    acceleration = float(np.max(np.abs(point.acceleration), initial=0.0))
    residual = float(np.max(np.abs(point.residual), initial=0.0))
    beside = f" relative to the drive of {drives(model, v)}" if np.any(v) else ""
    message = f"at rest{beside} after {search.steps} steps, unbalanced acceleration {acceleration:.3g}"
    if stable is False:
        worst = _components(model, directions[:, [int(np.argmin(values))]])
        message += f"; unstable along {', '.join(worst[:4])}: it would leave with e^({np.sqrt(-np.min(values)):.3g} t)"
    elif stable is None:
        message += f"; whether it is stable was not examined, for stiffness alone does not decide it: {why}"
    if undetermined:
        motions = int(np.sum(soft))
        joint = "" if motions == len(undetermined) else f"{motions} motion{'s' * (motions > 1)} along "
        message += f"; nothing determines {joint}{first_of(undetermined, 6)}"
    doubts = tuple(map(Message, notes))
    message = "; ".join((message, *doubts))
    return Equilibrium(
        point.q,
        v,
        point.z,
        point.lam,
        measures.t,
        residual,
        acceleration,
        search.steps,
        frequencies,
        stable,
        tuple(undetermined),
        message,
        measures.base,
        doubts,
    )


def _components(model: CompiledModel, directions: Array) -> list[str]:
    """Return the names of the components of v above a twentieth of the largest in a direction, (nv, m)."""
    if not directions.size:
        return []
    sizes = np.max(np.abs(directions) / np.max(np.abs(directions), axis=0), axis=1)
    return [name for name, size in zip(model.v_names, sizes, strict=True) if size > 0.05]


def _not_finite(model: CompiledModel, point: SearchPoint) -> NumericalError:
    bad = [name for name, value in zip(model.v_names, point.residual, strict=True) if not np.isfinite(value)]
    where = (
        f"the force along {first_of(bad, 6)}"
        if bad
        else "the stiffness"
        if np.all(np.isfinite(point.rates))
        else "a rate of z"
    )
    why, hint = "", "formulas that have a value there"
    if not bad and (rough := rough_operations(model.description.formulas)):
        why = f": a formula has no derivative there, of the forces perhaps {rough}"
        hint = "a formula of finite slope there, x / sqrt(x + width) for sqrt(x)"
    fault = f"{where} is not a finite number at the initial state{why} [E0052]"
    return NumericalError(Problem("equilibrium", fault, f"another initial state, or {hint}"))


def _no_stiffness(statics: Statics) -> float:
    """Return the squared frequency, (rad/s)^2, of stiffness by round-off: ``SOFT`` times gravity over length."""
    return SOFT * statics.gravity / statics.length


def _failure(
    model: CompiledModel, statics: Statics, search: Search, stepped: str, along: Array | None
) -> NumericalError:
    """Return the error for a search that failed: an unrestrained coordinate, violated constraints, internal states that
    do not rest, or no convergence, for which ``stepped`` is the reason by load steps.

    Parameters
    ----------
    along : (nv,) velocities of the initial state if drives move the machine; a wheel may roll along
    """
    point, steps = search.point, search.steps
    acceleration = point.acceleration
    k = int(np.argmax(np.abs(acceleration))) if len(acceleration) else 0
    unit = model.v_units[k].replace("/s", "/s^2") if model.v_units else ""
    if point.finite and len(point.imbalance):
        _, sizes, directions = np.linalg.svd(point.stiffness)  # moving along a direction of size 0 changes no force
        soft = sizes <= max(1e-9 * point.largest_stiffness, _no_stiffness(statics))
        pull = point.basis @ (directions[soft].T @ (directions[soft] @ point.imbalance))
        if np.any(soft) and np.max(np.abs(pull)) > 1e-3 * np.max(np.abs(acceleration)):
            k = int(np.argmax(np.abs(pull)))
            unit = model.v_units[k].replace("/s", "/s^2")
            fault = (
                f"nothing holds {model.v_names[k]}: it accelerates with {-pull[k]:.4g} {unit}, and no stiffness"
                " opposes it [E0055]"
            )
            hint = "a spring, a stop, a constraint, or a fixed joint"
            if along is not None:
                name = model.v_names[k].removeprefix("v.")
                hint += (
                    f"; if {name} rolls along with a drive, an initial velocity in place of the drive, or a run from"
                )
                hint += f' steady_motion({{"{name}": {along[k] or 20.0:.6g}}}), in Python'
            return NumericalError(Problem("equilibrium", fault, hint))
    violation = float(np.max(np.abs(point.violation), initial=0.0))
    if not np.all(np.abs(point.violation) <= 1e-8 * point.row_sizes):
        fault = f"the constraints are off by {violation:.3g} after {steps} steps [E0054]"
        return NumericalError(Problem("equilibrium", fault, "an initial state nearer to assembly"))
    if search.states_alone:
        k = int(np.argmax(np.abs(point.rates) / np.maximum(point.rate_noise, np.finfo(float).tiny)))
        unit = "" if model.z_units[k] in ("", "1") else f"{model.z_units[k]} "
        fault = (
            f"the forces balance, but the state {model.states[k]} does not rest: it changes at"
            f" {point.rates[k]:.4g} {unit}per s [E2201]"
        )
        hint = "inputs and parameters with which its rate is 0, as of an integral of an error that is 0 at rest"
        return NumericalError(Problem("equilibrium", fault, hint))
    fault = (
        f"no equilibrium was found in {steps} steps: {model.v_names[k]} still accelerates with {acceleration[k]:.4g}"
        f" {unit}; {stepped} [E0053]"
    )
    hint = "an initial state nearer to rest, or any_kind=True (--any-kind) for an unstable one"
    return NumericalError(Problem("equilibrium", fault, hint))
