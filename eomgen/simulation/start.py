"""start: from an initial state to a ``Simulator``, with the options of ``simulate``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from eomgen.base.calls import checked_call
from eomgen.compiled.arguments import number_of
from eomgen.compiled.functions import by_one_library
from eomgen.compiled.initial_state import angles_of_several_turns, check_initial
from eomgen.compiled.model import CompiledModel
from eomgen.compiled.terms import Parameters
from eomgen.errors import Problem, UsageError
from eomgen.simulation.automatic_method import method_of
from eomgen.simulation.judgement.starts import doubts_of_start
from eomgen.simulation.motions import Motions, Target, refuse_as_inputs
from eomgen.simulation.option_types import KNOWN_ELSEWHERE
from eomgen.simulation.simulator import Simulator
from eomgen.simulation.stepping.controllers import Controller, read_controllers
from eomgen.simulation.stepping.inputs import InputSignals, Signal, check_held, read_signals
from eomgen.simulation.stepping.run import Run, scene_inputs
from eomgen.simulation.stepping.settings import chosen_stepper, positive
from eomgen.simulation.stepping.states import start_of, starts_at_equilibrium
from eomgen.simulation.stepping.time_grid import FINEST, TimeGrid


@checked_call(
    **KNOWN_ELSEWHERE,
    state="initial",
    **dict.fromkeys(("t_end", "duration", "tf"), "model.start(...).advance(t_end)"),
)
@by_one_library
def start(
    model: CompiledModel,
    initial: Mapping[str, Any] | None = None,
    parameters: Parameters = None,
    method: str | None = None,
    step: float | None = None,
    *,
    rho_inf: float | None = None,
    alpha: float | None = None,
    beta: float | None = None,
    gamma: float | None = None,
    order: int | None = None,
    tolerance: float | None = None,
    inputs: Mapping[str, Signal] | None = None,
    controllers: Mapping[str, Controller] | None = None,
    t_start: float = 0.0,
    settings: Mapping[str, float] | None = None,
    start: str | None = None,
    motions: Mapping[str, Target] | None = None,
) -> Simulator:
    """Return a simulator at an initial state, to be stepped by the caller.

    Arguments default to the scene's values, as in ``simulate``, which has the same options. A simulator makes none
    of
    the checks of a whole run: energies, growth and the discretisation error are left to the caller.

    Parameters
    ----------
    initial, parameters : mapping, optional
        As in ``simulate``.
    method, start : str, optional
        As in ``simulate``.
    step, t_start : float, optional
        As in ``simulate``, s.
    rho_inf, alpha, beta, gamma, order, tolerance : float, optional
        As in ``simulate``.
    inputs : mapping
        Name -> number or function of t: values of inputs in steps without inputs of their own.
    controllers : mapping, optional
        As in ``simulate``; copies and ``restore`` need functions whose memory the scene declares.
    settings : mapping, optional
        As in ``simulate``.
    motions : mapping
        Name -> position, rate and acceleration at the start, or a function of t that gives these three.

    Returns
    -------
    Simulator
        At the initial state.

    Raises
    ------
    UsageError
        Anything that is wrong, by name.
    ModelError
        The method cannot run on this scene; constraints cannot be met.
    NumericalError
        The initial state has no finite accelerations.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> run = model.start(step=1e-3)
    >>> run.step(n=10)
    >>> run.t
    0.01
    """
    defaults = model.library.layout["defaults"]
    size = positive("step", defaults["step"] if step is None else step)
    t = number_of("t_start", t_start)
    p = model.evaluator.one_set(parameters, "one simulator for each")
    moves = Motions(model)
    p = moves.started(p, t, moves.check(motions))
    given = {"rho_inf": rho_inf, "alpha": alpha, "beta": beta, "gamma": gamma, "order": order, "tolerance": tolerance}
    method, note = method_of(model, method, initial, p, t, size, given)
    chosen = chosen_stepper(model, method, given, settings)
    library = chosen.library
    apart = float(np.spacing((np.float32 if library.real == "float" else np.float64)(abs(t))))
    if size < FINEST * apart:
        fault = (
            f"at t = {t:.9g} s neighbouring numbers differ by {apart:.3g} s, too much for a step of {size:.3g}"
            f" s [E2052]"
        )
        raise UsageError(Problem("step", fault, f"a step of {FINEST * apart:.2g} s or more, or times nearer to 0"))
    refuse_as_inputs(inputs, tuple(moves))
    from_caller = read_signals(inputs, model.inputs, 0, model.input_units)
    for key, signal in from_caller.items():
        if isinstance(signal, np.ndarray):
            fault = "a table is for a run whose end is known [E2053]"
            raise UsageError(Problem(f"input {key}", fault, "a number or a function of t here, and values in step(u)"))
    if chosen.method.inputs == "series":
        check_held(chosen.name, from_caller)
    signals = InputSignals(model.inputs, from_caller, scene_inputs(model, p), size, t, chosen.left_to_stepper)
    functions = read_controllers(controllers, library.layout)
    grid = TimeGrid(t, t, size, 0, 0.0)
    run = Run(model, chosen.name, chosen.method, chosen.settings_at(size), p, signals, grid, 1, controllers=functions)
    check_initial(initial)
    at_rest = starts_at_equilibrium(start, initial is not None, str(defaults["start"]))
    changed = bool(initial) or parameters is not None or bool(motions)
    state, corrections, doubts = start_of(run, initial, equilibrium_start=at_rest, changed=changed)
    simulator = Simulator(run, library)
    simulator.moved_from(moves.reached)
    notes = [*corrections, *doubts, *([note] if note else []), *angles_of_several_turns(model, initial)]
    if not at_rest:
        notes += doubts_of_start(model, t, state.q, p, run.signals if run.takes_rows else None)
    simulator.begin(t, state, notes)
    return simulator
