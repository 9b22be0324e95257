"""simulate: from an initial state to a Solution; validation, the compiled time loop, outputs and energies."""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from functools import partial
from typing import Any

import numpy as np

from eomgen.calls import checked_call
from eomgen.compiled.arguments import count_of, number_of
from eomgen.compiled.initial_state import InitialState, angles_of_several_turns, check_initial
from eomgen.compiled.model import CompiledModel
from eomgen.compiled.terms import Parameters
from eomgen.errors import Problem, UsageError
from eomgen.integrators.families.family import BAD_ARGUMENT
from eomgen.progress import Progress, shown
from eomgen.results.solution import Solution
from eomgen.simulation.accuracy.error_estimation import ErrorEstimation
from eomgen.simulation.automatic_method import method_of
from eomgen.simulation.checkpoint import CheckpointWriter, checkpoint_writer
from eomgen.simulation.judgement.finished_run import Beginning
from eomgen.simulation.motions import refuse_as_inputs
from eomgen.simulation.option_types import KNOWN_ELSEWHERE
from eomgen.simulation.outcome import Outcome
from eomgen.simulation.stepping.chunks import Trajectory, run_chunks
from eomgen.simulation.stepping.controllers import Controller, read_controllers
from eomgen.simulation.stepping.inputs import HeldRows, InputSignals, Signal, check_held, read_signals
from eomgen.simulation.stepping.run import Run, scene_inputs
from eomgen.simulation.stepping.settings import check_memory, chosen_stepper, positive
from eomgen.simulation.stepping.start_state import start_description, start_of, starts_at_equilibrium
from eomgen.simulation.stepping.stepper import Stepper
from eomgen.simulation.stepping.time_grid import time_grid

_LOG = logging.getLogger(__name__)


@checked_call(
    **KNOWN_ELSEWHERE,
    **dict.fromkeys(("tend", "tf", "T", "duration", "time", "tspan", "t_span"), "t_end"),
)
def simulate(
    model: CompiledModel,
    t_end: float | None = None,
    step: float | None = None,
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
    t_start: float = 0.0,
    settings: Mapping[str, float] | None = None,
    progress: Progress | bool | None = None,
    checkpoint: str | os.PathLike[str] | None = None,
    checkpoint_every: int | None = None,
    start: str | None = None,
    error_estimate: bool = True,
) -> Solution:
    """Integrate the equations of motion on a grid of equal steps; options and errors as of ``Model.simulate``."""
    defaults = model.library.layout["defaults"]
    step = positive("step", defaults["step"] if step is None else step)
    end = number_of("t_end", t_start + defaults["duration"] if t_end is None else t_end)
    t_first = number_of("t_start", t_start)
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
    overridden = _overridden(corrections) if initial else []
    turned = angles_of_several_turns(model, initial) if initial else []
    beginning = Beginning(state, at_rest, [*doubts, *overridden], choice, turned)
    began = time.perf_counter()
    writer = checkpoint_writer(run, library, checkpoint, checkpoint_every)
    told = _LOG.isEnabledFor(logging.INFO)
    with nullcontext() if progress is None else shown(progress, model.name) as reported:
        wanted = ErrorEstimation(reported) if error_estimate else None
        report = wanted.shown(run, grid.steps) if wanted and reported else reported
        trajectory = _stepped(run, stepper, beginning.state, report, writer)
        stepper.close()
        outcome = Outcome(run, stepper, trajectory, time.perf_counter() - began, writer, wanted, beginning)
        called = functions is not None or any(map(callable, from_caller.values()))
        foreign = called or reported is not None or writer is not None
        solution = outcome.solution(at_once=told or foreign or bool(trajectory.status) or trajectory.interrupted)
    if told:
        wall = solution.stats["wall_time"]
        _LOG.info("ran %s with %s in %.3g s: %s", model.name, chosen.name, wall, solution.message)
    return solution


def _stepped(
    run: Run, stepper: Stepper, state: InitialState, progress: Progress | None, writer: CheckpointWriter | None
) -> Trajectory:
    """Return what a run from a state comes to. Raises UsageError where the stepper refuses its settings."""
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
        what = f"{run.name} refuses {_listed(run.settings)}: {stepper.status_text(status)}"
        raise UsageError(Problem("settings", what, "the defaults"))
    if status:
        unknown = np.full(model.nv + len(model.multipliers), np.nan)
        rows = np.concatenate([[grid.start], state.q, state.v, unknown, state.z])[np.newaxis]
        return Trajectory(rows, status, False, 0)
    if writer is not None:
        writer.write(stepper, 0)  # a path without write access is reported before the run, not after it
    return run_chunks(stepper, grid, min(run.every, grid.steps + 1), driven, progress, writer)


def _overridden(corrections: Sequence[str]) -> list[str]:
    """Return one sentence for each initial value that a drive overrides."""
    return [
        f"{text}: its drive prescribes it, and the initial value is not taken"
        for text in corrections
        if ": driven " in text
    ]


def _listed(settings: Mapping[str, float]) -> str:
    return ", ".join(f"{name} = {value:.6g}" for name, value in settings.items())
