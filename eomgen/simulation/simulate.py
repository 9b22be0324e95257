"""simulate: from an initial state to a Solution; validation, the compiled time loop, outputs and energies."""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from eomgen.analysis.bending import largest_bending
from eomgen.analysis.definiteness import inertia_warning, linear_range_exceeded
from eomgen.arrays import Array
from eomgen.calls import checked_call
from eomgen.compiled.arguments import number_of
from eomgen.compiled.initial_state import InitialState
from eomgen.compiled.model import CompiledModel
from eomgen.compiled.terms import Parameters
from eomgen.errors import Problem, UsageError
from eomgen.integrators.events import STATUSES, STOPPED
from eomgen.integrators.families.family import BAD_ARGUMENT
from eomgen.integrators.methods import AUTO, canonical_name
from eomgen.integrators.samples import CONTROLLER_ADVICE, CONTROLLER_FAILED
from eomgen.progress import Progress, shown
from eomgen.results.solution import Solution
from eomgen.simulation.automatic import automatic
from eomgen.simulation.checkpoint import CheckpointWriter
from eomgen.simulation.constraint_violation import largest_violation
from eomgen.simulation.controllers import Controller, read_controllers
from eomgen.simulation.diagnosis import advice, failure, fast_joint, first_non_finite, instability
from eomgen.simulation.energy_balance import FAILED, REPORTED, Balance, energy_balance
from eomgen.simulation.error_estimate import ErrorEstimation, no_estimate
from eomgen.simulation.events import acting, ending, parameters_over, table_of
from eomgen.simulation.fast_motions import unresolved_motion
from eomgen.simulation.growth import at_rest, own_growth, unstable_growth
from eomgen.simulation.inputs import InputSignals, Signal, check_held, jumps_known, kind_of, read_signals
from eomgen.simulation.momentum import momentum_drift
from eomgen.simulation.run import Run, checkpoint_writer, start_description, start_of, starts_at_equilibrium
from eomgen.simulation.run_model import run_model
from eomgen.simulation.settings import (
    check_memory,
    check_span,
    chosen_method,
    count_of,
    followed_laws,
    positive,
    stepper_library,
    stepper_settings,
)
from eomgen.simulation.singular_positions import nearest_singular, passages, singular_ahead, way_past, way_through
from eomgen.simulation.stepper import Stepper, Trajectory, run_chunks
from eomgen.simulation.time_grid import time_grid
from eomgen.simulation.unit_quaternions import largest_stretch
from eomgen.simulation.warnings import (
    run_warnings,
    starts_beyond_limits,
    unresolved_damping,
    unresolved_states,
)

_LOG = logging.getLogger(__name__)
_BATCH = 8192


@checked_call(
    u="inputs",
    dt="step",
    h="step",
    tend="t_end",
    tf="t_end",
    duration="t_end",
    time="t_end",
    tspan="t_end",
    t0="t_start",
    solver="method",
    integrator="method",
    p="parameters",
    rtol="settings",
    atol="settings",
    max_iterations="settings",
    **dict.fromkeys(("q", "v", "z", "q0", "v0", "x0", "y0"), "initial"),
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
    p = model.parameter_array(parameters)
    if p.ndim != 1:
        what = f"one set of parameters is needed, not a batch of shape {p.shape}"
        raise UsageError(Problem("parameters", what, "one run for each"))
    choice = ""
    if (model.description.simulation.method if method is None else method) == AUTO:
        method, choice = automatic(model, initial, p, t_first, step)
    name = canonical_name(model.library.layout["built_method"] if method is None else method, tolerance)
    given = {"rho_inf": rho_inf, "alpha": alpha, "beta": beta, "gamma": gamma, "order": order, "tolerance": tolerance}
    stepped_by = chosen_method(name, given, defaults, bool(model.multipliers))
    library = stepper_library(model, name, stepped_by)
    extra = {} if settings is None else settings
    if not isinstance(extra, Mapping):
        raise UsageError(
            Problem("settings", f"a mapping is needed, not {type(extra).__name__}", 'settings={"rtol": 1e-9}')
        )
    chosen = stepper_settings(library.layout["method"], step, stepped_by, extra)
    grid = time_grid(t_first, end, step, library.real)
    functions = read_controllers(controllers, library.layout)
    stepper = Stepper(library, chosen, p, functions)
    check_memory(grid.steps // every + 2, stepper.sizes["row"])
    from_caller = read_signals(inputs, model.inputs, grid.steps, model.input_units)
    check_span(model, library, stepped_by, p, from_caller, grid)
    if stepped_by.inputs == "series":
        check_held(name, from_caller)
    signals = InputSignals(
        model.inputs,
        from_caller,
        lambda times: model.input_values(times, parameters=p),
        step,
        t_first,
        jumps_known(library),
    )
    run = Run(model, name, stepped_by, chosen, p, signals, grid, every, controllers=functions)
    equilibrium_start = starts_at_equilibrium(start, initial is not None, str(defaults["start"]))
    changed = bool(initial) or parameters is not None
    state, corrections, at_rest = start_of(run, initial, equilibrium_start=equilibrium_start, changed=changed)
    begun = start_description(
        equilibrium_start=equilibrium_start, given=bool(initial), chosen=start, of_scene=str(defaults["start"])
    )
    run = replace(run, corrections=corrections, begun=begun)

    began = time.perf_counter()
    writer = checkpoint_writer(run, library, checkpoint, checkpoint_every)
    with shown(progress, model.name) as reported:
        wanted = ErrorEstimation(reported) if error_estimate else None
        report = wanted.shown(run, grid.steps) if wanted else reported
        trajectory = _stepped(run, stepper, state, report, writer)
        solution = solution_of(run, stepper, trajectory, time.perf_counter() - began, writer, wanted)
    outside = [] if equilibrium_start else starts_beyond_limits(model, state.q, p)
    of_scene = starts_beyond_limits(model, model.initial_q, model.parameter_array())
    notes = [*(note for note in solution.metadata["notes"] if note not in of_scene), *outside]
    message = "; ".join(filter(None, [solution.message, *_unresolved(run, state), *outside, *at_rest, choice]))
    if choice:
        notes = [*notes, choice]
    _LOG.info("ran %s with %s in %.3g s: %s", model.name, name, solution.stats["wall_time"], message)
    return replace(solution, message=message, metadata={**solution.metadata, "notes": notes})


def _stepped(
    run: Run, stepper: Stepper, state: InitialState, progress: Progress | None, writer: CheckpointWriter | None
) -> Trajectory:
    """Return what a run from a state comes to. Raises UsageError where the stepper refuses its settings."""
    grid, model = run.grid, run.model
    first = (grid.step if grid.whole else grid.rest) * stepper.input_times
    table = run.driven(grid.start + first) if run.driven else None
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
    return run_chunks(stepper, grid, min(run.every, grid.steps + 1), run.driven, progress, writer)


def _unresolved(run: Run, state: InitialState) -> list[str]:
    """Return what decays too fast at the start of a run for an explicit method."""
    limit, t = run.method.real_stability, run.grid.start
    if not limit:
        return []
    u = run.signals.rows(np.array([t]))[0] if run.driven else None
    judged = [unresolved_states] if run.model.multipliers else [unresolved_damping, unresolved_states]
    return [fault(run.model, state, t, u, run.parameters, run.settings["step"], limit) for fault in judged]


def solution_of(
    run: Run,
    stepper: Stepper,
    trajectory: Trajectory,
    wall: float,
    writer: CheckpointWriter | None = None,
    estimation: ErrorEstimation | None = None,
) -> Solution:
    """Return what a trajectory came to: its rows with outputs and energies, how it ended, and what there is to say
    about it."""
    model, p = run.model, run.parameters
    events = table_of(trajectory, stepper, p)
    last_run = replace(run, parameters=parameters_over(events, model, p, trajectory.rows[-1, 0]))
    message = _message(last_run, stepper, trajectory)
    ended = trajectory.status in (0, STOPPED.number)
    if writer is not None and ended:
        last = f"; the checkpoint {writer.path} holds its last state" if trajectory.interrupted else ""
        message += writer.problem or last
    statistics = stepper.statistics if not (not ended and not trajectory.steps) else {}
    t, q, v, a, multipliers, z = _split(trajectory.rows, model)
    present = parameters_over(events, model, p, t)
    outputs, energy = _evaluate(model, (t, q, v, a, multipliers, z), run.signals if run.driven else None, present)
    error = estimation.of(run, stepper.library, trajectory, present, wall) if estimation else no_estimate(run)
    success = ended and not trajectory.interrupted and trajectory.failure is None
    changes = acting(events, stepper.layout)
    jumps = np.concatenate([model.jumps_between(t, 1e-9 * (float(np.abs(t).max()) + 1.0)), changes])
    if error.available:
        taken = statistics.get("own_steps") or statistics.get("expansions") or max(trajectory.steps, 1)
        average = (float(t[-1]) - run.grid.start) / taken
        fast = unresolved_motion(run, trajectory.rows, average, events, changes, jumps)
        error = replace(error, unresolved=fast)
    conservative = model.library.layout["facts"]["conservative"] and not len(changes)
    single = model.library.real == "float"
    epsilon = float(np.finfo(np.float32 if single else np.float64).eps)
    between = run.every > 1 or run.method.chooses_steps  # there are steps between the rows
    balance = energy_balance(t, energy, jumps, conservative=conservative, sparse=between, epsilon=epsilon)
    if balance.error is not None and balance.error > REPORTED and at_rest(run, trajectory.rows):
        balance = Balance(0.0)
    if success:
        growth = unstable_growth(last_run, stepper.library, trajectory)
        cause = partial(_cause_besides_step, run, t, q, "events" in stepper.layout["method"])
        found = largest_violation(model, t, q, p, statistics.get("max_constraint", 0.0)), largest_stretch(model, t, q)
        violation = max(filter(None, found), key=lambda one: one.share, default=None)
        bending = largest_bending(model, t, q)
        driving = run.signals if run.driven else None
        still = len(changes) or at_rest(run, trajectory.rows)
        drift = "" if still else momentum_drift(model, (t, q, v, z), p, driving, multipliers)
        if fault := failure(growth, balance, energy, run.method, violation):
            success, message = False, f"{message}, but {fault}"
        elif warning := run_warnings(
            statistics, balance, run.settings["step"], cause, violation, error, drift, single=single
        ):
            success = balance.gain <= FAILED or (between and not conservative)  # rows may miss a pulse of power
            message = f"{message}{'; ' if success else ', but '}{warning}"
        if bending is not None and success:
            success = bending.possible
            message = f"{message}{'; ' if success else ', but '}{bending}"
        if success and error.unresolved:
            message = f"{message}; {error.unresolved}"
        if stepper.controllers is not None and (cost := stepper.controllers.cost(wall)):
            message = f"{message}; {cost}"
        if passed := passages(int(statistics.get("singular_passages", 0))):
            message = f"{message}; {passed}"
    if balance.error is not None:
        statistics = {**statistics, "energy_error": balance.error}
    of_method, of_scene = run.method.warnings(bool(model.multipliers)), tuple(model.library.layout["warnings"])
    badly_followed = followed_laws(model, run.method, run.parameters, run.grid)[1]
    message, notes = "; ".join((message, *of_scene, *of_method, *badly_followed)), [*model.notes, *of_method]
    described = _metadata(run) | ({} if events is None else {"events": events.described()})
    return Solution(
        t=t,
        q=q,
        v=v,
        a=a,
        z=z,
        multipliers=multipliers,
        outputs=outputs,
        energy=energy,
        stats={**statistics, "wall_time": wall},
        message=message,
        success=success,
        interrupted=trajectory.interrupted,
        metadata={
            **described,
            "start": run.begun,
            "corrections": run.corrections,
            "notes": notes,
            "energy_balance": str(balance),
        },
        model=run_model(run, stepper.library, events),
        events=events,
        error=error,
    )


def _cause_besides_step(run: Run, t: Array, q: Array, has_events: bool) -> str:
    """Return what a doubtful run suffers from besides too large a step, and what to try; empty where nothing is
    found."""
    if beyond := linear_range_exceeded(run.model, t, q, run.parameters):
        return beyond
    if run.method.chooses_steps:
        finer = f"try: a tolerance smaller than {run.settings['tolerance']:.3g}"
        looks = f", or a step smaller than {run.settings['step']:.3g} s, in each of which events are looked for"
        return f"{finer}{looks if has_events else ''}"
    singular = nearest_singular(run.model, t, q, run.parameters)
    return f"{singular.what}; try: {way_through(run.method, run.settings['step'])}" if singular else ""


def _listed(settings: Mapping[str, float]) -> str:
    return ", ".join(f"{name} = {value:.6g}" for name, value in settings.items())


def _message(run: Run, stepper: Stepper, trajectory: Trajectory) -> str:
    model, p, settings = run.model, run.parameters, run.settings
    t = trajectory.rows[-1, 0]
    if trajectory.failure is not None:
        return (
            f"stopped at t = {t:.9g} s, after {trajectory.steps} of {run.grid.steps} steps:"
            f" {trajectory.failure.problems[0]}"
        )
    if trajectory.interrupted:
        return f"interrupted at t = {t:.9g} s, after {trajectory.steps} of {run.grid.steps} steps"
    if trajectory.status == 0:
        return f"reached t = {t:.9g} s in {trajectory.steps} steps{_own_steps(stepper.statistics)}"
    if sentence := ending(trajectory.status, stepper):
        taken = f"{trajectory.steps} of {run.grid.steps} steps{_own_steps(stepper.statistics)}"
        sentence = f"{sentence}, after {taken}"
        tried = next(item.advice for item in STATUSES if item.number == trajectory.status)
        return sentence if trajectory.status == STOPPED.number else f"{sentence}; try: {tried}"
    text = stepper.status_text(trajectory.status)
    if trajectory.status == CONTROLLER_FAILED:
        taken = f"stopped at t = {t:.9g} s, after {trajectory.steps} of {run.grid.steps} steps"
        return f"{taken}: {text}; try: {CONTROLLER_ADVICE}"
    _, q, v, a, _, z = (part[0] for part in _split(trajectory.rows[-1:], model))
    block, already, cause = first_non_finite(model, float(t), (q, v, a, z), settings["step"], p, run.signals)
    inertia = None if block else inertia_warning(model, q, p, trajectory.rows[0, 1 : 1 + model.nq], settings["step"])
    found = inertia.what if inertia else fast_joint(model, float(t), q, v, p, settings["step"])
    details = f"; the first block that is not finite is {block}" if block else f"; {found}" if found else ""
    hint = inertia.hint if inertia else advice(run.method, trajectory.status, settings)
    times, positions = trajectory.rows[:, 0], trajectory.rows[:, 1 : 1 + model.nq]
    singular = None if block or found else singular_ahead(model, times, positions, v, p, settings["step"])
    if singular:
        details = f"; {singular.what}"
        hint = way_past(run.method, settings["step"], at_start=len(times) == 1)
    if cause[0] and (by_method := unstable_growth(run, stepper.library, trajectory)):
        what, hint = instability(by_method, run.method)
        details = f"; {what}"
    elif cause[0]:
        details, hint = details + cause[0], cause[1]
    elif already:
        hint = "other parameters, formulas or coordinates there: no smaller step helps"
    elif not (found or singular) and (growth := own_growth(run, stepper.library, trajectory.rows)):
        details = f"{details}; {growth}"
        hint = (
            "the signs and sizes of forces, stiffnesses and gains, for it is the equations that diverge: no smaller"
            " step helps"
        )
    steps = f"{trajectory.steps} of {run.grid.steps} steps{_own_steps(stepper.statistics, model)}"
    return f"stopped at t = {t:.9g} s, after {steps}: {text}{details}; try: {hint}"


def _own_steps(statistics: Mapping[str, int | float], model: CompiledModel | None = None) -> str:
    """Return how many steps of the method's own a run took; with a model also the smallest one, and what asked for
    it."""
    if not statistics.get("own_steps"):
        return ""
    text = f" ({statistics['own_steps']} of its own, {statistics['rejections']} taken again"
    if model is not None:
        name = (*model.v_names, *model.z_names)[int(statistics["hardest"])]
        smallest, where = statistics["smallest_step"], statistics["smallest_step_time"]
        text += f"; the smallest, {smallest:.3g} s at t = {where:.9g} s, for {name}"
    return f"{text})"


def _split(rows: Array, model: CompiledModel) -> tuple[Array, Array, Array, Array, Array, Array]:
    ends = np.cumsum([1, model.nq, model.nv, model.nv, len(model.multipliers)])
    t, q, v, a, multipliers, z = (np.ascontiguousarray(part) for part in np.split(rows, ends, axis=1))
    return t[:, 0], q, v, a, multipliers, z


def _evaluate(
    model: CompiledModel,
    states: tuple[Array, Array, Array, Array, Array, Array],
    signals: InputSignals | None,
    p: Array,
) -> tuple[dict[str, Array], dict[str, Array]]:
    """Return outputs and energies at all recorded rows (t, q, v, a, multipliers, z)."""
    t, q, v, a, multipliers, z = states
    outputs: list[dict[str, Array]] = []
    energies: list[dict[str, Array]] = []
    for start in range(0, len(t), _BATCH):
        part = slice(start, start + _BATCH)
        state, present = (q[part], v[part], a[part], t[part]), _rows(p, part)
        u, base = _prescribed(model, t[part], present, signals)
        held = multipliers[part] if model.multipliers else None
        given: dict[str, Any] = {"z": z[part], "multipliers": held, "parameters": present, "base": base}
        if "outputs" in model.functions:
            outputs.append(model.outputs(*state, u, **given))
        if "energy" in model.functions:
            energies.append(model.energy(*state, u, **given))
    return _joined(outputs), _joined(energies)


def _prescribed(
    model: CompiledModel, t: Array, p: Array, signals: InputSignals | None
) -> tuple[Array | None, Array | None]:
    """Return the inputs and the state of the base at times (rows,), None where there are none; evaluated once, since a
    road of many harmonics costs more than all else of a row."""
    u = None
    if model.nu:
        u = model.input_values(t, parameters=p) if signals is None else signals.rows(t)
    return u, model.base(t, parameters=p) if model.evaluator.moving_base else None


def _rows(p: Array, part: slice) -> Array:
    """Return the parameters of a part of the rows; (np,) where they are the same for all."""
    return p if p.ndim == 1 else p[part]


def _joined(parts: Sequence[Mapping[str, Array]]) -> dict[str, Array]:
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]} if parts else {}


def _metadata(run: Run) -> dict[str, Any]:
    model, settings, layout = run.model, run.settings, run.model.library.layout
    return {
        "scene": model.name,
        "version": layout["version"],
        "method": run.name,
        "method_parameters": dict(run.method.keywords),
        "inputs": {
            name: kind_of(signal) if callable(signal) or isinstance(signal, np.ndarray) else signal
            for name, signal in run.signals.given.items()
        },
        "dense_output": run.method.dense_output,
        "step": settings["step"],
        "settings": dict(settings),
        "record_every": run.every,
        "t_start": run.grid.start,
        "t_end": run.grid.end,
        "parameters": dict(zip(model.parameters, run.parameters.tolist(), strict=True)),
        "names": {
            "q": model.q_names,
            "v": model.v_names,
            "a": [f"a{name[1:]}" for name in model.v_names],
            "multipliers": list(model.multipliers),
            "z": model.z_names,
        },
        "units": {
            "q": model.q_units,
            "v": model.v_units,
            "z": model.z_units,
            "inputs": {item["name"]: item["unit"] for item in layout["inputs"]},
            "outputs": {o["name"]: o["unit"] for o in layout["outputs"]},
        },
        "outputs": {
            output.name: {"description": output.description, "quantity": output.quantity}
            for output in model.description.outputs
        },
        "factors": [[f.group, f.q_start, f.q_size, f.v_start, f.v_size] for f in model.factors],
        "fingerprint": layout.get("fingerprint", ""),
    }
