"""simulate: from an initial state to a Solution; the compiled time loop, outputs and energies."""

from __future__ import annotations

import os
from collections.abc import Mapping
from contextlib import nullcontext
from typing import Any

from eomgen.base.arrays import count_of
from eomgen.base.calls import checked_call
from eomgen.base.messages import Log
from eomgen.base.progress import Progress, show_progress
from eomgen.compiled.arguments import number_of
from eomgen.compiled.functions import by_one_library
from eomgen.compiled.initial_state import angles_of_several_turns
from eomgen.compiled.model import CompiledModel
from eomgen.compiled.terms import Parameters
from eomgen.results.solution import Solution
from eomgen.simulation.bounded_steps import bound_steps
from eomgen.simulation.execution import Execution
from eomgen.simulation.judgement.finished_run import RunStart
from eomgen.simulation.option_types import KNOWN_ELSEWHERE
from eomgen.simulation.request import RunRequest, read_request
from eomgen.simulation.stepping.controllers import Controller, read_controllers
from eomgen.simulation.stepping.inputs import Signal
from eomgen.simulation.stepping.run import Run
from eomgen.simulation.stepping.settings import ChosenStepper
from eomgen.simulation.stepping.time_grid import time_grid

_LOG = Log(__name__)


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
        1.0}}``, ``{"v.hinge": 1.0}``. Internal states: all as ``z`` (an array, or a mapping from names), or by name:
        ``{"filtered": 0.2}``.
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
    request = read_request(model, step, t_start, parameters, initial, start)
    defaults = model.functions.library.layout["defaults"]
    end = number_of("t_end", request.t + defaults["duration"] if t_end is None else t_end)
    every = count_of("record_every", defaults["record_every"] if record_every is None else record_every)
    options = {"rho_inf": rho_inf, "alpha": alpha, "beta": beta, "gamma": gamma, "order": order, "tolerance": tolerance}
    chosen, choice = request.choose_stepper(method, options, settings)
    grid = time_grid(request.t, end, request.step, chosen.library.real)
    run = request.run(chosen, grid, every, inputs, read_controllers(controllers, chosen.library.layout))
    chosen.check_span(run, changed=request.changed)
    told = _LOG.is_enabled
    beginning = _begin(request, chosen, run, choice)
    with nullcontext() if progress is None else show_progress(progress, model.name) as reported:
        execution = Execution(chosen.library, checkpoint, checkpoint_every, reported, estimated=error_estimate)
        outcome = execution.outcome(run, beginning)
        if chosen.finds_bound and run.controllers is None:
            outcome = bound_steps(outcome, execution, beginning)
        # attributes that call functions of the caller, or are shown, are evaluated before the solution is returned
        called = run.controllers is not None or any(map(callable, run.signals.given.values()))
        shows = told or reported is not None or outcome.writer is not None
        cut_short = bool(outcome.trajectory.status) or outcome.trajectory.interrupted
        solution = outcome.solution(at_once=called or shows or cut_short)
    if told:
        wall = solution.stats["wall_time"]
        _LOG.info("ran %s with %s in %.3g s: %s", model.name, chosen.name, wall, solution.message)
    return solution


def _begin(request: RunRequest, chosen: ChosenStepper, run: Run, choice: str) -> RunStart:
    """Return the start of a run: its initial state on the constraints, doubts, and `choice`, the reason of ``auto``.
    Corrections of the initial state are appended to ``run.corrections``. The start of an earlier run with the chosen
    stepper is used again if the caller gives no parameters, initial values and inputs."""
    if request.changed or request.initial or run.signals.given:
        state, corrections, doubts = request.initial_state(run)
    else:
        state, corrections, doubts = chosen.start((request.t, request.at_rest), lambda: request.initial_state(run))
    run.corrections.extend(corrections)
    return RunStart(state, request.at_rest, doubts, choice, angles_of_several_turns(request.model, request.initial))
