"""Motions and laws of time that are too fast for the steps of a run, which no comparison of longer steps shows.

Implicit steps damp unresolved motions, and so do steps twice and four times as long: these agree, and
do not show the fast motion. So the equations are used: modes of M and K whose oscillation a step does not resolve, and
the size of the swing, by two differences of accelerations along a tenth of a radian of the mode. A slow motion that
goes with the angular frequency w swings a mode of frequency W by w/W of its acceleration only, however it curves.

A run sees laws of time at its steps alone. One that oscillates at a multiple of the frequency of the steps looks like a
constant, to runs with half the step as well, so no comparison of runs shows it. Here laws are evaluated between steps.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.limits import Limit
from eomgen.base.rounding import COMPUTED, SUMMED, WRITTEN
from eomgen.compiled.equations import accelerations, free_directions, has_residual_partials, residual_partials
from eomgen.compiled.model import CompiledModel
from eomgen.errors import EomgenError, UsageError
from eomgen.lie import product
from eomgen.products.doubts.places import evenly
from eomgen.results.finding import Finding
from eomgen.simulation.accuracy.motion_size import reach_of
from eomgen.simulation.judgement.finished_run import FinishedRun, laws_between_steps
from eomgen.simulation.stepping.events import parameters_over, parameters_with
from eomgen.simulation.stepping.run import Run

UNRESOLVED = Limit(1.0, "1", "step times angular frequency of a mode", "six steps to a period")
NOTICED = Limit(
    0.1,
    "1",
    "acceleration of an excited mode in parts of all, by kinetic energy",
    "a tenth of a motion is seen in a plot",
)
EXCITED = Limit(3.0, "1", "oscillation after an event or a jump in parts of the one before", "a choice")


class _ExaminedState(NamedTuple):
    """A state (q, v, z) at which a run starts or continues, named in words, with the parameters p (np,) in force; the
    previous state with parameters (``before``, None for the start); and whether formulas jump there in time."""

    name: str
    t: float
    q: Array
    v: Array
    z: Array
    p: Array
    before: tuple[Array, Array, Array, Array] | None = None
    jump: bool = False


class _Swing(NamedTuple):
    """An oscillating mode: amplitude in parts of all accelerations, angular frequency in 1/s, name of the velocity that
    dominates."""

    share: float
    frequency: float
    name: str


def unresolved_motion(finished: FinishedRun) -> str:
    """Return a sentence, with a remedy, on an excited motion that is too fast for the steps of an implicit method;
    empty if there is none, and for explicit methods."""
    run, statistics, trajectory = finished.run, finished.statistics, finished.trajectory
    if not run.method.implicit or not has_residual_partials(run.model) or not run.model.nv:
        return ""  # explicit methods do not damp the fast motions of a stable step: runs at other steps differ
    taken = statistics.get("own_steps") or statistics.get("expansions") or max(trajectory.steps, 1)
    step = (float(finished.states.t[-1]) - run.grid.start) / taken
    for state in _places(finished):
        try:
            result = _UnresolvedModes(run, state, step, finished.states.a).largest()
        except (EomgenError, np.linalg.LinAlgError, ValueError):  # states at which the equations give no numbers
            continue
        if result is not None:
            return _sentence(state.name, result, run, step)
    return ""


def _sentence(words: str, swing: _Swing, run: Run, step: float) -> str:
    hertz, period = swing.frequency / (2.0 * math.pi), 2.0 * math.pi / swing.frequency
    text = (
        f"{words} excites a motion of {swing.name} at {hertz:.3g} Hz, whose period of {period:.2g} s steps of"
        f" {step:.2g} s do not resolve: accelerations, forces and outputs made of them follow the slow motion alone,"
        " and the estimated error need not count the fast one"
    )
    finer = f"a step of {0.3 / swing.frequency:.2g} s"  # twenty to a period
    if run.method.chooses_steps:
        finer = f"a tolerance smaller than {run.settings['tolerance']:.3g}"
    return f"{text}; try: {finer}, or a start in which stiff parts are in balance"


def _places(finished: FinishedRun) -> list[_ExaminedState]:
    """Return the states at which fast motions may begin: start, events that act and jumps of forces, 16 at most of
    each."""
    run, events, acting = finished.run, finished.events, finished.changes
    model, (times, q, v, _, _, z) = run.model, finished.states
    result: list[_ExaminedState] = []
    if times[0] == run.grid.start:
        result.append(_ExaminedState("the start", float(times[0]), q[0], v[0], z[0], run.parameters))
    if events is not None:
        held = run.parameters
        for record in [item for item in events if item.t in acting and item.t < run.grid.end][:16]:
            words = f"the event {record.name} at t = {record.t:.6g} s"
            before = record.q_before, record.v_before, record.z_before, held
            held = parameters_with(events, model, run.parameters, record.modes)
            result.append(_ExaminedState(words, record.t, record.q, record.v, record.z, held, before))
    for jump in np.setdiff1d(finished.known_jumps(0), acting)[:16]:
        row = int(np.argmin(np.abs(times - jump)))
        if 0 < row < len(times) - 1 and abs(times[row] - jump) < 1e-6 * run.settings["step"]:
            state = q[row], v[row], z[row], parameters_over(events, model, run.parameters, times[row])
            result.append(_ExaminedState(f"the jump at t = {jump:.6g} s", float(jump), *state, before=state, jump=True))
    return result


@dataclass(frozen=True)
class _UnresolvedModes:
    """Search, at a state of a run, for modes too fast for the step size ``step``, s. ``accelerations`` (n, nv) are of
    the recorded rows, as a measure of size."""

    run: Run
    state: _ExaminedState
    step: float
    accelerations: Array

    def largest(self) -> _Swing | None:
        """Return the mode with the largest oscillation; None if no oscillation is noticeable."""
        state, result = self.state, []
        frequencies, forms, mass = self._fast_modes()
        energies = np.einsum("ni,ij,nj->n", self.accelerations, mass, self.accelerations)
        energies = np.nan_to_num(energies, nan=np.finfo(np.float64).max)  # infinite squares become the largest as well
        usual = float(np.quantile(np.sqrt(np.maximum(energies, 0.0)), 0.9))  # not zero if a run begins at rest
        for frequency, form in zip(frequencies, forms.T, strict=True):
            span = 0.1 / frequency
            later = 0.05 * span if state.jump else 0.0
            here, weights = (state.q, state.v, state.z, state.p), mass @ form
            swing, size = self._swing(here, state.t + later, frequency, weights, mass)
            size = max(size, usual)
            deflections = swing / frequency**2 * np.abs(form)
            rounding = SUMMED * reach_of(self.run.model, state.q)
            if not (swing > NOTICED * size and np.any(deflections > rounding)):
                continue
            if state.before is not None:
                earlier = state.t - 2.05 * span if state.jump else state.t
                before, _ = self._swing(state.before, earlier, frequency, weights, mass)
                if not swing > EXCITED * before:
                    continue
            name = self.run.model.v_names[int(np.argmax(form * weights))]
            result.append(_Swing(swing / size, frequency, name))
        return max(result, default=None)

    def _fast_modes(self) -> tuple[Array, Array, Array]:
        """Return angular frequencies (m,), forms (nv, m) of unit kinetic energy, and M (nv, nv), of up to 8 modes that
        oscillate too fast for the step; modes with the largest motion first."""
        model, (_, t, q, v, z, p, *_) = self.run.model, self.state
        u = self._inputs(t)
        a, multipliers = self._accelerations((q, v, z, p), t)
        held = {"multipliers": multipliers} if model.multipliers else {}
        K, C, M = residual_partials(model, q, v, a, t, u, z=z, parameters=p, **held)
        mass = 0.5 * (M + M.T)
        free = free_directions(model, q, t, p)
        root = np.linalg.cholesky(free.T @ mass @ free)
        basis = np.linalg.solve(root, free.T).T  # basis^T M basis = 1
        stiffness = basis.T @ K @ basis
        squares, vectors = np.linalg.eigh(0.5 * (stiffness + stiffness.T))
        forms = basis @ vectors
        frequencies = np.sqrt(np.maximum(squares, 0.0))
        decay = 0.5 * np.einsum("im,ij,jm->m", forms, C, forms)
        places = np.flatnonzero((frequencies * self.step > UNRESOLVED) & (decay * self.step < UNRESOLVED))[::-1]
        moved = np.abs(forms.T @ mass @ a)[places]
        moved = np.maximum(moved, np.abs(forms.T @ mass @ v)[places] * frequencies[places])
        places = places[np.argsort(-moved)[:8]]
        return frequencies[places], forms[:, places], mass

    def _swing(
        self, state: tuple[Array, Array, Array, Array], t: float, frequency: float, weights: Array, mass: Array
    ) -> tuple[float, float]:
        """Return the amplitude of a mode's acceleration from a state (q, v, z, p) at t, and the size of all
        accelerations, in roots of kinetic energy per s.

        ``weights`` (nv,) is M times the form of the mode; accelerations are taken at three times, at intervals of a
        tenth of a radian. An oscillation of amplitude A has the second derivative -W^2 A cos, and the first -W A sin.
        """
        model, (q, v, z, p) = self.run.model, state
        seen, span = [], 0.1 / frequency
        a, _ = self._accelerations(state, t)
        for number in range(1, 3):
            seen.append(a)
            q, half = product.update(model.factors, q, span * v + 0.5 * span**2 * a), v + 0.5 * span * a
            next_a, _ = self._accelerations((q, v + span * a, z, p), t + number * span)
            v, a = half + 0.5 * span * next_a, next_a
        seen.append(a)
        along = [float(weights @ acceleration) for acceleration in seen]
        second = (along[0] - 2.0 * along[1] + along[2]) / (span * frequency) ** 2
        first = (along[2] - along[0]) / (2.0 * span * frequency)
        swing = math.hypot(first, second)
        size = max(swing, *(math.sqrt(max(float(acceleration @ mass @ acceleration), 0.0)) for acceleration in seen))
        return swing, size

    def _accelerations(self, state: tuple[Array, Array, Array, Array], t: float) -> tuple[Array, Array]:
        model, u, (q, v, z, p) = self.run.model, self._inputs(t), state
        if model.multipliers:
            a, multipliers = model.constrained_dynamics(q, v, t, u, z=z, parameters=p)
            return a, multipliers
        return accelerations(model, q, v, t, u, z=z, parameters=p), np.empty(0)

    def _inputs(self, t: float) -> Array | None:
        return self.run.signals.rows(np.array([t]))[0] if self.run.takes_rows else None


UNSEEN = Limit(
    0.8,
    "1",
    "deviation of a law from the line through the steps in standard deviations",
    "a sine with 2.2 steps to a period",
)


@dataclass(frozen=True)
class _Law:
    """A function of time at the nodes of steps (``ends``, (nodes, steps)), at one time within each step (``between``),
    and the interpolation between nodes there (``shown``), (steps,) each."""

    name: str
    unit: str
    ends: Array
    between: Array
    shown: Array

    @property
    def range(self) -> float:
        return float(np.ptp([*self.ends.ravel(), *self.between]))

    @property
    def off(self) -> float:
        """The largest deviation from the interpolation over the steps."""
        return float(np.max(np.abs(self.between - self.shown)))

    @property
    def unseen(self) -> bool:
        every = np.concatenate([self.ends.ravel(), self.between])
        if not np.all(np.isfinite(every)) or self.off <= WRITTEN * float(np.max(np.abs(every))):
            return False
        deviation = float(np.sqrt(np.mean((self.between - self.shown) ** 2)))
        return deviation > UNSEEN * float(np.std(every))


def fast_laws(finished: FinishedRun) -> Iterator[Finding]:
    """Yield a finding on the input or force of time that varies most between the steps, if steps do not resolve one."""
    try:
        time_laws = [*_inputs(finished), *_forces(finished)]
    except UsageError:  # a function of the caller that has no value between steps
        return
    laws = [law for law in time_laws if law.unseen]
    if not laws:
        return
    law, step = max(laws, key=lambda candidate: candidate.off / candidate.range), finished.settings["step"]
    more = f" (and {len(laws) - 1} more)" if len(laws) > 1 else ""
    size = f"up to {law.off:.3g} {law.unit} off the line through them, and varies by {law.range:.3g} {law.unit} in all"
    text = f"{law.name}{more} varies faster than the steps resolve: between them it is {size}"
    hint = f"a step much smaller than {step:.3g} s, 20 or more to a period, or its means over the steps"
    yield Finding(value=law.off / law.range, text=text, hint=hint)


def _chosen(times: Array, step: float, last: float, ends: Array) -> NDArray[np.int_]:
    """Return indices into the times (n,), at most 200, at which whole steps begin. Steps beyond ``last``, and steps
    that contain one of the times ``ends``, s, at which parts of the run end, are left out."""
    candidates, slack = evenly(len(times), 4000), COMPUTED * step
    times = times[candidates]
    before, after = np.searchsorted(ends, times + slack), np.searchsorted(ends, times + step - slack)
    places = candidates[np.flatnonzero((times + step <= last + slack) & (before == after))]
    return places[evenly(len(places), 200)]


def _inputs(finished: FinishedRun) -> list[_Law]:
    """Return inputs that vary in time as laws: their values at the nodes of steps and between; none for inputs that the
    method takes otherwise."""
    run, nodes = finished.run, finished.stepper.input_times
    model, step, last = run.model, run.settings["step"], float(finished.states.t[-1])
    seen_at_nodes = run.takes_rows and run.method.inputs == "sampled"
    taken = seen_at_nodes or run.method.inputs != "series"
    columns = [
        k
        for k, name in enumerate(model.inputs)
        if (taken if not run.method.chooses_steps else seen_at_nodes and name in run.signals.given)
        and not isinstance(run.signals.given.get(name), float)
    ]
    if not columns:
        return []
    every: Array = run.grid.start + step * np.arange(round((last - run.grid.start) / step), dtype=float)
    begins: Array = every[_chosen(every, step, last, finished.parts.ends)]

    def rows(share: float) -> Array:
        times = begins + share * step
        return run.signals.rows(times) if run.takes_rows else model.input_values(times, parameters=run.parameters)

    words = [(k, f"the input {model.inputs[k]}", model.input_units.get(model.inputs[k], "")) for k in columns]
    return _laws(rows, nodes if seen_at_nodes else np.array([0.0, 1.0]), words) if len(begins) else []


def _laws(values: Callable[[float], Array], nodes: Array, words: Sequence[tuple[int, str, str]]) -> list[_Law]:
    """Return as laws the columns, each with a name and a unit, of ``values``, a function of the place in the steps,
    0 to 1, that returns (steps, columns). A step takes the values at the places ``nodes``, ascending."""
    fraction = 0.382  # no small multiple of this is whole, so no oscillation hides from it
    ends, between = np.array([values(node) for node in nodes]), values(fraction)
    k = int(np.searchsorted(nodes, fraction))
    part = (fraction - nodes[k - 1]) / (nodes[k] - nodes[k - 1])
    shown = (1.0 - part) * ends[k - 1] + part * ends[k]
    return [_Law(name, unit, ends[:, :, j], between[:, j], shown[:, j]) for j, name, unit in words]


def searches_left_out(finished: FinishedRun) -> str:
    """Return, in words, the searches within steps that are left out together with the error estimate; empty if none
    is."""
    run, model = finished.run, finished.run.model
    moves = model.nz or (model.nv and model.library.layout["facts"]["velocity_forces"])
    searches = {
        "laws that act between the steps": bool(laws_between_steps(run)),
        "laws of time that are faster than the steps": model.nu
        or (not run.method.chooses_steps and _has_forces_of_time(model)),
        "pairs of events": finished.events is not None,
        "rates that the steps do not resolve": bool(moves) and not run.method.chooses_steps,
    }
    *names, last = [name for name, made in searches.items() if made] or [""]
    listed = " and ".join(filter(None, (", ".join(names), last)))
    return f", and with it the search for {listed}" if listed else ""


def _has_forces_of_time(model: CompiledModel) -> bool:
    """Return whether forces depend on time itself; motions of the base that are too fast are refused."""
    functions = model.library.layout["functions"]
    takes = next((item["inputs"] for item in functions if item["name"] == "inverse_dynamics"), ())
    return "t" in takes and "inverse_dynamics" in model.functions


def _forces(finished: FinishedRun) -> list[_Law]:
    """Return, as laws, the generalized forces of time at the states of rows with zero acceleration, one for each
    velocity; none for methods with adaptive steps, or forces without time."""
    run, states, parameters = finished.run, finished.states, finished.present
    model, method, step = run.model, run.method, run.settings["step"]
    if method.chooses_steps or method.inputs == "series" or not _has_forces_of_time(model):
        return []
    places = _chosen(states.t[:-1], step, float(states.t[-1]), finished.parts.ends)
    if not len(places):
        return []
    t, q, v, z = states.t[places], states.q[places], states.v[places], states.z[places]
    p = parameters if parameters.ndim == 1 else parameters[places]
    u = None
    if model.nu:
        u = run.signals.rows(t) if run.takes_rows else model.input_values(t, parameters=p)

    def forces(share: float) -> Array:
        return model.inverse_dynamics(q, v, np.zeros_like(v), t + share * step, u, z=z, parameters=p)

    kinds = {"rad/s": "N m", "m/s": "N"}
    named = enumerate(zip(model.v_names, model.v_units, strict=True))
    words = [
        (j, f"the force along {name.removeprefix('v.')}, which depends on t,", kinds.get(unit, ""))
        for j, (name, unit) in named
    ]
    return _laws(forces, np.array([0.0, 1.0]), words)
