"""Stability of periodic motions by Floquet multipliers: the motion by runs over one period, its start by Newton's
method, linear models along the motion."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from eomgen.base.arrays import Array, Complex
from eomgen.base.calls import checked_call
from eomgen.base.progress import Progress
from eomgen.base.progress import show_progress as shown_progress
from eomgen.base.rounding import COMPUTED, SUMMED
from eomgen.compiled.arguments import number_of
from eomgen.compiled.coordinates import StateArrays
from eomgen.compiled.initial_state import angles_of_several_turns, check_initial
from eomgen.compiled.model import CompiledModel
from eomgen.compiled.terms import Parameters
from eomgen.errors import EomgenError, ModelError, NumericalError, Problem, UsageError
from eomgen.lie.product import difference, update
from eomgen.products.linear.analyses.solutions import about_row
from eomgen.products.linear.floquet import PLACES, Floquet, monodromy, multipliers
from eomgen.products.linear.linearization import Linearization
from eomgen.products.linear.spectra.road import check_positive
from eomgen.results.solution import Solution
from eomgen.simulation.option_types import KNOWN_ELSEWHERE
from eomgen.simulation.simulate import simulate
from eomgen.simulation.stepping.inputs import Signal

#: Numbers of intervals of the collocation, doubled until the monodromy matrix is known.
_FIRST, _LAST = 8, 512
#: Tolerated change over a period, as a part of the size of the motion.
_PERIODIC = 1e-8
#: Limit of the corrections of a start.
_CORRECTIONS = 8


@checked_call(**KNOWN_ELSEWHERE, **dict.fromkeys(("T", "t_end", "tend", "duration"), "period"))
def floquet(
    model: CompiledModel,
    period: float,
    *,
    initial: Mapping[str, Any] | None = None,
    parameters: Parameters = None,
    inputs: Mapping[str, Signal] | None = None,
    t_start: float = 0.0,
    tolerance: float = 1e-6,
    method: str | None = None,
    progress: Progress | bool | None = None,
) -> Floquet:
    """Return Floquet multipliers: the growth of small deviations from a periodic motion over one period.

    For rotors with two blades, shafts with unequal stiffness, parametric excitation. The motion starts at ``initial``;
    if the motion is not periodic, its start is corrected by Newton's method. Angles may grow by
    whole turns. Multipliers of deviations that lead along the motion or along a family of motions are 1.

    Parameters
    ----------
    period : float
        Of the motion and of the equations, s: 2 pi / speed of a rotor.
    initial, parameters, inputs : mapping, optional
        As of ``simulate``.
    t_start : float, optional
        Time at which the period starts, s.
    tolerance : float
        Relative error of the monodromy matrix, below 0.1, estimated by differences from fewer intervals.
    method : str
        Method of integration of the motion; ``rk45``, or ``rk45_partitioned`` under constraints, by default.
    progress : callable or bool, optional
        Called with (steps done, all steps); True shows a bar. The steps are linear models; their number grows with each
        correction of the start.

    Returns
    -------
    Floquet
        ``multipliers``, ``exponents`` (frequencies but for multiples of 1 / period), ``stability``, ``error``.

    Raises
    ------
    UsageError
        Arguments that cannot be taken.
    ModelError
        Sampled states, or a motion with events: deviations jump there.
    NumericalError
        The motion is not periodic, or the matrix is not known to the tolerance, as of forces with kinks.

    Examples
    --------
    >>> model = eomgen.build("examples/quarter_car/scene.toml")
    >>> model.floquet(0.5, inputs={"road": 0.0}).stability
    'stable'
    """
    check_positive("period", period, "floquet(period=2.0), s")
    tolerance = number_of("tolerance", tolerance, "number")
    if not 0.0 < tolerance < 0.1:  # multipliers with larger errors have no digit
        fault = f"the tolerance must lie in 0..0.1, not {tolerance:g} [E0353]"
        raise UsageError(Problem("floquet", fault, "tolerance=1e-6"))
    check_initial(initial)
    for note in angles_of_several_turns(model, initial):
        warnings.warn(f"floquet: {note}", RuntimeWarning, stacklevel=4)
    chosen = method or ("rk45_partitioned" if model.multipliers else "rk45")
    options = {"parameters": parameters, "inputs": inputs, "t_start": t_start, "method": chosen, "tolerance": SUMMED}
    with shown_progress(progress, f"{model.name}: multipliers") as report:
        orbit = _Orbit(model, float(period), options, report)
        start, corrections = _periodic_start(orbit, initial)
        known = _converge(orbit, start, tolerance, _FIRST)
    begin = row_of(orbit.run(start, _FIRST), 0)
    started: tuple[Any, ...] = (begin.q, begin.v, begin.z, corrections, model.name)
    return Floquet(orbit.period, known.matrix, known.states, *known.multipliers, *started)


class _Monodromy(NamedTuple):
    """A monodromy matrix by so many intervals; multipliers with uncertainties, and the error of the matrix."""

    matrix: Array
    intervals: int
    states: tuple[str, ...]
    multipliers: tuple[Complex, Array, float]


def _converge(orbit: _Orbit, start: Any, tolerance: float, count: int) -> _Monodromy:
    """Return the monodromy matrix with an estimated error below `tolerance`, from `count` intervals or more.

    The number of intervals is doubled up to 512; the error is estimated from a half and a quarter of the intervals.

    Raises
    ------
    NumericalError
        The largest number of intervals does not suffice.
    """
    error = math.inf
    while count <= _LAST:
        matrices, states = orbit.matrices(start, count)
        fine, half, quarter = (monodromy(matrices[::times], orbit.period) for times in (1, 2, 4))
        known = multipliers(fine, half, quarter)
        error = known[2]
        if error <= tolerance:
            return _Monodromy(fine, count, states, known)
        count *= 2
    fault = f"the monodromy matrix is known to {error:.2g} only, with {PLACES * _LAST} linear models [E2009]"
    hint = "a larger tolerance; or forces without kinks, and a model without fast modes"
    raise NumericalError(Problem("floquet", fault, hint))


class _Return(NamedTuple):
    """Differences between end and start of a period: changes (2 nv + nz,) of q (left-trivialised, without whole turns),
    v, z. ``turns`` (nv,) are the angles of whole turns in rad; ``part`` is the largest change as a part of the size of
    the motion, ``words`` names it."""

    changes: Array
    turns: Array
    part: float
    words: str


class _Orbit:
    """Simulations of a model over one period, with linear models along the motion. `options` are keyword arguments of
    ``simulate``; linear models of the last start are kept for repeated use."""

    def __init__(
        self, model: CompiledModel, period: float, options: dict[str, Any], report: Progress | None = None
    ) -> None:
        self.model, self.period, self.options, self.report = model, period, options, report
        self.finished = 0
        self.begin = float(options["t_start"])
        #: Matrices of the linear models by the place in the period, and names of the states, of the last start.
        self.known: dict[int, tuple[Array, tuple[str, ...]]] = {}

    def run(self, start: Any, count: int) -> Solution:
        """Return the simulated motion over the period with 6 `count` + 1 rows, for `count` intervals of the
        collocation. `start` is a StateArrays or the ``initial`` of ``simulate``. Raises ModelError for events,
        NumericalError for a run that ends early."""
        if isinstance(start, StateArrays):
            start = {"q": start.q, "v": start.v, **({"z": start.z} if self.model.nz else {})}
        rows = PLACES * count
        end = self.begin + self.period
        run = simulate(self.model, end, self.period / rows, initial=start, error_estimate=False, **self.options)
        if len(run.events):
            fault = f"the motion has an event, {run.events.names[0]}, at which deviations jump [E2010]"
            raise ModelError(Problem("floquet", fault, "a motion without events, or simulate"))
        if len(run.t) != rows + 1:
            fault = f"the motion ends early: {run.message} [E2011]"
            raise NumericalError(Problem("floquet", fault, "another initial state"))
        return run

    def linear(self, run: Solution, state: StateArrays) -> Linearization:
        """Return the linear model about a state of a run. Raises ModelError for sampled states."""
        assert run.model is not None  # for mypy
        line = about_row(run.model, state)
        if line.sampled is not None:
            fault = "the scene has sampled states, which change at instants [E2012]"
            raise ModelError(Problem("floquet", fault, "linearize().sampled_loop(), or continuous states"))
        return line

    def matrices(self, start: Any, count: int) -> tuple[Array, tuple[str, ...]]:
        """Return the matrices A of the linear models along the motion, (6 count + 1, ns, ns), and names of the ns
        states. Matrices known from fewer intervals are used again. Raises NumericalError if the independent coordinates
        change."""
        places = [k * (_LAST // count) for k in range(PLACES * count + 1)]
        missing = [(k, sample) for k, sample in enumerate(places) if sample not in self.known]
        run = self.run(start, count)
        for done, (k, sample) in enumerate(missing):
            if self.report is not None:
                self.report(self.finished + done, self.finished + len(missing))
            space = self.linear(run, row_of(run, k)).state_space()
            self.known[sample] = space.A, space.states
        self.finished += len(missing)
        names = self.known[0][1]
        if any(self.known[sample][1] != names for sample in places):
            fault = "the independent coordinates change along the motion, as constraints ask for [E2013]"
            raise NumericalError(Problem("floquet", fault, "joint coordinates in which one set serves all along"))
        return np.array([self.known[sample][0] for sample in places]), names

    def correct(self, run: Solution, changes: Array, matrix: Array) -> StateArrays:
        """Return the start of a run after a Newton step that removes the changes over the period to first order.
        `changes` (2 nv + nz,) are the differences of q, v and z over the period, `matrix` (ns, ns) is the monodromy
        matrix. The new start is on the constraints. Linear models of the old start are forgotten."""
        self.known.clear()
        row, nv = row_of(run, 0), self.model.nv
        free = self.linear(run, row).free
        x = np.linalg.lstsq(free.R, changes[:nv])[0]
        y = np.linalg.lstsq(free.S, changes[nv : 2 * nv] - free.T @ x)[0]
        change = np.concatenate([x, y, changes[2 * nv :]])
        step = np.linalg.lstsq(np.eye(len(matrix)) - matrix, change, rcond=COMPUTED)[0]
        of_x, of_y, of_z = np.split(step, [len(x), len(x) + len(y)])
        q = update(self.model.factors, row.q, free.R @ of_x)
        v = row.v + free.S @ of_y + free.T @ of_x
        if self.model.multipliers:
            met = self.model.consistent(q, v, self.begin, parameters=self.options["parameters"])
            q, v = met.q, met.v
        return StateArrays(row.t, q, v, row.a, row.z + of_z)

    def change_over_period(self, run: Solution) -> _Return:
        """Return the differences of q, v and z between the last and the first row of a run, without whole turns of
        angles."""
        model = self.model
        sizes_of_q = np.ones(model.nv)
        turns, ends = np.zeros(model.nv), np.array(run.q[-1])
        for factor in model.factors:
            if factor.q_size != factor.v_size:
                continue
            angle = np.array([unit == "rad/s" for unit in model.v_units[factor.v]])
            whole = np.where(angle, np.round((run.q[-1, factor.q] - run.q[0, factor.q]) / (2.0 * np.pi)), 0.0)
            turns[factor.v] = 2.0 * np.pi * whole
            ends[factor.q] -= turns[factor.v]
            sizes_of_q[factor.v] = np.ptp(run.q[:, factor.q], axis=0) + 1.0
        of_q = difference(model.factors, run.q[0], ends)
        changes = np.concatenate([of_q, run.v[-1] - run.v[0], run.z[-1] - run.z[0]])
        sizes = [sizes_of_q, *(1.0 + np.abs(part).max(axis=0) for part in (run.v, run.z))]
        names = [*(f"q.{name.removeprefix('v.')}" for name in model.v_names), *model.v_names, *model.z_names]
        parts = np.abs(changes) / np.concatenate(sizes)
        k = int(np.argmax(parts))
        return _Return(changes, turns, float(parts[k]), f"{names[k]} changes by {changes[k]:.3g}")


def row_of(run: Solution, k: int) -> StateArrays:
    """Return t, q, v, a and z in row `k` of a run."""
    return StateArrays(run.t[k], run.q[k], run.v[k], run.a[k], run.z[k])


def _periodic_start(orbit: _Orbit, initial: Any) -> tuple[Any, int]:
    """Return the start of the periodic motion near the initial state, and the number of Newton corrections.

    The start is `initial` itself if no correction is needed, else a StateArrays.

    Raises
    ------
    NumericalError
        No motion of this period is found, or the equations have another period.
    """
    start, count = initial, _FIRST
    for correction in range(_CORRECTIONS + 1):
        run = orbit.run(start, _FIRST)
        after = orbit.change_over_period(run)
        if after.part <= _PERIODIC:
            _check_equations(orbit, run, after.turns)
            return start, correction
        if correction == _CORRECTIONS or not np.all(np.isfinite(after.changes)):
            break
        known = _converge(orbit, start, 1e-4, count)
        count = known.intervals
        start = orbit.correct(run, after.changes, known.matrix)
    fault = f"the motion is not periodic: in {orbit.period:.9g} s {after.words} [E2014]"
    hint = "the period of the motion and of the equations, and an initial state near the periodic motion"
    spins = [factor.name for factor in orbit.model.factors if np.any(after.turns[factor.v])]
    if spins:
        hint += f'; if {spins[0]} turns freely, a drive of this joint such as "w*t", for forces slow a free spin'
    raise NumericalError(Problem("floquet", fault, hint))


def _check_equations(orbit: _Orbit, run: Solution, turns: Array) -> None:
    """Raise NumericalError unless the equations have the period of the orbit: they are equal one period later, and
    equations that do not change within the period do not change afterwards.

    Parameters
    ----------
    run : one period of the motion
    turns : (nv,) angles by which coordinates advance in whole turns per period, rad, else 0
    """
    rows = [row_of(run, k) for k in (0, round(0.375 * (len(run.t) - 1)))]
    for now in rows:
        q = update(orbit.model.factors, now.q, turns)
        if changed := _change(orbit, run, now, now._replace(t=now.t + orbit.period, q=q)):
            at = f"the {changed} one period after t = {now.t:.6g} s"
            fault = f"the equations do not have the period {orbit.period:.9g} s: {at} [E2015]"
            raise NumericalError(Problem("floquet", fault, "a common period of the motion and of all laws of time"))
    now, inner = rows
    if _change(orbit, run, now, now._replace(t=inner.t)):
        return
    for later in (0.0137, 0.137, 1.37, 13.7, 137.0):  # s, whole periods of few laws
        if changed := _change(orbit, run, now, now._replace(t=now.t + later)):
            fault = f"the equations do not change within {orbit.period:.9g} s, and the {changed} {later:.6g} s later"
            raise NumericalError(Problem("floquet", f"{fault} [E2016]", "a longer period, in s, of all laws of time"))


def _change(orbit: _Orbit, run: Solution, now: StateArrays, then: StateArrays) -> str:
    """Return the first quantity that differs between two states, with the relative difference, in words. Compared are
    accelerations and the matrices A of the linear models about the states `now` and `then` of a run. Empty without a
    difference, and if a state has no linear model (a table of time ends)."""
    try:
        before, after = orbit.linear(run, now), orbit.linear(run, then)
    except ModelError:
        raise
    except EomgenError:  # a table that ends with the run
        return ""
    for name, first, second in (
        ("accelerations", before.reference.a, after.reference.a),
        ("coefficients", before.state_space().A, after.state_space().A),
    ):
        off = float(np.linalg.norm(second - first) / (1.0 + np.linalg.norm(first)))
        if off > 1e2 * _PERIODIC:
            return f"{name} differ by {off:.2g}"
    return ""
