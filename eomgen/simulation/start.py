"""start: from an initial state to a ``Simulator``, with the options of ``simulate``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from eomgen.base.calls import checked_call
from eomgen.compiled.functions import by_one_library
from eomgen.compiled.initial_state import angles_of_several_turns
from eomgen.compiled.model import CompiledModel
from eomgen.compiled.terms import Parameters
from eomgen.errors import Problem, UsageError
from eomgen.simulation.judgement.starts import doubts_of_start
from eomgen.simulation.motions import Motions, Target
from eomgen.simulation.option_types import KNOWN_ELSEWHERE
from eomgen.simulation.request import read_request
from eomgen.simulation.simulator import Simulator
from eomgen.simulation.stepping.controllers import Controller, read_controllers
from eomgen.simulation.stepping.inputs import Signal
from eomgen.simulation.stepping.time_grid import TimeGrid, check_resolution


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

    Arguments default to the scene's values, as in ``simulate``, which has the same options. A simulator makes none of
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
    moves = Motions(model)
    remedy = "one simulator for each"
    request = read_request(model, step, t_start, parameters, initial, start, instead_of_batches=remedy)
    t, size = request.t, request.step
    if targets := moves.check(motions):
        request = request._replace(p=moves.start(request.p, t, targets), changed=True)
    options = {"rho_inf": rho_inf, "alpha": alpha, "beta": beta, "gamma": gamma, "order": order, "tolerance": tolerance}
    chosen, choice = request.choose_stepper(method, options, settings)
    library = chosen.library
    check_resolution(size, t, library.real)
    functions = read_controllers(controllers, library.layout)
    run = request.run(chosen, TimeGrid(t, t, size, 0, 0.0), 1, inputs, functions)
    for key, signal in run.signals.given.items():
        if isinstance(signal, np.ndarray):
            fault = "a table is for a run whose end is known [E2053]"
            raise UsageError(Problem(f"input {key}", fault, "a number or a function of t here, and values in step(u)"))
    state, corrections, doubts = request.initial_state(run)
    simulator = Simulator(run, library, moves)
    notes = [*corrections, *doubts, *([choice] if choice else []), *angles_of_several_turns(model, initial)]
    if not request.at_rest:
        notes += doubts_of_start(run, state)
    simulator.begin(t, state, notes)
    return simulator
