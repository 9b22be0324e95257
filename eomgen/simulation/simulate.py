"""simulate: from an initial state to a Solution; validation, the compiled time loop, outputs and energies; a second run
with bounded steps if the first one misses a law between its steps.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from functools import partial
from typing import Any

import numpy as np

from eomgen.base.arrays import count_of
from eomgen.base.calls import checked_call
from eomgen.base.data import replace
from eomgen.base.messages import Log
from eomgen.base.progress import Progress, shown
from eomgen.compiled.arguments import number_of
from eomgen.compiled.functions import by_one_library
from eomgen.compiled.initial_state import InitialState, angles_of_several_turns, check_initial
from eomgen.compiled.model import CompiledModel
from eomgen.compiled.terms import Parameters
from eomgen.errors import Problem, UsageError
from eomgen.integrators.families.family import BAD_ARGUMENT
from eomgen.results.solution import Solution
from eomgen.simulation.automatic_method import method_of
from eomgen.simulation.checkpoint import CheckpointWriter, checkpoint_writer
from eomgen.simulation.judgement.finished_run import RunStart
from eomgen.simulation.motions import refuse_as_inputs
from eomgen.simulation.option_types import KNOWN_ELSEWHERE
from eomgen.simulation.outcome import Outcome
from eomgen.simulation.stepping.chunks import Trajectory, run_chunks
from eomgen.simulation.stepping.controllers import Controller, read_controllers
from eomgen.simulation.stepping.inputs import HeldRows, InputSignals, Signal, check_held, read_signals
from eomgen.simulation.stepping.run import Run, scene_inputs
from eomgen.simulation.stepping.settings import check_memory, chosen_stepper, positive
from eomgen.simulation.stepping.states import start_description, start_of, starts_at_equilibrium
from eomgen.simulation.stepping.stepper import Stepper
from eomgen.simulation.stepping.time_grid import time_grid

_LOG = Log(__name__)


#: Cost of all runs with a bound: the limit of their steps is ``_TIMES`` times the steps of the run without a bound, as
#: users wait for that without asking, or ``_STEPS`` divided by the number of velocities and internal states, about a
#: second. Steps are counted, not seconds, so that the same run is bounded on every machine.
_TIMES, _STEPS = 30.0, 1e5
#: Maximum number of runs with a bound: the first bound is of the width along a path that the law has not changed.
_ROUNDS = 3
#: Least factor by which a bound is reduced if the bound is too large.
_SMALLER = 0.5
#: Ratio of the steps of a run with a bound to the steps that the bound explains, above which the run is given up: steps
#: become tiny at a jump that holds the motion.
_GIVEN_UP = 4.0


class CostlyRunError(Exception):
    """A run with a bound takes many more steps than the bound explains."""


def with_bounded_steps(outcome: Outcome, stepped: Callable[[Run, float], Outcome], *, checkpoint: bool) -> Outcome:
    """Return the outcome of the run with bounded steps, if the steps pass over a law and the bound is affordable.

    Parameters
    ----------
    stepped : returns the outcome of another run from the same initial state, and writes its checkpoints; raises
        CostlyRunError if the run takes more steps than the second argument
    checkpoint : whether there are any, which have to be of the run that is returned
    """
    run, taken = outcome.run, own_steps(outcome.statistics)
    short = _STEPS / max(1, run.model.nv + run.model.nz)
    if taken > short:  # then the examination, which repeats the run, takes long as well
        return outcome
    left = max(_TIMES * taken, short)
    try:
        for _ in range(_ROUNDS):
            law = outcome.passed_over if outcome.has(("complete", "two rows")) else None
            if law is None or not law.step:
                break
            known = outcome.run.settings["largest_step"]
            bound = min(law.step, _SMALLER * known) if known else law.step
            steps = (run.grid.reached - run.grid.start) / bound
            left -= steps
            if left <= 0.0:
                break
            _LOG.info("%s: steps of at most %.3g s, for %s", run.model.name, bound, law.law)
            settings = {**run.settings, "largest_step": bound}
            try:
                bounded = stepped(replace(run, settings=settings, bounded_for=law.law), _GIVEN_UP * (steps + taken))
            except CostlyRunError:
                outcome = stepped(outcome.run, math.inf) if checkpoint else outcome
                break
            if not (bounded.complete or bounded.trajectory.interrupted):  # at a jump that no step is small enough for
                reason = f"with largest_step = {bound:.2g} it fails at t = {bounded.trajectory.rows[-1, 0]:.6g} s"
                hint = f"a method of fixed steps, of {bound:.2g} s ({reason})"
                outcome = stepped(outcome.run, math.inf) if checkpoint else outcome
                outcome.passed_over = law._replace(finding=replace(law.finding, hint=hint))
                break
            outcome = bounded
    except KeyboardInterrupt:  # in an examination after the run, which is complete
        pass
    return outcome


def own_steps(counts: Mapping[str, int | float]) -> float:
    """Return the number of steps chosen by a method, from the counts of its stepper; 1 before the first step."""
    return float(counts.get("own_steps") or counts.get("expansions") or 1)


@checked_call(
    **KNOWN_ELSEWHERE,
    **dict.fromkeys(("tend", "tf", "T", "duration", "time", "tspan", "t_span"), "t_end"),
)
@by_one_library
def simulate(
    model: CompiledModel,
    t_end: float | str | None = None,
    step: float | str | None = None,
    *,
    method: str | None = None,
    rho_inf: float | None = None,
    alpha: float | None = None,
    beta: float | None = None,
    gamma: float | None = None,
    order: int | None = None,
    tolerance: float | None = None,
    initial: Mapping[str, Any] | None = None,
    parameters: Parameters = None,
    inputs: Mapping[str, Signal] | None = None,
    controllers: Mapping[str, Controller] | None = None,
    record_every: int | None = None,
    t_start: float | str = 0.0,
    settings: Mapping[str, float] | None = None,
    progress: Progress | bool | None = None,
    checkpoint: str | os.PathLike[str] | None = None,
    checkpoint_every: int | None = None,
    start: str | None = None,
    error_estimate: bool = True,
) -> Solution:
    """Integrate the equations of motion on a grid of equal steps.

    Arguments default to the scene's values, and the method to the method of the model's library. A numerical failure,
    Ctrl-C and growth of the motion by an unstable method (``simulation.judgement.instability``) raise no error: the
    Solution then ends with the last good state, has ``success`` False and a message.

    Parameters
    ----------
    t_end : float or str
        End of the run, s, or with its unit: ``"2 min"``. A last step that would pass it is shortened to end there;
        tables of inputs have a point for its whole.
    step : float or str
        Step size, s, or with its unit: ``"5 ms"``.
    method : str
        The model's own by default. ``auto``: chosen once, before the run, from the eigenvalues of the equations at the
        start, the constraints, and whether forces are smooth; the message and ``metadata["method"]`` name the
        choice.

        - Generalized-alpha, implicit, order 2: ``generalized_alpha`` (also ``chung_hulbert``); with other updates
          of rotations ``generalized_alpha_f1``, ``generalized_alpha_f2``, ``generalized_alpha_spatial``; its cases
          ``hht``, ``wbz``, ``newmark`` and ``trapezoidal`` (also ``average_acceleration``); with steps by a
          tolerance ``generalized_alpha_adaptive``, ``hht_adaptive``, ``wbz_adaptive`` and ``trapezoidal_adaptive``.
          For constraints of index 3 ``generalized_alpha_index3``, ``generalized_alpha_index3_f1``,
          ``generalized_alpha_index3_f2``, ``generalized_alpha_index3_spatial``, ``hht_index3``, ``wbz_index3``,
          ``newmark_index3`` and ``trapezoidal_index3``.
        - Runge-Kutta, explicit: ``rk4`` (also ``rkmk4``, ``runge_kutta``), of order 4; ``rk45`` (also
          ``dormand_prince``, ``dopri5``), of order 5 with steps of its own between rows with the interval ``step``; by
          coordinate partitioning of constrained scenes ``rk4_partitioned`` (also ``partitioned``) and
          ``rk45_partitioned``.
        - ``taylor``, series of any order, with adaptive steps; ``step`` is the spacing of the time grid on which
          states are recorded.
        - For real time, of order 2, with one factorization a step and no iteration, on trees and loops:
          ``rosenbrock`` and ``lsrt2``; ``corrected_predictor`` for measured forces.
        - For long conservative motions, of order 2, on trees and constraints: ``rattlie``, which is variational.
          For constant inertia and forces independent of velocities, symplectic compositions of kicks and drifts:
          ``leapfrog``, ``minimum_norm2`` and ``bcss3`` of order 2, ``yoshida4``, ``suzuki4``, ``omf4`` and
          ``blanes_moan4`` of order 4, ``yoshida6``, ``suzuki6`` and ``blanes_moan6`` of order 6, ``yoshida8`` and
          ``kahan_li8`` of order 8.
        - For stiff motions at high accuracy, with one factorization a step and no iteration, time-discontinuous
          Galerkin methods in passes: ``tdg1`` and ``tdg1_star`` of order 3, ``tdg2s`` of order 4, ``tdg2`` of order
          5, ``tdg3`` of order 7.
    rho_inf : float
        Spectral radius of generalized-alpha at infinite frequency, 0 to 1; of ``hht`` 1/2 to 1, of ``wbz`` 0 to 1.
    alpha : float
        Numerical damping of ``hht`` (0 to 1/3), ``wbz`` or ``newmark`` (0 to 1), in place of ``rho_inf``.
    beta : float
        Of ``newmark``; 1/4 by default.
    gamma : float
        Of ``newmark``; 1/2 by default, above it the order is 1.
    order : int
        Of ``taylor``, 2 to 40; the order that suits the tolerance by default.
    tolerance : float
        Of the local error, relative to the motion within a step: ``generalized_alpha``, ``hht``, ``wbz``
        and ``trapezoidal`` then choose their steps between rows with the interval ``step``, and so does ``rk45``, by
        1e-8 by default. Of ``taylor``, relative to the changes of lengths and angles within a step, or to a hundredth
        of the machine and of 1 rad; of z relative to the largest, or to 1; 1e-12 by default. 0: each step of the time
        grid is one step, of the order that is given.
    initial : mapping
        ``q`` and ``v`` as arrays, or joints by name: ``{"hinge": 0.3}``, ``{"hinge": {"position": 0.3, "velocity":
        1.0}}``. Internal states: all as ``z`` (an array, or a mapping from names), or by name: ``{"filtered":
        0.2}``.
    parameters : mapping or array_like, optional
        Tunable parameters by name or (np,), SI units or texts with a unit; defaults of the scene if not given.
    inputs : mapping
        Name -> number, function of t, or array on the step grid (steps + 1 values, linear in between).
    controllers : mapping
        Name -> function of the sampled controllers that the scene leaves to the caller: ``f(t, signals)``, with
        declared memory ``f(t, signals, memory)``, gives the values that are held until the next sample. Each run of the
        error estimate has a new object of a class; a function that may keep data by itself is called in one run only.
    record_every : int
        Steps between recorded rows; the first and the last state are always recorded.
    t_start : float
        Time of the initial state, s.
    settings : mapping
        The stepper's own, by name. Of generalized-alpha: ``rtol`` and ``atol`` of its Newton iteration,
        ``max_iterations``, ``max_halvings`` of a step that fails, ``reuse`` of its matrix (0 or 1), and ``perturb`` of
        a start in index 3 (0 or 1). Of ``rosenbrock``: ``damped_start`` (0 or 1). Of ``corrected_predictor``:
        ``matrix_every``, the number of steps with one matrix, 0 for one matrix in the run. Of these, ``lsrt2`` and
        ``tdg1`` to ``tdg3``: ``stop_at_growth`` (0 or 1) that a step would damp. Of ``rosenbrock`` and ``lsrt2`` on
        loops: the largest ``drift`` off the constraints, a share. Of ``rattlie``: ``rtol``, ``max_iterations``, and
        which ``multipliers`` rows have (0 to 3). Of methods with adaptive steps: ``largest_step``, s; 0 for 64 steps of
        the time grid (``taylor``: 256).
    progress : callable or True
        Called with (steps done, all steps) some ten times a second; the steps of the error estimate are counted
        too. True shows a bar, in notebooks and on terminals.
    checkpoint : path
        File from which the run can go on to the same bits, written at the start, at the end, at Ctrl-C and meanwhile.
        ``model.resume`` reads the file.
    checkpoint_every : int
        Steps between two checkpoints; one a minute by default.
    start : str
        ``initial``: the initial state; ``equilibrium``: static equilibrium near the initial state, with the initial
        velocities. The scene's if neither this nor ``initial`` is given.
    error_estimate : bool
        Whether to estimate the discretisation error by runs at other steps or tolerances: ``Solution.error``, and
        whether to look for laws and events between the steps; a search that is left out is named there.

    Returns
    -------
    Solution
        States at the recorded times, with outputs, energies, findings and estimated error.

    Raises
    ------
    UsageError
        Anything that is wrong before the run starts, by name; a controller's function that fails.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> run = model.simulate(0.1, 1e-3, method="rk4")
    >>> run.success, run.q.shape
    (True, (101, 2))
    """
    defaults = model.functions.library.layout["defaults"]
    step = positive("step", defaults["step"] if step is None else step)
    t_first = number_of("t_start", t_start)
    end = number_of("t_end", t_first + defaults["duration"] if t_end is None else t_end)
    every = count_of("record_every", defaults["record_every"] if record_every is None else record_every)
    p = model.evaluator.one_set(parameters, "one run for each")
    given = {"rho_inf": rho_inf, "alpha": alpha, "beta": beta, "gamma": gamma, "order": order, "tolerance": tolerance}
    method, choice = method_of(model, method, initial, p, t_first, step, given)
    chosen = chosen_stepper(model, method, given, settings)
    library = chosen.library
    grid = time_grid(t_first, end, step, library.real)
    stepper_settings = chosen.settings_at(step)
    functions = read_controllers(controllers, library.layout)
    stepper = Stepper(library, stepper_settings, p, functions)
    check_memory(grid.steps // every + 2, stepper.sizes["row"])
    refuse_as_inputs(inputs, [motion.name for motion in model.description.motions])
    from_caller = read_signals(inputs, model.inputs, grid.steps, model.input_units)
    chosen.check_span(model, None if parameters is None else p, from_caller, grid)
    if chosen.method.inputs == "series":
        check_held(chosen.name, from_caller)
    signals = InputSignals(model.inputs, from_caller, scene_inputs(model, p), step, t_first, chosen.left_to_stepper)
    check_initial(initial)
    of_scene = str(defaults["start"])
    at_rest = starts_at_equilibrium(start, initial is not None, of_scene)
    begun = start_description(equilibrium_start=at_rest, given=bool(initial), chosen=start, of_scene=of_scene)
    made = partial(
        Run, model, chosen.name, chosen.method, stepper_settings, p, signals, grid, every, controllers=functions
    )
    if parameters is None and not initial and not from_caller:
        state, corrections, doubts = chosen.start(
            (t_first, at_rest), lambda: start_of(made(), None, equilibrium_start=at_rest, changed=False)
        )
    else:
        changed = bool(initial) or parameters is not None
        state, corrections, doubts = start_of(made(), initial, equilibrium_start=at_rest, changed=changed)
    run = made(list(corrections), begun)
    beginning = RunStart(state, at_rest, doubts, choice, angles_of_several_turns(model, initial))
    writer = checkpoint_writer(run, library, checkpoint, checkpoint_every)
    told = _LOG.enabled
    with nullcontext() if progress is None else shown(progress, model.name) as reported:
        report = reported
        if error_estimate and reported is not None:
            from eomgen.simulation.accuracy.error_estimation import ErrorEstimation  # noqa: PLC0415  # on request

            report = ErrorEstimation(reported).shown(run, grid.steps)
        judged = partial(Outcome, beginning=beginning, estimated=error_estimate, progress=reported)
        outcome = _outcome(run, stepper, beginning.state, report, writer, judged)
        if chosen.finds_bound and functions is None:

            def again(bounded: Run, most: float) -> Outcome:
                other = Stepper(library, bounded.settings, p)
                rewritten = checkpoint_writer(bounded, library, checkpoint, checkpoint_every)

                def watch(done: int, total: int) -> None:
                    if own_steps(other.statistics) > most:
                        raise CostlyRunError
                    if report is not None:
                        report(done, total)

                return _outcome(bounded, other, beginning.state, watch, rewritten, judged)

            outcome = with_bounded_steps(outcome, again, checkpoint=writer is not None)
        called = functions is not None or any(map(callable, from_caller.values()))
        foreign = called or reported is not None or writer is not None
        cut_short = bool(outcome.trajectory.status) or outcome.trajectory.interrupted
        solution = outcome.solution(at_once=told or foreign or cut_short)
    if told:
        wall = solution.stats["wall_time"]
        _LOG.info("ran %s with %s in %.3g s: %s", model.name, chosen.name, wall, solution.message)
    return solution


def _outcome(
    run: Run,
    stepper: Stepper,
    state: InitialState,
    report: Progress | None,
    writer: CheckpointWriter | None,
    judged: Callable[..., Outcome],
) -> Outcome:
    """Return the outcome of a run from a state, which ``judged`` makes of run, stepper, trajectory, seconds and
    writer."""
    began = time.perf_counter()
    trajectory = _stepped(run, stepper, state, report, writer)
    stepper.close()
    return judged(run, stepper, trajectory, time.perf_counter() - began, writer)


def _stepped(
    run: Run, stepper: Stepper, state: InitialState, progress: Progress | None, writer: CheckpointWriter | None
) -> Trajectory:
    """Return the trajectory of a run from a state. Raises UsageError if the stepper refuses its settings."""
    grid, model = run.grid, run.model
    driven = run.driven
    table = None
    if isinstance(driven, HeldRows):
        table = driven.over(len(stepper.input_times))
    elif driven is not None:
        first = (grid.step if grid.whole else grid.rest) * stepper.input_times
        table = driven(grid.start + first)
    status = stepper.initialize(grid.start, state.q, state.v, table, state.z)
    if status == BAD_ARGUMENT.number:
        fault = f"{run.name} refuses {_listed(run.settings)}: {stepper.status_text(status)} [E2028]"
        raise UsageError(Problem("settings", fault, "the defaults"))
    if status:
        unknown = np.full(model.nv + len(model.multipliers), np.nan)
        rows = np.concatenate([[grid.start], state.q, state.v, unknown, state.z])[np.newaxis]
        return Trajectory(rows, status, False, 0)
    if writer is not None:
        writer.write(stepper, 0)  # a path without write access is reported before the run, not after it
    return run_chunks(stepper, grid, min(run.every, grid.steps + 1), driven, progress, writer)


def _listed(settings: Mapping[str, float]) -> str:
    return ", ".join(f"{name} = {value:.6g}" for name, value in settings.items())
