"""Checks of the start of a run: rates that explicit steps do not resolve, limits, impacts, tyres deep in their road,
and the choice of method.

Impacts that a run starts past, or on, and their effect on the motion, in words.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.compiled.equations import accelerations
from eomgen.compiled.initial_state import InitialState
from eomgen.compiled.model import CompiledModel
from eomgen.formula.evaluate import evaluate
from eomgen.formula.nodes import Formula, Symbol
from eomgen.lie import product
from eomgen.lie.numeric import rotated
from eomgen.results.finding import NOTE, Finding
from eomgen.simulation.accuracy.motion_size import reach_of
from eomgen.simulation.judgement.finished_run import Check, FinishedRun, RunStart
from eomgen.simulation.stepping.run import Run
from eomgen.system.cancellation import LOST, cancellation, digits_kept, largest_cancellation, relative_error
from eomgen.system.description import BASE, WORLD

if TYPE_CHECKING:
    from eomgen.simulation.stepping.inputs import InputSignals


_AT_REST = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
#: Horizontal part of a unit vector that counts as upright.
_UPRIGHT = 1e-9


def deep_tyres(model: CompiledModel, t: float, q: Array, p: Array, signals: InputSignals | None) -> list[str]:
    """Return one sentence for each tyre that starts with more than a quarter of its radius in the road.

    Models without ``poses`` have none, nor have roads by curves and waves at places that only a step knows.

    Parameters
    ----------
    t, q, p : s, (nq,), (np,)
    signals : inputs of the run; None without inputs
    """
    drawing = model.description.drawing
    if "poses" not in model.functions or not drawing.wheels:
        return []
    values = model.description.values(dict(zip(model.parameters, p.tolist(), strict=True)))
    inputs = {} if signals is None else dict(zip(model.inputs, signals.rows(np.array([t]))[0].tolist(), strict=False))
    poses = _poses(model, t, q, p)
    points = {point.name: point for point in drawing.points}
    notes = []
    for wheel in drawing.wheels:
        point = points[wheel.center]

        def value(formula: Formula, place: Array | None = None) -> float:
            def value_of(symbol: Symbol) -> float:
                if symbol.kind == "position" and place is not None:
                    return float(place[symbol.index])
                if symbol.kind == "time":
                    return t
                return inputs[symbol.name] if symbol.kind == "input" else values[symbol.name]

            return float(evaluate(formula, value_of))

        try:
            offset = np.array([value(part) for part in point.position])
            pose = poses[point.body]
            place = rotated(pose[:4], offset) + pose[4:]
            note = wheel.deep(float(place[2]), value(wheel.radius), value(wheel.road, place), value(wheel.stiffness))
        except (ArithmeticError, KeyError):
            continue
        notes += [note] if note else []
    return notes


def upright_tyres(model: CompiledModel, t: float, q: Array, p: Array) -> str:
    """Return the tyres whose axis is upright, so that their slip has no directions; empty for none."""
    wheels = [wheel for wheel in model.description.drawing.wheels if wheel.axis is not None]
    if not wheels or "poses" not in model.functions:
        return ""
    poses, points = _poses(model, t, q, p), {point.name: point for point in model.description.drawing.points}
    named = []
    for wheel in wheels:
        axis = rotated(poses[points[wheel.center].body][:4], np.array(wheel.axis))
        if np.hypot(axis[0], axis[1]) <= _UPRIGHT * np.linalg.norm(axis):
            named.append(wheel.name)
    return ", ".join(named)


def _poses(model: CompiledModel, t: float, q: Array, p: Array) -> dict[str, Array]:
    """Return quaternion and position of the bodies, the base and the world, (7,) each."""
    poses = dict(zip(model.bodies, model.evaluate("poses", q, t=t, parameters=p)["pose"], strict=True))
    poses[WORLD] = poses[BASE] = _AT_REST
    if "base" in model.functions:
        poses[BASE] = model.base(t, parameters=p)[:7]
    return poses


#: Difference step of velocities, relative to their size, and relative to the velocity that covers the coordinates in a
#: step.
_DIFFERENCE, _OF_REACH = 1e-7, 1e-10


class FastestDecay(NamedTuple):
    """The fastest decay: subject and verb in words, rate in 1/s."""

    text: str
    rate: float


def decay_of_states(
    model: CompiledModel, state: InitialState, t: float, u: Array | None, p: Array
) -> FastestDecay | None:
    """Return the fastest decay of internal states, by the eigenvalues of -Fz: 0 if no state decays.

    Without internal states, or if Fz is not finite, the result is None.
    """
    if not model.functions.of_runs("internal_partials"):
        return None
    by_state = model.internal_partials(state.q, state.v, state.z, t, u, parameters=p).rate_z
    if not np.all(np.isfinite(by_state)):
        return None
    return FastestDecay("internal states decay", float((-np.linalg.eigvals(by_state).real).max(initial=0.0)))


def decay_of_motion(
    model: CompiledModel, state: InitialState, t: float, u: Array | None, p: Array, step: float
) -> FastestDecay | None:
    """Return the fastest decay of velocities, at the initial velocities and at rest."""
    fastest = 0.0
    for rate in (state.v, np.zeros_like(state.v)):
        decay = _decay(model, state, rate, t, u, p, step)
        if decay is not None and np.all(np.isfinite(decay)):
            fastest = max(fastest, float(np.linalg.eigvals(decay).real.max(initial=0.0)))
    return FastestDecay("damping or friction decays", fastest)


def _decay(
    model: CompiledModel, state: InitialState, v: Array, t: float, u: Array | None, p: Array, step: float
) -> NDArray[np.floating[Any]] | None:
    """Return -d vdot/dv, (nv, nv), at velocities v: by partials, or by central differences if the model has none."""
    if model.functions.of_runs("partials"):
        _, C, M = model.partials(state.q, v, np.zeros_like(v), t, u, z=state.z, parameters=p)
        known = np.all(np.isfinite(C)) and np.all(np.isfinite(M)) and np.linalg.matrix_rank(M) == len(M)
        return np.linalg.solve(M, C) if known else None
    if not model.functions.of_runs("forward_dynamics") or not model.nv:
        return None
    reach = reach_of(model, state.q)
    least = _OF_REACH * np.where(reach > 0.0, reach, 1.0) / step
    ways = np.diag(np.maximum(least, _DIFFERENCE * np.abs(v)))
    with np.errstate(all="ignore"):
        ahead, behind = (
            accelerations(model, state.q, v + sign * ways, t, u, z=state.z, parameters=p) for sign in (1.0, -1.0)
        )
        columns: Array = (behind - ahead) / (2.0 * np.diag(ways)[:, np.newaxis])
    return columns.T


#: Limit of the distance of a function from its root, as a part of the coordinates, and of the rate within a step.
_ON = 1e-12


def impacts_at_start(run: Run, state: InitialState) -> list[str]:
    """Return one sentence for each impact that the initial state is past, or rests on without a side.

    For an impact of one direction, the free side has values of the function above zero (falling) or below (rising); an
    impact of both directions is met from either side, so that only a start on the impact has no side.
    """
    model, t = run.model, run.grid.start
    rows = model.library.layout["method"].get("events", {"rows": []})["rows"]
    if not any(row["action"] == "impact" for row in rows) or "events" not in model.functions:
        return []
    u = run.signals.rows(np.array([t]))[0] if model.nu else None
    reach = reach_of(model, state.q)
    ways = np.concatenate([np.zeros((1, model.nv)), np.diag(_ON * np.where(reach > 0.0, reach, 1.0))])
    places = product.update(model.factors, np.repeat(state.q[np.newaxis], len(ways), axis=0), ways)
    with np.errstate(all="ignore"):
        functions = model.evaluate(
            "events", places, state.v, np.zeros_like(state.v), t, u, z=state.z, parameters=run.parameters
        )
    values, rates = functions["event"], functions["event_rate"][0]
    rounding = np.abs(values[1:] - values[0]).sum(axis=0)  # when coordinates move by their rounding
    sentences = []
    for row, value, rate, off in zip(rows, values[0].tolist(), rates.tolist(), rounding.tolist(), strict=True):
        travel = abs(rate) * run.settings["step"]
        near = off + _ON * travel
        if row["action"] != "impact":
            continue
        name, sign = row["name"], row["sign"]
        if sign and value * sign > near:
            sentences.append(
                f"the run starts past the impact {name}, which is met from the side where its formula is"
                f" {'below' if sign > 0 else 'above'} zero: at the start it is {value:.4g}; try: another initial state,"
                f' or direction = "{"falling" if sign > 0 else "rising"}"'
            )
        elif not sign and abs(value) <= near and travel <= off:
            sentences.append(
                f"the run starts at rest on the impact {name}, which has no side: the motion may leave it either way;"
                ' try: direction = "falling" for a free side where its formula is above zero, "rising" for below'
            )
    return sentences


def starts_beyond_limits(model: CompiledModel, q: NDArray[np.float64], p: NDArray[np.float64]) -> list[str]:
    """Return one sentence for each coordinate beyond a limit, including joint angles of absolute bodies that q holds.

    Parameters
    ----------
    q, p : (nq,), (np,)
    """
    if not model.description.limits:
        return []
    values = model.description.values(dict(zip(model.parameters, p.tolist(), strict=True)))
    places = {name: number for number, name in enumerate(model.q_names)}

    def value(formula: Formula) -> float:
        return evaluate(formula, lambda symbol: values[symbol.name])

    limits = [limit for limit in model.description.limits if limit.coordinate in places]
    return [note for limit in limits if (note := limit.passed(float(q[places[limit.coordinate]]), value))]


def _unresolved_damping(run: FinishedRun) -> Iterator[Finding]:
    yield from _too_fast(run, decay_of_motion(*_state_at_start(run), run.settings["step"]))


def _unresolved_states(run: FinishedRun) -> Iterator[Finding]:
    yield from _too_fast(run, decay_of_states(*_state_at_start(run)))


def _state_at_start(run: FinishedRun) -> tuple[CompiledModel, InitialState, float, Array | None, Array]:
    owner, t = run.run, run.run.grid.start
    u = owner.signals.rows(np.array([t]))[0] if owner.takes_rows else None
    return owner.model, _beginning_of(run).state, t, u, owner.parameters


def _too_fast(run: FinishedRun, decay: FastestDecay | None) -> Iterator[Finding]:
    limit = run.run.method.real_stability
    if decay is not None and run.settings["step"] * decay.rate > limit:
        text = f"{decay.text} at up to {decay.rate:.3g} 1/s at the start, too fast for an explicit method at this step"
        hint = f"generalized_alpha, or a step below {limit / decay.rate:.2g} s"
        yield Finding(value=decay.rate, time=run.run.grid.start, text=text, hint=hint)


def _beginning_of(run: FinishedRun) -> RunStart:
    if run.beginning is None:
        raise ValueError("a check of the start needs the fact begun")
    return run.beginning


def _lost_digits(run: FinishedRun) -> Iterator[Finding]:
    """Find accelerations that lose digits when M is eliminated.

    Methods that iterate on the residual are as accurate as inverse dynamics, except for the start by forward dynamics;
    tdg2 and rosenbrock also record accelerations of each step from forward dynamics.
    """
    model, q = run.run.model, _beginning_of(run).state.q
    facts = model.library.layout["facts"]
    articulated = facts["ill_scaled"]
    terms = run.run.method.terms(False, facts["internal_states"], not articulated)
    iterated = "mass" not in terms and bool({"residual", "equations"} & set(terms))
    if "mass" not in model.functions or (iterated and "forward_dynamics" not in terms):
        return
    (inertia,) = model.evaluator.functions("mass", {"q": q, "p": run.run.parameters})
    M = np.asarray(inertia, dtype=float)
    if relative_error(largest_cancellation(M), articulated=articulated) <= LOST:
        return
    ratio = float(cancellation(M[np.newaxis], [factor.v for factor in model.factors])[0])
    lost = relative_error(ratio, articulated=articulated)
    if lost > LOST:
        text = f"{digits_kept(lost)}: inertias differ by a factor of {ratio:.1g} with joints locked and free"
        other = "the parameters of this run as defaults of the scene"
        better = [other] if not articulated and model.parameters else ["links that differ less"]
        if iterated:
            text = f"where forward dynamics gives them, at the start or at each recorded step, {text}"
        else:
            better = ["generalized_alpha", *better]
        yield Finding(value=lost, time=run.run.grid.start, text=text, hint=", or ".join(better))


def _start_beyond_limits(run: FinishedRun) -> Iterator[Finding]:
    beginning = _beginning_of(run)
    if not beginning.equilibrium:
        yield from map(Finding.of, starts_beyond_limits(run.run.model, beginning.state.q, run.run.parameters))


def _start_on_impact(run: FinishedRun) -> Iterator[Finding]:
    yield from map(Finding.of, impacts_at_start(run.run, _beginning_of(run).state))


def _turned_start(run: FinishedRun) -> Iterator[Finding]:
    yield from map(Finding.of, _beginning_of(run).notes)


def _deep_start(run: FinishedRun) -> Iterator[Finding]:
    beginning, owner = _beginning_of(run), run.run
    if not beginning.equilibrium:
        signals = owner.signals if owner.takes_rows else None
        yield from map(
            Finding.of, deep_tyres(owner.model, owner.grid.start, beginning.state.q, owner.parameters, signals)
        )


def _doubtful_start(run: FinishedRun) -> Iterator[Finding]:
    yield from map(Finding.of, _beginning_of(run).doubts)


def _chosen_method(run: FinishedRun) -> Iterator[Finding]:
    if choice := _beginning_of(run).choice:
        yield Finding.of(choice)


ROWS = (
    Check("unresolved_damping", _unresolved_damping, ("begun", "explicit", "no constraints")),
    Check("unresolved_states", _unresolved_states, ("begun", "explicit")),
    # Beyond the linear range of a beam no pivot of M says anything: the finding above names the beam.
    Check("lost_digits", _lost_digits, ("begun", "no constraints"), unless=("linear_range",)),
    Check("start_beyond_limits", _start_beyond_limits, ("begun",)),
    Check("start_on_impact", _start_on_impact, ("begun", "events")),
    Check("turned_start", _turned_start, ("begun",)),
    Check("deep_start", _deep_start, ("begun", "tyres")),
    Check("doubtful_start", _doubtful_start, ("begun",)),
    Check("chosen_method", _chosen_method, ("begun",), severity=NOTE),
)
