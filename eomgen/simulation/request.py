"""The request of a run: start, parameters and step that a caller asks for, checked once, from which the stepper, the
inputs and the initial state of the run follow.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from eomgen.base.arrays import Array
from eomgen.compiled.arguments import number_of
from eomgen.compiled.initial_state import InitialState, check_initial
from eomgen.compiled.model import CompiledModel
from eomgen.compiled.terms import Parameters
from eomgen.errors import Message, Problem, UsageError
from eomgen.integrators.families.register import AUTO, STANDARD
from eomgen.simulation.automatic_method import OF_OTHERS, choose_method
from eomgen.simulation.motions import refuse_as_inputs
from eomgen.simulation.stepping.controllers import CallerControllers
from eomgen.simulation.stepping.inputs import InputSignals, Signal, check_held, read_signals
from eomgen.simulation.stepping.run import SCENE_START, Run, scene_inputs
from eomgen.simulation.stepping.settings import ChosenStepper, chosen_stepper, positive
from eomgen.simulation.stepping.states import start_of, starts_at_equilibrium
from eomgen.simulation.stepping.time_grid import TimeGrid


class RunRequest(NamedTuple):
    """Start, parameters and step of a run.

    Attributes
    ----------
    step : s
    t : s, time of the initial state
    p : (np,) tunable parameters
    changed : whether a caller gives parameters
    initial : initial values that a caller gives, by name; None for the scene's
    start : ``initial`` or ``equilibrium`` if a caller says so, else None
    at_rest : whether the run starts at static equilibrium
    """

    model: CompiledModel
    step: float
    t: float
    p: Array
    changed: bool = False
    initial: Mapping[str, Any] | None = None
    start: str | None = None
    at_rest: bool = False

    def choose_stepper(
        self, method: str | None, options: Mapping[str, float | None], settings: Mapping[str, float] | None
    ) -> tuple[ChosenStepper, str]:
        """Return the stepper of the run, and the reason for its method if ``auto`` chose the method.

        Parameters
        ----------
        method : the scene's by default
        options : parameters of the method, None for the scene's value
        settings : of the stepper, that a caller gives
        """
        name, reason = self.method(method, options)
        return chosen_stepper(self.model, name, options, settings), reason

    def method(self, method: str | None, options: Mapping[str, float | None]) -> tuple[str | None, str]:
        """Return the method of the run, None for the scene's, and the reason of the choice for ``auto``.

        Raises
        ------
        UsageError
            ``auto`` with a parameter that one of the methods to choose from does not take.
        """
        if str(self.model.description.simulation.method if method is None else method) != AUTO:
            return method, ""
        for key, value in options.items():
            if value is not None and key in OF_OTHERS:
                fault = f"auto chooses between an explicit method and {STANDARD}, which take no {key} [E1991]"
                raise UsageError(Problem(key, fault, f'method = "{OF_OTHERS[key]}", or without {key}'))
        return choose_method(self.model, self.initial, self.p, self.t, self.step)

    def run(
        self,
        chosen: ChosenStepper,
        grid: TimeGrid,
        every: int,
        inputs: Mapping[str, Signal] | None,
        controllers: CallerControllers | None = None,
    ) -> Run:
        """Return the run on a time grid with the inputs that a caller gives. Raises UsageError for these.

        Parameters
        ----------
        chosen : method with its stepper
        every : steps between recorded rows
        controllers : the caller's functions
        """
        model = self.model
        if inputs is not None:
            refuse_as_inputs(inputs, [motion.name for motion in model.description.motions])
        caller_inputs = read_signals(inputs, model.inputs, grid.steps, model.input_units)
        if chosen.method.inputs == "series":
            check_held(chosen.name, caller_inputs)
        formulas = scene_inputs(model, self.p)
        signals = InputSignals(model.inputs, caller_inputs, formulas, self.step, self.t, chosen.left_to_stepper)
        settings = chosen.settings_at(self.step)
        begun = self.start_description
        return Run(model, chosen.name, chosen.method, settings, self.p, signals, grid, every, [], begun, controllers)

    def initial_state(self, run: Run) -> tuple[InitialState, list[Message], list[str]]:
        """Return the initial state of a run on the constraints, messages on changed values, and notes on doubts about
        the state."""
        changed = bool(self.initial) or self.changed
        return start_of(run, self.initial, equilibrium_start=self.at_rest, changed=changed)

    @property
    def start_description(self) -> str:
        """Description of the start for the metadata: the scene's initial values or equilibrium, or values that a caller
        gave."""
        if self.at_rest:
            return "equilibrium near the initial values given" if self.initial else "the scene's equilibrium"
        of_scene = str(self.model.functions.library.layout["defaults"]["start"])
        if not self.initial:
            return SCENE_START if of_scene == "initial" else f"{SCENE_START}, not its equilibrium"
        instead = self.start is None and of_scene == "equilibrium"
        return "initial values given, in place of the scene's equilibrium" if instead else "initial values given"


def read_request(
    model: CompiledModel,
    step: float | str | None,
    t_start: float | str,
    parameters: Parameters,
    initial: Mapping[str, Any] | None = None,
    start: str | None = None,
    *,
    instead_of_batches: str = "one run for each",
) -> RunRequest:
    """Return the request of a run from the arguments of ``simulate`` with these names. Raises UsageError.

    Parameters
    ----------
    instead_of_batches : remedy for several sets of parameters
    """
    defaults = model.functions.library.layout["defaults"]
    size = positive("step", defaults["step"] if step is None else step)
    t = number_of("t_start", t_start)
    p = model.evaluator.one_set(parameters, instead_of_batches)
    check_initial(initial)
    at_rest = starts_at_equilibrium(start, initial is not None, str(defaults["start"]))
    return RunRequest(model, size, t, p, parameters is not None, initial, start, at_rest)
