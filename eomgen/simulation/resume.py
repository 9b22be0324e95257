"""resume: the continuation of a run from a checkpoint, to the same bits."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.calls import checked_call
from eomgen.base.progress import Progress, show_progress
from eomgen.compiled.arguments import number_of
from eomgen.compiled.functions import by_one_library
from eomgen.compiled.model import CompiledModel
from eomgen.compiled.terms import Parameters
from eomgen.errors import Problem, UsageError
from eomgen.integrators.families.register import method_named
from eomgen.results.solution import Solution
from eomgen.simulation.checkpoint import Checkpoint
from eomgen.simulation.execution import Execution
from eomgen.simulation.stepping.controllers import CallerControllers, Controller, read_controllers
from eomgen.simulation.stepping.inputs import Signal, signals_by_name
from eomgen.simulation.stepping.run import stored_run
from eomgen.simulation.stepping.settings import check_span, stepper_library
from eomgen.simulation.stepping.stepper import Stepper
from eomgen.system.terms import Selection
from eomgen.toolchain.library import Library


@checked_call(
    u="inputs",
    p="parameters",
    file="path",
    tend="t_end",
    duration="t_end",
    **dict.fromkeys(("step", "dt", "method"), "model.simulate(...), for other steps: a checkpoint keeps its own"),
)
@by_one_library
def resume(
    model: CompiledModel,
    path: str | os.PathLike[str],
    t_end: float | None = None,
    *,
    parameters: Parameters = None,
    inputs: Mapping[str, Signal] | None = None,
    controllers: Mapping[str, Controller] | None = None,
    progress: Progress | bool | None = None,
    checkpoint: str | os.PathLike[str] | None = None,
    checkpoint_every: int | None = None,
    error_estimate: bool = True,
) -> Solution:
    """Continue a run from a checkpoint to the same bits, with the same method, step, settings, parameters, inputs and
    time grid.

    Parameters
    ----------
    path : path
        File of ``simulate(checkpoint=...)``.
    t_end : float
        End of the run, s, possibly later than the end of the first part, which is the default.
    parameters : mapping or array
        Not needed; refused if different from the parameters of the first part.
    inputs : mapping
        Functions of t, which are not in the file; numbers and tables are in the file, and different ones are refused.
    controllers : mapping
        The functions again; the scene has to declare their memory, because a checkpoint holds no other memory.
    progress : callable or bool, optional
        As in ``simulate``.
    checkpoint : str or Path, optional
        As in ``simulate``; checkpoints go to ``path`` by default.
    checkpoint_every : int, optional
        As in ``simulate``.
    error_estimate : bool
        As in ``simulate``; the estimate takes the state of the checkpoint for exact.

    Returns
    -------
    Solution
        From the checkpoint on; ``first.followed_by(second)`` puts both parts together.

    Raises
    ------
    FileError
        The file cannot be read or is not a checkpoint.
    ModelError
        The checkpoint belongs to another model, or to another compilation of the model.
    UsageError
        Other parameters or inputs; an end in the past; a controller's function whose memory is not declared.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> first = model.simulate(0.1, 1e-3, checkpoint="run.ckpt")
    >>> float(model.resume("run.ckpt", 0.2).t[-1])
    0.2
    """
    file = Path(path)
    saved = Checkpoint.load(file)
    saved_run = saved.run
    if saved_run["scene"] != model.name:
        saved.check(file, model.name, model.library)
    method = method_named(saved_run["method"], **saved_run["method_parameters"])
    library = stepper_library(model, saved_run["method"], method)
    on_tape = library.predecessor
    if on_tape is not None and saved_run["build"] == on_tape.digest:
        library = on_tape
    elif saved_run["fingerprint"] == library.layout["fingerprint"] and saved_run["build"] != library.digest:
        library = model.stepper(saved_run["method"], Selection.from_data(saved_run["selection"]))
    saved.check(file, model.name, library)
    end = float(saved_run["t_end"]) if t_end is None else number_of("t_end", t_end)
    signals = _inputs(saved, signals_by_name(inputs, model.inputs))
    run = stored_run(model, saved_run, method, library, end, signals, _controllers(library, controllers))
    grid, p = run.grid, run.parameters
    _same_parameters(model, p, parameters)
    stepper = Stepper(library, run.settings, p, run.controllers)
    stepper.restore(saved.state, saved.workspace)
    if grid.whole < stepper.count:
        fault = f"the end {end:.9g} s lies before the checkpoint's time {stepper.t:.9g} s [E2003]"
        raise UsageError(Problem("t_end", fault, "a later t_end"))
    check_span(run, library)
    written = file if checkpoint is None else checkpoint
    with show_progress(progress, model.name) as reported:
        execution = Execution(library, written, checkpoint_every, reported, estimated=error_estimate)
        return execution.outcome(run, None, resumed=stepper).solution(at_once=True)


def _controllers(library: Library, controllers: Mapping[str, Controller] | None) -> CallerControllers | None:
    """Return the caller's controller functions, checked against the library; None without sampled controllers of the
    caller. Raises UsageError if a function may keep data outside of the internal states, which no checkpoint holds."""
    functions = read_controllers(controllers, library.layout)
    if functions is not None and (names := functions.undeclared_names):
        fault = f"the function of {names} may keep something that no checkpoint holds [E2004]"
        hint = "memory = 0, or how many numbers it keeps, in the scene's controller"
        raise UsageError(Problem("controllers", fault, hint))
    return functions


def _same_parameters(model: CompiledModel, p: Array, values: Parameters) -> None:
    """Raise UsageError for each parameter in `values` that differs from `p` (np,), of the first part.
    `values` is a mapping of some parameters, an array of all, or None."""
    if values is None:
        return
    known = dict(zip(model.parameters, p.tolist(), strict=True))
    asked = model.parameter_array({**known, **values} if isinstance(values, Mapping) else values)
    hint = "a run of its own for other parameters"
    problems = [
        Problem(f"parameter {name}", f"the run has {old:.9g}, not {new:.9g} [E2005]", hint)
        for (name, old), new in zip(known.items(), np.broadcast_to(asked, p.shape), strict=True)
        if old != new
    ]
    if problems:
        raise UsageError(problems)


def _inputs(saved: Checkpoint, asked: Mapping[str, Signal]) -> dict[str, Signal]:
    """Return the inputs of a resumed run by name: tables and numbers from the checkpoint, and functions from the
    caller. Raises UsageError for functions that are missing, for numbers and tables that differ from the checkpoint's,
    and for inputs that the first part left to the scene. A longer table that begins with the stored one replaces it."""
    kinds = saved.run["inputs"]
    problems = []
    for name, kind in kinds.items():
        if kind == "function" and not callable(asked.get(name)):
            fault = "the run had a function of t here, which no file holds [E2006]"
            problems.append(Problem(f"input {name}", fault, "the same function again"))
        elif kind != "function" and name in asked and not _goes_on(saved.inputs[name], asked[name]):
            fault = f"the run has another {kind} [E2007]"
            problems.append(Problem(f"input {name}", fault, "none: it is in the checkpoint"))
    of_scene = [name for name in asked if name not in kinds]
    fault = "the run followed the scene here [E2008]"
    problems += [Problem(f"input {name}", fault, "leave it out") for name in of_scene]
    if problems:
        raise UsageError(problems)
    return {**{name: value if value.ndim else float(value) for name, value in saved.inputs.items()}, **asked}


def _goes_on(stored: Array, signal: Signal) -> bool:
    """Return whether the input `signal` agrees with the `stored` one: an equal number, or a table that begins with
    the stored table. False for anything that is not numbers."""
    try:
        again = np.asarray(signal, dtype=float)
    except (TypeError, ValueError):
        return False
    beginning = again[: len(stored)] if again.ndim == 1 and stored.ndim == 1 else again
    return bool(np.array_equal(beginning, stored))
