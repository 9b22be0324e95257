"""A validated run: the data for stepping, reporting and resuming it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, field
from eomgen.errors import Message, Problem, UsageError
from eomgen.integrators.families.family import BAD_ARGUMENT
from eomgen.integrators.families.register import Method
from eomgen.integrators.stepper_layout import default_settings
from eomgen.simulation.stepping.controllers import CallerControllers
from eomgen.simulation.stepping.inputs import HeldRows, InputRows, InputSignals, Signal, jumps_known, read_signals
from eomgen.simulation.stepping.time_grid import TimeGrid, time_grid
from eomgen.toolchain.library import Library

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel

#: The start of a run unless the caller or the scene specifies another.
SCENE_START = "the scene's initial state"


@dataclass(frozen=True)
class Run:
    """A run as data: model, method, settings, parameters, signals and time grid.

    Attributes
    ----------
    name, method, settings : of the stepper
    parameters : (np,) tunable parameters
    signals : signals of the inputs
    grid : the times of the whole run
    every : steps between recorded rows
    corrections : how the initial state was brought onto the constraints; added as soon as the start is known
    begun : description of the initial state, in words
    controllers : the caller's functions that samples call; None if there are none
    bounded_for : law that the examination of the first run found, and for which ``largest_step`` is set; else empty
    """

    model: CompiledModel
    name: str
    method: Method
    settings: dict[str, float]
    parameters: Array
    signals: InputSignals
    grid: TimeGrid
    every: int
    corrections: list[Message] = field(default_factory=list)
    begun: str = SCENE_START
    controllers: CallerControllers | None = None
    bounded_for: str = ""

    @property
    def summary(self) -> dict[str, Any]:
        """Scene, method, settings, parameters, time grid and start, as JSON data."""
        return {
            "scene": self.model.name,
            "method": self.name,
            "method_parameters": dict(self.method.keywords),
            "settings": dict(self.settings),
            "parameters": dict(zip(self.model.parameters, self.parameters.tolist(), strict=True)),
            "record_every": self.every,
            "t_start": self.grid.start,
            "t_end": self.grid.end,
            "start": self.begun,
        }

    def check_settings(self, status: int, text: str) -> None:
        """Raise UsageError if a stepper refuses its settings, by its status with a text."""
        if status == BAD_ARGUMENT.number:
            settings = ", ".join(f"{name} = {value:.6g}" for name, value in self.settings.items())
            raise UsageError(Problem("settings", f"{self.name} refuses {settings}: {text} [E2028]", "the defaults"))

    @property
    def takes_rows(self) -> bool:
        """Whether the stepper needs rows of inputs: the compiled formulas do not give all inputs."""
        return bool(self.signals.given or (self.signals.names and self.signals.formulas is None))

    @property
    def driven(self) -> InputRows | None:
        """Rows of inputs for times; None if the compiled formulas give all inputs."""
        if not self.takes_rows:
            return None
        row = self.signals.held
        return self.signals.table if row is None else HeldRows(row)


def scene_inputs(model: CompiledModel, p: Array) -> InputRows | None:
    """Return the function of the scene's own inputs (n, nu) of times (n,), with checked parameters (np,); None
    if the scene gives none."""
    if "inputs" not in model.functions:
        return None
    return lambda times: model.evaluator.formula_inputs({"t": times, "p": p})


def stored_run(
    model: CompiledModel,
    data: Mapping[str, Any],
    method: Method,
    library: Library,
    end: float,
    inputs: Mapping[str, Signal],
    controllers: CallerControllers | None = None,
) -> Run:
    """Return the run that a checkpoint or a solution describes, up to `end` in s, with the inputs of the caller. `data`
    has the description: settings, parameters, step, start and method by name. `library` has the stepper. Raises
    UsageError for inputs that are wrong, or an end before the start."""
    settings = {name: float(data["settings"][name]) for name in default_settings(library.layout["method"])}
    p = model.parameter_array({name: data["parameters"][name] for name in model.parameters})
    start, step = float(data["t_start"]), settings["step"]
    grid = time_grid(start, end, step, library.real)
    caller_inputs = read_signals(inputs, model.inputs, grid.steps)
    signals = InputSignals(model.inputs, caller_inputs, scene_inputs(model, p), step, start, jumps_known(library))
    every, corrections = int(data["record_every"]), [*map(Message, data.get("corrections", []))]
    begun = data.get("start", SCENE_START)
    history = corrections, begun, controllers, data.get("bounded_for", "")
    return Run(model, data["method"], method, settings, p, signals, grid, every, *history)
