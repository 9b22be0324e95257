"""The motion within the steps of a run: rows at the ends of all steps, the interpolant between them, and jumps of
formulas on the path, at which methods lose order.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eomgen.base.arrays import Array
from eomgen.compiled.equations import accelerations
from eomgen.errors import EomgenError
from eomgen.formula.evaluate import evaluate_batch, symbols
from eomgen.formula.features import jumps, may_be_fast
from eomgen.formula.nodes import ZERO_VECTOR, Formula, LoadSymbol, Symbol
from eomgen.lie import product
from eomgen.lie.groups import SO3
from eomgen.lie.numeric import log, rotated
from eomgen.results.dense_output import Rows, state_at
from eomgen.simulation.accuracy.comparison_runs import SAME_TIME, Span, comparison_run
from eomgen.simulation.stepping.run import Run
from eomgen.simulation.stepping.states import states_of
from eomgen.toolchain.library import Library


class StepStates:
    """States, inputs and motions of points on a run's path at given times; each quantity is evaluated at its first use.
    `t` (m,) are the times in s and `steps` (m,) the indices of the rows at the beginnings of their steps."""

    def __init__(self, path: StepPath, t: Array, steps: NDArray[np.intp]) -> None:
        self._path, self.t, self.steps = path, t, steps
        self._points: dict[tuple[str, str, tuple[Formula, ...], bool], Array] = {}

    @cached_property
    def states(self) -> tuple[Array, Array, Array]:
        """q, v and z."""
        return self._path.between(self.t, self.steps)

    @cached_property
    def p(self) -> Array:
        known = self._path.parameters
        return known if known.ndim == 1 else known[self.steps]

    @cached_property
    def u(self) -> Array:
        """Inputs, (m, nu): formulas that may be fast are evaluated, other inputs are interpolated between rows."""
        path = self._path
        rows, t = path.inputs, path.states.t
        after = np.minimum(self.steps + 1, len(t) - 1)
        share = (self.t - t[self.steps]) / np.where(after > self.steps, t[after] - t[self.steps], 1.0)
        result: Array = rows[self.steps] + share[:, np.newaxis] * (rows[after] - rows[self.steps])
        for column, formula in path.fast_inputs.items():
            result[:, column] = path.values(formula, self)
        return result

    def at_point(self, symbol: Symbol) -> Array:
        """Return the values (m,) of a formula's symbol that stands for one component of the motion of a point, body or
        load."""
        body, point, own_axes = self._path.points[symbol]
        kind = symbol.name if symbol.kind == "local" else symbol.kind
        key = kind, body, point, own_axes
        if key not in self._points:
            self._points[key] = self._path.motion(kind, body, point, self, own_axes=own_axes)
        return self._points[key][:, symbol.index]


class StepPath:
    """Interpolated motion along the steps of a run, with values of the scene's formulas and of the equations there.

    Parameters
    ----------
    rows : (n, width), recorded rows at the ends of steps
    parameters : (np,), or (n, np), at the rows
    inputs : (n, nu), if known
    """

    def __init__(self, run: Run, rows: Array, parameters: Array, inputs: Array | None = None) -> None:
        self.run, self.rows, self.parameters, self._inputs = run, rows, parameters, inputs
        t, q, v, a, _, z = states_of(rows, run.model)
        self.points: dict[Symbol, tuple[str, tuple[Formula, ...], bool]] = {}
        self.states = Rows(t, q, v, np.where(np.isfinite(a), a, 0.0), z)
        self.at_rows = StepStates(self, t, np.arange(len(t)))
        self.at_rows.states = q, v, z

    @cached_property
    def _places(self) -> dict[tuple[str, str], int]:
        model = self.run.model
        result = {("state", name): k for k, name in enumerate(model.states)}
        result |= {("input", name): k for k, name in enumerate(model.inputs)}
        for factor in () if model.description.joints else model.factors:
            result |= {("q", factor.name): factor.q_start, ("v", factor.name): factor.v_start}
        return result

    @cached_property
    def inputs(self) -> Array:
        """Inputs at the rows, (n, nu)."""
        run, t = self.run, self.states.t
        if self._inputs is not None:
            return self._inputs
        result = run.signals.rows(t) if run.takes_rows else run.model.input_values(t, parameters=self.parameters)
        return np.array(np.broadcast_to(result, (len(t), run.model.nu)))

    @cached_property
    def fast_inputs(self) -> dict[int, Formula]:
        """Formulas of inputs that may change fast within a step, by column of the inputs, if evaluable along the path.
        Inputs that the caller gives are left out, and so are formulas of other inputs."""
        formulas = {
            item.name: item.formula
            for item in self.run.model.description.inputs
            if item.formula is not None and item.name not in self.run.signals.given and may_be_fast(item.formula)
        }
        columns = {k: formulas[name] for k, name in enumerate(self.run.model.inputs) if name in formulas}
        of_inputs = {k for k, formula in columns.items() if any(symbol.kind == "input" for symbol in symbols(formula))}
        return {k: formula for k, formula in columns.items() if self.knows(formula) and k not in of_inputs}

    @cached_property
    def slopes(self) -> Array:
        """Rates of internal states at the rows, by differences that do not reach across jumps of forces."""
        t, z = self.states.t, self.states.z
        rise = np.diff(z, axis=0) / np.maximum(np.diff(t), np.finfo(float).tiny)[:, np.newaxis]
        result: Array = 0.5 * (np.concatenate([rise[:1], rise]) + np.concatenate([rise, rise[-1:]]))
        return result

    def at(self, times: Array, steps: NDArray[np.intp]) -> StepStates:
        return StepStates(self, times, steps)

    def between(self, times: Array, steps: NDArray[np.intp]) -> tuple[Array, Array, Array]:
        """Return q (m, nq), v (m, nv) and z (m, nz) at times (m,) in s, within the steps that begin at rows `steps`
        (m,). Coordinates follow quintics, or the Hermite interpolant on the group, internal states cubics; states that
        are sampled are constant between samples."""
        t, q, v, a, z = self.states
        h = (t[steps + 1] - t[steps])[:, np.newaxis]
        s = np.clip((times - t[steps])[:, np.newaxis] / h, 0.0, 1.0)
        model = self.run.model
        if all(factor.group == "R" for factor in model.factors):
            first, last = ((q[k], v[k], a[k]) for k in (steps, steps + 1))
            q_there, v_there, _ = product.group_curve(model.factors, first, last, h[:, 0], s[:, 0])
        else:
            factors = [[f.group, f.q_start, f.q_size, f.v_start, f.v_size] for f in model.factors]
            state = state_at(self.states, {"factors": factors, "dense_output": "hermite_5"}, times)
            q_there, v_there = state.q, state.v
        if not model.nz:
            return q_there, v_there, np.zeros((len(times), 0))
        rate, later = self.slopes[steps], self.slopes[steps + 1]
        rise = z[steps + 1] - z[steps]
        bend, twist = 3.0 * rise - h * (2.0 * rate + later), h * (rate + later) - 2.0 * rise
        z_there = z[steps] + s * (h * rate + s * (bend + s * twist))
        for k, held in enumerate(model.description.states):
            if held.sampling is not None:  # held between samples; a row at a sample has the value before it
                period, offset = held.sampling.period, held.sampling.offset
                sampled = offset + period * np.floor((times - offset) / period + SAME_TIME)
                z_there[:, k] = np.where(sampled >= t[steps] - SAME_TIME * h[:, 0], z[steps + 1, k], z[steps, k])
        return q_there, v_there, z_there

    def knows(self, formula: Formula) -> bool:
        """Return whether a formula can be evaluated along the path. Its symbols have to be times, coordinates,
        velocities, states, inputs, parameters, points of bodies or places of loads."""
        kinds = ("time", "parameter")
        return all(
            symbol.kind in kinds or (symbol.kind, symbol.name) in self._places or self._on_body(symbol)
            for symbol in symbols(formula)
        )

    def _on_body(self, symbol: Symbol) -> bool:
        """Return whether a symbol is a position, velocity or rotation of a point on a body that can be evaluated. The
        library has to have poses and twists. Body, point and axes of the symbol are kept in ``points``."""
        model = self.run.model
        if symbol in self.points:
            return True
        if "poses" not in model.functions or "twists" not in model.functions:
            return False
        if isinstance(symbol, LoadSymbol):
            body_point = symbol.body, symbol.point, symbol.own_axes
        elif symbol.kind in ("rotation", "angular_velocity"):
            body_point = symbol.name, ZERO_VECTOR, False
        else:
            points = {point.name: point for point in model.description.drawing.points}
            if symbol.kind not in ("position", "velocity") or symbol.name not in points:
                return False
            body_point = points[symbol.name].body, points[symbol.name].position, False
        if body_point[0] not in model.evaluator.bodies:
            return False
        self.points[symbol] = body_point
        return True

    def motion(self, kind: str, body: str, point: tuple[Formula, ...], blocks: StepStates, *, own_axes: bool) -> Array:
        """Return a vector (m, 3) of a body's motion at the times of blocks: of kind position, velocity, rotation or
        else.

        Other kinds: ``angular_velocity``, rad/s. A rotation is the vector log R. `point` has the coordinates of a point
        on the body as formulas. Vectors are in inertial axes, or with `own_axes` in axes of the body, except rotations.
        """
        model, (q, v, _) = self.run.model, blocks.states
        arguments: dict[str, Any] = {"t": blocks.t, "parameters": blocks.p}
        pose = model.pose(body, q, **arguments)
        if kind == "rotation":
            return log(SO3, pose[:, :4])
        back = pose[:, :4] * (1.0, -1.0, -1.0, -1.0)
        if kind == "angular_velocity":
            omega = model.twist(body, q, v, **arguments)[:, :3]
            return omega if own_axes else rotated(pose[:, :4], omega)
        r = np.stack([self.values(entry, blocks) for entry in point], axis=-1)
        motion = model.point(body, r, q, v if kind == "velocity" else None, **arguments)
        result = motion.position if motion.velocity is None else motion.velocity
        return rotated(back, result) if own_axes else result

    def place(self, symbol: Symbol) -> int:
        """Return the index of a known symbol within the block of its kind: q, v, z or u."""
        return self._places[symbol.kind, symbol.name] + symbol.index

    def values(self, formula: Formula, blocks: StepStates) -> Array:
        """Return the values (m,) of a formula at the times of blocks."""
        description, tunable = self.run.model.description, list(self.run.model.parameters)
        letters = {"q": 0, "v": 1, "state": 2}

        def value_of(symbol: Symbol) -> ArrayLike:
            if symbol.kind == "time":
                return blocks.t
            if symbol.kind == "parameter":
                fixed = description.fixed
                return fixed[symbol.name] if symbol.name in fixed else blocks.p[..., tunable.index(symbol.name)]
            if symbol in self.points:
                return blocks.at_point(symbol)
            column = self.place(symbol)
            return blocks.u[:, column] if symbol.kind == "input" else blocks.states[letters[symbol.kind]][:, column]

        return np.broadcast_to(evaluate_batch(formula, value_of, along_motion=True), blocks.t.shape)

    def rates(self, blocks: StepStates, states: tuple[Array, Array, Array] | None = None) -> Array:
        """Return accelerations and rates of internal states, (m, nv + nz), at the times, inputs and parameters of
        blocks. `states` are other q, v and z with m rows each; None: the states of the blocks."""
        model = self.run.model
        q, v, z = states or blocks.states
        arguments = {"u": blocks.u if model.nu else None, "z": z, "parameters": blocks.p}
        with np.errstate(all="ignore"):
            a = accelerations(model, q, v, blocks.t, **arguments)
            return np.hstack([a, model.internal_rates(q, v, t=blocks.t, **arguments)]) if model.nz else a


#: Maximum number of repeated steps; of a longer run eight pieces are repeated.
_MOST = 20_000


class StepRows(NamedTuple):
    """Rows of the ends of steps of a run, in one piece or in several.

    Attributes
    ----------
    rows : (n, width), as recorded rows
    parameters : (np,), or (n, np), at the rows
    breaks : indices of the last rows of all pieces but the last one
    """

    rows: Array
    parameters: Array
    breaks: NDArray[np.intp]


class _Pieces(NamedTuple):
    """Pieces of a run that are repeated.

    Attributes
    ----------
    parts : number of intervals within a step of the time grid
    number : of pieces
    width : number of rows of a piece
    duration : s, of a piece shorter than its rows; infinite otherwise
    """

    parts: int
    number: int
    width: int
    duration: float


def pieces(run: Run, rows: Array, statistics: Mapping[str, int | float], finer: float = 1.0) -> _Pieces:
    step, duration = run.settings["step"], float(rows[-1, 0] - rows[0, 0])
    own_steps = 0.0
    if run.method.chooses_steps:
        own_steps = float(statistics.get("own_steps") or statistics.get("expansions") or 0.0)
    parts = max(1, math.ceil(finer * own_steps * step / duration - 1e-9))
    steps = duration / step * parts
    count = 1 if steps <= _MOST else 8
    width = max(1, int((len(rows) - 1) * min(1.0, _MOST / steps) / count))
    most, interval = _MOST // count, duration / (len(rows) - 1)
    return _Pieces(parts, count, width, most * step / parts if width * interval * parts > most * step else math.inf)


def step_rows(
    run: Run,
    library: Library,
    rows: Array,
    parameters: Array,
    statistics: Mapping[str, int | float],
    *,
    finer: float = 1.0,
) -> StepRows | None:
    """Return rows at the ends of steps; None if the run cannot be repeated.

    Adaptive methods end their steps between rows of the time grid. Their rows come from the dense output, at the
    average spacing of the steps divided by ``finer``. Long runs are sampled in pieces, which end before the next row
    if the method takes thousands of steps between two rows.

    Parameters
    ----------
    rows, parameters : as recorded
    statistics : counts of the stepper
    """
    step = run.settings["step"]
    parts, count, width, most = pieces(run, rows, statistics, finer)
    if parts == 1 and run.every == 1:
        return StepRows(rows, parameters, np.empty(0, dtype=np.intp))
    if run.controllers is not None:
        return None
    begins = np.unique(np.linspace(0, len(rows) - 1 - width, count).astype(int)) if count > 1 else [0]
    result, present, breaks = [], [], []
    for begin in begins:
        last = min(begin + width, len(rows) - 1) if count > 1 else len(rows) - 1
        held = parameters if parameters.ndim == 1 else parameters[[begin, last]]
        ends = rows[[begin, last]]
        ends[1, 0] = min(ends[1, 0], ends[0, 0] + most)
        length = float(ends[1, 0] - ends[0, 0])
        span = Span(ends, held, 1, max(1, round(length / step)))
        piece = comparison_run(run, library, span, multiple=step / parts / min(step, length), every=1)
        if piece.interrupted or len(piece.rows) < 2:
            return None
        result.append(piece.rows)
        present.append(np.broadcast_to(piece.parameters, (len(piece.rows), piece.parameters.shape[-1])))
        breaks.append(len(piece.rows))
    joined = present[0][0] if parameters.ndim == 1 else np.concatenate(present)
    return StepRows(np.concatenate(result), joined, np.cumsum(breaks)[:-1] - 1)


#: Parts of each step at a level, and how much steeper than the average of its step a rate is at a jump.
_PARTS, _STEEPER = 16, 8.0


@np.errstate(all="ignore")  # of a run that leaves the finite numbers
def crosses_jumps(run: Run, rows: Array, parameters: Array, sizes: Array) -> bool:
    """Return whether accelerations or rates of internal states jump, for the step, on the path between rows (n, width):
    a large part of their change in a step belongs to a small part of the step.

    So do laws with comparisons, and laws of a width that the motion passes within a step, as the onset of a stop.
    Steps are divided towards zeros of comparisons, and steps of the largest bends towards the largest change.

    Parameters
    ----------
    sizes : (nv + nz,), of the motion and of internal states; jumps that move neither by a millionth do not count
    """
    if len(rows) < 4:
        return False
    try:
        path = StepPath(run, rows, parameters)
        rates = np.hstack([path.states.a, path.slopes]) if run.model.nz else path.states.a
        span = np.append(np.full(run.model.nv, np.ptp(path.states.t)), np.ones(run.model.nz))[: rates.shape[1]]
        # a jump has an effect on the motion
        least = 1e-6 * sizes / (run.settings["step"] * span)
        bends = np.zeros(len(rows))
        change = rates[1:] - rates[:-1]
        bends[1:-1] = (np.abs(change[1:] - change[:-1]) / np.where(least > 0.0, least, np.inf)).max(axis=1, initial=0.0)
        bent = np.maximum(bends[:-1], bends[1:])
        places = [expression for expression in _places(run) if path.knows(expression)]
        examined_steps = 16
        signs = [np.sign(path.values(expression, path.at_rows)) for expression in places]
        crossings = [np.flatnonzero(sign[1:] * sign[:-1] < 0.0)[:examined_steps] for sign in signs]
        order = np.argsort(bent)
        most = order[-examined_steps:]
        most = most[bent[most] > _STEEPER * bent[order[len(order) // 2]]]  # bends of all steps alike are rounding
        examined = [*zip(places, crossings, strict=True), (None, np.sort(most))]
        return any(_jumps(path, expression, steps, least) for expression, steps in examined if len(steps))
    except (EomgenError, np.linalg.LinAlgError):
        return False


def _places(run: Run) -> list[Formula]:
    """Return the expressions at whose zeros formulas of a model have jumps, except expressions of time alone. The
    result is kept in the library."""
    store = run.model.library.kept
    if "jumps" not in store:
        every = [term for formula in run.model.description.formulas for term in jumps(formula)]
        store["jumps"] = [term for term in every if any(symbol.kind != "time" for symbol in symbols(term))]
    result: list[Formula] = store["jumps"]
    return result


def _jumps(path: StepPath, expression: Formula | None, steps: NDArray[np.intp], least: Array) -> bool:
    """Return whether accelerations or rates of internal states jump within one of some steps. Each step, by the index
    of its first row, is cut into smaller and smaller intervals: about a sign change of `expression`, or with
    None about the largest change of the rates. A jump has a change above `least` (nv + nz,) that is much steeper than
    the average over the step."""
    step, (low, high) = path.run.settings["step"], (path.states.t[steps + k] for k in (0, 1))
    rows, share, slopes = np.arange(len(steps)), np.linspace(0.0, 1.0, _PARTS + 1), np.zeros(0)
    for _ in range(2 + math.ceil(math.log(max(1.0, float(np.max(high - low)) / step), _PARTS))):
        times = low[:, np.newaxis] + (high - low)[:, np.newaxis] * share
        there = path.at(times.ravel(), np.repeat(steps, _PARTS + 1))
        rates = path.rates(there).reshape(*times.shape, -1)
        changes = np.abs(np.diff(rates, axis=1))
        marks = np.nan_to_num(changes / least, nan=0.0).max(axis=2)
        if expression is not None:
            signs = np.sign(path.values(expression, there)).reshape(times.shape)
            marks = signs[:, 1:] != signs[:, :1]
        part = np.argmax(marks, axis=1)
        if not len(slopes) or np.max(high - low) > step:  # of the step, not of the interval between sparse rows
            slopes = changes.sum(axis=1) / (high - low)[:, np.newaxis]  # not the net change, 0 about an extremum
        low, high = times[rows, part], times[rows, part + 1]
        change, width = changes[rows, part], (high - low)[:, np.newaxis]
        if np.any((change > least) & (change > _STEEPER * slopes * width) & (_STEEPER * width < step)):
            return True
    return False
